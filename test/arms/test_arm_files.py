"""Arm files: the presets carry the paper's numbers, and every mistake is named by its path."""

from __future__ import annotations

import copy
import math
import os
from pathlib import Path
from typing import Any

from flex_planner.arms import arm_files
from flex_planner.arms.arm import Link, Motor, Node
from flex_planner.arms.arm_files import arm_from_mapping, ArmFileError, load_arm, preset_files
from flex_planner.base.errors import InvalidValueError
import pytest
import yaml

COMPLETE: dict[str, Any] = {
    'name': 'two links', 'source': 'invented', 'gravity': [0.0, -9.81],
    'links': [{'length': 0.5, 'mass': 3.0, 'flexural_rigidity': 50.0, 'modes': 2,
               'mode_family': 'pinned_pinned'},
              {'length': 0.25, 'linear_density': 6.0}],
    'joints': [{'motor': {'stall_torque': 8.0, 'no_load_speed': 3.5}, 'viscous_friction': 0.1},
               {}],
    'nodes': [{'mass': 1.0, 'inertia': 2.0}, {}, {'mass': 0.5}],
}

# Korayem et al. 2009, Table I: L = 0.5 m, m = 3 kg, tau_s = 8 N m, omega_s = 3.5 rad/s; E I of
# Table V; two modes per link, section 5.1
PRESETS = [('korayem_rigid', 0, math.inf), ('korayem_ei50', 2, 50.0), ('korayem_ei5', 2, 5.0)]

