"""
Links so stiff that a motion bends them by less than anything that counts: planned as rigid.

Their vibrations are too fast for a mesh, and change nothing. The bending that the rigid motion
causes follows from its accelerations, and the certificate is that of the arm as it is.

"""

from __future__ import annotations

from dataclasses import replace
from typing import Any

from flex_planner.base.errors import FlexPlannerError
from flex_planner.base.progress import StoppedError
from flex_planner.base.validation import Array
from flex_planner.collocation import (
    CollocationResult,
    CollocationSolution,
    differentiation_matrix,
    Solver,
    SolverStatus,
)
from flex_planner.dynamics.statics import natural_modes
from flex_planner.optimal_control.motion_problem import MotionProblem, task_parameters
from flex_planner.optimal_control.task import Task
from flex_planner.optimal_control.totals import integrate_totals
from flex_planner.planning.certificate import CertificateLimits, certify
from flex_planner.planning.plan import Plan, PlanStatus
from flex_planner.planning.verdict import judge
from flex_planner.planning.warnings import PlanWarning, WarningKind
import numpy as np
from numpy.typing import NDArray

Mask = NDArray[np.bool_]

# bending that counts for nothing, as a share of the length of a link; what is left alone where no
# mesh follows the vibrations; how many times the estimate before a motion is known may be too low
NEGLIGIBLE, _UNRESOLVED, _DOUBT = 1e-6, 1e-5, 4.0
# intervals of an exact solution, in units of those that overlook nothing
_EXACT = 3
# corrections of the bending: the load hardly depends on it
_CORRECTIONS = 4
# radians of the fastest vibration that a certificate follows, in all and in an interval
_MOST_RADIANS, _RADIANS = 5e4, 1e3
# values of a task with an entry per coordinate
_ENTRIES = ('position_weights', 'velocity_weights', 'start_velocities', 'goal_velocities',
            'goal_position_weights', 'goal_velocity_weights')


