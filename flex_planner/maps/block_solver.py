"""
Blocks of neighbouring cells, solved one after the other.

A cell starts from its neighbours in the block: where two of them lead towards it, their motions
are continued along that line; else from one of them; else from nothing. Blocks know nothing of one
another, so that their order does not matter.

"""

from __future__ import annotations

from dataclasses import replace
from itertools import product
import time

from flex_planner.base.errors import FlexPlannerError, SingularError, UnreachableError
from flex_planner.base.processes import return_memory
from flex_planner.base.progress import Monitor, StoppedError, StopReason
from flex_planner.capacity.extrapolation import step_ratio
from flex_planner.capacity.results import MinDuration
from flex_planner.maps.axes import Block
from flex_planner.maps.cell_results import CellCode, CellResult
from flex_planner.maps.cell_solver import CellSolution, CellSolver, NearCells, task_of
from flex_planner.maps.end_points import are_close
from flex_planner.maps.study import Study
from flex_planner.optimal_control.task import Task
from flex_planner.planning.plan_problem import STOP_STATUS

Index = tuple[int, ...]
_LONGEST_MESSAGE = 300


def blocks(study: Study) -> list[Block]:
    """Return the blocks of the grid in its order."""
    sides = [[slice(first, min(first + side, size)) for first in range(0, size, side)]
             for size, side in zip(study.shape, study.block_shape, strict=True)]
    return list(product(*sides))


def solve_block(study: Study, block: Block, monitor: Monitor | None = None) -> list[CellResult]:
    """
    Return the results of all cells of a block, in the order of their indices.

    A cell that fails is a result with a code, whatever happened.

    Parameters
    ----------
    study : Study
        What is asked.
    block : tuple of slice
        One of `blocks`.
    monitor : Monitor, optional
        May cancel, which leaves cells pending.

    """
    return _BlockRun(study, block, monitor).results()


class _BlockRun:
    """The solutions of a block so far, and the neighbours that each cell started from."""

    def __init__(self, study: Study, block: Block, monitor: Monitor | None) -> None:
        self._study, self._monitor, self._solver = study, monitor, CellSolver(study)
        self._cells = list(product(*(range(part.start, part.stop) for part in block)))
        self._results = {result.index: result for result in study.known_failures(block)}
        self._done: dict[Index, CellSolution] = {}
        self._starts: dict[Index, NearCells] = {}

    def results(self) -> list[CellResult]:
        """Return the results of the cells."""
        for index in self._cells:
            if index not in self._results:
                self._results[index] = self._add(index)
        # what did not converge may do so from the neighbours on the other sides
        for index in reversed(self._cells):
            if self._results[index].code in (CellCode.NOT_CONVERGED, CellCode.NOT_FOUND):
                self._try_again(index)
        return [self._results[index] for index in self._cells]

    def _try_again(self, index: Index) -> None:
        """Solve a cell once more, unless it would start as it did."""
        first = self._results[index]
        start = _near_cells(self._study, index, self._study.task(index), self._done)
        if start == self._starts[index]:
            return
        second = self._add(index)
        self._results[index] = replace(second, iterations=first.iterations + second.iterations,
                                       seconds=first.seconds + second.seconds)

    def _add(self, index: Index) -> CellResult:
        """Return the result of a cell, and keep its motion for the neighbours."""
        began, limited = time.monotonic(), Monitor(time_limit=self._study.cell_time_limit)
        if self._monitor is not None:
            limited.canceled = self._monitor.canceled
        result = self._solve(index, limited)
        if result.code is CellCode.TIMEOUT:
            result = replace(result, message=f'{result.message}; cell_time_limit is '
                                             f'{limited.time_limit:g} s')
        return_memory()
        start = self._starts.get(index, NearCells())
        return replace(result, message=result.message[:_LONGEST_MESSAGE],
                       warm=start.near is not None, seconds=time.monotonic() - began)

    def _solve(self, index: Index, monitor: Monitor) -> CellResult:
        """Solve a cell; whatever happens is a result."""
        try:
            if monitor.canceled():  # here: a search that is canceled still proves its bounds
                raise StoppedError(StopReason.CANCELED)
            task = self._study.task(index)
            start = self._starts[index] = _near_cells(self._study, index, task, self._done)
            found = self._solver.solve(index, task, monitor, start)
            result = self._solver.result(index, found)
            if result.code is CellCode.SOLVED or isinstance(found, MinDuration):
                self._done[index] = found
            return result
        except StoppedError as error:
            return CellResult(index=index, code=CellCode.of(STOP_STATUS[error.reason]),
                              message=str(error))
        except (UnreachableError, SingularError) as error:
            return CellResult(index=index, code=CellCode.UNREACHABLE, message=str(error))
        except FlexPlannerError as error:
            return CellResult(index=index, code=CellCode.INVALID, message=str(error))
        except Exception as error:  # one cell must not cost the others
            return CellResult(index=index, code=CellCode.FAILED,
                              message=f'{type(error).__name__}: {error}')


def _near_cells(study: Study, index: Index, task: Task,
                done: dict[Index, CellSolution]) -> NearCells:
    """Return the cells that a cell starts from."""
    best = NearCells()
    for axis in reversed(range(len(index))):  # along a line of the block where there is one
        for back in (1, -1):
            near, far = (_cell_before(index, axis, steps * back, task, done) for steps in (1, 2))
            if near is None:
                continue
            if far is not None and type(far) is type(near):
                here, values = index[axis], study.axes[axis].values
                return NearCells(near, far, step_ratio(
                    values[here - 2 * back], values[here - back], values[here]))
            best = best if best.near is not None else NearCells(near)
    return best


def _cell_before(index: Index, axis: int, back: int, task: Task,
                 done: dict[Index, CellSolution]) -> CellSolution | None:
    """Return the solution some cells before one, unless the arm turns the other way round."""
    found = done.get((*index[:axis], index[axis] - back, *index[axis + 1:]))
    return found if found is not None and are_close(task_of(found), task) else None
