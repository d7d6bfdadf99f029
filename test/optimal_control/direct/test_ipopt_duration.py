"""Direct collocation with a free duration, and from a path instead of a guess."""

from __future__ import annotations

from factories import TaskFactory
from flex_planner.base.validation import Array
from flex_planner.collocation import Solver
from flex_planner.optimal_control.arm_model import ArmModel
from flex_planner.optimal_control.direct.conversion import to_solution
from flex_planner.optimal_control.direct.ipopt import (
    DirectProblem,
    DirectResult,
    DirectSettings,
)
from flex_planner.optimal_control.direct.unknowns import Free
from flex_planner.optimal_control.motion_problem import MotionProblem
from flex_planner.planning.plan_path import plan_path
from known_limits import SHORTEST
import numpy as np
from plan_checks import problem_of, solution_of
import pytest

PRICE = 10.0


@pytest.fixture(scope='module')
def motion(rigid_model: ArmModel, paper_task: TaskFactory) -> MotionProblem:
    return problem_of(rigid_model, paper_task(rigid_model.arm))


@pytest.fixture(scope='module')
def direct(rigid_model: ArmModel) -> DirectProblem:
    return DirectProblem(rigid_model, DirectSettings(degree=4, intervals=30))


def quickened(direct: DirectProblem, motion: MotionProblem, price: float = PRICE,
              first: float = 1.0) -> DirectResult:
    found = direct.solve(motion.parameters, motion.start, motion.goal, first,
                         free=Free.DURATION, price=price)
    assert found.converged, found.message
    return found


def test_duration_at_a_price_is_that_of_the_indirect_method(
        direct: DirectProblem, motion: MotionProblem, paper_task: TaskFactory) -> None:
    found = quickened(direct, motion)
    plan = plan_path(paper_task(motion.model.arm, time_weight=PRICE), model=motion.model)
    # what the mesh does to the switches
    assert found.duration == pytest.approx(plan.task.duration, rel=1e-5)
    assert (found.times[-1], found.payload) == (found.duration, 1.0)
    # the cost is without that of the time
    assert found.cost + PRICE * found.duration == pytest.approx(plan.cost, rel=1e-6)


def test_duration_at_a_high_price_is_the_shortest(direct: DirectProblem,
                                                  motion: MotionProblem) -> None:
    found = quickened(direct, motion, 1e4)
    assert found.duration == pytest.approx(SHORTEST['rigid'], rel=1e-3)


def test_first_duration_does_not_matter(direct: DirectProblem, motion: MotionProblem) -> None:
    durations = [quickened(direct, motion, first=first).duration for first in (0.3, 1.0, 4.0)]
    np.testing.assert_allclose(durations, durations[0], rtol=1e-6)


def test_price_of_time_counts_only_where_the_duration_is_free(direct: DirectProblem,
                                                              motion: MotionProblem) -> None:
    data = motion.parameters, motion.start, motion.goal, 1.0
    priced, free = (direct.solve(*data, price=price) for price in (PRICE, 0.0))
    assert priced.duration == free.duration == 1.0
    assert priced.cost == pytest.approx(free.cost, rel=1e-10)


def test_motion_is_a_solution_for_newtons_method(direct: DirectProblem,
                                                 motion: MotionProblem) -> None:
    found = quickened(direct, motion)
    there = motion.with_changes(duration=found.duration)
    result = Solver().with_settings(stages=4).solve(there, to_solution(found, there))
    assert result.converged, result.message
    assert result.iterations <= 8


# From a path


def arc(start: Array, goal: Array, T: float, times: Array) -> tuple[Array, Array, Array]:
    """Return a straight motion at the speed of a half sine."""
    s, w = times[:, None] / T, np.pi
    stroke = goal - start
    return (start + (1 - np.cos(w * s)) / 2 * stroke, w / 2 * np.sin(w * s) * stroke / T,
            w**2 / 2 * np.cos(w * s) * stroke / T**2)


def test_path_is_a_start(direct: DirectProblem, motion: MotionProblem) -> None:
    data = motion.parameters, motion.start, motion.goal, 1.0
    start, goal = motion.start[:2], motion.goal[:2]
    found = direct.solve(*data, path=lambda times: arc(start, goal, 1.0, times))
    line = direct.solve(*data)
    assert found.converged, found.message
    assert found.cost == pytest.approx(line.cost, rel=1e-7)


def test_torques_of_a_path_are_its_own_as_far_as_motors_give_them(
        direct: DirectProblem, motion: MotionProblem) -> None:
    start, goal = motion.start[:2], motion.goal[:2]
    n, K, parameters = 2, 120, motion.parameters
    for T in (1.0, 0.2):
        x = direct._unknowns.on_path(lambda times, T=T: arc(start, goal, T, times),
                                     parameters, T)
        y, states, _, duration = direct._unknowns.split(x, parameters)
        assert (y.shape, states.shape, duration) == ((K, 8), (31, 4), T)
        torque = motion.model.inverse_dynamics(y[:, :4], y[:, 4:6], parameters.physical)[:, :n]
        w = torque + parameters.torque_slope * y[:, 2:4]
        within = np.abs(w) < 0.95 * parameters.stall_torque
        np.testing.assert_allclose(y[:, 6:][within], w[within], atol=1e-12)
        assert (np.abs(y[:, 6:]) <= 0.95 * parameters.stall_torque).all()
        assert within.all() == (T == 1.0)


def test_plan_is_a_guess_with_the_same_unknowns(direct: DirectProblem, motion: MotionProblem,
                                                paper_task: TaskFactory) -> None:
    plan = plan_path(paper_task(motion.model.arm), model=motion.model)
    found = direct.solve(motion.parameters, motion.start, motion.goal, 1.0,
                         guess=solution_of(plan))
    line = direct.solve(motion.parameters, motion.start, motion.goal, 1.0)
    assert found.converged, found.message
    assert found.cost == pytest.approx(line.cost, rel=1e-8)
