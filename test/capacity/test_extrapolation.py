"""Searches continued along a line of tasks: the same answers, with far fewer iterations."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import TypeVar

from flex_planner.arms.arm import Arm
from flex_planner.arms.inverse_kinematics import inverse_kinematics
from flex_planner.base.errors import InvalidValueError
from flex_planner.capacity.extrapolation import extrapolate, Neighbours, SwitchedMotion
from flex_planner.capacity.min_duration import find_min_duration, payload_against_duration
from flex_planner.capacity.results import MaxPayload, MinDuration
from flex_planner.collocation import CollocationSolution, GaussRule
from flex_planner.optimal_control.arm_model import ArmModel
from flex_planner.optimal_control.task import Task
import numpy as np
from payload_searches import followed
import pytest

Array = np.ndarray
TaskFactory = Callable[..., Task]
Found = TypeVar('Found', MaxPayload, MinDuration)

STEP = 0.0125  # [m]


def towards(arm: Arm, paper_task: TaskFactory, y: float, payload: float = 0.0) -> Task:
    """Return the motion of the paper to another goal."""
    goal = inverse_kinematics(arm, np.array([0.4, y]), elbow=-1)
    return replace(paper_task(arm, payload_mass=payload), goal_positions=goal)


def line(arm: Arm, paper_task: TaskFactory, count: int, payload: float = 0.0) -> list[Task]:
    return [towards(arm, paper_task, 0.4 + STEP * k, payload) for k in range(count)]


def continued_along(tasks: list[Task], search: Callable[..., Found]) -> list[Found]:
    """Search each task from the two before."""
    found: list[Found] = []
    for task in tasks:
        near = found[-1] if found else None
        far = found[-2] if len(found) > 1 else None
        found.append(search(task, start_from=Neighbours(near=near, far=far)))
    return found


@pytest.mark.parametrize('name', ['rigid_arm', 'ei50_arm'])
def test_payloads_on_a_line_are_those_found_one_by_one(
        request: pytest.FixtureRequest, paper_task: TaskFactory, name: str) -> None:
    arm: Arm = request.getfixturevalue(name)
    tasks, model = line(arm, paper_task, 5), ArmModel(arm)

    def search(task: Task, **start: object) -> MaxPayload:
        return followed(task, model=model, **start)

    warm = continued_along(tasks, search)
    for task, one in zip(tasks[2:], warm[2:], strict=True):
        cold = search(task)
        assert one.solved, one.message
        assert one.payload == pytest.approx(cold.payload, abs=1e-3)
        assert one.local_upper - one.payload <= 1e-3
        assert one.plan is not None
        assert one.plan.certificate.tip_error < 1e-7
        assert one.iterations < 0.6 * cold.iterations


def test_durations_on_a_line_are_those_found_one_by_one(
        rigid_arm: Arm, paper_task: TaskFactory) -> None:
    tasks, model = line(rigid_arm, paper_task, 5, payload=1.0), ArmModel(rigid_arm)

    def search(task: Task, **start: object) -> MinDuration:
        return find_min_duration(task, model=model, search='fast', **start)

    warm = continued_along(tasks, search)
    for task, one in zip(tasks[2:], warm[2:], strict=True):
        cold = search(task)
        assert one.solved, one.message
        assert one.duration == pytest.approx(cold.duration, abs=1e-4)
        assert one.iterations < cold.iterations / 2
        assert one.plan is not None
        assert one.plan.task.duration == one.duration
        # switches of a plan taken over from its search are in seconds, not in shares of the time
        np.testing.assert_allclose(one.plan.switching_times, cold.plan.switching_times, atol=0.02)


def test_meshes_do_not_grow_along_a_line(rigid_arm: Arm, paper_task: TaskFactory) -> None:
    model = ArmModel(rigid_arm)
    found = continued_along(line(rigid_arm, paper_task, 10), lambda task, **start: (
        followed(task, model=model, **start)))
    sizes = [one.plan.mesh_intervals for one in found if one.plan is not None]
    assert len(sizes) == 10
    assert max(sizes[5:]) <= max(sizes[:3])


def test_uneven_steps_take_their_ratio(rigid_arm: Arm, paper_task: TaskFactory) -> None:
    model = ArmModel(rigid_arm)
    far, near, there = (towards(rigid_arm, paper_task, y) for y in (0.4, 0.41, 0.435))
    first = followed(far, model=model)
    second = followed(near, model=model, start_from=first)
    right = followed(there, model=model, start_from=Neighbours(
        near=second, far=first, ratio=2.5))
    assert right.payload == pytest.approx(followed(there, model=model).payload, abs=1e-3)
    assert right.iterations <= 12


def test_line_that_leads_nowhere_costs_no_answer(rigid_arm: Arm, paper_task: TaskFactory) -> None:
    model = ArmModel(rigid_arm)
    first, second = (followed(task, model=model)
                     for task in line(rigid_arm, paper_task, 2))
    elsewhere = towards(rigid_arm, paper_task, -0.3)
    expected = followed(elsewhere, model=model)
    for ratio in (1.0, 50.0, -50.0):
        found = followed(elsewhere, model=model, start_from=Neighbours(
            near=second, far=first, ratio=ratio))
        assert found.solved, found.message
        assert found.payload == pytest.approx(expected.payload, abs=1e-3)


def test_searches_of_another_arm_are_left_aside(rigid_arm: Arm, ei50_arm: Arm,
                                                paper_task: TaskFactory) -> None:
    first, second = (followed(task) for task in line(rigid_arm, paper_task, 2))
    task = towards(ei50_arm, paper_task, 0.425)
    found = followed(task, start_from=Neighbours(near=second, far=first))
    assert found.solved, found.message
    assert found.payload == pytest.approx(followed(task).payload, abs=1e-3)


@pytest.mark.parametrize('ratio', [np.nan, 101.0, -101.0])
def test_ratio_out_of_bounds_is_refused(ratio: float) -> None:
    with pytest.raises(InvalidValueError, match='ratio is'):
        Neighbours(ratio=ratio)


def test_payload_against_duration_continues(rigid_arm: Arm, paper_task: TaskFactory) -> None:
    task, durations = paper_task(rigid_arm), [1.2, 1.15, 1.1, 1.0, 0.95]
    found = list(payload_against_duration(task, durations))
    assert [one.task.duration for one in found] == durations
    for one in found:
        alone = followed(replace(task, duration=one.task.duration))
        assert one.payload == pytest.approx(alone.payload, abs=1e-3)
    assert sum(one.iterations for one in found[2:]) < 60


def test_plan_with_weights_is_not_taken_from_the_search(rigid_arm: Arm,
                                                        paper_task: TaskFactory) -> None:
    tasks = [replace(task, velocity_weights=[10.0, 10.0])
             for task in line(rigid_arm, paper_task, 3)]
    last = continued_along(tasks, followed)[-1]
    assert last.plan is not None
    assert last.plan.task.velocity_weights[0] == 10.0
    bare = followed(replace(tasks[-1], velocity_weights=[]))
    assert bare.plan is not None
    assert last.plan.cost > bare.plan.cost + 1
    assert last.payload == pytest.approx(bare.payload, abs=1e-3)


# The guess itself, for functions whose switches are known


def bent_line(switch: float, slope: float, intervals: int = 8) -> CollocationSolution:
    """Return a function with a corner: 0 before the switch, rising with a slope after it."""
    mesh = np.unique(np.concatenate([np.linspace(0, 1, intervals + 1), [switch]]))
    values = slope * np.maximum(mesh - switch, 0)
    return CollocationSolution.from_values(mesh, values[:, None], GaussRule.of(4))


def switched(switch: float, slope: float, *others: float) -> SwitchedMotion:
    times = np.sort(np.array([switch, *others]))
    kinds = (times != switch).astype(int)
    return SwitchedMotion(bent_line(switch, slope), times, kinds)


def test_corner_is_where_the_line_of_corners_leads() -> None:
    guess = extrapolate(switched(0.3, 1.0), switched(0.35, 1.1), 1.0, 1.0)
    t = np.linspace(0, 1, 101)
    # before the corner 0; after it values at the same share of the way are continued
    assert np.abs(guess(t[t <= 0.4])).max() < 1e-12
    share = (t[t > 0.4] - 0.4) / 0.6
    expected = 2 * 1.1 * share * 0.65 - 1.0 * share * 0.7
    np.testing.assert_allclose(guess(t[t > 0.4])[:, 0], expected, atol=1e-12)
    assert np.isclose(guess.mesh, 0.4).any()


def test_corner_of_one_motion_only_is_kept() -> None:
    here = switched(0.35, 1.1, 0.6, 0.62)
    guess = extrapolate(switched(0.3, 1.0), here, 1.0, 1.0)
    t = np.linspace(0.41, 1, 60)
    share = (t - 0.4) / 0.6
    np.testing.assert_allclose(guess(t)[:, 0], 1.1 * share * 0.65, atol=1e-12)


def test_corners_that_would_cross_stay_apart() -> None:
    before = SwitchedMotion(bent_line(0.5, 1.0), np.array([0.3, 0.5]), np.array([0, 1]))
    here = SwitchedMotion(bent_line(0.5, 1.0), np.array([0.44, 0.5]), np.array([0, 1]))
    guess = extrapolate(before, here, 1.0, 1.0)
    assert (np.diff(guess.mesh) > 0).all()
    assert np.isfinite(guess.nodes).all()


def test_motion_of_another_duration_is_stretched() -> None:
    guess = extrapolate(switched(0.3, 1.0), switched(0.3, 1.0), 1.0, 2.0)
    assert guess.mesh[-1] == 2.0
    np.testing.assert_allclose(guess(np.array([0.6, 2.0]))[:, 0], [0.0, 0.7], atol=1e-12)


def test_motions_with_other_numbers_of_stages_go_together() -> None:
    before = switched(0.3, 1.0)
    finer = before.solution.on_mesh(before.solution.mesh, GaussRule.of(7))
    guess = extrapolate(SwitchedMotion(finer, before.times, before.kinds), switched(0.35, 1.1),
                        1.0,
                        1.0)
    same = extrapolate(before, switched(0.35, 1.1), 1.0, 1.0)
    assert guess.rule.stages == 4
    t = np.linspace(0, 1, 101)
    np.testing.assert_allclose(guess(t), same(t), atol=1e-12)


def test_kind_of_a_switch_is_the_limit_that_is_met(rigid_arm: Arm,
                                                   paper_task: TaskFactory) -> None:
    found = followed(paper_task(rigid_arm))
    extremal = found.extremals[-1]
    motion = SwitchedMotion.of(extremal.problem, extremal.result.solution,
                               extremal.result.switches)
    assert set(motion.kinds) <= {0, 1, 2, 3}
    assert {0, 2} <= set(motion.kinds)
