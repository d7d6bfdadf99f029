"""The quantities of a map, cell by cell."""

from __future__ import annotations

from dataclasses import dataclass, replace
import math
from typing import NamedTuple, TypeAlias

from flex_planner.arms.kinematics import tip_position
from flex_planner.base.errors import HoldingError
from flex_planner.base.progress import Monitor
from flex_planner.capacity.extrapolation import Neighbours, thin_out
from flex_planner.capacity.max_payload import find_max_payload
from flex_planner.capacity.min_duration import find_min_duration
from flex_planner.capacity.results import LimitResult, MaxPayload, MinDuration
from flex_planner.collocation import Solver, SolverSettings
from flex_planner.control.joint_controller import Gains
from flex_planner.dynamics.arm_dynamics import ArmDynamics
from flex_planner.maps.cell_results import CellCode, CellResult
from flex_planner.maps.kept_motions import KeptMotion
from flex_planner.maps.quantities import Quantity
from flex_planner.maps.study import Study
from flex_planner.optimal_control.arm_model import ArmModel
from flex_planner.optimal_control.motion_problem import MotionProblem, task_parameters
from flex_planner.optimal_control.task import Task
from flex_planner.planning.plan import Plan
from flex_planner.planning.plan_path import plan_path
from flex_planner.planning.strategies.first_extremals import solve_first
from flex_planner.simulation.comparison import sample_finely
from flex_planner.simulation.execution import execute_plan, ExecutionMode, Setting
import numpy as np

_RATE = 1000.0  # [Hz]
# accuracy of a duration that is only to be compared, as a share of what is asked for
_SHORT = 0.02
# largest mesh of a cell: what takes more memory is not solved by it either
_INTERVALS, _LARGEST = 400, 8  # at least, and in units of the coarsest that overlooks nothing


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Vibration:
    """A plan, and how far the tip of another arm still moves after it was carried out [m]."""

    plan: Plan
    peak_to_peak: float


CellSolution: TypeAlias = MaxPayload | MinDuration | Plan | Vibration


class NearCells(NamedTuple):
    """What a cell starts from: two cells on a line with it, the nearer one first; or fewer."""

    near: CellSolution | None = None
    far: CellSolution | None = None
    ratio: float = 1.0


class CellSolver:
    """
    Solves the cells of a study.

    Parameters
    ----------
    study : Study
        What is asked; its arm is compiled here, or read from disk.

    """

    def __init__(self, study: Study) -> None:
        self._study, self._model = study, ArmModel(study.arm)

    def solve(self, index: tuple[int, ...], task: Task, monitor: Monitor,
              start: NearCells) -> CellSolution:
        """
        Return the solution of the task of a cell, starting from cells near it.

        With limits on the way every cell is solved for itself.

        Raises
        ------
        FlexPlannerError
            If the cell makes no sense, naming the value.
        StoppedError
            If the monitor stopped a simulation.

        """
        study, model = self._study, self._model
        if study.motion.limits:  # the kind that is best may be another one there
            start = NearCells()
        try:
            problem = MotionProblem(model, task, task_parameters(task))
        except HoldingError:  # there is no motion, and the plan says why
            return plan_path(task, model=model)
        solver = Solver(_settings(problem), monitor)
        if study.quantity is Quantity.MAX_PAYLOAD:
            return self._find_payload(problem, solver, start)
        if study.quantity is Quantity.MIN_DURATION:
            return find_min_duration(task, model=model, solver=solver, accuracy=study.accuracy,
                                     start_from=_neighbours(start))
        plan = plan_path(task, model=model, solver=solver, start_from=_plan_of(start.near))
        if study.quantity is Quantity.MIN_EFFORT or not plan.solved:
            return plan
        return self._measure_vibration(index, task, plan, monitor)

    def _find_payload(self, problem: MotionProblem, solver: Solver,
                      start: NearCells) -> CellSolution:
        """
        Return the largest payload, or the shortest duration where that is too long.

        What cannot be done in the time is soonest shown by the time that it takes: along a line
        of such cells that costs a few iterations.

        """
        task, late = problem.task, isinstance(start.near, MinDuration)
        if self._duration_decides and (late or _may_carry_nothing(problem, solver, start)):
            shortest = find_min_duration(
                task, model=self._model, solver=solver, accuracy=_SHORT * task.duration,
                start_from=_neighbours(start) if late else None)
            if shortest.solved and shortest.local_lower > task.duration:
                return shortest
        return find_max_payload(task, model=self._model, solver=solver,
                                accuracy=self._study.accuracy,
                                start_from=None if late else _neighbours(start))

    @property
    def _duration_decides(self) -> bool:
        """Whether a shortest duration holds for all motions: not where they may swing first."""
        arm = self._study.arm
        limited = [np.isfinite(joint.motor.standstill_torque) for joint in arm.joints]
        return all(limited) and not arm.gravity.any()

    def _measure_vibration(self, index: tuple[int, ...], task: Task, plan: Plan,
                           monitor: Monitor) -> Vibration:
        """Carry a plan out on the arm that is simulated."""
        study = self._study
        arm, carried = study.plant(index)
        gains = study.simulated.gains or Gains.of(arm.n_joints, 0.0, 0.0)
        goal = tip_position(task.arm, plan.problem.goal[:task.arm.n_coordinates])
        setting = Setting(model=ArmDynamics(arm), gains=gains, rate=_RATE, payload_mass=carried,
                          goal=goal, settling=study.simulated.settling, monitor=monitor)
        mode = ExecutionMode.FLEXIBLE if study.simulated.gains else ExecutionMode.FLEXIBLE_OPEN
        executed = execute_plan(mode, plan, sample_finely(plan, _RATE, monitor), setting)
        return Vibration(plan=plan, peak_to_peak=executed.residual.tip)

    def result(self, index: tuple[int, ...], found: CellSolution) -> CellResult:
        """Return the result of a cell from its solution."""
        if isinstance(found, MinDuration) and self._study.quantity is Quantity.MAX_PAYLOAD:
            return _late_result(index, found)
        plan = _plan_of(found)
        solution = found.plan if isinstance(found, Vibration) else found
        code = CellCode.of(solution.status)
        if code is not CellCode.SOLVED or plan is None:
            return CellResult(index=index, code=code, message=solution.message,
                              iterations=solution.iterations)
        value, bound = _value(found)
        return CellResult(index=index, code=code, message=solution.message, value=value,
                          bound=bound, cost=plan.cost, tip_error=plan.certificate.tip_error,
                          iterations=solution.iterations,
                          motion=(_motion_to_keep(found, plan) if self._study.keeps_motions
                                  else None))