REMOVE = object()
DENSITY = 'links[0].linear_density or mass or density'
RIGIDITY = 'links[0].flexural_rigidity or youngs_modulus'
SECTION = 'links[1].section or second_moment_of_area'
FAMILY_NAMES = 'one of pinned_pinned, clamped_free, clamped_mass'
MISTAKES: list[tuple[str, object, str, str]] = [
    # place in COMPLETE, value put there, field named, rest of the message
    ('name', REMOVE, 'name', 'must be given'),
    ('name', 3, 'name', 'must be text'),
    ('source', ['a'], 'source', 'must be text'),
    ('links', REMOVE, 'links', 'must be given'),
    ('links', 'two', 'links', 'must be a list'),
    ('links', {'length': 1}, 'links', 'must be a list'),
    ('links', [], 'number of links', 'an integer from 1 to 8'),
    ('links/0', 'long', 'links[0]', 'must be a mapping of fields'),
    ('links/0/length', REMOVE, 'links[0].length', 'must be given'),
    ('links/0/length', 0, 'links[0].length', '> 0 m'),
    ('links/0/length', '0.5 m', 'links[0].length', '> 0 m'),
    ('links/0/length', True, 'links[0].length', '> 0 m'),
    ('links/0/mass', REMOVE, DENSITY, 'is missing, but must be given, exactly one of them'),
    ('links/0/linear_density', 6.0, DENSITY, "is 'linear_density and mass', but must be given, "),
    ('links/0/density', 2700.0, DENSITY,
     "is 'mass and density', but must be given, exactly one of them"),
    ('links/0/mass', 0.0, 'links[0].mass', '> 0 kg'),
    ('links/0/mass', -3.0, 'links[0].mass', '> 0 kg'),
    ('links/0/mass', True, 'links[0].mass', '> 0 kg'),
    ('links/0/mass', 'heavy', 'links[0].mass', '> 0 kg'),
    ('links/0/mass', math.inf, 'links[0].mass', '> 0 kg'),
    ('links/0/mass', math.nan, 'links[0].mass', '> 0 kg'),
    ('links/1/length', -0.25, 'links[1].length', '> 0 m'),
    ('links/1/linear_density', 0.0, 'links[1].linear_density', '> 0 kg/m'),
    ('links/0/flexural_rigidity', REMOVE, RIGIDITY,
     'is missing, but must be given, exactly one of them'),
    ('links/0/youngs_modulus', 7e10, RIGIDITY, "is 'flexural_rigidity and youngs_modulus'"),
    ('links/1/youngs_modulus', 7e10, SECTION, 'given with youngs_modulus'),
    ('links/1/youngs_modulus', -1.0, 'links[1].youngs_modulus', '> 0 N/m^2'),
    ('links/1/flexural_rigidity', 0.0, 'links[1].flexural_rigidity', '> 0 N m^2'),
    ('links/1/section', {'width': 0.1}, 'links[1].section.thickness', 'must be given'),
    ('links/1/section', {'width': 0.0, 'thickness': 1.0}, 'links[1].section.width', '> 0 m'),
    ('links/1/section', {'width': 1.0, 'thickness': -1.0}, 'links[1].section.thickness', '> 0 m'),
    ('links/1/section', {'width': 1.0, 'thickness': 1.0, 'depth': 1.0}, 'links[1].section.depth',
     'no such field'),
    ('links/1/section', 0.1, 'links[1].section', 'a mapping of fields'),
    ('links/1/second_moment_of_area', 0.0, 'links[1].second_moment_of_area', '> 0 m^4'),
    ('links/0/shape_mass', 1.0, 'links[0].shape_mass', 'no such field'),  # of clamped_mass only
    ('links/0/damping_ratio', 1.0, 'links[0].damping_ratio', 'a number < 1'),
    ('links/0/damping_ratio', -0.1, 'links[0].damping_ratio', '>= 0'),
    ('joints/0/lower_limit', 'low', 'joints[0].lower_limit', 'a number'),
    ('joints/0/upper_limit', True, 'joints[0].upper_limit', 'a number'),
    ('links/0/flexural_rigidity', -1, 'links[0].flexural_rigidity', '> 0 N m^2'),
    ('links/0/modes', 2.5, 'links[0].modes', 'an integer from 0 to 8'),
    ('links/0/mode_family', 'sine', 'links[0].mode_family', FAMILY_NAMES),
    ('links/0/mode_family', ['sine'], 'links[0].mode_family', FAMILY_NAMES),
    ('links/0/lenght', 0.5, 'links[0].lenght', 'there is no such field; did you mean length?'),
    ('joints', REMOVE, 'joints', 'must be given'),
    ('joints', [{}], 'number of joints', '2, one per link'),
    ('joints/0/motor', 8.0, 'joints[0].motor', 'a mapping of fields'),
    ('joints/0/motor/stall_torque', REMOVE, 'joints[0].motor.stall_torque', 'must be given'),
    ('joints/0/motor/stall_torque', 0, 'joints[0].motor.stall_torque', '> 0 N m'),
    ('joints/0/motor/no_load_speed', -1, 'joints[0].motor.no_load_speed', '> 0 rad/s'),
    ('joints/0/motor/max_speed', 0, 'joints[0].motor.max_speed', '> 0 rad/s'),
    ('joints/0/motor/power', 8.0, 'joints[0].motor.power', 'no such field'),
    ('joints/0/viscous_friction', -0.1, 'joints[0].viscous_friction', '>= 0 N m s/rad'),
    ('joints/1/frction', 0.1, 'joints[1].frction', 'no such field; did you mean friction?'),
    ('joints/1/friction', 0.1, 'joints[1].friction', 'a mapping of fields'),
    ('nodes', [{}], 'number of nodes', '0 or 3'),
    ('nodes/0/mass', -1, 'nodes[0].mass', '>= 0 kg'),
    ('nodes/2/inertia', -1, 'nodes[2].inertia', '>= 0 kg m^2'),
    ('nodes/1/radius', 1, 'nodes[1].radius', 'no such field'),
    ('gravity', [0.0, 0.0, -9.81], 'gravity', 'a list of 2 numbers'),
    ('gravity', -9.81, 'gravity', 'a list of 2 numbers'),
    ('gravity', [0.0, 'down'], 'gravity', 'a list of 2 numbers'),
    ('payload', 1.0, 'payload', 'a mapping of fields'),
    ('payloads', 1.0, 'payloads', 'no such field'),
]


def changed(place: str, value: object) -> dict[str, Any]:
    """Return COMPLETE with one value replaced, added or removed."""
    content = copy.deepcopy(COMPLETE)
    target: Any = content
    *parents, last = (int(part) if part.isdigit() else part for part in place.split('/'))
    for part in parents:
        target = target[part]
    if value is REMOVE:
        del target[last]
    else:
        target[last] = value
    return content


def write(folder: Path, content: object) -> str:
    path = folder / 'arm.yaml'
    path.write_text(content if isinstance(content, str) else yaml.safe_dump(content))
    return str(path)


