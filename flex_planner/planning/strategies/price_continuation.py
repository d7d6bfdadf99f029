"""
Families of motions: heavier and heavier payloads, shorter and shorter durations.

Each is followed at a rising price. With a payload at a price sigma per kilogram, the motion of
least J - sigma m_p is one of least J for its payload, and dJ/dm_p is sigma there; as sigma grows
without bound the payload comes to the most that the arm carries. So with the duration.

"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from functools import cached_property

from flex_planner.base.errors import FlexPlannerError
from flex_planner.base.progress import Monitor
from flex_planner.collocation import (
    CollocationResult,
    CollocationSolution,
    solve,
    SolverSettings,
    SolverStatus,
)
from flex_planner.collocation.homotopy import STOPPED
from flex_planner.optimal_control.free_payload import (
    FreeDurationProblem,
    payload_price,
    PayloadProblem,
)
from flex_planner.optimal_control.motion_problem import MotionProblem
from flex_planner.optimal_control.task import MAX_DURATION
from flex_planner.planning.certificate import totals
from flex_planner.planning.strategies.initial_guesses import (
    coarse_mesh,
    cold_start,
    warm_start,
)
import numpy as np

# from a payload or duration to how far from the limit is near enough
Enough = Callable[[float], float]
Family = Callable[[MotionProblem, CollocationResult, SolverSettings, Monitor, Enough],
                  Iterator['Extremal']]
Step = Callable[['Extremal', float, SolverSettings, Monitor], 'Extremal | None']

# errors on the way: payloads and durations are some hundred times as exact
_TOLERANCE = 1e-2
# of the price from one motion to the next; grows where that is easy, shrinks where it fails
_FACTOR, _LARGEST_FACTOR, _SMALLEST_FACTOR = 4.0, 16.0, 1.02
_EASY = 8
# near a limit the price is raised to what leaves this share of the room that is wanted
_CLOSE, _SURE, _LEAST_FACTOR = 0.2, 0.6, 1.5
# the room falls with this power of the price: 2 for rigid arms, less where links ring
_POWER = 1.5
_SHORTER = 0.85
_HEAVIER, _LEAST_MORE = 0.25, 0.1
# of a price: as a share of what the motion costs per unit, and at all
_LEAST_SHARE, _LEAST_PRICE = 1e-3, 1e-12


def no_aim(value: float) -> float:
    """Go as far as the prices lead."""
    return 0.0


@dataclass(frozen=True, kw_only=True, eq=False)
class Extremal:
    """
    A motion on the way to a limit.

    Attributes
    ----------
    value : float
        Payload [kg] or duration [s].
    price : float
        What a little more payload, or a little less time, adds to J [1/kg, 1/s].
    result : CollocationResult
        Of the motion with this payload and duration; where it is not a solution, the family ends
        for want of one.
    problem : MotionProblem
        That it solves.

    """

    value: float
    price: float
    result: CollocationResult
    problem: MotionProblem

    @property
    def stopped(self) -> bool:
        """Whether the monitor ended the search here."""
        return self.result.status in STOPPED

    @cached_property
    def room(self) -> float:
        """
        How far the limit is at most: what the motors have left over the price of more.

        J is convex along the family where no weights but R count, and cannot grow by more than
        `reserve` as long as the motion stays of its kind.

        """
        if not self.price:
            return np.inf
        return reserve(self.problem, self.result.solution) / self.price


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class SearchStart:
    """
    What a search may start from: a motion on the way to the limit of a similar task.

    Attributes
    ----------
    value, price : float
        As of `Extremal`.
    solution : CollocationSolution
        Of that motion.

    """

    value: float
    price: float
    solution: CollocationSolution

    @classmethod
    def of(cls, stop: Extremal) -> SearchStart:
        """Return a stop as a start."""
        return cls(value=stop.value, price=stop.price, solution=stop.result.solution)


def reserve(problem: MotionProblem, solution: CollocationSolution) -> float:
    """
    Return what the cost of a motion would grow by with every motor on its limit all the time.

    At the speeds and in the directions that it has; infinite for motors without limits.

    """
    model, parameters = problem.model, problem.parameters
    n, n_t = model.arm.n_joints, model.arm.n_coordinates
    z = solution.stage_values().reshape(-1, problem.size)
    torque = model.controls(z, problem.p).torque
    bound = parameters.torque_limits.toward(torque, z[:, n_t:n_t + n])
    weights = (solution.steps[:, None] * solution.rule.weights).ravel()
    return float(weights @ ((bound**2 - torque**2) @ parameters.effort_weights)) / 2


def payloads(problem: MotionProblem, first: CollocationResult, settings: SolverSettings,
             monitor: Monitor, enough: Enough = no_aim) -> Iterator[Extremal]:
    """
    Yield heavier and heavier payloads, each with the motion of least effort that carries it.

    Ends where no heavier one is found; if the monitor stops it, with a stop that says so. Where no
    step in price succeeds, the payload is raised by itself.

    Parameters
    ----------
    problem : MotionProblem
        The motion with the first payload.
    first : CollocationResult
        Its solution.
    settings, monitor
        Of the solver, see `on_the_way`.
    enough : callable
        From a value to the room that is wanted there, see `Extremal.room`; 0 for as little as
        there is.

    """
    start = Extremal(value=problem.task.payload_mass, result=first, problem=problem,
                     price=_payload_price(problem, first.solution))
    return _followed(start, _heavier, settings, monitor, enough)


def durations(problem: MotionProblem, first: CollocationResult, settings: SolverSettings,
              monitor: Monitor, enough: Enough = no_aim) -> Iterator[Extremal]:
    """
    Yield shorter and shorter durations, see `payloads`.

    The phase of what rings in a flexible motion changes fast with its duration; where no step in
    price succeeds, the duration is shortened by itself.

    """
    start = Extremal(value=problem.task.duration, result=first, problem=problem,
                     price=time_price(problem, first.solution))
    return _followed(start, _quicker, settings, monitor, enough)


def _followed(here: Extremal, further: Step, settings: SolverSettings, monitor: Monitor,
              enough: Enough) -> Iterator[Extremal]:
    """Yield stops at higher and higher prices, as far apart as Newton's method allows."""
    factor = _FACTOR if here.problem.model.arm.n_modes else _LARGEST_FACTOR
    while factor > _SMALLEST_FACTOR:
        monitor.payload = here.problem.task.payload_mass
        try:
            stop = further(here, min(factor, _aim(here, enough)), settings, monitor)
        except FlexPlannerError:  # too heavy to hold, or absurd
            stop = None
        if stop is None:
            factor **= 0.5
            continue
        yield stop
        if stop.stopped:
            return
        if stop.result.iterations <= _EASY:
            factor = min(factor**1.5, _LARGEST_FACTOR)
        here = stop


