"""Random tasks within random limits, on which a plan was missing or dear once, and the judge."""

from __future__ import annotations

from dataclasses import replace

from bench.independent.equations import Equations
from bench.limits_battery import ARMS
from bench.limits_judge import Judge
from bench.limits_tasks import draw_limits, flexible_task
import casadi as ca
from flex_planner import plan_path
from flex_planner.base.validation import Array
from flex_planner.planning.plan import Plan
import numpy as np
import pytest

# what IPOPT finds, by `bench.limits_battery`, and how much dearer a plan may be
_WORSE = 1e-3
_KINDS_THAT_BREAK_LIMITS = [(7, 0.0615903), (42, 0.0493899)]
_TOUCHED_LIMITS = [(28, 0.0141108), (73, 0.130643)]
# with 240 intervals for the first and the last: with less it passes between its points what it
# should touch
_SLOW = [(41, 0.144070), (54, 0.0287053), (82, 0.0315937)]


def plan_rigid(seed: int) -> tuple[Plan, Array]:
    """Return the plan of a random rigid task, and its slacks on a fine grid by the judge."""
    make, kinds = ARMS['rigid']
    task = make(seed)
    limits = draw_limits(plan_path(task), kinds, seed)
    plan = plan_path(replace(task, path_constraints=limits))
    samples = plan.uniform_samples(2001)
    return plan, Judge(task, limits, 4).slacks(samples.coordinates, samples.rates)


@pytest.mark.parametrize(('seed', 'cost'), _KINDS_THAT_BREAK_LIMITS)
def test_kinds_of_motion_that_break_a_limit_are_bent_where_a_dearer_one_keeps_all(
        seed: int, cost: float) -> None:
    plan, slacks = plan_rigid(seed)
    assert plan.solved and plan.cost < (1 + _WORSE) * cost
    assert slacks.min() > 0


@pytest.mark.parametrize(('seed', 'cost'), _TOUCHED_LIMITS)
def test_limits_that_are_only_touched_do_not_stop_the_interior_point_method(
        seed: int, cost: float) -> None:
    plan, slacks = plan_rigid(seed)
    assert plan.solved and plan.cost < (1 + _WORSE) * cost
    assert slacks.min() > 0


@pytest.mark.thorough
@pytest.mark.parametrize(('seed', 'cost'), _SLOW)
def test_meshes_are_cut_until_a_motion_within_limits_is_found(seed: int, cost: float) -> None:
    plan, slacks = plan_rigid(seed)
    assert plan.solved and plan.cost < (1 + _WORSE) * cost
    assert slacks.min() > 0


@pytest.mark.thorough
def test_starts_far_from_limits_lead_to_a_cheaper_kind() -> None:
    plan, slacks = plan_rigid(40)
    # by IPOPT; from the free motion alone the plan costs 0.047525
    assert plan.solved and plan.cost < (1 + _WORSE) * 0.0415670
    assert slacks.min() > 0


def test_forces_of_the_judge_are_those_of_all_masses() -> None:
    task = flexible_task(3)
    arm = Equations.of(task.arm, task.payload_mass, task.payload_inertia)
    draw = np.random.default_rng(5)
    q, v, a = (draw.normal(size=4) * [1, 1, 0.01, 0.01] for _ in range(3))
    mass, force = arm.mass_and_force(q, v)
    state = [ca.SX.sym(name, 4) for name in 'qva']
    judge = Judge(task, (), 2)
    forces = ca.Function('f', state, [judge.forces(*state)])(q, v, a)
    assert np.array(forces).ravel() == pytest.approx(mass @ a - force, rel=1e-9, abs=1e-10)
