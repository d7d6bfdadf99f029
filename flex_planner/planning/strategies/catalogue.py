"""The strategies that lead to a plan, in the order in which they are tried."""

from __future__ import annotations

from collections.abc import Sequence

from flex_planner.collocation import Solver
from flex_planner.optimal_control.motion_problem import MotionProblem
from flex_planner.planning.kinds.kinds_strategy import explore_kinds
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

# intervals of a first mesh that are many, in units of those of a mesh without ringing
_MANY = 5

BARRIER = (Strategy('interior point', pass_barrier),
           Strategy('interior point from the rigid motion', pass_barrier_from_rigid))
COLD_START = Strategy('cold start', cold_start, quick=True)
RIGID_FIRST = Strategy('rigid motion first', lift_rigid_motion, quick=True)
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
    Strategy('kinds of motion', explore_kinds, cost=0.0),
    Strategy('continuation in payload', continue_in_payload),
    Strategy('continuation in duration', continue_in_duration),
    Strategy('direct collocation', direct_collocation, cost=5.0),
)
QUICK = tuple(strategy for strategy in CATALOGUE if strategy.quick)


def order_strategies(problem: MotionProblem, solver: Solver,
                     strategies: Sequence[Strategy]) -> list[Strategy]:
    """
    Return strategies in the order that suits a motion.

    Where the first mesh is fine because something rings many times, each iteration on it costs as
    much as several motions of the rigid arm. Under gravity a straight line, which is not bent,
    takes ten of them or more, and the bent rigid motion one or two.

    """
    rings = problem.fewest_intervals(solver.settings.stages) > _MANY * solver.settings.intervals
    if not (rings and problem.holding_torque.any()
            and COLD_START in strategies and RIGID_FIRST in strategies):
        return list(strategies)
    first = strategies.index(COLD_START)
    others = [each for each in strategies if each is not RIGID_FIRST]
    return [*others[:first], RIGID_FIRST, *others[first:]]
