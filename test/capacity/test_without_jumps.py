"""The largest payload and the shortest duration of torques that have no jumps."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

from factories import TaskFactory
from flex_planner.base.errors import InvalidTaskError
from flex_planner.base.validation import Array
from flex_planner.capacity.max_payload import find_max_payload
from flex_planner.capacity.min_duration import find_min_duration
from flex_planner.capacity.results import PayloadMethod
from flex_planner.collocation import CollocationSolution, GaussRule
from flex_planner.optimal_control.arm_model import ArmModel
from flex_planner.optimal_control.constrained_motion import relieve_ends, slacks_of
from flex_planner.optimal_control.motion_problem import MotionProblem, task_parameters
from flex_planner.optimal_control.path_barrier import PathBarrier
from flex_planner.optimal_control.state_duration_barrier import StateDurationBarrier
from flex_planner.optimal_control.state_payload_barrier import StatePayloadBarrier
from flex_planner.planning.plan import PlanStatus
import numpy as np
import pytest

# N m/s
RATE = 300.0
# By IPOPT, on Radau collocation of textbook equations of two rigid links with torque as a state,
# 100 intervals of degree 3 (bench/torque_rates.py): the largest payload of the paper's motion in
# 1 s [kg], and its shortest duration with 1 kg [s]
HEAVIEST, SHORTEST = 5.40921, 0.66964


def bounded(model: ArmModel, paper_task: TaskFactory) -> Any:
    return paper_task(model.arm, max_torque_rate=RATE)


def test_largest_payload_is_that_of_direct_collocation(rigid_model: ArmModel,
                                                       paper_task: TaskFactory) -> None:
    found = find_max_payload(bounded(rigid_model, paper_task), model=rigid_model, search='fast',
                             accuracy=5e-3)
    assert found.status is PlanStatus.SOLVED and found.plan is not None, found.message
    assert HEAVIEST - 5e-3 < found.payload < HEAVIEST < found.local_upper
    assert found.plan.solved and found.plan.task.payload_mass == found.payload
    assert (found.plan.torque_rates < RATE).all() and found.plan.certificate.limit_slack > 0
    # where the search ended is no bound, and is not said to be one
    assert found.within_limits and 'an estimate and no proof' in found.message


def test_shortest_duration_is_that_of_direct_collocation(rigid_model: ArmModel,
                                                         paper_task: TaskFactory) -> None:
    found = find_min_duration(bounded(rigid_model, paper_task), model=rigid_model, search='fast',
                              accuracy=1e-3)
    assert found.status is PlanStatus.SOLVED and found.plan is not None, found.message
    assert found.local_lower < SHORTEST < found.duration < SHORTEST + 1e-3
    assert (found.plan.torque_rates < RATE).all() and found.plan.certificate.limit_slack > 0


@pytest.mark.parametrize('free', ['payload', 'duration'])
def test_free_value_has_the_jacobian_of_its_conditions(free: str, rigid_model: ArmModel,
                                                       paper_task: TaskFactory) -> None:
    # a step of z and y from where the linearised conditions of y hold changes F by J dz
    arm = replace(rigid_model.arm, gravity=[0.0, -2.0])
    task = paper_task(arm, max_torque_rate=[RATE, np.inf])
    problem = MotionProblem(rigid_model, task, task_parameters(task))
    slacks = slacks_of(problem)
    assert slacks is not None
    slacks = relieve_ends(problem, slacks)
    draw, mu = np.random.default_rng(3), 0.1
    straight = problem.straight_line(1, GaussRule.of(4))
    nodes = straight.nodes + 0.1 * draw.normal(size=straight.nodes.shape) * problem.scale
    start = CollocationSolution.from_values(straight.mesh, nodes, straight.rule)
    if free == 'payload':
        barrier: Any = StatePayloadBarrier(problem, 3.0)
        both: Any = PathBarrier(barrier, slacks)
    else:
        barrier = both = StateDurationBarrier(problem, slacks, 3.0)
    z = barrier.extend(start).stage_values().reshape(-1, barrier.size)
    y = both.guess(start, mu).reshape(len(z), -1)
    step = 1e-6 * draw.normal(size=z.shape) * both.scale(mu)
    step[:, -2] = step[0, -2]  # a payload is the same everywhere

    def settle(z: Array) -> tuple[Array, Array]:
        settled = y
        for _ in range(60):  # slacks and multipliers as they belong to z
            settled = settled + 0.5 * both.find_step(z, settled, np.zeros_like(z), mu)
        rate, jacobian = both.condense(z, settled, mu)
        return rate, jacobian

    jacobian = settle(z)[1]
    change = (settle(z + step)[0] - settle(z - step)[0]) / 2
    expected = (jacobian @ step[..., None])[..., 0]
    size = np.abs(jacobian * step[:, None, :]).max(axis=2)
    assert (np.abs(change - expected) <= 1e-5 * size + 1e-12).all()
    for row in (both.left, both.right):
        _, rows = row(z[0])
        differences = (row(z[0] + step[0])[0] - row(z[0] - step[0])[0]) / 2
        np.testing.assert_allclose(differences, rows @ step[0], rtol=1e-4, atol=1e-9)


def test_steps_of_payloads_refuse_rates(rigid_model: ArmModel, paper_task: TaskFactory) -> None:
    with pytest.raises(InvalidTaskError, match='max_torque_rate .* incremental method'):
        find_max_payload(bounded(rigid_model, paper_task), model=rigid_model,
                         method=PayloadMethod.INCREMENTAL)
