"""The law of a drive, so far as it is known."""

from __future__ import annotations

from dataclasses import dataclass

from flex_planner.base.validation import number
from flex_planner.control.joint_controller import EffortHold, Gains, MAX_RATE, MIN_RATE
from flex_planner.identification.loop_sizes import LAGS
from flex_planner.identification.simulated_log import DriveLaw
import numpy as np


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Drive:
    """
    A drive that adds a PD to the efforts of its reference, samples and holds.

    Parameters
    ----------
    gains : Gains
        Of the PD.
    rate : float
        Of its samples, 10 to 100000 [Hz].
    hold : EffortHold
        Which effort of the reference it applies over a period.
    measured_speeds : bool
        Whether it gets speeds of their own; else it takes differences of its samples.
    speed_filter : float
        Corner frequency of the low pass for such differences, 0 for none, to 100000 [Hz].
    delay : float
        From a sample to its torque, where a fit begins, 0 to four periods [s].
    resolution : float
        Of the encoders, 0 if it is not known, to 1 [rad].

    Raises
    ------
    InvalidValueError
        If a value breaks its bound.

    """

    gains: Gains
    rate: float = 1000.0
    hold: EffortHold = EffortHold.END
    measured_speeds: bool = False
    speed_filter: float = 0.0
    delay: float = 0.0
    resolution: float = 0.0

    def __post_init__(self) -> None:
        number('rate', self.rate, at_least=MIN_RATE, at_most=MAX_RATE, unit='Hz')
        number('speed_filter', self.speed_filter, at_least=0, at_most=MAX_RATE, unit='Hz')
        number('delay', self.delay, at_least=0, at_most=LAGS / self.rate,
               unit=f's, {LAGS} periods')
        number('resolution', self.resolution, at_least=0, at_most=1, unit='rad')

    def law(self) -> DriveLaw:
        """Return it as the model takes it."""
        n = self.gains.stiffness.size
        keeps = np.exp(-2 * np.pi * self.speed_filter / self.rate) if self.speed_filter else 0.0
        return DriveLaw(period=1 / self.rate, stiffness=self.gains.stiffness,
                        damping=self.gains.damping, guide_stiffness=np.zeros(n),
                        guide_damping=np.zeros(n), keeps=float(keeps),
                        measured=self.measured_speeds)
