"""
Many arms through one trajectory by their joint controller, in compiled code.

What a controller is told in each of its periods is the same for all arms, so it is found once.
Periods are crossed in as many equal steps as the tolerances ask for; `ControlledArm.follow`, which
cuts steps where motors meet their limits, is as exact as a certificate needs and takes several
times as long.

"""

from __future__ import annotations

import ctypes
from pathlib import Path

from flex_planner.base.compiled_library import load_once
from flex_planner.base.progress import Monitor
from flex_planner.base.validation import Array
from flex_planner.control.controlled_motion import ControlledArm, ControlledMotion
from flex_planner.control.joint_controller import JointController
from flex_planner.control.joint_reference import Reference
import numpy as np

_SOURCE = Path(__file__).with_name('held_periods.c')
_OPTIONS = ('-O2', '-ftree-vectorize', '-fno-math-errno')
_TOLERANCES = 1e-5, 1e-8
# in a period: the arm must have run away
MOST_STEPS = 256
_address, _number, _real = ctypes.c_void_p, ctypes.c_longlong, ctypes.c_double


class Periods(ctypes.Structure):
    """`struct periods` of held_periods.c."""

    _fields_ = [('rate', _address), ('joints', _number), ('size', _number), ('count', _number),
                ('most_steps', _number), ('length', _real), ('rtol', _real), ('atol', _real),
                ('reference', _address), ('controller', _address), ('physical', _address),
                ('states', _address), ('law', _address), ('order', _number),
                ('resolution', _real), ('law_states', _address), ('torques', _address)]


class HeldPeriods:
    """
    A trajectory as a controller is told of it, period by period, from time 0.

    Parameters
    ----------
    reference : Reference
        The trajectory.
    controller : JointController
        Which of its efforts are held for how long.
    until : float
        The last period is the one that this time lies in [s].

    """

    def __init__(self, reference: Reference, controller: JointController, until: float) -> None:
        period = controller.period
        count = int(np.ceil(until / period - 1e-6))
        self._reference, self._until = reference, until
        self._times: Array = np.arange(count + 1, dtype=np.float64) * period
        begins = self._times[:-1]
        self._rows = np.hstack([*reference.motion(begins),
                                *controller.hold.efforts(reference, begins, period)])

    def follow(self, arm: ControlledArm, state: Array,
               monitor: Monitor | None = None) -> ControlledMotion:
        """
        Return the motion of an arm with this controller from a state (2 n_t,) at time 0.

        Raises
        ------
        StoppedError
            If the monitor stopped it.

        """
        rate, library = arm.dynamics.forward_dynamics_address, load_library()
        if rate is None or library is None:
            return arm.follow(self._reference, state, self._until, monitor)
        if monitor is not None:
            monitor.check()
        states = np.full((self._times.size, 2 * arm.dynamics.arm.n_coordinates), np.nan)
        states[0] = state
        physical, constants = (np.ascontiguousarray(values, dtype=np.float64) for values in (
            arm.parameters.physical, arm.constants))
        job = Periods(
            rate=rate, joints=arm.dynamics.arm.n_joints, size=states.shape[1],
            count=len(self._rows), most_steps=MOST_STEPS, length=arm.controller.period,
            rtol=_TOLERANCES[0], atol=_TOLERANCES[1], reference=self._rows.ctypes.data,
            controller=constants.ctypes.data, physical=physical.ctypes.data,
            states=states.ctypes.data)
        states[cross_periods(library, job) + 1:] = np.nan
        return ControlledMotion(times=self._times, states=states)


def cross_periods(library: ctypes.CDLL, job: Periods) -> int:
    """Fill in the states after periods, and return how many were crossed."""
    crossed = int(library.cross_periods(ctypes.byref(job)))
    if crossed < 0:
        raise MemoryError('no memory to simulate an arm')
    return crossed


def load_library() -> ctypes.CDLL | None:
    """Return the library, None without a compiler."""
    return load_once(_SOURCE, _OPTIONS, _open, 'arms are simulated several times slower')


def _open(library: Path) -> ctypes.CDLL:
    functions = ctypes.CDLL(str(library))
    functions.cross_periods.restype = _number
    functions.cross_periods.argtypes = (ctypes.POINTER(Periods),)
    return functions