@pytest.mark.parametrize(('name', 'modes', 'rigidity'), PRESETS)
def test_preset_carries_the_numbers_of_the_paper(name: str, modes: int, rigidity: float) -> None:
    arm = load_arm(name)
    assert [(link.length, link.mass, link.modes, link.flexural_rigidity)
            for link in arm.links] == [(0.5, 3.0, modes, rigidity)] * 2
    assert [(joint.motor.stall_torque, joint.motor.no_load_speed, joint.viscous_friction)
            for joint in arm.joints] == [(8.0, 3.5, 0.0)] * 2
    assert {link.mode_family for link in arm.links} == {'pinned_pinned'}
    assert arm.nodes == (Node(),) * 3
    assert arm.gravity.tolist() == [0.0, 0.0]
    assert 'Korayem' in arm.source


def test_every_preset_loads_and_says_where_it_comes_from() -> None:
    presets = preset_files()
    assert {name for name, *_ in PRESETS} <= set(presets)
    for name in presets:
        assert load_arm(name).source


def test_file_is_read_as_written(tmp_path: Path) -> None:
    arm = load_arm(write(tmp_path, COMPLETE))
    first, second = arm.links
    assert (arm.name, arm.source, arm.gravity.tolist()) == ('two links', 'invented', [0, -9.81])
    assert (first.linear_density, first.flexural_rigidity, first.modes) == (6.0, 50.0, 2)
    assert (second.length, second.linear_density, second.modes) == (0.25, 6.0, 0)
    assert [node.mass for node in arm.nodes] == [1.0, 0.0, 0.5]
    assert arm.nodes[0].inertia == 2.0
    assert arm.joints[0].viscous_friction == 0.1
    assert math.isinf(arm.joints[1].motor.stall_torque)


def test_motor_may_have_a_largest_speed_beside_its_torque_or_alone() -> None:
    def motor(**fields: float) -> Motor:
        return arm_from_mapping(changed('joints/1/motor', fields)).joints[1].motor

    assert motor(stall_torque=4.0, max_speed=2.0) == Motor(stall_torque=4.0, max_speed=2.0)
    assert motor(max_speed=2.0) == Motor(max_speed=2.0)
    assert math.isinf(motor(stall_torque=4.0).max_speed)


def of_section(**fields: Any) -> Link:
    """Return a link that is described by its section, with some fields changed."""
    link = {'length': 0.5, 'density': 2700.0, 'youngs_modulus': 7e10, 'modes': 1,
            'section': {'width': 0.04, 'thickness': 0.003}, **fields}
    given = {name: value for name, value in link.items() if value is not REMOVE}
    return arm_from_mapping(changed('links/0', given)).links[0]


def test_section_density_and_modulus_give_the_beam() -> None:
    link = of_section()
    assert link.linear_density == pytest.approx(2700 * 0.04 * 0.003, rel=1e-15)
    assert link.flexural_rigidity == pytest.approx(7e10 * 0.04 * 0.003**3 / 12, rel=1e-15)


@pytest.mark.parametrize(('fields', 'density', 'rigidity'), [
    # a rigidity or a mass that is given needs no section for itself
    ({'youngs_modulus': REMOVE, 'flexural_rigidity': 5.0}, 0.324, 5.0),
    ({'density': REMOVE, 'mass': 0.2}, 0.4, 6.3),
    ({'density': REMOVE, 'linear_density': 0.3, 'section': REMOVE,
      'second_moment_of_area': 1e-10}, 0.3, 7.0),
    ({'youngs_modulus': REMOVE, 'modes': 0}, 0.324, math.inf)])
def test_quantities_of_a_beam_combine(fields: dict[str, Any], density: float,
                                      rigidity: float) -> None:
    link = of_section(**fields)
    assert (link.linear_density, link.flexural_rigidity) == pytest.approx((density, rigidity),
                                                                          rel=1e-14)


@pytest.mark.parametrize(('fields', 'message'), [
    ({'section': REMOVE}, 'section is missing, but must be given with density'),
    ({'section': REMOVE, 'second_moment_of_area': 1e-10},
     'section is missing, but must be given with density'),
    ({'section': REMOVE, 'density': REMOVE, 'mass': 1.0},
     'section or second_moment_of_area is missing, but must be given with youngs_modulus'),
    ({'second_moment_of_area': 1e-10}, 'second_moment_of_area is 1e-10, but must be left out')])
