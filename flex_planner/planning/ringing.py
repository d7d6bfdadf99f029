"""
What is left ringing in stiff links and joints by a torque that takes no notice of them.

A vibration far faster than a motion follows its load, but for the jumps of the load at both ends:
each leaves it ringing about the new place of rest. Of the linear arm at an end of the motion that
is known in closed form, without a simulation.

"""

from __future__ import annotations

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
    mass, stiffness : numpy.ndarray, shape (n_t, n_t)
        M and the second derivative of the potential energy.

    """

    problem: MotionProblem
    stiff: Mask
    rates: Array
    vectors: Array
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
        return cls(problem=problem, stiff=stiff, rates=np.sqrt(np.maximum(squares, 0.0)),
                   vectors=vectors, mass=mass, stiffness=stiffness)

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

    def price(self, amplitudes: Array) -> float:
        """
        Return what it costs in J to bring amplitudes (m,) to rest within the motion.

        The torque of least effort does it in resonance: by b cos(w t) and b sin(w t) with the
        shares b of the joints, weighed by R. Over many periods each moves a vibration of amplitude
        A by ``w A = T/2 b^T R^-1 b`` per unit, whose effort is ``(w A)^2 / (T b^T R^-1 b)``.

        """
        weights = self.problem.parameters.effort_weights
        shares = self.vectors[:weights.size]
        reached = self.problem.task.duration * (shares**2 / weights[:, None]).sum(axis=0)
        return float(((self.rates * amplitudes)**2 / reached).sum())

    def foresee(self, amplitudes: Array) -> Certificate:
        """Return the certificate of an arm that comes to the goal with amplitudes (m,)."""
        problem, n_t = self.problem, self.stiff.size
        miss = np.concatenate([np.abs(self.vectors) @ np.abs(amplitudes),
                               np.abs(self.vectors) @ np.abs(self.rates * amplitudes)])
        rest = np.concatenate([problem.goal[:n_t], np.zeros(n_t)])
        tip, asked = (tip_position(problem.model.arm, q)
                      for q in (rest[:n_t] + miss[:n_t], rest[:n_t]))
        return Certificate(
            collocation_residual=0.0, boundary_error=float(miss @ miss / 2),
            hamiltonian_drift=0.0, tip_error=float(np.linalg.norm(tip - asked)),
            residual_vibration=residual_vibration(problem.model, rest + miss, rest[:n_t],
                                                  problem.parameters),
            state_error=0.0, costate_error=0.0)
