"""What the check of a recording finds, and what it must find."""

from __future__ import annotations

from dataclasses import dataclass

from flex_planner.base.validation import Array
from flex_planner.planning.execution import ExecutionLimits


@dataclass(frozen=True, slots=True, kw_only=True)
class CheckLimits:
    """
    What the findings must not exceed; the boundary error has the limit of the task.

    Attributes
    ----------
    execution : ExecutionLimits
        Of the arrival with feedback, the same as when it was published.
    tip_deviation : float
        Of the tip on its way, with feedback, as a share of the arm's reach.
    joint_deviation : float
        Of joint angles on their way, with feedback, as a share of the largest range.
    certificate_difference : float
        Of tip errors and vibrations from those of the recorded certificate, as a share of these
        and a micrometre.
    torque_error, shifted_torque_error : float
        By which a torque may leave its bounds of eq. (15) or differ from eq. (14), as a share
        of the largest torque; the second, and the interpolation error of the report, where
        efforts are shifted in time and states and costates between the points are needed.
    hamiltonian_drift : float
        Spread of H relative to its largest term.
    end_error : float
        Of the first and the last sample [rad, m, rad/s, m/s].
    limit_passed, limit_difference : float
        By how much a sample may pass a limit on the way, and have less left of it than the report
        says of the motion; as shares of its scale.

    """

    execution: ExecutionLimits = ExecutionLimits()
    tip_deviation: float = 5e-3
    joint_deviation: float = 1e-2
    certificate_difference: float = 1e-3
    torque_error: float = 1e-6
    shifted_torque_error: float = 1e-2
    hamiltonian_drift: float = 0.02
    end_error: float = 1e-6
    limit_passed: float = 1e-5
    limit_difference: float = 1e-5


@dataclass(frozen=True, slots=True, kw_only=True)
class Finding:
    """
    One number that the check found.

    Attributes
    ----------
    name, unit : str
        What it is.
    value, limit : float
        Passed if value <= limit.
    recorded : float or None
        The same in the recorded certificate, where it has it.

    """

    name: str
    unit: str
    value: float
    limit: float
    recorded: float | None = None

    @property
    def passed(self) -> bool:
        """Return whether the value keeps its limit; not a number does not."""
        return self.value <= self.limit

    def __str__(self) -> str:
        """Return the finding in words."""
        unit = f' {self.unit}' if self.unit else ''
        planned = '' if self.recorded is None else f', {self.recorded:.1e}{unit} when planned'
        verdict = 'passed' if self.passed else 'FAILED'
        return f'{verdict}: {self.value:.3g}{unit} (limit {self.limit:.3g}{unit}{planned})'


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class MotionCheck:
    """
    What the check of a recorded motion found.

    Attributes
    ----------
    findings : tuple of Finding
        In the order in which they are shown.
    tip : numpy.ndarray, shape (k, 2), or (k, 3) of a spatial arm
        Tip of the re-simulated arm at the recorded times [m].

    """

    findings: tuple[Finding, ...]
    tip: Array

    @property
    def passed(self) -> bool:
        """Return whether every finding keeps its limit."""
        return all(finding.passed for finding in self.findings)
