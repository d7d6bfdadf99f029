"""Shortest duration, and the maximum payload of many durations: both sides of one front."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
import math
from typing import Any

from flex_planner.arms.arm import Arm, Joint, Link, Motor
from flex_planner.base.errors import InvalidSizeError, InvalidTaskError, InvalidValueError
from flex_planner.base.progress import Monitor, Progress
from flex_planner.capacity.max_payload import find_max_payload
from flex_planner.capacity.min_duration import find_min_duration, payload_against_duration
from flex_planner.capacity.results import MinDuration
from flex_planner.optimal_control.arm_model import ArmModel
from flex_planner.optimal_control.direct.ipopt import DirectProblem, DirectSettings
from flex_planner.optimal_control.task import Task
from flex_planner.planning.plan import PlanStatus
from known_limits import HEAVIEST, one_link, SHORTEST
import numpy as np
from payload_searches import followed
from plan_checks import problem_of, stopped_in
import pytest

TaskFactory = Callable[..., Task]

inf, nan = math.inf, math.nan
HALF_A_DIGIT = 5e-7
every_arm = pytest.mark.parametrize('name', SHORTEST)
both_stops = pytest.mark.parametrize('status', [PlanStatus.CANCELED, PlanStatus.TIMEOUT])


def shortest(task: Task, **options: Any) -> MinDuration:
    """Search along one kind of motion, where that is what matters, or the task has no others."""
    return find_min_duration(task, search='fast', **options)


def assert_encloses(found: MinDuration, duration: float, accuracy: float = 1e-4) -> None:
    assert found.solved, found.message
    # the motion at the upper end is as exact as the bracket is narrow
    assert found.local_lower - accuracy / 10 <= duration <= found.duration + accuracy / 10
    assert 0 < found.duration - found.local_lower <= accuracy


def assert_stopped(found: MinDuration, status: PlanStatus, *, certified: bool = False,
                   limit: float = SHORTEST['rigid']) -> None:
    """Check the outcome of a search that was stopped, with or without something certified."""
    assert (found.status, found.solved) == (status, False)
    if not certified:
        assert (found.message, found.duration) == (status.value, inf)
        assert found.plan is None or not found.plan.solved
        return
    assert found.message == f'{status.value} ({found.duration:.6g} s are certified)'
    assert found.plan is not None
    assert (found.plan.solved, found.plan.task.duration) == (True, found.duration)
    assert found.local_lower <= limit <= found.duration


# Shortest


@every_arm
def test_shortest_duration_is_enclosed(request: pytest.FixtureRequest, paper_task: TaskFactory,
                                       name: str) -> None:
    model = request.getfixturevalue(f'{name}_model')
    found = find_min_duration(paper_task(model.arm), model=model)
    assert_encloses(found, SHORTEST[name])
    assert found.duration == pytest.approx(SHORTEST[name], abs=1e-4)
    assert (found.starts, len(found.kinds)) == (16, 1)
    assert 0 < found.proved_lower < found.local_lower
    assert found.message == (
        f'{found.duration:.6g} s are enough, certified, the only kind of motion found from 16 '
        f'starts; this kind of motion ends at {found.local_lower:.6g} s')
    assert found.plan is not None
    assert found.plan.solved
    assert found.plan.task.duration == found.duration
    # both motors are on their limits most of the time
    assert found.plan.saturation.min() > 0.8


def test_accuracy_is_what_is_asked(rigid_model: ArmModel, paper_task: TaskFactory) -> None:
    for accuracy in (0.1, 1e-6):
        found = shortest(paper_task(rigid_model.arm), model=rigid_model, accuracy=accuracy)
        assert_encloses(found, SHORTEST['rigid'], accuracy)
    assert found.duration == pytest.approx(SHORTEST['rigid'], abs=1e-6 + HALF_A_DIGIT)


@pytest.mark.parametrize('payload_mass', [0.0, 0.5, 3.0, 100.0])
def test_shortest_duration_of_one_link_has_its_closed_form(payload_mass: float) -> None:
    # bang-bang: u_max T^2 = 4 M d
    found = find_min_duration(one_link(2.0, payload_mass=payload_mass))
    assert_encloses(found, math.sqrt(1 + payload_mass))


@pytest.mark.parametrize('guess', [0.1, 0.3, 0.643, 50.0])
def test_first_guess_does_not_matter(rigid_model: ArmModel, paper_task: TaskFactory,
                                     guess: float) -> None:
    found = find_min_duration(paper_task(rigid_model.arm, duration=guess), model=rigid_model)
    assert_encloses(found, SHORTEST['rigid'])
    assert found.task.duration == guess


def test_first_guess_may_be_the_longest_duration(rigid_model: ArmModel,
                                                 paper_task: TaskFactory) -> None:
    found = find_min_duration(paper_task(rigid_model.arm, duration=1000.0), model=rigid_model)
    assert found.local_lower <= SHORTEST['rigid'] <= found.duration


@pytest.mark.parametrize('changes', [
    {'w_2': 200.0}, {'position_weights': [50.0, 0.0]}, {'effort_weights': [1.0, 5.0]},
    {'time_weight': 3.0}], ids=str)
def test_weights_do_not_matter(rigid_model: ArmModel, paper_task: TaskFactory,
                               changes: dict[str, Any]) -> None:
    task = paper_task(rigid_model.arm, **changes)
    found = find_min_duration(task, model=rigid_model)
    assert_encloses(found, SHORTEST['rigid'])
    # the plan is that of the task, in a given time
    assert found.plan is not None
    assert found.plan.task.velocity_weights.tolist() == task.velocity_weights.tolist()
    assert found.plan.task.time_weight == 0


def test_shortest_duration_of_the_maximum_payload_is_its_duration(
        rigid_model: ArmModel, paper_task: TaskFactory) -> None:
    heavy = followed(paper_task(rigid_model.arm), model=rigid_model, accuracy=1e-4)
    quick = shortest(paper_task(rigid_model.arm, heavy.payload), model=rigid_model)
    # a kilogram more takes 60 ms more, and a bracket is 0.1 g wide
    assert quick.local_lower < 1.0 <= quick.duration + 1e-5
    assert quick.duration < 1.0 + 1e-4


def test_maximum_payload_of_the_shortest_duration_is_its_payload(
        rigid_model: ArmModel, paper_task: TaskFactory) -> None:
    quick = shortest(paper_task(rigid_model.arm, 3.0), model=rigid_model)
    heavy = followed(paper_task(rigid_model.arm, 2.0, duration=quick.duration), model=rigid_model)
    # 0.1 ms more carries a gram more
    assert heavy.payload <= 3.0 + 2e-3
    assert 3.0 <= heavy.local_upper


def test_less_time_is_not_enough_and_a_little_more_is(rigid_model: ArmModel,
                                                      paper_task: TaskFactory) -> None:
    found = shortest(paper_task(rigid_model.arm), model=rigid_model)
    # by another method
    problem = problem_of(rigid_model, paper_task(rigid_model.arm))
    direct = DirectProblem(rigid_model, DirectSettings(degree=4, intervals=20))
    less, more = (direct.solve(problem.parameters, problem.start, problem.goal, duration)
                  for duration in (0.999 * found.local_lower, 1.001 * found.duration))
    assert more.converged, more.message
    assert less.message == 'infeasible problem detected'


@every_arm
def test_gap_bounds_the_limit_at_every_extremal(request: pytest.FixtureRequest,
                                                paper_task: TaskFactory, name: str) -> None:
    model = request.getfixturevalue(f'{name}_model')
    extremals = shortest(paper_task(model.arm), model=model, accuracy=1e-3).extremals
    assert len(extremals) > 1
    assert all(one.value - one.gap < SHORTEST[name] < one.value for one in extremals)
    assert all(np.diff([one.value for one in extremals]) < 0)
    assert all(np.diff([one.price for one in extremals]) > 0)


def lift(payload_mass: float, duration: float) -> Task:
    """Return the motion of a pendulum of 0.3 kg and 1 m with 6 N m, up to the level."""
    link = Link(length=1.0, linear_density=0.3)
    arm = Arm(name='pendulum', links=(link,), joints=(Joint(motor=Motor(stall_torque=6.0)),),
              gravity=[0, -9.81])
    return Task(arm=arm, start_positions=[-0.5], goal_positions=[0.0], duration=duration,
                payload_mass=payload_mass)


def test_lift_of_more_payload_against_gravity_takes_longer() -> None:
    found = [find_min_duration(lift(payload, 1.0)) for payload in (0.0, 0.2, 0.4)]
    assert all(each.solved for each in found)
    assert found[0].duration < found[1].local_lower
    assert found[1].duration < found[2].local_lower
    heavy = find_max_payload(lift(0.0, found[1].duration))
    # 0.1 ms carries 0.1 g
    assert heavy.payload - 2e-4 <= 0.2 <= heavy.local_upper


@pytest.mark.parametrize('payload_mass', [0.0, 0.4])
def test_search_that_ends_elsewhere_claims_nothing(payload_mass: float) -> None:
    # from a slow lift one way leads to swings, or nowhere
    found = shortest(lift(payload_mass, 2.0))
    assert 0 <= found.local_lower <= found.duration
    assert found.solved == found.message.endswith(
        f'this kind of motion ends at {found.local_lower:.6g} s')
    assert found.solved or found.message != PlanStatus.SOLVED.value


@pytest.mark.parametrize('payload_mass', [0.0, 0.4])
def test_first_guess_of_a_lift_does_not_matter_where_kinds_are_explored(
        payload_mass: float) -> None:
    long, short = (find_min_duration(lift(payload_mass, guess)) for guess in (2.0, 0.75))
    assert_encloses(long, short.duration, 2e-4)
    assert_encloses(short, long.duration, 2e-4)


# Progress


def test_search_reports_its_phases(rigid_model: ArmModel, paper_task: TaskFactory) -> None:
    reports: list[Progress] = []
    found = find_min_duration(paper_task(rigid_model.arm), model=rigid_model,
                              monitor=Monitor(report=reports.append))
    assert list(dict.fromkeys(each.phase for each in reports)) == [
        *(f'kinds of motion, start {i} of 16' for i in range(1, 17)),
        'duration at a rising price', 'continuation to the limit']
    assert len(reports) == found.iterations
    assert found.planning_time > 0


# Payload against duration


def test_payload_grows_with_the_duration_and_is_that_of_single_searches(
        rigid_model: ArmModel, paper_task: TaskFactory) -> None:
    durations, task = [0.7, 0.8, 0.9, 1.0, 1.1], paper_task(rigid_model.arm)
    found = list(payload_against_duration(task, durations, model=rigid_model))
    alone = [find_max_payload(replace(task, duration=0.7), model=rigid_model), *(
        followed(replace(task, duration=duration), model=rigid_model)
        for duration in durations[1:])]
    assert [each.task.duration for each in found] == durations
    assert all(each.solved for each in found)
    assert all(less.local_upper < more.payload
               for less, more in zip(found[:-1], found[1:], strict=True))
    # each pair of brackets has the limit in it
    assert all(max(one.payload, other.payload) <= min(one.local_upper, other.local_upper)
               for one, other in zip(found, alone, strict=True))
    assert found[3].payload <= HEAVIEST['rigid'] <= found[3].local_upper
    # the first has nothing to start from
    assert found[0].iterations == alone[0].iterations
    assert [each.starts for each in found] == [16, 0, 0, 0, 0]
    assert sum(each.iterations for each in found[1:]) < sum(each.iterations for each in alone[1:])


def test_payload_of_an_arm_that_bends_grows_with_the_duration(ei5_model: ArmModel,
                                                              paper_task: TaskFactory) -> None:
    less, more = payload_against_duration(paper_task(ei5_model.arm), [0.98, 1.0],
                                          model=ei5_model)
    assert less.local_upper < more.payload <= 5.741828 <= more.local_upper
    assert more.iterations < less.iterations


def test_duration_that_is_too_short_is_passed_over(rigid_model: ArmModel,
                                                   paper_task: TaskFactory) -> None:
    short, first, second, third = payload_against_duration(
        paper_task(rigid_model.arm), [0.6, 1.0, 1.05, 1.1], model=rigid_model)
    assert short.status is PlanStatus.NOT_FOUND
    assert first.payload <= HEAVIEST['rigid'] <= first.local_upper
    assert second.iterations < first.iterations
    assert third.iterations < first.iterations / 2  # two neighbours tell where the motion goes


def test_durations_are_searched_one_by_one(rigid_model: ArmModel, paper_task: TaskFactory) -> None:
    monitor = Monitor()
    search = payload_against_duration(paper_task(rigid_model.arm), [1.0, 1.1], model=rigid_model,
                                      monitor=monitor)
    assert monitor.iteration == 0
    assert next(search).iterations == monitor.iteration
    monitor.canceled = lambda: True
    canceled = next(search)
    assert (canceled.status, canceled.payload) == (PlanStatus.CANCELED, 0.0)
    with pytest.raises(StopIteration):
        next(search)


def test_no_durations_are_no_searches(rigid_model: ArmModel, paper_task: TaskFactory) -> None:
    assert list(payload_against_duration(paper_task(rigid_model.arm), [],
                                         model=rigid_model)) == []


@pytest.mark.parametrize(('durations', 'error', 'message'), [
    ([1.0, 0.0], InvalidValueError,
     'durations[1] is 0.0, but must be a number > 0 and <= 1000 s'),
    ([nan], InvalidValueError,
     'durations[0] is nan, but must be a finite number > 0 and <= 1000 s'),
    ([1.0, 1001.0], InvalidValueError,
     'durations[1] is 1001.0, but must be a number > 0 and <= 1000 s'),
    ([[1.0, 2.0]], InvalidSizeError,
     'durations has shape (1, 2), but must be a list of 2 numbers')], ids=str)
def test_bad_durations_are_refused_at_once(
        rigid_model: ArmModel, paper_task: TaskFactory, durations: Any,
        error: type[InvalidValueError], message: str) -> None:
    with pytest.raises(error) as caught:
        payload_against_duration(paper_task(rigid_model.arm), durations, model=rigid_model)
    assert str(caught.value) == message


def test_bad_task_is_refused_before_anything_is_searched(rigid_model: ArmModel,
                                                         paper_task: TaskFactory) -> None:
    monitor = Monitor()
    search = payload_against_duration(paper_task(rigid_model.arm, time_weight=1.0), [1.0],
                                      model=rigid_model, monitor=monitor)
    with pytest.raises(InvalidTaskError, match='time_weight is 1, but must be 0'):
        next(search)
    assert monitor.iteration == 0


# Refused


@pytest.mark.parametrize('torques', [(inf, inf), (8.0, inf)])
def test_arm_with_a_motor_without_limit_is_refused(rigid_arm: Arm, paper_task: TaskFactory,
                                                   torques: tuple[float, float]) -> None:
    arm = replace(rigid_arm, joints=tuple(Joint(motor=Motor(stall_torque=torque))
                                          for torque in torques))
    with pytest.raises(InvalidTaskError, match='a motor of the arm has no stall torque'):
        find_min_duration(paper_task(arm))


@pytest.mark.parametrize('changes', [
    {'goal_position_weights': [1.0, inf]}, {'goal_velocity_weights': [inf, 0.0]},
    {'goal_velocities': [0.0, 0.1]}], ids=str)
def test_motion_that_need_not_end_at_rest_is_refused(
        rigid_model: ArmModel, paper_task: TaskFactory, changes: dict[str, Any]) -> None:
    with pytest.raises(InvalidTaskError, match='that of a motion which ends at rest'):
        find_min_duration(paper_task(rigid_model.arm, **changes), model=rigid_model)


@pytest.mark.parametrize(('accuracy', 'message'), [
    (0.0, 'accuracy is 0.0, but must be a number >= 1e-07 and <= 100 s'),
    (101.0, 'accuracy is 101.0, but must be a number >= 1e-07 and <= 100 s'),
    (nan, 'accuracy is nan, but must be a finite number >= 1e-07 and <= 100 s')])
def test_bad_accuracy_is_named_with_its_bound(rigid_model: ArmModel, paper_task: TaskFactory,
                                              accuracy: float, message: str) -> None:
    with pytest.raises(InvalidValueError) as caught:
        find_min_duration(paper_task(rigid_model.arm), model=rigid_model, accuracy=accuracy)
    assert str(caught.value) == message


# Stopped


@both_stops
@pytest.mark.parametrize(('phase', 'iterations'), [
    ('duration at a rising price', 0), ('duration at a rising price', 23),
    ('continuation to the limit', 0),
    ('continuation to the limit', 1)])
def test_search_is_stopped_wherever_it_is(rigid_model: ArmModel, paper_task: TaskFactory,
                                          phase: str, iterations: int, status: PlanStatus) -> None:
    monitor = stopped_in(phase, status, iterations)
    found = shortest(paper_task(rigid_model.arm), model=rigid_model, monitor=monitor)
    begun = iterations > 0 or phase == 'continuation to the limit'
    assert_stopped(found, status, certified=begun and status is PlanStatus.TIMEOUT)
    assert monitor.phase == phase


@both_stops
def test_search_from_a_guess_that_is_too_short_is_stopped(
        rigid_model: ArmModel, paper_task: TaskFactory, status: PlanStatus) -> None:
    for iterations in (5, 10, 20):
        monitor = stopped_in('duration at a rising price', status, iterations)
        found = shortest(paper_task(rigid_model.arm, duration=0.3), model=rigid_model,
                         monitor=monitor)
        met = status is PlanStatus.TIMEOUT and math.isfinite(found.duration)
        assert_stopped(found, status, certified=met)
        assert monitor.iteration <= iterations + 1


@both_stops
def test_search_of_an_arm_that_bends_is_stopped(ei5_model: ArmModel, paper_task: TaskFactory,
                                                status: PlanStatus) -> None:
    monitor = stopped_in('duration at a rising price', status, 30)
    found = find_min_duration(paper_task(ei5_model.arm), model=ei5_model, monitor=monitor)
    assert_stopped(found, status, certified=status is PlanStatus.TIMEOUT, limit=SHORTEST['ei5'])


@both_stops
def test_search_is_stopped_in_its_last_simulation(rigid_model: ArmModel, paper_task: TaskFactory,
                                                  status: PlanStatus) -> None:
    task = paper_task(rigid_model.arm)
    whole = shortest(task, model=rigid_model).iterations
    monitor = Monitor()

    def due() -> bool:
        late = monitor.iteration == whole
        if late and status is PlanStatus.TIMEOUT:
            monitor.time_limit = -1.0
        return late and status is PlanStatus.CANCELED

    monitor.canceled = due
    found = shortest(task, model=rigid_model, monitor=monitor)
    assert_stopped(found, status, certified=status is PlanStatus.TIMEOUT)
    assert (monitor.phase, found.iterations) == ('continuation to the limit', whole)


@both_stops
def test_exploration_is_stopped(rigid_model: ArmModel, paper_task: TaskFactory,
                                status: PlanStatus) -> None:
    for start, iterations in (('start 1 of 16', 5), ('start 9 of 16', 0)):
        phase = f'kinds of motion, {start}'
        monitor = stopped_in(phase, status, iterations)
        found = find_min_duration(paper_task(rigid_model.arm), model=rigid_model, monitor=monitor)
        assert_stopped(found, status)
        assert monitor.phase == phase