def test_combination_that_leaves_the_beam_open_is_named(fields: dict[str, Any],
                                                        message: str) -> None:
    with pytest.raises(InvalidValueError, match=rf'^links\[0\]\.{message}'):
        of_section(**fields)


def test_loads_of_shapes_damping_and_limits_are_read() -> None:
    content = changed('links/0', {
        'length': 0.5, 'mass': 3.0, 'flexural_rigidity': 50.0, 'modes': 2, 'damping_ratio': 0.02,
        'mode_family': 'clamped_mass', 'shape_mass': 1.5, 'shape_inertia': 0.25})
    content['joints'][0] = {'lower_limit': -1.0, 'upper_limit': 2.0}
    arm = arm_from_mapping(content)
    link = arm.links[0]
    assert (link.shape_mass, link.shape_inertia, link.damping_ratio) == (1.5, 0.25, 0.02)
    lower, upper = arm.angle_limits()
    assert (lower.tolist(), upper.tolist()) == ([-1.0, -math.inf], [2.0, math.inf])


@pytest.mark.parametrize('field', ['shape_mass', 'shape_inertia'])
def test_shapes_with_a_load_need_to_be_told_it(field: str) -> None:
    link = {'length': 0.5, 'mass': 3.0, 'flexural_rigidity': 50.0, 'modes': 2,
            'mode_family': 'clamped_mass', 'shape_mass': 1.5, 'shape_inertia': 0.25}
    del link[field]
    with pytest.raises(InvalidValueError, match=rf'^links\[0\]\.{field} is missing'):
        arm_from_mapping(changed('links/0', link))


def test_preset_of_section_5_4_carries_the_numbers_of_table_6() -> None:
    arm = load_arm('korayem_table6')
    first, second = arm.links
    # E = 6.9e10 N/m^2, 2700 kg/m^3; 0.1524 x 0.005537 m and 0.0762 x 0.001574 m
    assert (first.flexural_rigidity, second.flexural_rigidity) == pytest.approx(
        (148.7566, 1.708587), rel=1e-6)
    assert (first.linear_density, second.linear_density) == pytest.approx((2.278365, 0.3238348),
                                                                          rel=1e-6)
    assert (first.length, second.length) == (0.5969, 0.4842)
    assert [joint.motor.stall_torque for joint in arm.joints] == [13.5, 4.0]
    assert [joint.motor.torque_slope for joint in arm.joints] == [0.0, 0.0]
    assert [(node.mass, node.inertia) for node in arm.nodes] == [(0, 1), (5.415, 1), (0.83, 1)]


def test_preset_of_de_luca_and_siciliano_knows_what_its_first_link_carries() -> None:
    arm = load_arm('de_luca_siciliano')
    first, second = arm.links
    payload, inertia = 0.1, 0.0005  # of the paper, not part of the arm
    assert first.shape_mass == pytest.approx(arm.nodes[1].mass + second.mass + payload)
    assert first.shape_inertia == pytest.approx(
        arm.nodes[1].inertia + second.mass * 0.5**2 / 3 + payload * 0.5**2 + inertia)
    assert (second.shape_mass, second.shape_inertia) == (payload, inertia)


def test_constant_torque_limit_needs_no_speed() -> None:
    arm = arm_from_mapping(changed('joints/0/motor/no_load_speed', REMOVE))
    assert arm.joints[0].motor.torque_slope == 0.0


@pytest.mark.parametrize(('place', 'value', 'field', 'message'), MISTAKES)
def test_mistake_is_named_by_its_path_in_the_file(tmp_path: Path, place: str, value: object,
                                                  field: str, message: str) -> None:
    path = write(tmp_path, changed(place, value))
    with pytest.raises(ArmFileError) as caught:
        load_arm(path)
    assert str(caught.value).startswith((f'{path}: {field} is ', f'{path}: {field} has '))
    assert message in str(caught.value)
    cause = caught.value.__cause__
    assert isinstance(cause, InvalidValueError)
    assert cause.field == field


@pytest.mark.parametrize('content', ['3', '[1, 2]', 'text', '~', '---'])
def test_file_that_is_no_mapping_is_refused(tmp_path: Path, content: str) -> None:
    with pytest.raises(ArmFileError, match='the file is .* must be a mapping of fields'):
        load_arm(write(tmp_path, content))