def _aim(here: Extremal, enough: Enough) -> float:
    """Return the factor in price that leaves about so much room."""
    room, wanted = here.room, enough(here.value)
    if not wanted or not room < _CLOSE * here.value:
        return _LARGEST_FACTOR
    return max(float((room / (_SURE * wanted)) ** (1 / _POWER)), _LEAST_FACTOR)


def _heavier(here: Extremal, factor: float, settings: SolverSettings,
             monitor: Monitor) -> Extremal | None:
    """Return the next stop, a factor in price away or else a step in payload."""
    price = here.price * factor
    found = worth(here.problem, here.result.solution, price, settings, monitor)
    if found is not None and (found.stopped or found.value > here.value):
        return found
    more = max(_HEAVIER * here.value, _LEAST_MORE)
    heavier = changed(here.problem, payload_mass=here.value + more)
    there = solve(heavier, here.result.solution, settings, monitor)
    if not there.converged:
        return None
    price = _payload_price(heavier, there.solution)
    stop = Extremal(value=here.value + more, result=there, problem=heavier, price=price)
    # far from the limit the price may fall for a while: J of light payloads need not be convex
    return stop if price > here.price or here.room > here.value + more else None


def worth(problem: MotionProblem, guess: CollocationSolution, price: float,
          settings: SolverSettings,
          monitor: Monitor) -> Extremal | None:
    """Return the motion whose payload is worth a price, or None."""
    ahead = PayloadProblem(problem.model, problem.task, problem.parameters, price)
    found = solve(ahead, ahead.extended(guess), settings, monitor)
    payload, inner = ahead.restricted(found.solution)
    if found.status in STOPPED:
        return Extremal(value=payload, price=price, result=found, problem=problem)
    if not found.converged or payload < 0:
        return None
    return Extremal(value=payload, price=price,
                    result=replace(found, solution=inner, errors=found.errors[:problem.size]),
                    problem=ahead.with_payload(payload))


