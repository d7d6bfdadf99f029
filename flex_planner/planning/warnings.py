"""What a user should know of a plan that is certified."""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum


class WarningKind(Enum):
    """What a warning is about."""

    SENSITIVE_TO_MODES = 'sensitive to modes'
    SENSITIVE_TO_STIFFNESS = 'sensitive to stiffness'
    SENSITIVE_TO_PAYLOAD = 'sensitive to payload'
    FEEDBACK_UNSTABLE = 'feedback unstable'
    OPEN_LOOP_UNSTABLE = 'open loop unstable'


@dataclass(frozen=True, slots=True)
class PlanWarning:
    """
    A warning.

    Attributes
    ----------
    kind : WarningKind
        What it is about.
    sentence : str
        What was found, for people.

    """

    kind: WarningKind
    sentence: str
