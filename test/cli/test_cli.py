"""The console script ``flex-planner``: what it prints, draws and refuses."""

from __future__ import annotations

import io
from pathlib import Path
import re
import struct

from flex_planner import __version__
from flex_planner.arms.arm_files import load_arm, preset_files
from flex_planner.base.library_cache import cache_folder
from flex_planner.cli import main
from presets import PLANAR_PRESETS
import pytest

MOTION = ['--from', '0.5,0', '--to', '0.5,0.5', '--duration', '1']


def run(capsys: pytest.CaptureFixture[str], *arguments: str) -> tuple[int, str, str]:
    code = main(['arm', *arguments])
    out, err = capsys.readouterr()
    return code, out, err


def refused(capsys: pytest.CaptureFixture[str], *arguments: str) -> str:
    """Run a command that fails; return its message, which is one line."""
    code, out, err = run(capsys, *arguments)
    assert (code, out) == (1, '')
    assert err.startswith('flex-planner: ')
    assert err.count('\n') == 1
    return err


def frequencies(text: str, joints: str) -> list[float]:
    """Return the frequencies [Hz] at the first posture that is told."""
    found = re.search(rf'natural frequencies, joints {joints}: (.*) Hz', text)
    assert found is not None
    return [float(part) for part in found[1].replace('unstable', 'nan').split(', ')]


@pytest.mark.parametrize('name', PLANAR_PRESETS)
def test_every_preset_is_described(capsys: pytest.CaptureFixture[str], name: str) -> None:
    code, out, err = run(capsys, name, '--no-plot', '--payload', '0.5')
    arm = load_arm(name)
    assert (code, err) == (0, '')
    assert out.startswith(f'{arm.name}\nsource: ')
    total = (sum(link.mass for link in arm.links) + sum(node.mass for node in arm.nodes)
             + sum(joint.housing.mass for joint in arm.joints[1:]))
    assert f'mass: {total:.4g} kg' in out
    assert 'payload 0.5 kg' in out
    assert f'{arm.n_joints} joints, {arm.n_modes} modal' in out
    for i, link in enumerate(arm.links, 1):
        assert f'link {i}: {link.length:.4g} m, {link.mass:.4g} kg' in out
    assert out.count('joints locked') == out.count('joints free') >= 1


