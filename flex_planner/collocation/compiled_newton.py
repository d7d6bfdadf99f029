"""Newton's method on one mesh in compiled code: what newton.py does, see core.c."""

from __future__ import annotations

from collections.abc import Callable
import ctypes
from typing import Any

from flex_planner.base.progress import Monitor, StoppedError
from flex_planner.base.validation import Array
from flex_planner.collocation.compiled_system import CompiledSystem, FAILURES, split_indices
from flex_planner.collocation.core import (
    Core,
    core_problem,
    CoreJunctions,
    CoreNewton,
    CoreSizes,
    load_core,
    pack_rule,
    REPORT,
    STOP,
)
from flex_planner.collocation.junctions import empty_rows, join_at
from flex_planner.collocation.newton_outcome import (
    CORRECTION_NOT_FINITE,
    KEPT,
    NewtonOutcome,
    NO_STEP_HELPS,
    SMALLEST_STEP,
)
from flex_planner.collocation.problem import (
    BoundaryValueProblem,
    compiled_rate_of,
    CompiledRate,
    RATE_NOT_FINITE,
    SingularSystemError,
)
from flex_planner.collocation.solution import CollocationSolution
import numpy as np

# what `solve_newton` of core.c returns
_SOLVED, _NOT_CONVERGED, _REFUSED, _STOPPED, _NO_MEMORY = 0, 7, 8, 9, 10
_MESSAGES = {**FAILURES, 4: RATE_NOT_FINITE, 5: CORRECTION_NOT_FINITE, 6: NO_STEP_HELPS}


def solve_compiled(problem: BoundaryValueProblem, guess: CollocationSolution, tolerance: float,
                   max_iterations: int, monitor: Monitor, *,
                   exact: bool = False) -> NewtonOutcome | None:
    """Return what `newton` would, None if the problem or the core is not compiled."""
    rate = compiled_rate_of(problem)
    if rate is None:
        return None
    left = problem.left(guess.nodes[0])[0].size
    core = load_core(CoreSizes(problem.size, left, problem.explicit.size, guess.rule.stages,
                               int(exact)), monitor)
    if core is None:
        return None
    run = _CompiledRun(core, problem, rate, guess, left, exact=exact)
    return run.solve(tolerance, max_iterations, monitor)


class _Calls:
    """What core.c calls of Python: boundary rows, monitor. Errors are kept until it returns."""

    def __init__(self, problem: BoundaryValueProblem, left: int, monitor: Monitor,
                 intervals: int) -> None:
        self._problem, self._left, self._monitor = problem, left, monitor
        self._intervals = intervals
        self.error: BaseException | None = None

    def ends(self, first: int, last: int, left: int, right: int, left_rows: int | None,
             right_rows: int | None) -> int:
        """Evaluate the boundary rows."""
        size, top = self._problem.size, self._left
        try:
            residual, rows = self._problem.left(_view(first, size).copy())
            _view(left, top)[:] = residual
            if left_rows:
                _view(left_rows, top * size)[:] = rows.ravel()
            residual, rows = self._problem.right(_view(last, size).copy())
            _view(right, size - top)[:] = residual
            if right_rows:
                _view(right_rows, (size - top) * size)[:] = rows.ravel()
        except SingularSystemError as error:
            self.error = error
            return _REFUSED
        except BaseException as error:
            self.error = error
            return _STOPPED
        return _SOLVED

    def junction(self, index: int, nodes: int, gap: int, rows: int | None) -> int:
        """Evaluate the rows of a junction."""
        size = self._problem.size
        before, after = _view(nodes, 2 * size).reshape(2, size).copy()
        try:
            residual, found = join_at(self._problem, index, before, after)
        except SingularSystemError as error:
            self.error = error
            return _REFUSED
        except BaseException as error:
            self.error = error
            return _STOPPED
        _view(gap, size)[:] = residual
        if rows:
            _view(rows, 2 * size * size)[:] = found.ravel()
        return _SOLVED

    def stop(self) -> int:
        """Ask the monitor whether to stop."""
        return self._guard(self._monitor.check)

    def report(self, norm: float) -> None:
        """Tell the monitor of an iteration; an error stops the next."""
        self._guard(lambda: self._monitor.step(norm, self._intervals))

    def _guard(self, call: Callable[[], None]) -> int:
        if self.error is not None and not isinstance(self.error, SingularSystemError):
            return _STOPPED
        try:
            call()
        except BaseException as error:
            self.error = error
            return _STOPPED
        return _SOLVED


