"""The strategies that lead to a plan, in the order in which they are tried."""

from __future__ import annotations

from collections.abc import Sequence

from flex_planner.collocation import Solver
from flex_planner.optimal_control.motion_problem import MotionProblem
from flex_planner.planning.kinds.kinds_strategy import explore_kinds
from flex_planner.planning.strategies.calm_links import calm_links
from flex_planner.planning.strategies.friction_homotopy import sharpen_friction
from flex_planner.planning.strategies.homotopies import (
    lower_vibration_price,
    raise_weights,
    soften_links,
)
from flex_planner.planning.strategies.initial_guesses import (
    coarse_mesh,
    cold_start,
    direct_collocation,
    lift_rigid_motion,
)
from flex_planner.planning.strategies.interior_point import (
    pass_barrier,
    pass_barrier_from_rigid,
)
from flex_planner.planning.strategies.limit_strategies import (
    continue_in_duration,
    continue_in_payload,
)
from flex_planner.planning.strategies.strategy import Strategy
from flex_planner.planning.strategies.via_homotopy import move_via_points
from flex_planner.planning.warnings import bends_at_once

# intervals of a first mesh that are many, in units of those of a mesh without ringing
_MANY = 5
# joints of a chain for which few starts lead to a motion
_SEVERAL = 3

BARRIER = (Strategy('interior point', pass_barrier),
           Strategy('interior point from the rigid motion', pass_barrier_from_rigid))
CALM = Strategy('homotopy in a price on bending', calm_links, cost=0.25)
COLD_START = Strategy('cold start', cold_start, quick=True)
RIGID_FIRST = Strategy('rigid motion first', lift_rigid_motion, quick=True)
KINDS = Strategy('kinds of motion', explore_kinds, cost=0.0)
DIRECT = Strategy('direct collocation', direct_collocation, cost=5.0)
CATALOGUE: tuple[Strategy, ...] = (
    COLD_START,
    RIGID_FIRST,
    Strategy('homotopy in the weights', raise_weights, quick=True),
    Strategy('coarse mesh first', coarse_mesh, quick=True),
    Strategy('homotopy in via points', move_via_points, quick=True),
    Strategy('homotopy in Coulomb friction', sharpen_friction, quick=True, cost=0.25),
    *BARRIER,
    Strategy('homotopy in vibration weights', lower_vibration_price),
    Strategy('homotopy in stiffness', soften_links),
    KINDS,
    CALM,
    Strategy('continuation in payload', continue_in_payload),
    Strategy('continuation in duration', continue_in_duration),
    DIRECT,
)
QUICK = tuple(strategy for strategy in CATALOGUE if strategy.quick)


def order_strategies(problem: MotionProblem, solver: Solver,
                     strategies: Sequence[Strategy]) -> list[Strategy]:
    """
    Return strategies in the order that suits a motion.

    Where the first mesh is fine because something rings many times, each iteration on it costs as
    much as several motions of the rigid arm. Under gravity a straight line, which is not bent,
    takes ten of them or more, and the bent rigid motion one or two.

    Where three rigid links or more fail to follow from a straight line, IPOPT mostly takes them
    there in a fraction of the time that its sixteen starts for kinds of motion take.

    Links that are clamped to joints without inertia ring, and seldom follow from a straight line.

    """
    ordered = list(strategies)
    if problem.model.arm.n_joints >= _SEVERAL and not problem.model.arm.n_passive:
        ordered = _ahead(ordered, DIRECT, KINDS)
    if bends_at_once(problem.task.arm):
        straight, from_rigid = BARRIER
        ordered = _ahead(_ahead(ordered, from_rigid, straight), CALM, straight)
    rings = problem.fewest_intervals(solver.settings.stages) > _MANY * solver.settings.intervals
    if rings and problem.holding_torque.any():
        ordered = _ahead(ordered, RIGID_FIRST, COLD_START)
    return ordered


def _ahead(strategies: list[Strategy], first: Strategy, second: Strategy) -> list[Strategy]:
    """Return strategies with one of them moved ahead of another, if it comes after that."""
    if first not in strategies or second not in strategies:
        return strategies
    at, after = strategies.index(second), strategies.index(first)
    if after < at:
        return strategies
    return [*strategies[:at], first, *strategies[at:after], *strategies[after + 1:]]
