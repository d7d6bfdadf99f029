"""Every plan is checked by means that did not produce it."""

from __future__ import annotations

from dataclasses import dataclass, fields

from flex_planner.arms.kinematics import tip_position
from flex_planner.base.progress import Monitor
from flex_planner.base.validation import Array
from flex_planner.collocation import CollocationResult, CollocationSolution
from flex_planner.dynamics.integration import integrate
from flex_planner.dynamics.statics import residual_vibration
from flex_planner.optimal_control.motion_problem import MotionProblem
from flex_planner.optimal_control.planned_torque import PlannedTorque
from flex_planner.planning.constraint_margins import smallest_slack
import numpy as np


@dataclass(frozen=True, slots=True, kw_only=True)
class Certificate:
    """
    How exactly a plan meets its conditions.

    ``inf`` where nothing was found out, of a slack ``-inf``.

    Attributes
    ----------
    collocation_residual : float
        Largest defect of a mesh interval relative to the unknowns.
    boundary_error : float
        Left side of eq. (17) with W_p = W_v = 1, at the end of the re-simulation.
    hamiltonian_drift : float
        Spread of H over the motion relative to its largest term; 0 on an extremal. H may jump
        where a via point is passed at a given time: the spread is that between such times.
    tip_error : float
        Distance of the re-simulated tip from the point that was asked for, or else from where the
        goal's joint angles have it [m].
    residual_vibration : float
        Largest bending after the joints are locked at the end of the re-simulation [m].
    state_error, costate_error : float
        Estimated largest error of states and costates at the nodes of the mesh, relative to
        the largest value of each. Of a plan that starts from another one it may be carried over,
        at twice its size or more, see `collocation.restart`.
    via_error : float
        Largest distance of the re-simulated tip from a via point at its time; of joint angles, the
        largest error of one times the reach of the arm; 0 without via points [m].
    limit_slack : float
        Smallest slack of all limits on the way, at the nodes of the mesh in the re-simulation, as
        a share of the limit's scale; ``inf`` without limits, ``-inf`` where it is not known.
        `Plan.constraints` has those of the motion as it is planned, between the nodes, too, and
        `ExecutionCertificate.limits` that of the motion under a joint controller.

    """

    collocation_residual: float = np.inf
    boundary_error: float = np.inf
    hamiltonian_drift: float = np.inf
    tip_error: float = np.inf
    residual_vibration: float = np.inf
    state_error: float = np.inf
    costate_error: float = np.inf
    via_error: float = np.inf
    limit_slack: float = -np.inf


@dataclass(frozen=True, slots=True, kw_only=True)
class CertificateLimits:
    """
    What a certificate must not exceed, entry by entry, to be passed.

    The collocation residual has no limit here: the solver's tolerance is one already.

    """

    boundary_error: float = 1e-3
    hamiltonian_drift: float = 0.02
    tip_error: float = 1e-5
    residual_vibration: float = 1e-4
    via_error: float = 1e-5

    def violations(self, certificate: Certificate) -> list[str]:
        """Return a sentence for each limit that is not met."""
        pairs = ((entry.name, getattr(certificate, entry.name), getattr(self, entry.name))
                 for entry in fields(self))
        return [f'{name.replace("_", " ")} is {value:.3g}, but must be <= {limit:g}'
                for name, value, limit in pairs if not value <= limit]


def certify(problem: MotionProblem, result: CollocationResult, monitor: Monitor, *,
            rtol: float = 1e-8) -> Certificate:
    """
    Return the certificate of a solution.

    The planned torque is applied to the original dynamics, from the start, by an integrator of
    another kind; H is evaluated between the collocation points.

    Raises
    ------
    StoppedError
        If the monitor stopped it.
    ValueError
        If the solution is of another duration than the task.

    """
    if not np.isclose(result.solution.mesh[-1], problem.task.duration, rtol=1e-12):
        raise ValueError('the solution does not last as long as its task')
    states, torque = _simulate(problem, result.solution, monitor, rtol)
    final, reached = states[-1], _target(problem, result.solution)
    if not np.isfinite(final).all():
        return Certificate(collocation_residual=result.residual)
    arm, n_t = problem.model.arm, problem.model.arm.n_coordinates
    miss = final - reached
    tip, asked = tip_position(arm, np.stack([final[:n_t], reached[:n_t]]))
    if problem.task.must_reach_point:
        asked = problem.task.goal_point
    return Certificate(
        collocation_residual=result.residual, boundary_error=float(miss @ miss / 2),
        hamiltonian_drift=hamiltonian_drift(problem, result.solution),
        tip_error=float(np.linalg.norm(tip - asked)),
        residual_vibration=residual_vibration(problem.model, _at_rest(problem) + miss,
                                              problem.goal[:n_t], problem.parameters),
        state_error=float(result.errors[problem.layout.states].max()),
        costate_error=float(result.errors[problem.layout.costates].max()),
        via_error=_via_error(problem, torque.breaks, states),
        limit_slack=smallest_slack(problem, states, _torques(problem, torque)))


