"""The strategies that lead to a plan, in the order in which they are tried."""

from __future__ import annotations

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

BARRIER = (Strategy('interior point', pass_barrier),
           Strategy('interior point from the rigid motion', pass_barrier_from_rigid))
CATALOGUE: tuple[Strategy, ...] = (
    Strategy('cold start', cold_start, quick=True),
    Strategy('rigid motion first', lift_rigid_motion, quick=True),
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
