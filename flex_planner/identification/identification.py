"""The result of an identification: each parameter with its interval and a verdict."""

from __future__ import annotations

from dataclasses import dataclass, replace
from enum import Enum

from flex_planner.arms.arm import Arm
from flex_planner.base.validation import Array
from flex_planner.identification.experiments import Method
from flex_planner.identification.fit import Fit
from flex_planner.identification.plant_parameters import arm_with, Parameter
import numpy as np

WEAK_SHARE = 0.2
"""Share of a value that its uncertainty may be, for it to be identified."""


class Verdict(Enum):
    """Verdicts on a parameter; the value is shown to people."""

    IDENTIFIED = 'identified'
    WEAK = 'weak'
    FIXED = 'fixed'


class Finding(Enum):
    """Codes of warnings about an identification."""

    NOT_THE_PLANT = 'model_is_not_the_plant'
    MODES_MATTER = 'modes_matter'
    LOGS_DISAGREE = 'logs_disagree'
    ONE_LOG = 'one_log'
    AT_BOUND = 'at_bound'
    NOT_CONVERGED = 'not_converged'
    FRICTION = 'angles_do_not_fit'
    BEGAN_IN_MOTION = 'began_in_motion'


@dataclass(frozen=True, slots=True, kw_only=True)
class Warned:
    """A warning: its code, what happened, and what to try."""

    code: Finding
    text: str

    def __str__(self) -> str:
        return self.text


@dataclass(frozen=True, slots=True, kw_only=True)
class Estimate:
    """
    A parameter as it was found.

    Attributes
    ----------
    parameter : Parameter
        Which.
    value, assumed : float
        Found, and from the arm file.
    half_width : float
        Of the interval of 95 %, scaled by the errors; nan where it is withheld because the model
        is not the plant, or where the parameter was fixed.
    spread : float
        Largest distance of the value from those of single logs and of one mode more; nan without.
    verdict : Verdict
        `WEAK` where the uncertainty is over 20 % of the value, and where the interval is withheld:
        fits of a model that is not the plant may agree on what is not so.

    """

    parameter: Parameter
    value: float
    assumed: float
    half_width: float
    spread: float
    verdict: Verdict


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Identification:
    """
    The result.

    Attributes
    ----------
    arm, richer_arm : Arm
        With the values of before, and with more modes.
    method : Method
        Of the fit.
    logs : tuple of str
        Names.
    planned : Fit
        With the number of modes of the arm, over all logs.
    more_modes : Fit or None
        With more modes per link; None if there are none, or they were not wanted.
    best : Fit
        The one of these two whose values count: with more modes only if its squared errors are
        less than half.
    single : tuple of Fit
        Of each log alone, if there are several.
    left_out : numpy.ndarray, shape (logs, n)
        Least percentage of each log that fits to other logs explain; nan with one log.
    estimates : tuple of Estimate
        All parameters that the arm has.
    warnings : tuple of Warned
        What is to be known before the values are used.

    """

    arm: Arm
    richer_arm: Arm
    method: Method
    logs: tuple[str, ...]
    planned: Fit
    more_modes: Fit | None
    best: Fit
    single: tuple[Fit, ...]
    left_out: Array
    estimates: tuple[Estimate, ...]
    warnings: tuple[Warned, ...]

    @property
    def payload_mass(self) -> float:
        """Return the mass that the arm carried [kg]."""
        return float(self.best.values[0])

    @property
    def delay(self) -> float:
        """Return the delay of the torque [s]."""
        return float(self.best.values[-1])

    @property
    def encoder_offsets(self) -> Array:
        """Return what encoders say too much, shape (n,) [rad]."""
        offsets: Array = self.best.values[-1 - self.arm.n_joints:-1]
        return offsets

    def identified_arm(self, source: str = '') -> Arm:
        """Return the arm with the stiffness, damping, friction and rotors that were found."""
        arm = self.richer_arm if self.best is self.more_modes else self.arm
        note = f'{arm.source.rstrip()} {source}'.strip()
        return replace(arm_with(arm, self.best.values), source=note)

    def has(self, code: Finding) -> bool:
        """Return whether there is a warning."""
        return any(one.code is code for one in self.warnings)


def judge_estimate(parameter: Parameter, value: float, assumed: float, half_width: float,
                   spread: float, *, free: bool, withheld: bool) -> Estimate:
    """
    Return a parameter with its verdict.

    Its uncertainty is the larger one of interval and spread between fits. Where the interval is
    withheld the spread alone is no evidence, and the parameter is weak: the fits of a model that
    lacks something agree on the damping, say, that stands for it.

    """
    shown = np.nan if withheld or not free else half_width
    if not free:
        verdict = Verdict.FIXED
    elif not withheld and np.nanmax([half_width, spread]) <= WEAK_SHARE * abs(value):
        verdict = Verdict.IDENTIFIED
    else:
        verdict = Verdict.WEAK
    return Estimate(parameter=parameter, value=value, assumed=assumed, half_width=shown,
                    spread=spread if free else np.nan, verdict=verdict)