def _quicker(here: Extremal, factor: float, settings: SolverSettings,
             monitor: Monitor) -> Extremal | None:
    """Return the next stop, a factor in price away or else a step in duration."""
    price = here.price * factor
    found = worth_time(here.problem, here.result.solution, price, settings, monitor)
    if found is not None and (found.stopped or found.value < here.value):
        return found
    shorter = changed(here.problem, duration=here.value * _SHORTER)
    there = stretched(shorter, here.result.solution, settings, monitor)
    if not there.converged:
        return None
    price = time_price(shorter, there.solution)
    stop = Extremal(value=shorter.task.duration, result=there, problem=shorter, price=price)
    return stop if price > here.price else None


def worth_time(problem: MotionProblem, guess: CollocationSolution, price: float,
               settings: SolverSettings, monitor: Monitor) -> Extremal | None:
    """Return the motion whose duration is worth a price, or None."""
    ahead = free(problem, price)
    found = solve(ahead, ahead.extended(guess), settings, monitor)
    duration = float(found.solution.nodes[0, -1])
    if found.status in STOPPED:
        return Extremal(value=duration, price=price, result=found, problem=problem)
    if not found.converged or not duration > 0:
        return None
    return Extremal(value=duration, price=price, problem=ahead.fixed(duration),
                    result=replace(found, solution=ahead.restricted(found.solution),
                                   errors=found.errors[:problem.size],
                                   switches=found.switches * duration))


def longer_durations(problem: MotionProblem, first: CollocationResult, settings: SolverSettings,
                     monitor: Monitor) -> Iterator[Extremal]:
    """Yield longer and longer durations, whose prices fall."""
    here = first
    while problem.task.duration / _SHORTER <= MAX_DURATION:
        problem = changed(problem, duration=problem.task.duration / _SHORTER)
        here = stretched(problem, here.solution, settings, monitor)
        if not here.converged and here.status not in STOPPED:
            return
        yield Extremal(value=problem.task.duration, price=time_price(problem, here.solution),
                       result=here, problem=problem)


def free(problem: MotionProblem, price: float) -> FreeDurationProblem:
    """Return the motion with a free duration at a price per second."""
    task = replace(problem.task, time_weight=price)
    return FreeDurationProblem(MotionProblem(problem.model, task, problem.parameters))


def stretched(problem: MotionProblem, solution: CollocationSolution, settings: SolverSettings,
              monitor: Monitor) -> CollocationResult:
    """Solve a motion, starting from one of another duration, or else from nothing."""
    for strategy in (warm_start(solution), cold_start, coarse_mesh):
        attempt = strategy(problem, settings, monitor)
        if attempt is not None and attempt.result.status is not SolverStatus.NEWTON_FAILED:
            break
    assert attempt is not None
    return attempt.result


def changed(problem: MotionProblem, **changes: float) -> MotionProblem:
    """Return the problem of a task changed in payload or duration."""
    task = replace(problem.task, **changes)  # type: ignore[arg-type]
    parameters = replace(problem.parameters, payload_mass=task.payload_mass)
    return MotionProblem(problem.model, task, parameters)


def on_the_way(settings: SolverSettings, tolerance: float = _TOLERANCE) -> SolverSettings:
    """Return settings for motions on the way to a limit: exact and patient enough."""
    wanted = max(min(tolerance, _TOLERANCE), settings.error_tolerance)
    return replace(settings, error_tolerance=wanted,
                   max_iterations=min(25, settings.max_iterations))


def time_price(problem: MotionProblem, solution: CollocationSolution) -> float:
    """Return -dJ/dt_f of a motion, -H, at least something positive."""
    hamiltonian = problem.model.controls(solution.nodes, problem.p).hamiltonian
    share = totals(problem, solution).cost / problem.task.duration
    return max(-float(np.mean(hamiltonian)), _LEAST_SHARE * share, _LEAST_PRICE)


def _payload_price(problem: MotionProblem, solution: CollocationSolution) -> float:
    """Return dJ/dm_p of a motion, at least something positive: gravity may help."""
    share = totals(problem, solution).cost / (problem.task.payload_mass + _LEAST_MORE)
    return max(payload_price(problem, solution), _LEAST_SHARE * share, _LEAST_PRICE)