def _settings(problem: MotionProblem) -> SolverSettings:
    """Return the settings of a cell, so that none takes much more memory than others."""
    settings = SolverSettings()
    fewest = problem.fewest_intervals(settings.stages)
    most = min(max(_INTERVALS, _LARGEST * fewest), settings.max_intervals)
    return replace(settings, max_intervals=most)


def _neighbours(start: NearCells) -> Neighbours:
    """Return the searches among the cells that a cell starts from."""
    near, far = (one if isinstance(one, LimitResult) else None for one in (start.near, start.far))
    return Neighbours(near=near, far=far, ratio=start.ratio)


def _may_carry_nothing(problem: MotionProblem, solver: Solver, start: NearCells) -> bool:
    """Return whether neighbours, or a first trial, suggest that nothing can be carried."""
    near, far = start.near, start.far
    if not isinstance(near, MaxPayload):
        return not solve_first(problem, solver.coarse()).converged
    slope = near.payload - far.payload if isinstance(far, MaxPayload) else -near.payload / 2
    return near.payload + 2 * start.ratio * slope < problem.task.payload_mass


def _motion_to_keep(found: CellSolution, plan: Plan) -> KeptMotion | None:
    """Return the motion for others to start from: near a limit, the last but one of the search."""
    if isinstance(found, MaxPayload) and found.extremals:
        extremal = found.extremals[-2:][0]
        motion = thin_out(extremal, Solver().coarse())
        return KeptMotion.of(extremal.problem, motion.solution, extremal.price)
    return None if plan.solution is None else KeptMotion.of(plan.problem, plan.solution)


def _late_result(index: tuple[int, ...], found: MinDuration) -> CellResult:
    """Return the result of a cell whose motion takes longer than it may."""
    task = found.task
    return CellResult(index=index, code=CellCode.NOT_FOUND, iterations=found.iterations, message=(
        f'the shortest duration found with {task.payload_mass:g} kg is {found.duration:.4g} s, '
        f'and {task.duration:g} s were asked for'))


def task_of(found: CellSolution) -> Task:
    """Return the task of a solution."""
    return found.plan.task if isinstance(found, Vibration) else found.task


def _plan_of(found: CellSolution | None) -> Plan | None:
    """Return the plan of a solution."""
    if found is None or isinstance(found, Plan):
        return found
    return found.plan


def _value(found: CellSolution) -> tuple[float, float]:
    """Return the quantity, and the bound of its true value."""
    if isinstance(found, MaxPayload):
        return found.payload, found.local_upper
    if isinstance(found, MinDuration):
        return found.duration, found.local_lower
    if isinstance(found, Vibration):
        return found.peak_to_peak, math.nan
    return found.cost, math.nan
