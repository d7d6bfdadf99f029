"""Where IPOPT starts, and what it answers: plain data that goes to another process and back."""

from __future__ import annotations

from collections import OrderedDict
from dataclasses import dataclass
import pickle
from threading import local
import time
from typing import Any

from flex_planner.arms.arm import Arm
from flex_planner.base.processes import held_interrupts
from flex_planner.base.progress import Monitor, StoppedError
from flex_planner.base.validation import Array
from flex_planner.optimal_control.direct.mesh import Transcription
import numpy as np

# programmes that are kept once they are derived; those of a search differ in a mesh or two
_KEPT = 8


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Start:
    """
    A programme with its data, and where IPOPT begins.

    Attributes
    ----------
    recipe : bytes
        What the programme is derived from, see `pack_recipe`.
    inputs : dict of str to numpy.ndarray
        Of CasADi's solver: ``x0``, bounds and parameters, multipliers for a warm start.

    """

    recipe: bytes
    inputs: dict[str, Array]


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Answer:
    """
    Where IPOPT has ended.

    Attributes
    ----------
    x, lam_x, lam_g : numpy.ndarray
        Unknowns, multipliers of their bounds and of the rows.
    objective : float
        Of the programme.
    converged : bool
        Whether it is a solution.
    message : str
        What IPOPT says.
    iterations : int
        Of IPOPT.
    build_seconds, seconds : float
        Time of the derivation, 0 where the programme was known, and of the solve.

    """

    x: Array
    lam_x: Array
    lam_g: Array
    objective: float
    converged: bool
    message: str
    iterations: int = 0
    build_seconds: float = 0.0
    seconds: float = 0.0

    @classmethod
    def failed(cls, start: Start, message: str, iterations: int = 0,
               seconds: float = 0.0) -> Answer:
        """Return that IPOPT came no further than where it started."""
        x, rows = start.inputs['x0'], start.inputs['lbg'].size
        return cls(x=x, lam_x=np.zeros(x.size), lam_g=np.zeros(rows), objective=np.nan,
                   converged=False, message=message, iterations=iterations, seconds=seconds)


def pack_recipe(arm: Arm, mesh: Transcription, options: dict[str, Any], *,
                with_rates: bool = False) -> bytes:
    """Return what a programme and its solver are derived from; equal bytes mean equal ones."""
    return pickle.dumps((arm, mesh, options, with_rates))


class _Known(local):
    """The solvers that this thread has derived, each with its watch."""

    def __init__(self) -> None:
        self.solvers: OrderedDict[bytes, tuple[Any, Any]] = OrderedDict()


_KNOWN = _Known()


def solve_here(start: Start, monitor: Monitor, intervals: int) -> Answer:
    """
    Run IPOPT in this process, which nothing stops but at the end of an iteration.

    Parameters
    ----------
    start : Start
        The programme, and where to begin.
    monitor : Monitor
        Receives every iteration with the largest violation of a row.
    intervals : int
        Of the mesh, for the monitor.

    Raises
    ------
    StoppedError
        If the monitor stopped it.

    """
    began = time.perf_counter()
    solver, watch = _derive(start.recipe)
    built = time.perf_counter()
    with held_interrupts() as raised:
        watch.follow(monitor, intervals, raised)
        found = solver(**start.inputs)
    if watch.error is not None:
        raise watch.error
    if watch.stopped is not None:
        raise StoppedError(watch.stopped)
    stats = solver.stats()
    return Answer(
        **{name: np.array(found[name])[:, 0] for name in ('x', 'lam_x', 'lam_g')},
        objective=float(found['f']), converged=bool(stats['success']),
        message=str(stats['return_status']).replace('_', ' ').lower(),
        iterations=int(stats['iter_count']), build_seconds=built - began,
        seconds=time.perf_counter() - built)


def _derive(recipe: bytes) -> tuple[Any, Any]:
    """Return the solver of a recipe and its watch, derived once."""
    from flex_planner.optimal_control.direct.programme import Programme

    known = _KNOWN.solvers
    if recipe not in known:
        arm, mesh, options, with_rates = pickle.loads(recipe)
        programme = Programme.of(arm, mesh, with_rates=with_rates)
        watch = programme.watch()
        known[recipe] = programme.ipopt(options, watch), watch
    known.move_to_end(recipe)
    while len(known) > _KEPT:
        known.popitem(last=False)
    return known[recipe]