def simulate_to_goal(problem: MotionProblem, solution: CollocationSolution, monitor: Monitor,
                     rtol: float) -> tuple[Array, Array]:
    """
    Return where the planned torque leads, and where it should, shape (2 n_t,) each.

    Raises
    ------
    StoppedError
        If the monitor stopped it.

    """
    states, _ = _simulate(problem, solution, monitor, rtol)
    return states[-1], _target(problem, solution)


def _simulate(problem: MotionProblem, solution: CollocationSolution, monitor: Monitor,
              rtol: float) -> tuple[Array, PlannedTorque]:
    """Return the states (N + 1, 2 n_t) at the breaks of the planned torque, and the torque."""
    torque = PlannedTorque.of(problem, solution)
    return integrate(problem.model, problem.parameters.physical, problem.start, torque, monitor,
                     rtol=rtol, atol=rtol / 100), torque


def _torques(problem: MotionProblem, torque: PlannedTorque) -> Array:
    """Return the planned torques at their breaks, where they are states, shape (N + 1, n or 0)."""
    times = torque.breaks if problem.layout.torques else ()
    return np.array([torque(time) for time in times]).reshape(torque.breaks.size, -1)


def _target(problem: MotionProblem, solution: CollocationSolution) -> Array:
    """Return the state (2 n_t,) that a motion should reach."""
    return problem.target_state(solution.nodes[-1, :problem.goal.size])


def _via_error(problem: MotionProblem, times: Array, states: Array) -> float:
    """Return by how much states at given times miss the via points [m]."""
    via, arm, worst = problem.via, problem.model.arm, 0.0
    for k, time in enumerate(via.times):
        at = int(np.abs(times - time).argmin())
        miss, _ = via.miss(k, states[at, :arm.n_coordinates])
        size = (float(np.linalg.norm(miss)) if via.points[k].point.size
                else float(np.abs(miss).max()) * arm.reach)
        worst = max(worst, size if times[at] == time else np.inf)
    return worst


def _at_rest(problem: MotionProblem) -> Array:
    """Return the goal without its velocities."""
    half = problem.goal.size // 2
    return np.concatenate([problem.goal[:half], np.zeros(half)])


def hamiltonian_drift(problem: MotionProblem, solution: CollocationSolution) -> float:
    """Return the spread of H over the motion relative to the size of its terms."""
    times = np.linspace(0, problem.task.duration, 4 * solution.intervals + 1, dtype=np.float64)
    z = solution(times)
    controls = problem.controls(times, z)
    layout = problem.layout
    powers = np.abs(z[:, layout.costates] * problem.rate(times, z)[:, layout.states]).max(axis=1)
    size = max(float(np.max(controls.cost_rate)), float(np.max(powers)), np.finfo(float).tiny)
    constant = controls.hamiltonian + problem.barrier_rate(z) - _due_change(problem, times, z)
    phases = np.searchsorted(problem.junctions[problem.via.given], times, side='right')
    spread = max(float(np.ptp(constant[phases == k])) for k in np.unique(phases))
    return spread / size


def _due_change(problem: MotionProblem, times: Array, z: Array) -> Array:
    """Return how much H changes by the conditions themselves."""
    rates = problem.hamiltonian_rate(times, z)
    return np.append(0.0, np.cumsum((rates[1:] + rates[:-1]) / 2 * np.diff(times)))