class StiffLinks:
    """
    A problem, and the same with its stiff links rigid.

    Parameters
    ----------
    problem : MotionProblem
        Of the arm as it is.
    solver : Solver
        Whose meshes may be too coarse for the vibrations.

    Attributes
    ----------
    indices : tuple of int
        Of the stiff links; empty if there are none, or if the task counts their bending.

    """

    def __init__(self, problem: MotionProblem, solver: Solver) -> None:
        self._problem, arm, settings = problem, problem.model.arm, solver.settings
        finest = _EXACT * problem.fewest_intervals(settings.stages)
        self._most = _UNRESOLVED if finest > settings.max_intervals else NEGLIGIBLE
        owners = np.repeat(np.arange(arm.n_joints), [link.modes for link in arm.links])
        shares = np.bincount(owners, _bends(problem)[-owners.size:], arm.n_joints) / np.array(
            [link.length for link in arm.links])
        stiff = [i for i, link in enumerate(arm.links)
                 if link.modes and _DOUBT * shares[i] < self._most]
        self._kept: Mask = np.concatenate([
            np.ones(arm.n_coordinates - arm.n_modes, dtype=bool), ~np.isin(owners, stiff)])
        self.indices = tuple(stiff) if stiff and self._is_free() else ()

    def task(self) -> Task:
        """
        Return the task for the arm with its stiff links rigid.

        Where gravity bends the arm, its joints begin and end where they do with all links as they
        are.

        """
        task, n = self._problem.task, self._problem.model.arm.n_joints
        fields: dict[str, Any] = {'arm': task.arm.with_rigid_links(self.indices)}
        fields |= {name: getattr(task, name)[self._kept] for name in _ENTRIES}
        if task.arm.bends_at_rest:
            fields |= {'start_positions': self._problem.start[:n], 'start_point': np.zeros(0),
                       'goal_positions': self._problem.goal[:n], 'goal_point': np.zeros(0)}
        return replace(task, **fields)

    def restrict(self, solution: CollocationSolution) -> CollocationSolution:
        """Return a solution without the stiff links' coordinates."""
        kept = np.tile(self._kept, 4)
        if solution.nodes.shape[1] != kept.size:
            return solution
        return CollocationSolution(solution.mesh, solution.nodes[:, kept],
                                   solution.stages[..., kept], solution.rule)

    def lift(self, plan: Plan, solver: Solver) -> Plan | None:
        """
        Return a plan of the arm with rigid links as one of the arm as it is.

        It is None if it cannot be certified, or bends the links by more than is negligible.

        """
        problem = self._problem_of(plan)
        if plan.solution is None or not plan.certified:
            return _unsolved(plan, problem)
        solution, bends = _Lift(problem, plan, self._kept).solution()
        lengths = [problem.model.arm.links[i].length for i in self.indices]
        if not bends <= self._most * max(lengths):
            return None
        return self._certify(replace(plan, task=problem.task, problem=problem), solution, bends,
                             solver)

    def _is_free(self) -> bool:
        """Return whether the task asks nothing of the stiff links' bending."""
        task = self._problem.task
        asked = [getattr(task, name)[~self._kept] for name in _ENTRIES]
        hard = all(np.isinf(values).all() for values in asked[4:])
        return hard and not (np.any(asked[:4]) or task.start_modal_displacements.size)

    def _problem_of(self, plan: Plan) -> MotionProblem:
        """Return the problem of the arm as it is that a plan with rigid links solves."""
        task, found = self._problem.task, plan.task
        weights: dict[str, Any] = {}
        for name in ('position_weights', 'velocity_weights'):
            weights[name] = np.zeros(self._kept.size)
            weights[name][self._kept] = getattr(found, name)
        changed = replace(task, duration=found.duration, payload_mass=found.payload_mass,
                          effort_weights=found.effort_weights, **weights)
        if not task.arm.bends_at_rest:  # another way round to a point
            changed = replace(changed, goal_positions=found.goal_positions)
        return MotionProblem(self._problem.model, changed, task_parameters(changed))

    def _certify(self, plan: Plan, solution: CollocationSolution, bends: float,
                 solver: Solver) -> Plan | None:
        """Return the plan with the certificate of the arm as it is; None if it misses it."""
        known = plan.certificate
        half = solution.nodes.shape[1] // 2
        result = CollocationResult(
            solution=solution, status=SolverStatus.CONVERGED, residual=known.collocation_residual,
            errors=np.repeat([known.state_error, known.costate_error], half),
            switches=plan.switching_times, iterations=plan.iterations, meshes=1,
            message='')
        solver.monitor.phase = 'certificate of the stiff arm'
        followed, factor = _softened(plan.problem, self.indices)
        short = replace(result, solution=_cut(solution, _radians(followed) / _RADIANS))
        try:
            certificate = certify(followed, short, solver.monitor)
        except StoppedError:
            return None
        limits = CertificateLimits(boundary_error=plan.task.tolerance)
        if limits.violations(certificate):
            return None
        total = integrate_totals(plan.problem, solution)
        judged = judge(replace(plan, solution=solution, certificate=certificate, cost=total.cost,
                               effort=total.effort, energy=total.energy))
        if plan.status is not PlanStatus.SOLVED and judged.status is PlanStatus.SOLVED:
            judged = replace(judged, status=plan.status, message=plan.message)
        warning = self._warning(bends, factor)
        return replace(judged, warnings=(*judged.warnings, warning))

    def _warning(self, bends: float, factor: float) -> PlanWarning:
        """Say what was done."""
        numbers = ' and '.join(str(i + 1) for i in self.indices)
        links = f'links {numbers} are' if len(self.indices) > 1 else f'link {numbers} is'
        checked = '' if factor == 1 else (
            f', with {factor:.2g} times the stiffness, beyond which no simulation follows')
        return PlanWarning(kind=WarningKind.STIFF_LINKS, value=bends, sentence=(
            f'{links} planned as rigid: the motion bends none of them by more than {bends:.1e} m; '
            f'the certificate is that of the arm that bends{checked}'))


