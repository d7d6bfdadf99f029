"""What planning for flexible links is worth, in numbers, words and a picture."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
import re
from typing import Any

from flex_planner.arms.arm import Arm
from flex_planner.arms.arm_files import load_arm
from flex_planner.base.errors import InvalidSizeError, InvalidTaskError, InvalidValueError
from flex_planner.base.progress import Monitor, StoppedError
from flex_planner.control.joint_controller import Gains
from flex_planner.dynamics.integration import integrate
from flex_planner.dynamics.statics import residual_vibration
from flex_planner.optimal_control.arm_model import ArmModel
from flex_planner.optimal_control.planned_torque import PlannedTorque
from flex_planner.optimal_control.task import postures_from_points, Task
from flex_planner.planning.plan import PlanStatus
from flex_planner.plotting import draw_comparison, save
from flex_planner.reports.comparison import comparison_rows, comparison_table
from flex_planner.simulation.comparison import compare, Comparison
from flex_planner.simulation.execution import ExecutionMode
from flex_planner.simulation.mismatch import Mismatch
import matplotlib.image
import numpy as np
import pytest

MM = 1e-3


@pytest.fixture(scope='module')
def compared(ei5_arm: Arm, ei5_model: ArmModel, paper_task: Any) -> Comparison:
    return compare(paper_task(ei5_arm), model=ei5_model, rate=4000.0, settling=0.3)


def test_rigid_plan_leaves_a_millimetre_and_a_flexible_plan_nothing(
        compared: Comparison) -> None:
    # the headline: 0.9 mm and about 1 mm against less than 0.001 mm, torques alone
    rigid = compared.of(ExecutionMode.RIGID_OPEN)
    flexible = compared.of(ExecutionMode.FLEXIBLE_OPEN)
    assert rigid.arrival_error == pytest.approx(0.912 * MM, abs=0.005 * MM)
    assert rigid.bending == pytest.approx(1.068 * MM, abs=0.005 * MM)
    # held for 0.25 ms; the error falls with the square of that
    assert flexible.arrival_error < 2e-4 * MM
    assert flexible.bending < 1e-4 * MM


def test_rigid_plan_is_as_wrong_by_another_integrator(compared: Comparison) -> None:
    rigid, model = compared.rigid, compared.flexible.model
    assert rigid.solution is not None
    torque = PlannedTorque.of(rigid.problem, rigid.solution)
    start = compared.flexible.problem.start
    state = integrate(model, compared.flexible.problem.parameters.physical, start, torque)[-1]
    result = compared.of(ExecutionMode.RIGID_OPEN)
    index = np.searchsorted(result.execution.times, 1.0 - 1e-9)
    found = result.execution.coordinates[index]
    np.testing.assert_allclose(found, state[:6], atol=2e-6)  # of 1e-3: the torque is held
    rest = np.concatenate([state[:2], np.zeros(4)])
    bending = residual_vibration(model, state, rest, compared.flexible.problem.parameters)
    assert result.bending == pytest.approx(bending, rel=1e-3)


def test_arm_that_moves_at_the_start_is_simulated_from_there(ei5_arm: Arm, ei5_model: ArmModel,
                                                             paper_task: Any) -> None:
    task = paper_task(ei5_arm, start_velocities=[0.3, -0.5, 0.01, 0.0, 0.0, 0.02],
                      start_modal_displacements=[2e-3, 0.0, -1e-3, 0.0])
    found = compare(task, model=ei5_model, rate=4000.0, settling=0.3)
    flexible, rigid = (found.of(mode) for mode in (ExecutionMode.FLEXIBLE_OPEN,
                                                   ExecutionMode.RIGID_OPEN))
    assert flexible.execution.coordinates[0].tolist() == [*task.start_positions, 2e-3, 0, -1e-3, 0]
    # the torque is held for 0.25 ms
    assert flexible.arrival_error < 1e-3 * MM
    # a rigid plan knows of the joints' speeds alone
    assert not rigid.execution.coordinates[0, 2:].any()
    assert found.rigid.problem.start.tolist() == [*task.start_positions, 0.3, -0.5]
    assert rigid.arrival_error > 0.1 * MM


def test_errors_are_those_of_the_recorded_motion(compared: Comparison) -> None:
    for result in compared.results:
        times, tip = result.execution.times, result.execution.tip
        assert times[0] == 0
        assert times[-1] == pytest.approx(1.3)
        error = np.hypot(*(tip - [0.5, 0.5]).T)
        assert result.arrival_error == pytest.approx(error[4000], rel=1e-6, abs=1e-12)
        assert result.final_error == pytest.approx(error[times >= 1.27 - 1e-9].max(), abs=1e-12)
        assert result.residual.tip <= 2 * np.abs(tip[4000:] - tip[4000]).max() * np.sqrt(2)


def test_feedback_does_not_replace_the_feedforward(compared: Comparison) -> None:
    plain = compared.of(ExecutionMode.PD_ONLY)
    assert plain.arrival_error > 10 * MM
    assert plain.tracking_error > 1e4 * compared.of(ExecutionMode.FLEXIBLE).tracking_error
    # the joints settle sooner, but the links go on ringing
    open_loop = compared.of(ExecutionMode.RIGID_OPEN)
    assert compared.of(ExecutionMode.RIGID).arrival_error < open_loop.arrival_error
    assert compared.of(ExecutionMode.RIGID).bending > 1 * MM


def test_wrong_payload_and_stiffness_cost_what_they_cost(ei5_arm: Arm, ei5_model: ArmModel,
                                                         paper_task: Any) -> None:
    other = compare(paper_task(ei5_arm), model=ei5_model, settling=0.3, payload_mass=1.05,
                    mismatch=Mismatch(modes=3, rigidity_scale=0.9))
    assert other.arm.n_modes == 6
    flexible = other.of(ExecutionMode.FLEXIBLE_OPEN)
    assert 5 * MM < flexible.arrival_error < 20 * MM
    assert other.of(ExecutionMode.FLEXIBLE).arrival_error < flexible.arrival_error / 10
    assert other.of(ExecutionMode.FLEXIBLE).bending < 0.7 * other.of(ExecutionMode.RIGID).bending


def test_clamped_links_need_a_flexible_plan_even_more() -> None:
    arm = load_arm('clamped_motors')
    start, goal = postures_from_points(arm, (0.5, 0.0), (0.5, 0.5), elbow=-1)
    found = compare(Task(arm=arm, start_positions=start, goal_positions=goal, duration=1.0,
                         payload_mass=1.0, effort_weights=[1 / 8, 1 / 8]), settling=0.5)
    assert found.of(ExecutionMode.RIGID_OPEN).arrival_error == pytest.approx(15.7 * MM,
                                                                             abs=0.3 * MM)
    assert found.of(ExecutionMode.FLEXIBLE_OPEN).arrival_error < 0.3 * MM
    assert found.of(ExecutionMode.RIGID).arrival_error > 20 * MM
    assert found.of(ExecutionMode.FLEXIBLE).arrival_error < 0.02 * MM


def test_plan_that_fails_leaves_its_ways_out(ei5_arm: Arm, ei5_model: ArmModel,
                                             paper_task: Any, tmp_path: Path) -> None:
    late = Monitor(time_limit=0.0)
    found = compare(paper_task(ei5_arm), model=ei5_model, monitor=late)
    assert not found.solved
    assert found.results == ()
    assert found.flexible.status is PlanStatus.TIMEOUT
    assert comparison_table(found) == ''
    assert dict(comparison_rows(found))['planned rigid'].startswith('time limit reached')
    save(draw_comparison(found), tmp_path / 'none.png')


def test_simulation_can_be_canceled(ei5_arm: Arm, ei5_model: ArmModel, paper_task: Any) -> None:
    watch = Monitor()
    watch.canceled = lambda: watch.phase == ExecutionMode.RIGID_OPEN.value
    with pytest.raises(StoppedError):
        compare(paper_task(ei5_arm), model=ei5_model, monitor=watch)


@pytest.mark.parametrize(('options', 'error', 'text'), [
    ({'rate': 1.0}, InvalidValueError, 'rate is 1.0'),
    ({'settling': 0.0}, InvalidValueError, 'settling is 0.0'),
    ({'payload_mass': -1.0}, InvalidValueError, 'payload_mass is -1.0'),
    ({'gains': Gains.of(3, 1.0, 1.0)}, InvalidSizeError, 'stiffness has 3 numbers'),
    ({'mismatch': Mismatch(added_friction=np.ones(3))}, InvalidSizeError, 'added_friction')])
def test_bad_comparison_is_refused_before_anything_is_planned(
        ei5_arm: Arm, paper_task: Any, options: dict[str, Any], error: type[Exception],
        text: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr('flex_planner.simulation.comparison.plan_path', None)
    with pytest.raises(error, match=text):
        compare(paper_task(ei5_arm), **options)


def test_motion_that_does_not_end_at_rest_is_refused(
        ei5_arm: Arm, ei5_model: ArmModel, paper_task: Callable[..., Any]) -> None:
    moving = replace(paper_task(ei5_arm), goal_velocities=np.array([0.1, 0.0]))
    with pytest.raises(InvalidTaskError, match='does not end at rest'):
        compare(moving, model=ei5_model)


def test_table_says_what_was_compared(compared: Comparison) -> None:
    rows = dict(comparison_rows(compared))
    assert rows['simulated arm'] == 'E I = 5, 5 N m^2, 4 modes, 1 kg'
    assert rows['goal of the tip'] == '(0.5, 0.5) m'
    assert rows['planned flexible'].endswith('iterations)')
    lines = [re.split(' {2,}', line.strip()) for line in comparison_table(compared).splitlines()]
    assert lines[0][0] == 'error on arrival [mm]'
    assert [line[0] for line in lines[1:]] == [mode.value for mode in ExecutionMode]
    assert [lines[2][1], lines[2][4]] == ['0.912', '1.07']


def test_picture_is_drawn(compared: Comparison, tmp_path: Path) -> None:
    path = tmp_path / 'comparison.png'
    save(draw_comparison(compared), path)
    picture = matplotlib.image.imread(path)
    assert picture.shape[0] > 1000
    assert np.ptp(picture[..., :3]) > 0.9  # not blank
