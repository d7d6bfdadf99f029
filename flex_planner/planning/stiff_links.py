"""
Links and elastic joints so stiff that they follow the motion quasi-statically.

Their vibrations are too fast for a mesh, and cost next to nothing. They are planned as rigid; the
bending that the motion causes follows from its accelerations, with the torque that it takes, and
the certificate is that of the arm as it is, with all vibrations free.

"""

from __future__ import annotations

from dataclasses import replace
from typing import Any

from flex_planner.base.errors import FlexPlannerError
from flex_planner.base.progress import StoppedError
from flex_planner.collocation import (
    CollocationResult,
    CollocationSolution,
    Solver,
    SolverStatus,
)
from flex_planner.optimal_control.motion_problem import MotionProblem, task_parameters
from flex_planner.optimal_control.task import Task
from flex_planner.optimal_control.totals import integrate_totals
from flex_planner.planning.certificate import CertificateLimits, certify
from flex_planner.planning.plan import Plan, PlanStatus
from flex_planner.planning.quasi_static_motion import follow_quasi_statically
from flex_planner.planning.ringing import FastVibrations, Mask, price_rest
from flex_planner.planning.stiff_parts import (
    fastest_turn,
    find_stiff_parts,
    negligible_share,
    StiffParts,
)
from flex_planner.planning.verdict import judge
from flex_planner.planning.warnings import PlanWarning, WarningKind
import numpy as np

# radians of the fastest vibration that a certificate follows: of links, which can be softened,
# of joints, and in an interval
_MOST_RADIANS, _MOST_OF_JOINTS, _RADIANS = 5e4, 1e6, 1e3
# of the integrator: what rings need not be known so exactly, and its steps are short
_TOLERANCE = 1e-6
# at which vibrations are looked at on the way
_POSTURES = 9
# values of a task with an entry per coordinate
_ENTRIES = ('position_weights', 'velocity_weights', 'start_velocities', 'goal_velocities',
            'goal_position_weights', 'goal_velocity_weights')
# what a plan may have changed in it
_CHANGED = ('duration', 'payload_mass', 'effort_weights', 'position_weights', 'velocity_weights',
            'goal_positions')