@pytest.mark.parametrize('content', [
    '', ' \n', 'name: [1', 'a: !!python/object:os.system {}', '? [a]\n: 1', '[' * 5000],
    ids=['empty', 'blank', 'broken', 'object', 'list as key', 'too deep'])
def test_file_that_is_no_plain_yaml_is_refused(tmp_path: Path, content: str) -> None:
    with pytest.raises(ArmFileError, match='cannot be read'):
        load_arm(write(tmp_path, content))


def test_field_given_twice_is_refused(tmp_path: Path) -> None:
    text = yaml.safe_dump(COMPLETE) + 'gravity: [0.0, 0.0]\n'
    with pytest.raises(ArmFileError, match='gravity'):
        load_arm(write(tmp_path, text))


def test_binary_file_is_refused(tmp_path: Path) -> None:
    path = tmp_path / 'arm.yaml'
    path.write_bytes(b'\xff\xfe\x00')
    with pytest.raises(ArmFileError, match='cannot be read'):
        load_arm(str(path))


def test_huge_file_is_refused_before_it_is_parsed(tmp_path: Path) -> None:
    with pytest.raises(ArmFileError, match='larger than 1000000 bytes'):
        load_arm(write(tmp_path, '#' * 1_000_001))


@pytest.mark.parametrize('name', ['missing.yaml', 'missing.yml', 'missing.YAML', './missing'])
def test_missing_file_is_named(name: str) -> None:
    with pytest.raises(ArmFileError, match=f"arm file '{name}' does not exist"):
        load_arm(name)


@pytest.mark.parametrize('name', ['korayem', '', 'Korayem_rigid'])
def test_unknown_preset_is_answered_with_the_known_ones(name: str) -> None:
    with pytest.raises(ArmFileError, match=f"'{name}' is neither .*korayem_ei5.*korayem_rigid"):
        load_arm(name)


