"""URDF files and their overlays: what is merged, what is refused, what is told."""

from __future__ import annotations

from pathlib import Path
import sys
from types import SimpleNamespace
from typing import Any
from xml.dom import minidom

from flex_planner.arms.arm_files import arm_from_mapping, ArmFileError, load_arm
from flex_planner.arms.spatial_arm import SpatialArm
from flex_planner.arms.urdf import parse_urdf, read_urdf
from flex_planner.arms.urdf_files import UrdfError
from flex_planner.base.errors import InvalidValueError
import numpy as np
import pytest

DATA = Path(__file__).parents[1] / 'data' / 'spatial'
TEXT = (DATA / 'branched.urdf').read_text()
OVERLAY: dict[str, Any] = {'urdf': 'branched.urdf', 'tip': 'tool',
                           'locked_joints': {'grip': 0.03}}
BOOM: dict[str, Any] = {'section': {'outer_diameter': 0.04, 'wall': 0.002},
                        'youngs_modulus': 7.0e10, 'modes': {'across': 1, 'across2': 1}}


def read(**fields: Any) -> SpatialArm:
    arm = arm_from_mapping({**OVERLAY, **fields}, folder=DATA)
    assert isinstance(arm, SpatialArm)
    return arm


def test_joints_have_the_limits_and_the_friction_of_the_file() -> None:
    turn, lift, slide, roll = read().joints
    assert (turn.viscous_friction, turn.coulomb_friction) == (0.4, 0.6)
    assert turn.motor.standstill_torque == 60
    assert np.isinf(turn.motor.no_load_speed)
    assert turn.motor.max_speed == 3
    assert (lift.lower_limit, lift.upper_limit) == (-2, 2)
    assert np.isinf([turn.lower_limit, turn.upper_limit]).all()
    assert slide.slides
    assert (slide.lower_limit, slide.upper_limit) == (-0.1, 0.3)
    assert np.isinf(roll.motor.standstill_torque)


def test_what_was_merged_snapped_and_ignored_is_told() -> None:
    notes = '\n'.join(read().notes)
    for part in ('link shoulder was merged with camera',
                 'link wrist was merged with flange, gripper, finger, tool',
                 'joint grip is locked at 0.03', 'limit effort is 0 and was taken as none',
                 'rpy "0 1.5708 0" was taken as right angles', 'turn, lift, slide, roll'):
        assert part in notes


def test_no_mass_is_lost() -> None:
    # all but the pedestal, which does not move
    assert sum(link.mass for link in read().links) == pytest.approx(
        2.5 + 0.3 + 1.2 + 0.8 + 0.6 + 0.5 + 0.1)


def test_overlay_makes_a_link_a_beam_of_its_mass() -> None:
    arm = read(links={'boom': BOOM})
    boom = arm.links[1]
    assert boom.mass == pytest.approx(1.2)
    assert boom.beam is not None
    assert boom.beam.linear_density == pytest.approx(1.2 / 0.8)
    assert arm.n_modes == 2
    note = next(note for note in arm.notes if note.startswith('link boom: as a beam'))
    assert 'centre of mass is 0 mm' in note


def test_masses_of_an_overlay_stand_for_those_of_the_file() -> None:
    split = read(links={'boom': {**BOOM, 'tip_body': {'mass': 0.5}}})
    assert split.links[1].mass == pytest.approx(1.2)
    other = read(links={'boom': {**BOOM, 'mass': 0.9}})
    assert other.links[1].mass == pytest.approx(0.9)
    assert any('stand for the 1.2 kg of its <inertial>' in note for note in other.notes)


def test_what_is_fixed_to_a_beam_stays_at_its_nearer_end() -> None:
    camera = TEXT.replace('<parent link="shoulder"/><child link="camera"/><origin xyz="0.1 0 0.1"',
                          '<parent link="boom"/><child link="camera"/><origin xyz="0.7 0 0.1"')
    content = {**OVERLAY, 'links': {'boom': BOOM}}
    folder = DATA.parent  # not read: the text is given below
    assert folder.is_dir()
    arm = overlay_of(camera, content)
    boom = arm.links[1]
    assert boom.mass == pytest.approx(1.2 + 0.3)
    assert boom.tip_body.mass == pytest.approx(0.3)
    assert any('link camera is fixed to the end of the beam boom' in note for note in arm.notes)


