"""The part of an arm's compiled functions that simulating it takes."""

from __future__ import annotations

from collections.abc import Callable

from flex_planner.arms.arm import Arm
from flex_planner.base.validation import Array
from flex_planner.dynamics.compiled_functions import content_key, load_functions
from flex_planner.optimal_control.arm_model import _build, _key, ArmModel, RUNGE_KUTTA_STAGES
import numpy as np

_FUNCTIONS = ('forward_dynamics', 'runge_kutta_step', 'mass_and_energy', 'static_forces')
_SMALLEST = float(np.finfo(np.float64).tiny)

Step = Callable[[Array, Array, float], tuple[Array, float]]


class PlantModel(ArmModel):
    """
    The dynamics of one arm, without the optimality conditions.

    Compiling those takes most of the time, and with 8 modes a link it takes minutes.

    Parameters
    ----------
    arm : Arm
        Compiled on first use anywhere on this machine (seconds), then read from disk.

    """

    def __init__(self, arm: Arm) -> None:
        self.arm = arm
        self._functions = load_functions(content_key(_key(arm), 'plant'), lambda: {
            name: function for name, function in _build(arm).items() if name in _FUNCTIONS})

    def step(self, p: Array, *, rtol: float, atol: float) -> Step:
        """
        Return one step of the Dormand-Prince method of order 8 as a quick function.

        From a state (2 n_t,), torques (n,) that are held and a length [s] it makes the next
        state, and an error that is at most 1 if the tolerances are kept. As `state_rate`, it must
        not be shared between threads.

        """
        n, size = self.arm.n_joints, 2 * self.arm.n_coordinates
        x, torques, length = np.zeros((1, size)), np.zeros((1, 12, n)), np.zeros((1, 1))
        after, fifth, third = (np.zeros((1, size)) for _ in range(3))
        run = self._functions['runge_kutta_step'].repeated(
            [x, torques.reshape(1, RUNGE_KUTTA_STAGES * n), length, np.array(p)],
            [after, fifth, third])

        def advance(state: Array, torque: Array, seconds: float) -> tuple[Array, float]:
            x[0], torques[0], length[0, 0] = state, torque, seconds
            run()
            scale = atol + rtol * np.maximum(np.abs(state), np.abs(after[0]))
            return after[0].copy(), _error(fifth[0] / scale, third[0] / scale)

        return advance


def _error(fifth: Array, third: Array) -> float:
    """Return the error of a step; Hairer, Norsett and Wanner, section II.10."""
    first, second = float(fifth @ fifth), float(third @ third)
    bound = np.sqrt(max((first + 0.01 * second) * fifth.size, _SMALLEST))
    error = first / bound
    return float(error) if np.isfinite(error) else np.inf