def test_presets_are_found_in_the_share_folder_of_an_installation(
        tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    folder = tmp_path / 'share' / 'flex_planner' / 'config' / 'arms'
    folder.mkdir(parents=True)
    Path(write(folder, COMPLETE)).rename(folder / 'installed.yaml')
    monkeypatch.setattr(arm_files, '__file__', str(tmp_path / 'lib' / 'arms' / 'arm_files.py'))
    monkeypatch.setenv('AMENT_PREFIX_PATH', f'/nonexistent:{tmp_path}')
    assert load_arm('installed').name == 'two links'


def test_source_tree_comes_before_installations(tmp_path: Path,
                                                monkeypatch: pytest.MonkeyPatch) -> None:
    folder = tmp_path / 'share' / 'flex_planner' / 'config' / 'arms'
    folder.mkdir(parents=True)
    own = load_arm('korayem_rigid').name
    Path(write(folder, COMPLETE)).rename(folder / 'korayem_rigid.yaml')
    monkeypatch.setenv('AMENT_PREFIX_PATH', str(tmp_path))
    assert load_arm('korayem_rigid').name == own


@pytest.mark.parametrize('text', ['50', '50.0', '5e1', '5.0e1', '5.E+1', '+.5e2', '5.0E1'])
def test_numbers_may_have_any_usual_form(tmp_path: Path, text: str) -> None:
    preset = preset_files()['korayem_ei50'].read_text()
    assert 'flexural_rigidity: 50.0' in preset
    path = tmp_path / 'arm.yaml'
    path.write_text(preset.replace('flexural_rigidity: 50.0', f'flexural_rigidity: {text}'))
    assert load_arm(path).flexural_rigidities().tolist() == [50.0, 50.0]


@pytest.mark.parametrize('name', ['arm.YAML', 'arm.Yml', 'arm', 'arm.txt', './arm', 'a b.yaml'])
def test_file_of_any_name_is_found(tmp_path: Path, monkeypatch: pytest.MonkeyPatch,
                                   name: str) -> None:
    monkeypatch.chdir(tmp_path)
    Path(write(tmp_path, COMPLETE)).rename(name)
    assert load_arm(name).name == 'two links'


def test_preset_comes_before_a_file_without_suffix(tmp_path: Path,
                                                   monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    own = load_arm('korayem_rigid').name
    Path(write(tmp_path, COMPLETE)).rename('korayem_rigid')
    assert (load_arm('korayem_rigid').name, load_arm('./korayem_rigid').name) == (own, 'two links')


def test_home_folder_is_found(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv('HOME', str(tmp_path))
    write(tmp_path, COMPLETE)
    assert load_arm('~/arm.yaml').name == 'two links'
    with pytest.raises(ArmFileError, match="there is no home folder of a user 'no-such-user'"):
        load_arm('~no-such-user/arm.yaml')


def test_arm_is_read_from_a_pipe() -> None:
    # what a shell makes of <(cat arm.yaml)
    reader, writer = os.pipe()
    os.write(writer, yaml.safe_dump(COMPLETE).encode())
    os.close(writer)
    try:
        assert load_arm(f'/dev/fd/{reader}').name == 'two links'
    finally:
        os.close(reader)


@pytest.mark.parametrize('encoding', ['utf-8-sig', 'utf-16'])
def test_arm_of_another_system_is_read(tmp_path: Path, encoding: str) -> None:
    text = yaml.safe_dump(changed('name', 'Größe 🦾')).replace('\n', '\r\n')
    (tmp_path / 'arm.yaml').write_bytes(text.encode(encoding))
    assert load_arm(tmp_path / 'arm.yaml').name == 'Größe 🦾'


@pytest.mark.parametrize('name', ['.', '/', '..', '/dev/zero', '/dev/null', 'folder.yaml'])
def test_what_is_no_file_is_refused_by_name(tmp_path: Path, monkeypatch: pytest.MonkeyPatch,
                                            name: str) -> None:
    monkeypatch.chdir(tmp_path)
    Path('folder.yaml').mkdir()
    with pytest.raises(ArmFileError, match=f'^{name}: cannot be read: it is'):
        load_arm(name)


@pytest.mark.parametrize('mass', ['010', '1:30', '0x10', '1_000', '1e999'])
def test_number_that_could_be_misread_is_refused(tmp_path: Path, mass: str) -> None:
    text = yaml.safe_dump(COMPLETE).replace('mass: 3.0', f'mass: {mass}')
    with pytest.raises(ArmFileError, match=f'line .*{mass} must be'):
        load_arm(write(tmp_path, text))


@pytest.mark.parametrize(('place', 'value', 'message'), [
    ('links/0/length', 1e-200, r'links\[0\].length is 1e-200, but must be a number in the range '
     '1e-05 to 10000 m$'),
    ('links/0/mass', 5e-324, r'links\[0\].mass is 5e-324, .* range 1e-12 to 1e\+09 kg'),
    ('links/0/flexural_rigidity', 1e300, 'range 1e-15 to 1e.15 N m.2'),
    ('links/1/linear_density', 1e-10, r'links\[1\].linear_density is 1e-10'),
    ('links/0/mass', 1e-10, r'links\[0\].linear_density \(of mass and length\) is 2e-10'),
    ('joints/0/motor/stall_torque', 1e308, 'range 1e-12 to 1e.09 N m'),
    ('joints/0/motor/no_load_speed', 1e-300, 'range 1e-06 to 1e.06 rad/s'),
    ('joints/0/viscous_friction', 1e300, 'range 0 to 1e.09 N m s/rad'),
    ('joints/0', {'lower_limit': -1e300}, 'range -1e.06 to 1e.06 rad'),
    ('joints/0', {'upper_limit': -math.inf}, 'an angle in rad, or left out for no limit'),
    ('joints/0', {'lower_limit': math.inf, 'upper_limit': math.inf}, 'upper_limit is inf'),
    ('nodes/0/mass', 1e300, r'nodes\[0\].mass is 1e\+300, .* range 0 to 1e\+09 kg$'),
    ('nodes/0/inertia', 1e20, r'nodes\[0\].inertia is 1e\+20'),
    ('gravity', [0.0, 1e200], r'gravity\[1\] is 1e\+200, .* range -1000 to 1000 m/s.2')])
def test_number_far_from_every_arm_is_named_with_its_range(place: str, value: object,
                                                           message: str) -> None:
    with pytest.raises(InvalidValueError, match=message):
        arm_from_mapping(changed(place, value))