class _CompiledRun:
    """One run, with the memory that core.c works in."""

    def __init__(self, core: Core, problem: BoundaryValueProblem, rate: CompiledRate,
                 guess: CollocationSolution, left: int, *, exact: bool) -> None:
        self._core, self._problem, self._guess, self._left = core, problem, guess, left
        count, size = guess.intervals, problem.size
        self._nodes, self._stages = guess.nodes.copy(), guess.stages.copy()
        blocks = (count, guess.rule.stages) if exact else (count,)
        self._parts = (guess.steps, np.empty((*blocks, size, size)), np.empty((left, size)),
                       np.empty((size - left, size)), np.empty(size), problem.explicit)
        self._factors, self._rate = core.allocate(count), rate
        self._junctions = empty_rows(problem, guess)

    def solve(self, tolerance: float, max_iterations: int, monitor: Monitor) -> NewtonOutcome:
        """Iterate until it ends."""
        guess = self._guess
        calls = _Calls(self._problem, self._left, monitor, guess.intervals)
        steps, jacobians, left, right, scale, explicit = self._parts
        arrays: dict[str, Any] = {
            'rule': pack_rule(guess.rule), 'steps': steps,
            'least_scale': np.ascontiguousarray(self._problem.scale, dtype=np.float64),
            'nodes': self._nodes, 'stages': self._stages, 'factorisation': self._factors,
            'jacobians': jacobians, 'left_rows': left, 'right_rows': right, 'scale': scale}
        arrays['explicit'], arrays['implicit'] = split_indices(scale.size, explicit)
        run = CoreNewton(
            count=guess.intervals, most_iterations=max_iterations, tolerance=tolerance, kept=KEPT,
            smallest_step=SMALLEST_STEP,
            problem=core_problem(self._rate, calls.ends, calls.junction),
            junctions=CoreJunctions.of(self._junctions.intervals, self._junctions.rows),
            stop=STOP(calls.stop), report=REPORT(calls.report),
            **{name: array.ctypes.data for name, array in arrays.items()})
        outcome = self._core.solve_newton(ctypes.byref(run))
        return self._outcome(run, outcome, calls.error, max_iterations)

    def _outcome(self, run: CoreNewton, outcome: int, error: BaseException | None,
                 max_iterations: int) -> NewtonOutcome:
        guess, stopped = self._guess, None
        message = _MESSAGES.get(outcome, 'converged')
        if outcome == _NO_MEMORY:
            raise MemoryError('no memory for the equations of a motion')
        if outcome == _STOPPED:
            if not isinstance(error, StoppedError):
                raise error or AssertionError('core.c stopped without a reason')
            stopped, message = error.reason, error.reason.value
        elif outcome == _REFUSED:
            message = str(error)
        elif outcome == _NOT_CONVERGED:
            message = f'not converged after {max_iterations} iterations'
        solution = CollocationSolution(guess.mesh, self._nodes, self._stages, guess.rule)
        system = (CompiledSystem(self._core, guess.rule, self._parts, self._factors,
                                 self._junctions)
                  if run.factorised else None)
        return NewtonOutcome(solution, outcome == _SOLVED, run.norm, run.iterations, system,
                             stopped, message, bool(run.coarse))


def _view(address: int, count: int) -> Array:
    """Return numbers of core.c as an array."""
    if not count:
        return np.zeros(0)
    return np.ctypeslib.as_array((ctypes.c_double * count).from_address(address))