def overlay_of(text: str, content: dict[str, Any]) -> SpatialArm:
    """Return the arm of an overlay of a URDF text."""
    import tempfile

    with tempfile.TemporaryDirectory() as folder:
        (Path(folder) / 'branched.urdf').write_text(text)
        arm = arm_from_mapping(content, folder=Path(folder))
    assert isinstance(arm, SpatialArm)
    return arm


def test_overlay_of_a_joint_wins() -> None:
    arm = read(joints={'turn': {
        'motor': {'rotor_inertia': 2e-5, 'gear_ratio': 100}, 'friction': {'viscous': 0.1},
        'elasticity': {'stiffness': 2e4}, 'upper_limit': 1.0}})
    turn = arm.joints[0]
    assert turn.motor.reflected_inertia == pytest.approx(0.2)
    assert turn.motor.standstill_torque == 60  # of the URDF, as the overlay has none
    assert (turn.viscous_friction, turn.coulomb_friction) == (0.1, 0.0)
    assert turn.is_elastic
    assert turn.upper_limit == 1
    assert arm.n_passive == 1


@pytest.mark.parametrize(('fields', 'message'), [
    ({'tip': None}, 'tip is missing, but must be given where the URDF branches: one of'),
    ({'tip': 'tol'}, "tip is 'tol', but must be .*tool"),
    ({'locked_joints': {}}, "joint grip is 'beside the chain', but must be fixed, or locked"),
    ({'locked_joints': {'grib': 0.0}}, 'locked_joints.grib is .*grip'),
    ({'links': {'bom': BOOM}}, "links.bom is 'given', but must be .*boom"),
    ({'joints': {'lift': {'motor': {'stall': 3}}}}, 'joints.lift.motor.stall'),
    ({'links': {'boom': {**BOOM, 'tip_body': {'mass': 2.0}}}},
     'links.boom.mass is missing, but must be given: the URDF has 1.2 kg'),
    ({'base': 'finger'}, "base is 'finger', but must be a link above the tip tool"),
])
def test_bad_overlays_are_refused(fields: dict[str, Any], message: str) -> None:
    content = {key: value for key, value in {**OVERLAY, **fields}.items() if value is not None}
    with pytest.raises(InvalidValueError, match=message):
        arm_from_mapping(content, folder=DATA)


@pytest.mark.parametrize(('old', 'new', 'message'), [
    ('<child link="boom"/>', '<child link="bom"/>', "joint lift, child is 'bom'"),
    ('<axis xyz="0 -1 0"/>', '<axis xyz="0 -1"/>', 'joint lift, axis xyz is .* three numbers'),
    ('type="prismatic"', 'type="screw"', "joint slide, type is 'screw'"),
    ('<mass value="1.2"/>', '<mass value="heavy"/>', 'link boom, mass, value is .*finite'),
    ('<mass value="1.2"/>', '', 'link boom, mass is missing'),
    ('<limit lower="-2" upper="2" effort="80" velocity="2"/>', '',
     'joint lift, limit is missing'),
    ('<link name="tool"/>', '<link name="tool"/><link name="tool"/>',
     "link tool is 'there twice'"),
    ('<link name="tool"/>', '<link name="tool"/><link name="loose"/>',
     'links without a joint to a parent'),
    ('ixx="0.002"', 'ixx="-0.002"', 'link boom, inertia is .* negative principal moments'),
])
def test_bad_urdf_files_are_refused(old: str, new: str, message: str) -> None:
    assert old in TEXT
    with pytest.raises(InvalidValueError, match=message):
        parse_urdf(TEXT.replace(old, new))


def test_a_joint_that_follows_another_is_refused_unless_it_is_locked() -> None:
    text = TEXT.replace('<dynamics damping="0.5"/>', '<mimic joint="turn"/>')
    with pytest.raises(InvalidValueError, match='joint lift, mimic'):
        overlay_of(text, OVERLAY)
    locked = overlay_of(text, {**OVERLAY, 'locked_joints': {'grip': 0.03, 'lift': 0.5}})
    assert locked.n_joints == 3


