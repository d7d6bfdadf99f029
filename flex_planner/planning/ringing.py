"""
What is left ringing in stiff links and joints by a torque that takes no notice of them.

A vibration far faster than a motion follows its load, but for the jumps of the load at both ends:
each leaves it ringing about the new place of rest. Of the linear arm at an end of the motion that
is known in closed form, without a simulation.

"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from flex_planner.arms.kinematics import tip_position
from flex_planner.base.validation import Array
from flex_planner.dynamics.statics import residual_vibration
from flex_planner.optimal_control.motion_problem import MotionProblem
from flex_planner.planning.certificate import Certificate
import numpy as np
from numpy.typing import NDArray

Mask = NDArray[np.bool_]


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class FastVibrations:
    """
    The m vibrations of stiff coordinates about a posture, the others' masses free to give way.

    Attributes
    ----------
    problem : MotionProblem
        Of the arm as it is.
    stiff : numpy.ndarray of bool, shape (n_t,)
        Coordinates that vibrate, m of them.
    rates : numpy.ndarray, shape (m,)
        Angular frequencies, ascending [rad/s].
    vectors : numpy.ndarray, shape (n_t, m)
        Columns are displacements of all coordinates, orthonormal in the mass matrix.
    damping : numpy.ndarray, shape (m,)
        Twice the rates at which they decay [1/s].
    mass, stiffness : numpy.ndarray, shape (n_t, n_t)
        M and the second derivative of the potential energy.

    """

    problem: MotionProblem
    stiff: Mask
    rates: Array
    vectors: Array
    damping: Array
    mass: Array
    stiffness: Array

    @classmethod
    def about(cls, problem: MotionProblem, rest: Array, stiff: Mask) -> FastVibrations:
        """Return those about a state (2 n_t,) of rest."""
        from scipy.linalg import eigh  # see `ArmDynamics.prepare`

        model, p = problem.model, problem.parameters.physical
        n_t, kept = stiff.size, ~stiff
        mass = model.mass_and_energy(rest[None], p)[0][0]
        stiffness = model.static_forces(rest[None, :n_t], p)[1][0]
        carried = np.linalg.solve(mass[np.ix_(kept, kept)], mass[np.ix_(kept, stiff)])
        own = mass[np.ix_(stiff, stiff)] - mass[np.ix_(stiff, kept)] @ carried
        squares, shapes = eigh(stiffness[np.ix_(stiff, stiff)], own)
        vectors = np.zeros((n_t, squares.size))
        vectors[stiff], vectors[kept] = shapes, -carried @ shapes
        friction = shapes.T @ _friction(problem, rest, np.flatnonzero(stiff)) @ shapes
        return cls(problem=problem, stiff=stiff, rates=np.sqrt(np.maximum(squares, 0.0)),
                   vectors=vectors, damping=np.maximum(np.diag(friction), 0.0), mass=mass,
                   stiffness=stiffness)

    def bends_under(self, torque: Array) -> Array:
        """Return what a torque (n,) bends the stiff coordinates by, those of (n_t,)."""
        kept = np.flatnonzero(~self.stiff)
        force = np.zeros(kept.size)
        force[:torque.size] = torque
        moved = np.linalg.solve(self.mass[np.ix_(kept, kept)], force)
        bends = np.zeros(self.stiff.size)
        bends[self.stiff] = -np.linalg.solve(self.stiffness[np.ix_(self.stiff, self.stiff)],
                                             self.mass[np.ix_(self.stiff, kept)] @ moved)
        return bends

    def amplitudes(self, bends: Array) -> Array:
        """Return those of the vibrations (m,) after a jump of the load that bends by (n_t,)."""
        loads = self.stiffness[np.ix_(self.stiff, self.stiff)] @ bends[self.stiff]
        found: Array = self.vectors[self.stiff].T @ loads / self.rates**2
        return found

    @property
    def shares(self) -> Array:
        """Return b^T R^-1 b, b the shares of the joints in each vibration, (m,)."""
        weights = self.problem.parameters.effort_weights
        found: Array = (self.vectors[:weights.size]**2 / weights[:, None]).sum(axis=0)
        return found

    def share_at_most(self) -> float:
        """
        Return the share of J that rest costs at most after least effort, without damping.

        Which moves a joint by a cubic polynomial, so that its torque falls in a line through zero:
        of its jumps at both ends, b^T u leaves the amplitude ``b^T u / w^2``.

        """
        return float(12 / (self.rates[0] * self.problem.task.duration)**2)

    def foresee(self, amplitudes: Array) -> Certificate:
        """Return the worst certificate of an arm that comes to the goal with amplitudes (m,)."""
        problem, n_t = self.problem, self.stiff.size
        arm, rest = problem.model.arm, np.concatenate([problem.goal[:n_t], np.zeros(n_t)])
        asked = tip_position(arm, rest[:n_t])
        error = away = vibration = 0.0
        for vector, rate in zip((self.vectors * amplitudes).T, self.rates, strict=True):
            state = rest + np.concatenate([vector, rate * vector])
            error += float((1 + rate**2) * vector @ vector / 2)
            away += float(np.linalg.norm(tip_position(arm, state[:n_t]) - asked))
            vibration += residual_vibration(problem.model, state, rest[:n_t], problem.parameters)
        return Certificate(collocation_residual=0.0, boundary_error=error, hamiltonian_drift=0.0,
                           tip_error=away, residual_vibration=vibration, state_error=0.0,
                           costate_error=0.0, via_error=0.0)


def price_rest(along: Sequence[FastVibrations], start: Array, goal: Array, *,
               damped: bool = True) -> float:
    """
    Return what it costs in J to bring to rest what jumps at start and goal leave.

    The torque of least effort does it in resonance: by b cos(w t) and b sin(w t) with the shares b
    of the joints, weighed by R. Over many periods each moves a vibration of amplitude A by ``w A =
    tau / 2 b^T R^-1 b`` per unit, whose effort is ``(w A)^2 / (tau b^T R^-1 b)``; tau is the
    duration, or how long a damped vibration remembers. What start and goal leave may add up or
    cancel: this is the mean, the most is twice as much.

    Parameters
    ----------
    along : sequence of FastVibrations
        About postures at equal steps from start to goal.
    start, goal : numpy.ndarray, shape (m,)
        Amplitudes.
    damped : bool
        Whether the vibrations are damped as those of the arm are.

    """
    first, last = along[0], along[-1]
    duration = last.problem.task.duration
    decay = last.damping * duration * (1.0 if damped else 0.0)
    safe = np.where(decay > 0, decay, 1.0)
    memory = duration * np.where(decay > 0, -np.expm1(-decay) / safe, 1.0)
    squares = np.exp(-decay) * (first.rates * start)**2 + (last.rates * goal)**2
    shares = np.mean([one.shares for one in along], axis=0)
    return float((squares / (memory * shares)).sum())


def _friction(problem: MotionProblem, rest: Array, stiff: NDArray[np.intp]) -> Array:
    """Return the forces on stiff coordinates by their rates about a state of rest, (m, m)."""
    half = rest.size // 2
    states = np.tile(rest, (2 * stiff.size, 1))
    rate = 1e-3  # forces are linear in it, but for what turns them
    rows = np.arange(stiff.size)
    states[rows, half + stiff], states[rows + stiff.size, half + stiff] = rate, -rate
    forces = problem.model.inverse_dynamics(states, np.zeros((2 * stiff.size, half)),
                                            problem.parameters.physical)[:, stiff]
    friction: Array = (forces[:stiff.size] - forces[stiff.size:]).T / (2 * rate)
    return friction
