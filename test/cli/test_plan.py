"""The commands that plan: what they print, draw, record and refuse, and how they are stopped."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import redirect_stderr, redirect_stdout
from dataclasses import dataclass
import io
import os
from pathlib import Path
import re
import signal
import subprocess
import sys
from typing import Any

from flex_planner.arms.arm import Arm
from flex_planner.cli import main
from flex_planner.cli.options import join_lists
from flex_planner.optimal_control.task import postures_from_points, Task
from flex_planner.optimal_control.torque_offset import DEGREE
from flex_planner.planning.plan_path import plan_path
from flex_planner.recording import (
    definition_folder,
    MessageTypes,
    read_metadata,
    read_recording,
)
from flex_planner_interfaces.msg import MotionTask, PayloadSearch, PlanReport
import pytest

POINTS = ['--from', '0.5,0', '--to', '0.5,0.5']
WEIGHTS = ['--effort-weights', '0.125,0.125']
MOTION = [*POINTS, '--duration', '1', *WEIGHTS]
DRY = ['--no-plot', '--no-recording']
NODE = '/flex_planner'
LARGEST = 5.855  # [kg], of the rigid arm, by brute force over 20000 constant torques
NUMBER = r'[\d.e+-]+'


@dataclass(frozen=True)
class Outcome:
    """What a command did."""

    code: int
    out: str
    err: str

    @property
    def rows(self) -> dict[str, str]:
        """Return the table by its names."""
        lines = (re.split(' {2,}', line.strip(), maxsplit=1) for line in self.out.splitlines())
        return {line[0]: line[1] for line in lines if len(line) > 1}

    def number(self, name: str) -> float:
        """Return the first number in a row of the table."""
        found = re.match(NUMBER, self.rows[name])
        assert found is not None
        return float(found[0])

    @property
    def reason(self) -> str:
        """Return the last line on standard error."""
        return self.err.splitlines()[-1]


def run(*arguments: str) -> Outcome:
    out, err = io.StringIO(), io.StringIO()
    with redirect_stdout(out), redirect_stderr(err):
        code = main(arguments)
    return Outcome(code, out.getvalue(), err.getvalue())


def is_picture(path: str) -> bool:
    return Path(path).read_bytes().startswith(b'\x89PNG\r\n\x1a\n')


def recorded(path: str) -> dict[str, Any]:
    """Return the last message of each topic."""
    types = MessageTypes.load([definition_folder('flex_planner_interfaces')])
    return {entry.topic.name.removeprefix(f'{NODE}/'): entry.message
            for entry in read_recording(path, types)}


@pytest.fixture(scope='module')
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp('cli') / 'new' / 'output'


@pytest.fixture(scope='module')
def planned(folder: Path) -> Outcome:
    return run('plan', 'korayem_rigid', *MOTION, '--payload', '1', '--output', str(folder),
               '--no-plot')


@pytest.fixture(scope='module')
def searched(folder: Path) -> Outcome:
    return run('payload', 'korayem_rigid', *MOTION, '--output', str(folder))


@pytest.fixture(scope='module')
def raised(folder: Path) -> Outcome:
    return run('payload', 'korayem_rigid', *MOTION, '--output', str(folder), '--payload', '5',
               '--method', 'incremental', '--step', '0.5', '--accuracy', '0.5', '--no-plot')


def test_plan_is_told_with_its_costs_peaks_and_certificate(planned: Outcome,
                                                           rigid_arm: Arm) -> None:
    start, goal = postures_from_points(rigid_arm, (0.5, 0), (0.5, 0.5), elbow=-1)
    plan = plan_path(Task(arm=rigid_arm, start_positions=start, goal_positions=goal, duration=1,
                          payload_mass=1, effort_weights=[1 / 8, 1 / 8]))
    assert planned.code == 0
    assert planned.rows['motion'] == '(0.5, 0) m to (0.5, 0.5) m in 1 s with 1 kg'
    assert planned.rows['status'] == 'solved and certified'
    assert 'cold start, ' in planned.rows['planned in']
    for name, value in (('cost J', plan.cost), ('effort', plan.effort), ('energy', plan.energy)):
        assert planned.number(name) == pytest.approx(value, rel=1e-5)  # six digits are shown
    assert 'of no-load speed), peak torque' in planned.rows['joint 2']
    assert planned.rows['motors on their limit'] == 'never'
    assert planned.number('re-simulated tip error') < 0.01


def test_warnings_are_told_with_a_plan_and_with_a_largest_payload(
        planned: Outcome, searched: Outcome) -> None:
    assert planned.rows['warning'].startswith('the torque jumps by shares of the stall torque: ')
    lines = [line for line in searched.out.splitlines() if line.startswith('warning ')]
    report = recorded(searched.rows['recording'])['plan_report']
    assert report.warning_kinds == ['TORQUE_JUMPS', 'BRAKING_TORQUE']
    assert [line[27:] for line in lines] == report.warnings


def test_large_bending_is_refused_unless_it_is_allowed(tmp_path: Path) -> None:
    soft = tmp_path / 'soft.yaml'
    soft.write_text('name: soft\nlinks: [{length: 0.5, linear_density: 0.2, modes: 1, '
                    'flexural_rigidity: 0.3, mode_family: clamped_free}]\n'
                    'joints: [motor: {stall_torque: 5.0}]\nnodes: [{inertia: 0.01}, {}]\n')
    motion = ['--from-angles', '0', '--to-angles', '90', '--duration', '0.7', '--payload', '0.1']
    refused = run('plan', str(soft), *motion, *DRY)
    assert refused.code == 1
    assert refused.reason.startswith('flex-planner: solved, but links bend further than the model '
                                     'of the arm holds: link 1 bends by 50% of its length at ')
    allowed = run('plan', str(soft), *motion, *DRY, '--allow-large-bending')
    assert (allowed.code, allowed.rows['status']) == (0, 'solved and certified')
    assert f'{"warning":<26} link 1 bends by 50% of its length at ' in allowed.out


def test_plan_is_told_with_what_a_controller_makes_of_it(planned: Outcome) -> None:
    assert planned.rows['published trajectory'] == (
        'carried out with 100, 100 N m/rad and 10, 10 N m s/rad at 1000 Hz, effort_hold end')
    assert planned.number('executed tip error') < 0.01
    assert 'a small error at the start grows to 1 times its size' in planned.rows[
        'without feedback']
    assert 'residual vibration if' not in planned.rows  # the arm is rigid


def test_flexible_plan_is_told_with_what_its_model_leaves_out() -> None:
    outcome = run('plan', 'korayem_ei5', *MOTION, *DRY, '--payload', '1')
    assert outcome.code == 0
    assert outcome.number('2 more modes per link') < 0.1
    assert outcome.number('stiffness +-10%') > 0.5
    assert 0.05 < outcome.number('payload +-10%') < 0.5
    assert outcome.number('nothing differs') < 0.02
    assert 'residual vibration if stiffness differs by 10%: 1 mm, but 0.011 mm' in outcome.out


def test_controller_of_the_command_line_is_the_one_that_is_recorded(tmp_path: Path) -> None:
    outcome = run('plan', 'korayem_rigid', *MOTION, '--no-plot', '--output', str(tmp_path),
                  '--controller-rate', '250', '--effort-hold', 'start', '--controller-period',
                  '0', '--controller-stiffness', '80,40', '--controller-damping', '8,4')
    assert outcome.code == 0
    report = recorded(outcome.rows['recording'])['plan_report']
    assert (report.controller_rate, report.effort_hold) == (250.0, 'start')
    assert report.controller_stiffness.tolist() == [80.0, 40.0]
    assert report.controller_damping.tolist() == [8.0, 4.0]
    assert report.controller_period == 0.0
    # half a period of 4 ms
    assert report.executed_tip_error > 5e-5
    assert main(['report', outcome.rows['recording'], '--check', '--output',
                 str(tmp_path / 'page.html')]) == 0


def test_trajectory_that_cannot_be_carried_out_is_a_failure(tmp_path: Path) -> None:
    outcome = run('plan', 'korayem_rigid', *MOTION, '--no-plot', '--output', str(tmp_path),
                  '--controller-rate', '100', '--controller-damping', '1000,1000')
    assert outcome.code == 1
    assert 'the trajectory cannot be carried out: executed tip error is' in outcome.err
    found = recorded(outcome.rows['recording'])
    assert found['plan_report'].error_code == PlanReport.CERTIFICATE_FAILED
    assert 'joint_trajectory' not in found


def uninterrupted(phases: list[str]) -> list[str]:
    """Return phases without what was compiled on the way, after which one goes on."""
    kept: list[str] = []
    resumed = False
    for phase in phases:
        if phase.startswith(('compiling', 'loading')):
            resumed = True
        elif not (resumed and kept[-1:] == [phase]):
            kept.append(phase)
            resumed = False
    return kept


def test_progress_is_a_line_per_phase(planned: Outcome, searched: Outcome) -> None:
    for outcome, phase in ((planned, 'cold start'), (searched, 'kinds of motion, start 1 of 16')):
        lines = outcome.err.splitlines()
        assert all(re.fullmatch(r' *[\d.]+ s  .+', line) for line in lines)
        phases = uninterrupted([line.split(' s  ')[1] for line in lines])
        assert phases[:2] == ['preparing the dynamics of Korayem 2009 two-link arm, rigid', phase]
        assert len(set(phases)) == len(phases)


def test_plan_is_recorded(planned: Outcome, folder: Path) -> None:
    assert Path(planned.rows['recording']).parent == folder / 'recordings'
    found = recorded(planned.rows['recording'])
    assert set(found) == {'motion_task', 'plan_report', 'joint_trajectory',
                          'flexible_trajectory', 'reference_states'}
    assert found['plan_report'].error_code == PlanReport.NONE
    assert found['plan_report'].cost == pytest.approx(planned.number('cost J'), rel=1e-5)
    assert len(found['joint_trajectory'].points) > 100
    task = found['motion_task']
    assert (task.space, task.elbow, task.duration) == (MotionTask.CARTESIAN, -1, 1)
    assert (task.goal_point.x, task.goal_point.y, task.payload_mass) == (0.5, 0.5, 1)


def test_largest_payload_is_told_with_its_bracket_and_front(searched: Outcome) -> None:
    assert searched.code == 0
    assert searched.number('largest payload') == pytest.approx(LARGEST, abs=2e-3)
    below, above = re.findall(rf'({NUMBER}) kg', searched.rows['largest payload'])
    assert 0 < float(above) - float(below) <= 1e-3
    assert searched.rows['limited by'].startswith('the motor of joint 1, on its limit for 99.')
    names, *front = [line.split() for line in searched.out.split('\n\n')[1].splitlines()]
    assert names[-1] == 's/kg]'
    assert [float(line[0]) for line in front] == sorted(float(line[0]) for line in front)
    assert float(front[-1][0]) == pytest.approx(float(below), abs=1e-5)
    assert float(front[-1][1]) == pytest.approx(searched.number('cost J'), rel=1e-5)


def test_search_is_drawn_and_recorded(searched: Outcome, folder: Path) -> None:
    for name, file in (('search', 'max_payload'), ('motion', 'max_payload_motion')):
        assert searched.rows[f'picture of the {name}'] == str(folder / f'korayem_rigid_{file}.png')
        assert is_picture(searched.rows[f'picture of the {name}'])
    found = recorded(searched.rows['recording'])
    search = found['payload_search']
    assert search.method == PayloadSearch.DIRECT
    assert search.payload == pytest.approx(LARGEST, abs=2e-3)
    assert found['flexible_trajectory'].payload_mass == search.payload
    assert (search.payload_accuracy, search.payload_step, search.limiting_joint) == (1e-3, 1, 0)
    assert len(search.front_payloads) > 1


def test_payloads_tried_are_told_and_recorded(raised: Outcome) -> None:
    assert raised.code == 0
    assert raised.rows['method'] == 'payload raised step by step'
    assert raised.rows['largest payload'] == '5.5 kg; no solution at 6 kg'
    trials = [line.split() for line in raised.out.split('\n\n')[1].splitlines()[1:]]
    assert [line[1:4] for line in trials] == [
        ['5.500000', '0.500000', 'yes'], ['6.000000', '0.500000', 'no']]
    search = recorded(raised.rows['recording'])['payload_search']
    assert list(search.tried_payloads) == [5.5, 6]
    assert 'picture of the search' not in raised.rows


def test_nothing_is_left_beside_pictures_and_recordings(
        planned: Outcome, searched: Outcome, raised: Outcome, folder: Path) -> None:
    assert sorted(path.name for path in folder.iterdir()) == [
        'korayem_rigid_max_payload.png', 'korayem_rigid_max_payload_motion.png', 'recordings']
    kinds = sorted(path.name.split('_2')[0] for path in (folder / 'recordings').iterdir())
    assert kinds == ['find_max_payload', 'find_max_payload', 'plan_path']


def test_joint_angles_say_the_same_as_points(planned: Outcome, tmp_path: Path) -> None:
    outcome = run('plan', 'korayem_rigid', '--from-angles', '60,-120', '--to-angles', '90,-90',
                  '--duration', '1', *WEIGHTS, '--payload', '1', '--no-plot',
                  '--output', str(tmp_path))
    assert outcome.rows['motion'] == '(60, -120) deg to (90, -90) deg in 1 s with 1 kg'
    assert outcome.rows['cost J'] == planned.rows['cost J']
    task = recorded(outcome.rows['recording'])['motion_task']
    assert task.space == MotionTask.JOINT
    assert task.goal_positions.tolist() == pytest.approx([1.5708, -1.5708], abs=1e-4)


def test_angles_at_the_start_go_with_a_point_at_the_goal(planned: Outcome) -> None:
    outcome = run('plan', 'korayem_rigid', '--from-angles', '60,-120', '--to', '0.5,0.5',
                  '--duration', '1', *WEIGHTS, '--payload', '1', *DRY)
    assert outcome.rows['motion'] == '(60, -120) deg to (0.5, 0.5) m in 1 s with 1 kg'
    assert outcome.rows['cost J'] == planned.rows['cost J']


@pytest.mark.parametrize('command', ['plan', 'payload'])
def test_point_that_the_bent_arm_cannot_reach_is_named_by_its_option(command: str,
                                                                     tmp_path: Path) -> None:
    path = tmp_path / 'arm.yaml'
    path.write_text("""
        {name: soft, gravity: [0, -9.81], joints: [{motor: {stall_torque: 9}}, {}], links: [
          {length: 0.5, mass: 0.5, flexural_rigidity: 20, modes: 1, mode_family: clamped_free},
          {length: 0.5, mass: 0.5, flexural_rigidity: 20, modes: 1, mode_family: clamped_free}]}
        """)
    outcome = run(command, str(path), '--from', '0.5,0', '--to', '0.9,0.8', '--duration', '1',
                  *DRY)
    assert outcome.code == 1
    assert outcome.err.splitlines()[-1] == (
        'flex-planner: --to: no posture was found in which the arm, bent by gravity, rests with '
        'its tip at (0.9, 0.8) m')
    outcome = run('plan', str(path), '--from', '0.5,0', '--to', '0.5,0.5', '--duration', '1',
                  '--start-modal-displacements', '0,0', *DRY)
    assert "--start-modal-displacements is 'given', but must be left out" in outcome.err


def test_nothing_is_written_if_told_so(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    assert run('plan', 'korayem_rigid', *MOTION, *DRY).code == 0
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize('command', ['plan', 'payload'])
def test_impossible_payload_is_a_failure_that_is_told_and_recorded(command: str,
                                                                   tmp_path: Path) -> None:
    outcome = run(command, 'korayem_rigid', *MOTION, '--payload', '7', '--output', str(tmp_path),
                  '--time-limit', '600')
    assert outcome.code == 1
    # the motors' power of 14 W proves it from some 50 kg on; 7 kg is only not found
    assert outcome.reason.startswith('flex-planner: no motion found: ')
    assert re.search(r'the heaviest payload found in 1 s is 5\.8\d* kg', outcome.reason)
    assert outcome.rows['status'] == 'no motion found'
    assert 'iterations' in outcome.rows['planned in']
    report = recorded(outcome.rows['recording'])['plan_report']
    assert report.error_code == PlanReport.NOT_FOUND
    assert not list(tmp_path.glob('*.png'))


@pytest.mark.parametrize('command', ['plan', 'payload'])
def test_payload_that_is_proved_impossible_is_refused_with_the_proof(command: str) -> None:
    outcome = run(command, 'korayem_rigid', *MOTION, *DRY, '--payload', '100')
    assert (outcome.code, outcome.rows['status']) == (1, 'impossible for every motion')
    assert outcome.reason.startswith('flex-planner: impossible for every motion: the motors give')
    assert outcome.reason.endswith('(POWER)')


def test_time_limit_is_named_where_it_ends_a_search() -> None:
    outcome = run('payload', 'korayem_rigid', *MOTION, *DRY, '--time-limit', '0.01')
    assert outcome.code == 1
    assert outcome.rows['largest payload'] == 'none found'
    assert outcome.reason == 'flex-planner: time limit reached: --time-limit is 0.01 s'


@pytest.mark.parametrize(('arguments', 'message'), [
    (['--from', '0.5,0', '--duration', '1'], 'but the command has --from'),
    (['--duration', '1'], 'but the command has none of them'),
    ([*MOTION, '--from-angles', '1,2'], 'but the command has --from, --to, --from-angles'),
    ([*MOTION, '--to', '2,0'], '--to: the point (2, 0) m is 2 m from the base; the arm reaches'),
    ([*MOTION, '--from', '-1,0'], '--from: the arm is stretched out'),
    ([*MOTION, '--from', '0.5,zero'], "--from is '0.5,zero', but must be numbers separated by"),
    ([*MOTION, '--to', '1,2,3'], '--to has 3 numbers, but must be a list of 2 numbers'),
    ([*MOTION, '--elbow', '2'], '--elbow is 2, but must be +1 or -1'),
    ([*MOTION, '--duration', '-1'], '--duration is -1.0, but must be a number > 0 and <= 1000 s'),
    ([*MOTION, '--payload', 'nan'], '--payload is nan, but must be a finite number >= 0'),
    ([*MOTION, '--payload-inertia', '-1'], '--payload-inertia is -1.0, but must be'),
    ([*MOTION, '--payload-inertia', '1,2,3'], '--payload-inertia has 3 numbers, but must be a'),
    ([*MOTION, '--payload-com', '1,2,3'], '--payload-com has 3 numbers, but must be a list of 2'),
    ([*MOTION, '--to-orientation', '0,90,0'],
     "--to-orientation is 'given', but must be left out for a planar arm"),
    (['--from-angles', '0,10', '--to-angles', '9,30', '--to-orientation', '0,9,0', '--duration',
      '1'], '--to-orientation belongs to the point of --to, which is missing'),
    ([*MOTION, '--tolerance', '2'], '--tolerance is 2.0, but must be a number > 0 and <= 1'),
    ([*MOTION, '--time-limit', '0'], '--time-limit is 0.0, but must be a number > 0'),
    ([*MOTION, '--effort-weights', '1'], '--effort-weights has 1 number, but must be a list of'),
    ([*MOTION, '--torque-rate-weight', '0'], '--torque-rate-weight[0] is 0.0, but must be a'),
    ([*MOTION, '--max-torque-rate', '1,2,3'], '--max-torque-rate has 3 numbers, but must be'),
    ([*MOTION, '--velocity-weights', '-1,0'], '--velocity-weights[0] is -1.0, but must be'),
    ([*MOTION, '--position-weights', '1,2,3'], '--position-weights has 3 numbers'),
    (['--from', '0.5,0', '--to-angles', '0,1', '--duration', '1'],
     'but the command has --from, --to-angles'),
    ([*MOTION, '--start-velocities', '1'], '--start-velocities has 1 number, but must be a list'),
    ([*MOTION, '--start-modal-displacements', '1'], '--start-modal-displacements has 1 number'),
    ([*MOTION, '--controller-rate', '1'], '--controller-rate is 1.0, but must be a number >= 10'),
    ([*MOTION, '--controller-period', '1'], '--controller-period is 1.0, but must be a number'),
    ([*MOTION, '--controller-stiffness', '1'], '--controller-stiffness has 1 number, but must'),
    ([*MOTION, '--controller-damping', '1,-1'], '--controller-damping[1] is -1.0, but must be'),
    (['--from-angles', '0,90', '--to-angles', '0,1e5', '--duration', '1'],
     '--to-angles[1] is 100000.0, but must be a number >= -5729.58 and <= 5729.58 deg')])
def test_bad_option_is_answered_by_one_line_that_names_it(arguments: list[str],
                                                          message: str) -> None:
    outcome = run('plan', 'korayem_rigid', *arguments, *DRY)
    assert (outcome.code, outcome.out) == (1, '')
    assert outcome.err.startswith('flex-planner: ')
    assert message in outcome.err
    assert outcome.err.count('\n') == 1


def test_joint_limits_are_told_in_radians(tmp_path: Path) -> None:
    path = tmp_path / 'arm.yaml'
    path.write_text('name: one\nlinks: [{length: 0.5, mass: 1}]\n'
                    'joints: [{lower_limit: -1, upper_limit: 1}]\n')
    outcome = run('plan', str(path), '--from-angles', '0', '--to-angles', '90', '--duration', '1')
    assert '--to-angles[0] in radians is 1.57' in outcome.err
    assert 'within the limits of the joint, -1 to 1 rad' in outcome.err


@pytest.mark.parametrize(('arguments', 'message'), [
    (['--accuracy', '0'], '--accuracy is 0.0, but must be a number >= 1e-06'),
    (['--accuracy', '2', '--step', '1'], '--step is 1.0, but must be a number >= 2')])
def test_bad_option_of_the_search_is_named(arguments: list[str], message: str) -> None:
    outcome = run('payload', 'korayem_rigid', *MOTION, *DRY, *arguments)
    assert (outcome.code, outcome.out) == (1, '')
    assert message in outcome.reason


def test_folder_that_cannot_be_written_is_told_before_anything_is_solved(tmp_path: Path) -> None:
    (tmp_path / 'file').write_text('')
    outcome = run('plan', 'korayem_rigid', *MOTION, '--output', str(tmp_path / 'file' / 'new'))
    assert (outcome.code, outcome.out) == (1, '')
    assert '--output is ' in outcome.err
    assert f'({tmp_path / "file"}: Not a directory)' in outcome.err
    assert 'preparing' not in outcome.err


def test_lists_may_begin_with_a_minus_sign() -> None:
    assert join_lists(['plan', 'arm', '--to', '-0.5,0', '--elbow', '-1', '--from=-1,0']) \
        == ['plan', 'arm', '--to=-0.5,0', '--elbow', '-1', '--from=-1,0']
    assert run('plan', 'korayem_rigid', '--from', '-.5,0', '--to', '-0.5,-0.5', '--duration',
               '1.5', *DRY).code == 0


def start_long_search(folder: Path) -> subprocess.Popen[str]:
    """Start a search that takes many seconds, and wait until it is under way."""
    process = subprocess.Popen(
        [sys.executable, '-m', 'flex_planner.cli', 'payload', 'korayem_ei50', *MOTION,
         '--method', 'incremental', '--accuracy', '1e-6', '--output', str(folder / 'new')],
        text=True, stdout=subprocess.PIPE, stderr=subprocess.PIPE, cwd=folder)
    assert process.stderr is not None
    for line in process.stderr:
        if 'payload raised' in line:
            break
    return process


@pytest.fixture
def long_search(tmp_path: Path) -> Iterator[subprocess.Popen[str]]:
    process = start_long_search(tmp_path)
    yield process
    process.kill()
    process.communicate()


def test_interrupt_ends_the_search_and_leaves_nothing(long_search: subprocess.Popen[str],
                                                      tmp_path: Path) -> None:
    long_search.send_signal(signal.SIGINT)
    out, err = long_search.communicate(timeout=60)
    assert (long_search.returncode, out) == (130, '')
    assert re.fullmatch(r'flex-planner: canceled after [\d.]+ s, in the phase '
                        r"'payload raised'; nothing was written\n", err)
    assert not list(tmp_path.iterdir())


def test_plan_is_drawn_and_recorded_also_without_ros(tmp_path: Path) -> None:
    blocked = ['rclpy', 'flex_planner_interfaces', 'geometry_msgs', 'rcl_interfaces']
    arguments = ['plan', 'korayem_rigid', *MOTION, '--output', str(tmp_path)]
    result = subprocess.run(
        [sys.executable, '-c', f'import sys; sys.modules.update(dict.fromkeys({blocked}))\n'
         f'from flex_planner.cli import main; sys.exit(main({arguments}))'],
        text=True, capture_output=True, timeout=60, env=dict(os.environ))
    assert result.returncode == 0
    assert 'ROS' not in result.stderr
    assert is_picture(str(tmp_path / 'korayem_rigid_motion.png'))
    assert read_metadata(next((tmp_path / 'recordings').iterdir())).message_count > 100


# Objectives


def test_plan_with_a_speed_limit_tells_the_weights_tried(capsys: pytest.CaptureFixture[str],
                                                         tmp_path: Path) -> None:
    code = main(['plan', 'korayem_rigid', '--from', '0.5,0', '--to', '0.5,0.5', '--duration', '1',
                 '--payload', '1', '--effort-weights', '0.125,0.125', '--max-joint-speeds',
                 '0.8,inf', '--no-plot', '--no-recording', '--output', str(tmp_path)])
    text = capsys.readouterr().out
    assert code == 0
    assert 'objectives                 met by the smallest weights' in text
    # within the 1 % of the weight, to which the speed answers weakly
    assert re.search(r'^joint 1 +peak speed 0\.(79\d|800) rad/s', text, re.MULTILINE)
    assert '    1   joint speeds' in text


@pytest.mark.parametrize(('limits', 'text'), [
    ('0.5,0.5', 'joint speeds: joint 1 reaches 0.61'),
    ('0.8', '--max-joint-speeds has 1 entries, but must be a list of 2 numbers'),
    ('0.8,0', '--max-joint-speeds[1] is 0.0, but must be > 0')])
def test_speed_limit_that_cannot_be_kept_or_read_is_a_failure_with_a_reason(
        capsys: pytest.CaptureFixture[str], tmp_path: Path, limits: str, text: str) -> None:
    code = main(['plan', 'korayem_rigid', '--from', '0.5,0', '--to', '0.5,0.5', '--duration', '1',
                 '--payload', '1', '--effort-weights', '0.125,0.125', '--max-joint-speeds',
                 limits, '--no-plot', '--no-recording', '--output', str(tmp_path)])
    assert code == 1
    assert text in capsys.readouterr().err


FORGIVING = ['plan', 'korayem_ei5', *MOTION, '--payload', '1', '--no-plot',
             '--search', 'fast', '--max-residual', '0.0015']


def test_plan_that_forgives_is_printed_recorded_and_checked(tmp_path: Path) -> None:
    outcome = run(*FORGIVING, '--robust', '0.1,0.05', '--output', str(tmp_path))
    assert outcome.code == 0, outcome.err
    assert outcome.rows['forgives'] == '0.1 of stiffness, 0.05 of payload'
    assert outcome.rows['residual bending'].endswith('may be 1.5 mm')
    (path,) = (tmp_path / 'recordings').iterdir()
    messages = recorded(str(path))
    task, report = messages['motion_task'], messages['plan_report']
    assert (task.stiffness_error, task.payload_error, task.max_residual) == (0.1, 0.05, 0.0015)
    assert 0 < report.forgiven_residual <= 0.0015 < report.forgiven_residual_before
    assert len(report.torque_offset) == 2 * (len(report.torque_offset_breaks) - 1 + DEGREE)
    # costates and efforts go together, with the torque that effort was measured from
    checked = run('report', str(path))
    assert checked.code == 0 and 'FAILED' not in checked.out


@pytest.mark.parametrize(('options', 'message'), [
    (['--robust', '0.1,0.1'], '--robust is given without --max-residual'),
    (['--max-residual', '0'], '--max-residual is 0.0, but must be a number >= 1e-09'),
    (['--max-residual', '0.001', '--robust', '0.1'], '--robust'),
    (['--max-residual', '0.001', '--robust', '0.9,0.1'], '--robust, stiffness_error is 0.9'),
])
def test_wrong_forgiveness_names_the_option(options: list[str], message: str) -> None:
    outcome = run('plan', 'korayem_ei5', *MOTION, *DRY, *options)
    assert outcome.code != 0 and message in outcome.err