def test_spatial_arm_is_described(capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    path = tmp_path / 'arm.yaml'
    path.write_text(SPATIAL)
    code, out, err = run(capsys, str(path), '--no-plot', '--posture', '30,0.1')
    assert (code, err) == (0, '')
    for part in ('mass: 2.5 kg', 'link 2: to (0.5, 0, 0) m, 0.5 kg, beam of 1 kg/m, clamped_free: '
                 '1 mode across along (0, 1, 0) with EI 20 N m^2',
                 'joint 1: turns about (0, 0, 1), no torque limit',
                 'joint 2: slides along (0, 0, 1), no torque limit, friction 0.5 N s/m, '
                 '-0.2 to 0.4 m', 'at joint angles (30, 0.1) deg, m:'):
        assert part in out


SPATIAL = """\
name: lift
kind: spatial
joints: [{axis: [0, 0, 1]},
         {type: prismatic, axis: [0, 0, 1], viscous_friction: 0.5, lower_limit: -0.2,
          upper_limit: 0.4}]
tip: {xyz: [0.5, 0, 0]}
links: [{inertial: {mass: 2.0, inertia: [0.1, 0.1, 0.1]}},
        {mass: 0.5, flexural_rigidity: 20.0, modes: {across: 1}}]
"""


def test_text_says_what_the_paper_s_arm_is_like(capsys: pytest.CaptureFixture[str]) -> None:
    _, out, _ = run(capsys, 'korayem_ei50', '--no-plot', '--posture', '90,-90')
    assert 'mass: 6 kg (links 6 kg, nodes 0 kg), payload 0 kg' in out
    assert 'reach: 0 to 1 m; horizontal plane' in out
    assert 'link 2: 0.5 m, 3 kg (6 kg/m), EI 50 N m^2, 2 pinned_pinned modes' in out
    assert 'joint 1: +-8 N m at standstill, no-load speed 3.5 rad/s' in out
    assert 'at joint angles (90, -90) deg:' in out
    assert frequencies(out, 'locked') == [18.14, 18.14, 72.55, 72.55]
    assert frequencies(out, 'free')[:4] == [0, 0, 19.69, 28.38]
    assert 'holding torque' not in out


def test_limits_of_a_joint_and_what_its_inertia_lacks_are_told(
        capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    path = tmp_path / 'light.yaml'
    path.write_text('name: light\nlinks: [{length: 0.5, mass: 3.0, flexural_rigidity: 50.0, '
                    'modes: 1, mode_family: clamped_free}]\njoints: [{lower_limit: -1.0, '
                    'motor: {stall_torque: 8.0, max_speed: 2.5}}]\n')
    _, out, _ = run(capsys, str(path), '--no-plot')
    assert 'joint 1: +-8 N m at any speed, at most 2.5 rad/s, -57.3 to inf deg\n' in out
    assert 'warning: joint 1 has hardly any rotary inertia, but a link is clamped to it' in out
    _, out, _ = run(capsys, 'clamped_motors', '--no-plot')
    assert 'warning' not in out


def test_weight_shows_as_deflection_and_torque(capsys: pytest.CaptureFixture[str]) -> None:
    _, out, _ = run(capsys, 'korayem_hanging', '--no-plot', '--posture', '0,0', '--payload', '1')
    assert 'gravity 9.81 m/s^2 in the plane' in out
    # two rods of 3 kg and 1 kg at the tip, level
    assert f'holding torque: {9.81 * 4:.4g}, {9.81 * 1.25:.4g} N m' in out
    assert 'modes -0.481, 0, -0.481, 0 mm' in out  # 4 rho g L^4 / (pi^5 E I)


def test_upright_arm_is_called_unstable(capsys: pytest.CaptureFixture[str]) -> None:
    _, out, _ = run(capsys, 'korayem_hanging', '--no-plot', '--posture', '90,0')
    assert 'joints free: unstable, unstable, ' in out


def test_rigid_arm_has_no_modes(capsys: pytest.CaptureFixture[str]) -> None:
    _, out, _ = run(capsys, 'korayem_rigid', '--no-plot')
    assert 'joints locked: none' in out


def test_postures_may_be_repeated(capsys: pytest.CaptureFixture[str]) -> None:
    _, out, _ = run(capsys, 'korayem_ei5', '--no-plot', '--posture', '10,20', '--posture=-5,7.5')
    assert re.findall(r'at joint angles \((.*)\) deg', out) == ['10, 20', '-5, 7.5']


def test_payload_lowers_the_frequencies(capsys: pytest.CaptureFixture[str]) -> None:
    light, heavy = (frequencies(run(capsys, 'single_link', '--no-plot', '--payload', mass)[1],
                                'locked')[0] for mass in ('0', '0.1'))
    # a cantilever of 0.2 kg/m and 0.5 m: 1.8751^2 sqrt(E I / (rho L^4)) / 2 pi
    assert light == pytest.approx(5.005, abs=1e-3)
    assert heavy < 0.5 * light


@pytest.mark.parametrize('name', ['korayem_ei50', 'korayem_rigid', 'desk_arm'])
def test_picture_is_written_where_it_is_asked_for(capsys: pytest.CaptureFixture[str],
                                                  tmp_path: Path, name: str) -> None:
    path = tmp_path / 'new' / 'shapes.png'
    code, out, _ = run(capsys, name, '--plot', str(path))
    assert code == 0
    assert out.endswith(f'\npicture of the arm         {path}\n')
    data = path.read_bytes()
    assert data.startswith(b'\x89PNG\r\n\x1a\n')
    assert min(struct.unpack('>II', data[16:24])) > 400  # pixels


def test_picture_is_named_after_the_arm(capsys: pytest.CaptureFixture[str], tmp_path: Path,
                                        monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    run(capsys, 'korayem_table6')
    assert [str(path.relative_to(tmp_path)) for path in tmp_path.rglob('*.*')] == [
        'output/korayem_table6_arm.png']


@pytest.mark.parametrize(('arguments', 'message'), [
    (['korayem'], "arm 'korayem' is neither a file nor one of the presets"),
    (['missing.yaml'], "arm file 'missing.yaml' does not exist"),
    (['korayem_rigid', '--payload', '-1'], '--payload is -1.0, but must be a number >= 0 and'),
    (['korayem_rigid', '--payload', 'nan'], '--payload is nan'),
    (['korayem_rigid', '--posture', '1'], '--posture has 1 number, but must be a list of 2'),
    (['korayem_rigid', '--posture', '1,two'], "--posture is '1,two', but must be numbers"),
    (['korayem_rigid', '--posture', '1,inf'], '--posture[1] is inf')])
def test_bad_input_is_answered_by_one_line(capsys: pytest.CaptureFixture[str],
                                           arguments: list[str], message: str) -> None:
    assert message in refused(capsys, *arguments)


def test_mistake_in_a_file_is_named(capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    path = tmp_path / 'arm.yaml'
    path.write_text('name: arm\nlinks: [{length: 0.5, mas: 1}]\njoints: [{}]\n')
    assert f'{path}: links[0].linear_density or mass or density' in refused(capsys, str(path))


def test_picture_that_cannot_be_written_is_an_error(capsys: pytest.CaptureFixture[str],
                                                    tmp_path: Path) -> None:
    (tmp_path / 'file').write_text('')
    code, out, err = run(capsys, 'korayem_ei50', '--plot', str(tmp_path / 'file' / 'a.png'))
    assert code == 1
    assert out.startswith('Korayem 2009 two-link arm')  # is lost no more than anything else
    assert err.startswith('flex-planner: warning: no picture of the arm: ')
    assert err.count('\n') == 1


def test_arm_too_soft_for_its_load_is_an_error(capsys: pytest.CaptureFixture[str],
                                               tmp_path: Path) -> None:
    path = tmp_path / 'arm.yaml'
    link = '{length: 0.5, mass: 3, flexural_rigidity: 2, modes: 1, mode_family: clamped_free}'
    path.write_text(f'name: soft\ngravity: [0, -9.81]\nlinks: [{link}, {link}]\n'
                    'joints: [{}, {}]\n')
    message = refused(capsys, str(path), '--posture', '0,0', '--payload', '1', '--no-plot')
    assert 'no static equilibrium was found at joint angles (0, 0) deg' in message


def test_version_is_that_of_the_package(capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit) as caught:
        main(['--version'])
    assert caught.value.code == 0
    assert capsys.readouterr().out.strip() == __version__


@pytest.mark.parametrize('arguments', [
    [], ['arms'], ['arm'], ['arm', 'x', '--payload', 'heavy'], ['plan'], ['plan', 'x'],
    ['plan', 'x', *MOTION, '--payload', 'heavy'], ['payload', 'x', *MOTION, '--method', 'guess']])
def test_wrong_usage_is_told(capsys: pytest.CaptureFixture[str], arguments: list[str]) -> None:
    with pytest.raises(SystemExit) as caught:
        main(arguments)
    assert caught.value.code == 2
    assert 'usage: flex-planner' in capsys.readouterr().err


@pytest.mark.parametrize(('arguments', 'message'), [
    (['pln'], "'pln' must be one of arm, plan, "),
    (['pln'], 'did you mean plan?'),
    (['plan', 'x', '--duraton', '1'], '--duraton is no option of flex-planner plan; did you mean '
     '--duration?'),
    (['payload', 'x', *MOTION, '--methd=direct'], '--methd is no option of flex-planner payload; '
     'did you mean --method?'),
    (['payload', 'x', *MOTION, '--method', 'dierct'], "'dierct' must be one of direct, "
     'incremental; did you mean direct?'),
    (['arm', 'x', '--colour'], '--colour is no option of flex-planner arm\n'),
    (['arm', 'x', 'y'], 'y is an argument too many for flex-planner arm\n')])
def test_misspelt_option_is_told_with_what_is_meant(
        capsys: pytest.CaptureFixture[str], arguments: list[str], message: str) -> None:
    with pytest.raises(SystemExit) as caught:
        main(arguments)
    assert caught.value.code == 2
    assert message in capsys.readouterr().err


def test_misspelt_preset_is_told_with_what_is_meant(capsys: pytest.CaptureFixture[str]) -> None:
    assert refused(capsys, 'desk-ram').endswith('; did you mean desk_arm?\n')


def test_help_and_tables_name_no_equations(capsys: pytest.CaptureFixture[str]) -> None:
    for command in ('arm', 'plan', 'payload', 'compare', 'gains', 'map', 'report'):
        with pytest.raises(SystemExit):
            main([command, '--help'])
    assert re.search(r'\beqs?[. ]', capsys.readouterr().out) is None


def test_arm_comes_through_a_pipe(capsys: pytest.CaptureFixture[str],
                                  monkeypatch: pytest.MonkeyPatch) -> None:
    data = preset_files()['korayem_rigid'].read_bytes()
    monkeypatch.setattr('sys.stdin', io.TextIOWrapper(io.BytesIO(data)))
    assert main(['arm', '-', '--no-plot']) == 0
    assert 'rigid' in capsys.readouterr().out


@pytest.mark.parametrize(('arguments', 'message'), [
    (['arm', 'korayem_ei5', '--plot', '~no-such-user/a.png'], 'no home folder of a user'),
    (['arm', 'korayem_ei5', '--payload', '010'], "'010' must be a plain decimal number, such as"),
    (['arm', 'korayem_ei5', '--payload', '1:30'], "'1:30' must be a plain decimal number, with"),
    (['arm', 'korayem_ei5', '--payload', '1 kg'], "'1 kg' must be a number"),
    (['arm', 'korayem_ei5', '--payload', '1e999'], 'must be a number below 1e308'),
    (['paper', '--processes', '1.5'], "'1.5' must be an integer")])
def test_argument_that_is_not_what_it_should_be_is_named(
        capsys: pytest.CaptureFixture[str], arguments: list[str], message: str) -> None:
    with pytest.raises(SystemExit) as caught:
        main(arguments)
    assert caught.value.code == 2
    assert message in capsys.readouterr().err.splitlines()[-1]


def test_negative_number_with_an_exponent_is_no_option(capsys: pytest.CaptureFixture[str]) -> None:
    assert '--payload is -1000.0, but' in refused(capsys, 'korayem_rigid', '--payload', '-1e3')


@pytest.mark.parametrize('entry', ['010', '1_0', '0x10', '1:30'])
def test_number_in_a_list_is_plain(capsys: pytest.CaptureFixture[str], entry: str) -> None:
    assert f"--posture is '{entry}', but must be a plain decimal number" in refused(
        capsys, 'korayem_rigid', '--posture', f'1,{entry}')


def test_picture_goes_to_the_home_folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv('XDG_CACHE_HOME', str(cache_folder().parent))  # compiled before
    monkeypatch.setenv('HOME', str(tmp_path))
    assert main(['arm', 'korayem_ei5', '--plot=~/modes.png']) == 0
    assert (tmp_path / 'modes.png').is_file()