def test_impossible_inertia_is_told() -> None:
    notes = parse_urdf(TEXT.replace('ixx="0.002"', 'ixx="0.5"')).notes
    assert any('link boom: no body has its inertia' in note for note in notes)


def test_files_that_cannot_be_read_are_named(tmp_path: Path) -> None:
    (tmp_path / 'arm.yaml').write_text('urdf: none.urdf\n')
    with pytest.raises(ArmFileError, match='arm.yaml: urdf: .*none.urdf'):
        load_arm(tmp_path / 'arm.yaml')
    (tmp_path / 'none.urdf').write_text('<robot>')
    with pytest.raises(ArmFileError, match='none.urdf: is no XML'):
        load_arm(tmp_path / 'arm.yaml')
    with pytest.raises(UrdfError, match='no package nowhere is installed'):
        read_urdf('package://nowhere/robot.urdf', tmp_path)


def test_urdf_of_a_package_is_found(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    share = tmp_path / 'share' / 'robots'
    share.mkdir(parents=True)
    (share / 'one.urdf').write_text(TEXT)
    monkeypatch.setenv('AMENT_PREFIX_PATH', str(tmp_path))
    assert read_urdf('package://robots/one.urdf', Path()).name == 'branched'


XACRO = """<robot name="arm" xmlns:xacro="http://www.ros.org/wiki/xacro">
  <xacro:arg name="effort" default="60"/>
  <xacro:property name="half" value="${pi/2}"/>
  <xacro:macro name="rod" params="name length">
    <link name="${name}"><inertial><origin xyz="${length/2} 0 0"/><mass value="1.2"/>
      <inertia ixx="0.002" ixy="0" ixz="0" iyy="0.06" iyz="0" izz="0.06"/></inertial></link>
  </xacro:macro>
  <link name="base"/>
  <xacro:rod name="upper" length="0.8"/>
  <xacro:rod name="fore" length="0.5"/>
  <joint name="a" type="revolute"><parent link="base"/><child link="upper"/>
    <origin rpy="${half} 0 0"/><axis xyz="0 0 1"/>
    <limit lower="-2" upper="2" effort="$(arg effort)" velocity="3"/></joint>
  <joint name="b" type="revolute"><parent link="upper"/><child link="fore"/>
    <origin xyz="0.8 0 0"/><axis xyz="0 0 1"/>
    <limit lower="-2" upper="2" effort="30" velocity="3"/></joint>
</robot>"""


def test_xacro_files_are_expanded(tmp_path: Path) -> None:
    pytest.importorskip('xacro', reason='an extra')
    file = tmp_path / 'arm.urdf.xacro'
    file.write_text(XACRO)
    arm = arm_from_mapping({'urdf': file.name, 'tip': 'fore'}, folder=tmp_path)
    assert isinstance(arm, SpatialArm)
    assert arm.joints[0].motor.standstill_torque == 60
    np.testing.assert_allclose(arm.links[0].body.center_of_mass, [0.4, 0, 0])
    file.write_text(XACRO.replace('${half}', '${hal}'))
    with pytest.raises(UrdfError, match=r"arm.urdf.xacro: xacro: name 'hal' is not defined"):
        read_urdf(file.name, tmp_path)


def test_what_xacro_makes_of_a_file_is_read(tmp_path: Path,
                                            monkeypatch: pytest.MonkeyPatch) -> None:
    file = tmp_path / 'arm.xacro'
    file.write_text(TEXT)
    monkeypatch.setitem(sys.modules, 'xacro', None)
    with pytest.raises(UrdfError, match='xacro is not installed: expand it elsewhere'):
        read_urdf(file.name, tmp_path)
    monkeypatch.setitem(sys.modules, 'xacro', SimpleNamespace(process_file=minidom.parse))
    assert read_urdf(file.name, tmp_path).name == parse_urdf(TEXT).name
    file.write_text('<robot')
    with pytest.raises(UrdfError, match='arm.xacro: xacro: '):
        read_urdf(file.name, tmp_path)