class StiffLinks:
    """
    A problem, and the same with its stiff links and joints rigid.

    Parameters
    ----------
    problem : MotionProblem
        Of the arm as it is.
    solver : Solver
        Whose meshes may be too coarse for the vibrations.

    Attributes
    ----------
    parts : StiffParts
        None if the task counts their bending.

    """

    def __init__(self, problem: MotionProblem, solver: Solver) -> None:
        settings = solver.settings
        self._problem = problem
        self._share = negligible_share(problem, settings.stages, settings.max_intervals)
        parts = find_stiff_parts(problem, settings.stages, settings.max_intervals)
        self._kept: Mask = ~parts.mask(problem.model.arm)
        self.parts = parts if self._is_free() else StiffParts()

    def task(self) -> Task:
        """
        Return the task for the arm with its stiff parts rigid.

        Where gravity bends the arm, its joints begin and end where they do with all parts as they
        are.

        """
        task, n = self._problem.task, self._problem.model.arm.n_joints
        fields: dict[str, Any] = {'arm': self.parts.rigid(task.arm)}
        fields |= {name: getattr(task, name)[self._kept] for name in _ENTRIES}
        if task.arm.bends_at_rest:
            fields |= {'start_positions': self._problem.start[:n], 'start_point': np.zeros(0),
                       'goal_positions': self._problem.goal[:n], 'goal_point': np.zeros(0)}
        return replace(task, **fields)

    def restrict(self, solution: CollocationSolution) -> CollocationSolution:
        """Return a solution without the coordinates of stiff parts."""
        kept = np.tile(self._kept, 4)
        if solution.nodes.shape[1] != kept.size:
            return solution
        return CollocationSolution(solution.mesh, solution.nodes[:, kept],
                                   solution.stages[..., kept], solution.rule)

    def lift(self, plan: Plan, solver: Solver, most: float | None = None) -> Plan | None:
        """
        Return a plan of the arm with rigid parts as one of the arm as it is.

        Parameters
        ----------
        plan : Plan
            Of the task that `task` returns.
        solver : Solver
            Its monitor may interrupt the certificate.
        most : float, optional
            What it may cost in J at most to bring the stiff parts to rest; by default a
            negligible share.

        Returns
        -------
        Plan or None
            None if it costs more, or if the motion cannot be certified.

        """
        problem = self._problem_of(plan)
        if plan.solution is None or not plan.certified:
            return _unsolved(plan, problem)
        solution, left_out = follow_quasi_statically(problem, plan.problem, plan.solution,
                                                     self._kept)
        total = integrate_totals(problem, solution)
        price, undamped = (each + left_out for each in self._price(problem, solution))
        # what is left of damped vibrations dies out, though to hasten that costs more
        if not undamped <= (self._share * total.cost if most is None else most):
            return None
        lifted = replace(plan, task=problem.task, problem=problem, solution=solution,
                         cost=total.cost, effort=total.effort, energy=total.energy)
        return self._certify(lifted, solution, price, solver)

    def _is_free(self) -> bool:
        """Return whether the task asks nothing of the bending of stiff parts."""
        task = self._problem.task
        asked = [getattr(task, name)[~self._kept] for name in _ENTRIES]
        hard = all(np.isinf(values).all() for values in asked[4:])
        if any(one.bends for one in task.path_constraints):
            return False
        return hard and not (np.any(asked[:4]) or task.start_modal_displacements.size)

    def _problem_of(self, plan: Plan) -> MotionProblem:
        """Return the problem of the arm as it is that a plan with rigid parts solves."""
        task, found = self._problem.task, plan.task
        weights: dict[str, Any] = {}
        for name in ('position_weights', 'velocity_weights'):
            weights[name] = np.zeros(self._kept.size)
            weights[name][self._kept] = getattr(found, name)
        changed = replace(task, duration=found.duration, payload_mass=found.payload_mass,
                          effort_weights=found.effort_weights, **weights)
        if not task.arm.bends_at_rest:  # another way round to a point
            changed = replace(changed, goal_positions=found.goal_positions)
        if all(np.array_equal(getattr(task, name), getattr(changed, name)) for name in _CHANGED):
            return self._problem
        return MotionProblem(self._problem.model, changed, task_parameters(changed))

    def _price(self, problem: MotionProblem, solution: CollocationSolution) -> tuple[float, float]:
        """Return what it would cost in J to bring the stiff parts to rest, and without damping."""
        n_t = self._kept.size
        times = np.linspace(0, problem.task.duration, _POSTURES, dtype=np.float64)
        path = solution(times)[:, :n_t]
        path[[0, -1]] = problem.start[:n_t], problem.goal[:n_t]
        along = [FastVibrations.about(problem, np.concatenate([q, np.zeros(n_t)]), ~self._kept)
                 for q in path]
        start = along[0].amplitudes(solution.nodes[0, :n_t] - path[0])
        goal = along[-1].amplitudes(solution.nodes[-1, :n_t] - path[-1])
        return price_rest(along, start, goal), price_rest(along, start, goal, damped=False)

    def _certify(self, plan: Plan, solution: CollocationSolution, price: float,
                 solver: Solver) -> Plan | None:
        """Return the plan with the certificate of the arm as it is; None if it misses it."""
        known = plan.certificate
        half = solution.nodes.shape[1] // 2
        followed, factor = _softened(plan.problem, self.parts.links)
        radians = fastest_turn(followed)
        if radians > _MOST_OF_JOINTS:
            return None
        result = CollocationResult(
            solution=_cut(solution, radians / _RADIANS), status=SolverStatus.CONVERGED,
            residual=known.collocation_residual,
            errors=np.repeat([known.state_error, known.costate_error], half),
            switches=plan.switching_times, iterations=plan.iterations, meshes=1, message='')
        solver.monitor.phase = 'certificate of the stiff arm'
        try:
            certificate = certify(followed, result, solver.monitor, rtol=_TOLERANCE)
        except StoppedError:
            return None
        limits = CertificateLimits(boundary_error=plan.task.tolerance)
        if limits.violations(certificate):
            return None
        judged = judge(replace(plan, certificate=certificate))
        if plan.status is not PlanStatus.SOLVED and judged.status is PlanStatus.SOLVED:
            judged = replace(judged, status=plan.status, message=plan.message)
        warning = self._warning(judged, price, factor)
        return replace(judged, warnings=(*judged.warnings, warning))

    def _warning(self, plan: Plan, price: float, factor: float) -> PlanWarning:
        """Say what was done."""
        assert plan.solution is not None
        stiff = np.flatnonzero(~self._kept)
        shares = np.linspace(0, 1, 9, dtype=np.float64)
        bends = np.abs(plan.solution.values_at(shares)[..., stiff])
        beyond = plan.problem.model.arm.n_joints + len(plan.problem.model.arm.elastic_joints)
        told = [f'{kind} by up to {float(bends[..., which].max()):.1e} {unit}'
                for kind, unit, which in (('twists', 'rad', stiff < beyond),
                                          ('bends', 'm', stiff >= beyond)) if which.any()]
        its, follow = ('its', 'it follows') if self.parts.count == 1 else ('their', 'they follow')
        share = price / plan.cost if plan.cost > 0 else 0.0
        checked = '' if factor == 1 else (
            f', with {factor:.2g} times the stiffness, beyond which no simulation follows')
        return PlanWarning(kind=WarningKind.STIFF_LINKS, value=float(bends.max()), sentence=(
            f'{self.parts}: too stiff to vibrate with the motion, which {" and ".join(told)}; '
            f'{follow} quasi-statically. To bring {its} vibrations to rest as well would cost '
            f'about {price:.1e} more, {share:.0e} of J (an estimate). The certificate is that of '
            f'the arm with all vibrations free{checked}'))


def _softened(problem: MotionProblem, stiff: tuple[int, ...]) -> tuple[MotionProblem, float]:
    """Return a problem whose vibrations a simulation can follow, and its share of stiffness."""
    radians, rigidity = fastest_turn(problem), problem.parameters.rigidity.copy()
    if radians <= _MOST_RADIANS or not stiff:
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
    """Return a plan without a motion; what is proved of rigid parts is not of others."""
    status, message = plan.status, plan.message
    if status is PlanStatus.INFEASIBLE:
        status, message = PlanStatus.NOT_FOUND, f'{message}, proved for rigid links'
    return replace(plan, task=problem.task, problem=problem, solution=None, status=status,
                   message=message)


def find_stiff_links(problem: MotionProblem, solver: Solver) -> StiffLinks | None:
    """Return the stiff links and joints of a problem; None without any, or with via points."""
    if not problem.model.arm.n_passive or problem.junctions.size:
        return None
    try:
        found = StiffLinks(problem, solver)
    except (FlexPlannerError, np.linalg.LinAlgError):
        return None
    return found if found.parts else None
