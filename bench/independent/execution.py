"""A published trajectory on the independent arm: with and without feedback, and what is left."""

from __future__ import annotations

from dataclasses import dataclass

from bench.independent.controller import Controller, Trajectory
from bench.independent.equations import Equations
from bench.independent.shapes import Array, shapes
from flex_planner.arms.arm import Arm
import numpy as np
from scipy.integrate import DOP853
from scipy.linalg import eigh

_RTOL, _ATOL = 1e-9, 1e-12
_STATIONS = 201


@dataclass(frozen=True, slots=True, kw_only=True)
class Figures:
    """
    What a report calls the same; infinite if the arm ran away [m].

    Attributes
    ----------
    tip_error, vibration : float
        With feedback.
    open_tip_error, open_vibration : float
        Without.

    """

    tip_error: float
    vibration: float
    open_tip_error: float
    open_vibration: float


def carry_out(equations: Equations, trajectory: Trajectory, controller: Controller,
              start: Array, arrival: float) -> Array:
    """
    Return the states at the first update at or after the arrival, with feedback and without.

    Parameters
    ----------
    equations : Equations
        Of the arm, n_t coordinates.
    trajectory : Trajectory
        From time 0.
    controller : Controller
        Of its joints.
    start : numpy.ndarray, shape (n_t,)
        Coordinates at time 0; at rest.
    arrival : float
        [s].

    Returns
    -------
    numpy.ndarray, shape (2, 2 n_t)
        NaN if the arm ran away.

    """
    period, n = 1 / controller.rate, equations.n
    state = np.tile(np.concatenate([start, np.zeros_like(start)]), (2, 1))
    used, size = np.array([[1.0], [0.0]]), start.size
    for update in range(int(np.ceil(arrival / period - 1e-6))):
        time = update * period
        angles, speeds = trajectory.desired(time)
        feedback = used * (controller.stiffness * (angles - state[:, :n])
                           + controller.damping * (speeds - state[:, size:size + n]))
        first, last = controller.feedforward(trajectory, time)
        state = _hold(equations, state, period, first + feedback, last - first)
    return state


def _hold(equations: Equations, state: Array, period: float, torque: Array,
          change: Array) -> Array:
    """Return states (2, 2 n_t) a period later, under torques (2, n) that change by (n,)."""
    n, size = equations.n, state.shape[1] // 2

    def rate(time: float, flat: Array) -> Array:
        q, rates = flat.reshape(2, 2, size).transpose(1, 0, 2)
        asked = torque + change * (time / period)
        limited = equations.limited(asked, rates[:, :n])
        return np.stack([rates, equations.acceleration(q, rates, limited)], axis=1).ravel()

    if not np.isfinite(state).all():
        return state
    solver = DOP853(rate, 0.0, state.ravel(), period, rtol=_RTOL, atol=_ATOL,
                    first_step=period)
    while solver.status == 'running':
        solver.step()
    arrived: Array = solver.y.reshape(2, -1)
    return arrived if solver.status == 'finished' else np.full_like(arrived, np.nan)


def vibration(arm: Arm, equations: Equations, state: Array) -> float:
    """
    Return how far links may bend from their rest after the joints are locked [m].

    The torques that stop the joints at once jerk the links, too: they act on the joints alone, so
    what changes the rates of the modes by dr is M_ff dr = M_fr times the speed that joints lose.

    Parameters
    ----------
    arm : Arm
        With n_t coordinates.
    equations : Equations
        Of it.
    state : numpy.ndarray, shape (2 n_t,)
        When they are locked.

    """
    n, size = equations.n, state.size // 2
    if size == n:
        return 0.0
    q, rates = state[:size], state[size:]
    rest = equations.rest(q[:n])
    mass, _ = equations.mass_and_force(q, rates)
    moving = rates[n:] + np.linalg.solve(mass[n:, n:], mass[n:, :n] @ rates[:n])
    mass, _ = equations.mass_and_force(rest, 0 * rest)
    squares, modes = eigh(equations.locked_stiffness(rest), mass[n:, n:])
    parts = modes.T @ mass[n:, n:] @ np.stack([q[n:] - rest[n:], moving], axis=1)
    amplitudes = np.hypot(parts[:, 0], parts[:, 1] / np.sqrt(squares))
    return max(float((np.abs(bent @ modes) @ amplitudes).max()) for bent in _bending(arm))


def _bending(arm: Arm) -> list[Array]:
    """Return the deflections of each link at its stations per modal coordinate, (k, n_f)."""
    found, first = list[Array](), 0
    for link in arm.links:
        bent = np.zeros((_STATIONS, arm.n_coordinates - arm.n_joints))
        stations = np.linspace(0, link.length, _STATIONS, dtype=np.float64)
        bent[:, first:first + link.modes] = shapes(link, stations)
        first += link.modes
        found.append(bent)
    return found
