"""
How well motions would tell the parameters of an arm, before they are recorded.

Plans of the arm itself are the best motions: they ring the modes that the model has, and hardly
those that it lacks, which steps and noise ring as well.

"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

from flex_planner.arms.arm import Arm
from flex_planner.base.progress import Monitor
from flex_planner.base.validation import integer, number
from flex_planner.control.joint_reference import JointReference
from flex_planner.identification.drive import Drive
from flex_planner.identification.experiments import closed_loop
from flex_planner.identification.fit import predict_half_widths
from flex_planner.identification.identification import WEAK_SHARE
from flex_planner.identification.joint_log import JointLog
from flex_planner.identification.loop_model import LoopModel
from flex_planner.identification.plant_parameters import (
    check_identifiable,
    free_parameters,
    list_parameters,
    Parameter,
    parameters_of,
    Quantity,
)
from flex_planner.optimal_control.task import MAX_PAYLOAD
import numpy as np

ASSUMED_RESOLUTION = 1e-4
"""Of encoders of a drive that says none [rad]."""

_RATE, _MOST_MOTIONS = 100.0, 20
ALL = frozenset(Quantity)


@dataclass(frozen=True, slots=True, kw_only=True)
class Prediction:
    """
    A parameter and how well motions would tell it.

    Attributes
    ----------
    parameter : Parameter
        Which.
    value : float
        As assumed.
    half_width : float
        Of the interval of 95 %, if the model were the plant; infinite if nothing tells it.

    """

    parameter: Parameter
    value: float
    half_width: float

    @property
    def is_weak(self) -> bool:
        """Return whether the interval is over 20 % of the value, if there is one."""
        return np.isinf(self.half_width) or bool(
            self.value and self.half_width > WEAK_SHARE * abs(self.value))


def predict_identification(arm: Arm, references: Sequence[JointReference], drive: Drive, *,
                           payload_mass: float = 0.0, free: frozenset[Quantity] = ALL,
                           settling: float = 1.0,
                           monitor: Monitor | None = None) -> tuple[Prediction, ...]:
    """
    Return how well logs of some motions, of their angles at 100 Hz, would tell the parameters.

    Parameters
    ----------
    arm : Arm
        As it is assumed.
    references : sequence of JointReference
        1 to 20 motions that begin at rest.
    drive : Drive
        That follows them; encoders of 1e-4 rad if it does not say.
    payload_mass : float
        As assumed [kg].
    free : frozenset of Quantity
        What is to be found.
    settling : float
        How long to record after a motion, 0 to 60 [s].
    monitor : Monitor, optional
        May stop it.

    Raises
    ------
    InvalidValueError
        If a value breaks its bound, or a joint slides.
    StoppedError
        If the monitor stopped it.

    """
    check_identifiable(arm)
    integer('number of motions', len(references), at_least=1, at_most=_MOST_MOTIONS)
    mass = number('payload_mass', payload_mass, at_least=0, at_most=MAX_PAYLOAD, unit='kg')
    number('settling', settling, at_least=0, at_most=60, unit='s')
    known = replace(drive, resolution=drive.resolution or ASSUMED_RESOLUTION)
    experiments = [closed_loop(_future_log(i, one, settling), known, one.torques[0])
                   for i, one in enumerate(references, 1)]
    values, chosen = parameters_of(arm, mass, drive.delay), free_parameters(arm, free)
    widths = predict_half_widths(LoopModel(arm, arm.payload_inertia), experiments, values, chosen,
                                 monitor)
    parameters = list_parameters(arm.n_joints)
    return tuple(Prediction(parameter=parameters[i], value=float(values[i]),
                            half_width=float(width))
                 for i, width in zip(chosen, widths, strict=True))


def _future_log(number_of: int, reference: JointReference, settling: float) -> JointLog:
    """Return a log in which the arm follows a reference exactly."""
    times = np.arange(0, reference.times[-1] + settling, 1 / _RATE)
    return JointLog(name=f'motion {number_of}', times=times, angles=reference.motion(times)[0],
                    reference=reference)