class _Lift:
    """The coordinates and costates of stiff links that a motion with rigid ones implies."""

    def __init__(self, problem: MotionProblem, plan: Plan, kept: Mask) -> None:
        assert plan.solution is not None
        self._problem, self._found, self._kept = problem, plan.solution, kept
        self._stiff = np.flatnonzero(~kept)
        self._theta = np.concatenate([[0.0], self._found.rule.nodes, [1.0]])

    def solution(self) -> tuple[CollocationSolution, float]:
        """Return the motion of all coordinates, and the largest bending [m]."""
        found, n_t = self._found, self._kept.size
        z = self._widen(found.values_at(self._theta))
        shape = z.shape[:2]
        flat = self._bend(z.reshape(-1, 4 * n_t)).reshape(z.shape)
        slope = differentiation_matrix(self._theta)
        stiff = self._stiff
        flat[..., n_t + stiff] = self._rates(flat[..., stiff], slope)
        rate = self._problem.model.optimality(flat.reshape(-1, 4 * n_t), self._problem.p)
        change = self._rates(flat[..., 3 * n_t + stiff], slope)
        flat[..., 2 * n_t + stiff] = rate.reshape(*shape, -1)[..., 3 * n_t + stiff] - change
        columns = np.concatenate([part * n_t + stiff for part in range(4)])
        nodes = self._widen(found.nodes)
        nodes[:, columns] = np.vstack([flat[:, 0, columns], flat[-1:, -1, columns]])
        stages = self._widen(found.stages)
        stages[..., columns] = self._rates(flat[..., columns], slope)[:, 1:-1]
        bends = float(np.abs(flat[..., stiff]).max(initial=0.0))
        return CollocationSolution(found.mesh, nodes, stages, found.rule), bends

    def _widen(self, values: Array) -> Array:
        """Return values of all coordinates, 0 for those of stiff links."""
        full = np.zeros((*values.shape[:-1], 4 * self._kept.size))
        full[..., np.tile(self._kept, 4)] = values
        return full

    def _bend(self, z: Array) -> Array:
        """Return points whose stiff links are bent so that they do not vibrate."""
        problem, n_t, stiff = self._problem, self._kept.size, self._stiff
        kept = np.flatnonzero(self._kept)
        z[:, stiff] = problem.start[stiff]
        mass = problem.model.mass_and_energy(z[:, :2 * n_t], problem.parameters.physical)[0]
        multipliers = np.linalg.solve(mass[:, kept[:, None], kept],
                                      z[:, 3 * n_t + kept, None])
        z[:, 3 * n_t + stiff] = (mass[:, stiff[:, None], kept] @ multipliers)[..., 0]
        stiffness = problem.model.static_forces(
            z[:, :n_t], problem.parameters.physical)[1][:, stiff[:, None], stiff]
        for _ in range(_CORRECTIONS):
            surplus = problem.model.controls(z, problem.p).acceleration.copy()
            surplus[:, kept] = 0.0
            # with the others' accelerations as they are, what is left moves the stiff ones
            force = (mass @ surplus[..., None])[:, stiff]
            schur = mass[:, stiff[:, None], kept] @ np.linalg.solve(
                mass[:, kept[:, None], kept], (mass[:, kept[:, None], stiff]
                                               @ surplus[:, stiff, None]))
            z[:, stiff] += np.linalg.solve(stiffness, force - schur)[..., 0]
        return z

    def _rates(self, values: Array, slope: Array) -> Array:
        """Return the derivatives by time of values (N, k, m) at the same points."""
        rates: Array = (slope @ values) / self._found.steps[:, None, None]
        return rates


def _bends(problem: MotionProblem) -> Array:
    """Return how far each passive coordinate goes, roughly: at rest and in motion, (n_f,)."""
    n, n_t = problem.model.arm.n_joints, problem.model.arm.n_coordinates
    at_rest = np.abs([problem.start[n:n_t], problem.goal[n:n_t]]).max(axis=0)
    moving = 10 * problem.scale[n:n_t]
    bends: Array = at_rest + moving
    return bends


def _radians(problem: MotionProblem) -> float:
    """Return the angle through which the fastest vibration turns during a motion."""
    n_t = problem.model.arm.n_coordinates
    rates, _ = natural_modes(problem.model, problem.start[:n_t], problem.parameters, locked=False)
    return float(np.nan_to_num(rates).max()) * problem.task.duration


def _softened(problem: MotionProblem, stiff: tuple[int, ...]) -> tuple[MotionProblem, float]:
    """Return a problem whose vibrations a simulation can follow, and its share of stiffness."""
    radians, rigidity = _radians(problem), problem.parameters.rigidity.copy()
    if radians <= _MOST_RADIANS:
        return problem, 1.0
    factor = (_MOST_RADIANS / radians) ** 2
    chosen = list(stiff)
    rigidity[chosen] = np.minimum(rigidity[chosen], factor * rigidity[chosen].max())
    softer = replace(problem.parameters, rigidity=rigidity)
    return MotionProblem(problem.model, problem.task, softer), factor


def _cut(solution: CollocationSolution, count: float) -> CollocationSolution:
    """Return the same motion on at least so many intervals."""
    parts = max(1, int(np.ceil(count / solution.intervals)))
    shares = np.arange(parts) / parts
    inside = solution.times_at(shares).ravel()
    return solution.on_mesh(np.append(inside, solution.mesh[-1]))


def _unsolved(plan: Plan, problem: MotionProblem) -> Plan:
    """Return a plan without a motion; what is proved of rigid links is not of others."""
    status, message = plan.status, plan.message
    if status is PlanStatus.INFEASIBLE:
        status, message = PlanStatus.NOT_FOUND, f'{message}, proved for rigid links'
    return replace(plan, task=problem.task, problem=problem, solution=None, status=status,
                   message=message)


def find_stiff_links(problem: MotionProblem, solver: Solver) -> StiffLinks | None:
    """Return the stiff links of a problem; None without any."""
    if not problem.model.arm.n_modes:
        return None
    try:
        found = StiffLinks(problem, solver)
    except (FlexPlannerError, np.linalg.LinAlgError):
        return None
    return found if found.indices else None
