"""Tasks at the edge of sense: an answer at once, whatever it is."""

from __future__ import annotations

from collections.abc import Callable

from flex_planner import find_max_payload, find_min_duration, load_arm, plan_path, Task
from flex_planner.base.errors import InvalidTaskError
from flex_planner.base.progress import Monitor
from flex_planner.base.validation import Array
from flex_planner.capacity.results import MaxPayload
from flex_planner.planning.plan import Plan, PlanStatus
import numpy as np
import pytest

START = np.array([0.4, -0.8])
TURN = np.array([2 * np.pi, 0.0])
# more than any of these takes on a machine that is busy
LIMIT = 30.0


def task(arm: str, goal: Array, duration: float) -> Task:
    return Task(arm=load_arm(arm), start_positions=START, goal_positions=goal, duration=duration)


@pytest.mark.parametrize('duration', [1e-9, 1e-3, 1.0])
@pytest.mark.parametrize('solve', [plan_path, find_max_payload])
def test_a_full_turn_in_no_time_is_proved_impossible(
        solve: Callable[..., Plan | MaxPayload], duration: float) -> None:
    monitor = Monitor(time_limit=LIMIT)
    found = solve(task('korayem_rigid', START + TURN, duration), monitor=monitor)
    assert found.status is PlanStatus.INFEASIBLE
    assert 'turning joint 1 by 360 deg takes at least' in found.message
    assert monitor.iteration == 0


@pytest.mark.parametrize('solve', [plan_path, find_max_payload])
def test_a_speed_beyond_all_bounds_is_refused(solve: Callable[..., object]) -> None:
    with pytest.raises(InvalidTaskError, match='duration is 1e-09 s, but must be at least 0.0062'):
        solve(task('korayem_ei50', START + TURN, 1e-9))


def test_an_arm_that_bends_is_not_explored_in_a_fraction_of_the_rigid_one_s_time() -> None:
    monitor = Monitor(time_limit=LIMIT)
    found = plan_path(task('korayem_ei50', START + TURN, 0.1), monitor=monitor)
    assert found.status is PlanStatus.NOT_FOUND
    assert 'with rigid links the motion takes at least' in found.message
    assert monitor.iteration == 0


def test_a_start_that_is_the_goal_needs_no_exploration() -> None:
    found = plan_path(task('korayem_rigid', START, 1.0))
    assert found.solved
    assert found.cost == 0
    assert found.starts == 1


@pytest.mark.parametrize('solve', [find_max_payload, find_min_duration])
def test_a_start_that_is_the_goal_but_for_rounding_has_no_limit(
        solve: Callable[..., object]) -> None:
    with pytest.raises(InvalidTaskError, match='goal_positions are start_positions'):
        solve(task('korayem_rigid', START + 1e-13, 1.0))


@pytest.mark.parametrize('duration', [1e-9, 1000.0])
def test_a_first_guess_of_a_duration_may_be_out_of_all_proportion(duration: float) -> None:
    found = find_min_duration(task('korayem_rigid', START + [0.5, 0.3], duration), search='fast')
    assert found.status is PlanStatus.SOLVED
    assert found.duration == pytest.approx(0.7133, abs=1e-3)


def test_a_duration_in_which_any_payload_is_carried() -> None:
    monitor = Monitor(time_limit=LIMIT)
    found = find_max_payload(task('korayem_rigid', START + [0.5, 0.3], 1000.0), monitor=monitor)
    assert found.status is PlanStatus.SOLVED
    assert found.payload == 1e6
    assert 'a task may ask for no more' in found.message
    assert monitor.iteration < 50
