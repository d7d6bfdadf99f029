"""
Exceptions that flex_planner raises.

Bad input raises; a numerical failure does not: it is a status of the plan.

"""

from __future__ import annotations

from flex_planner.base.text import printable, shown_value


class FlexPlannerError(Exception):
    """
    Base of every exception that flex_planner raises on purpose.

    Its message is one line of bounded length that is safe to show, whatever names it repeats.

    """

    def __str__(self) -> str:
        return printable(super().__str__())


class InvalidValueError(FlexPlannerError, ValueError):
    """
    A value in an arm, a task or a setting breaks its bound.

    Parameters
    ----------
    field : str
        Name of the field, as the user wrote it.
    value : object
        What was given.
    bound : str
        What was expected, in words, e.g. ``'> 0 m'``.

    """

    def __init__(self, field: str, value: object, bound: str) -> None:
        self.field = field
        self.value = value
        self.bound = bound
        shown = 'missing' if value is None else shown_value(value)
        super().__init__(f'{field} is {shown}, but must be {bound}')


class InvalidSizeError(InvalidValueError):
    """
    A list has the wrong number of entries.

    Parameters
    ----------
    field : str
        Name of the field.
    value : str
        How many entries it has, in words.
    bound : str
        What was expected, in words.

    """

    def __init__(self, field: str, value: str, bound: str) -> None:
        super().__init__(field, value, bound)
        self.args = (f'{field} has {value}, but must be {bound}',)


class NotFiniteError(InvalidValueError):
    """A number is infinite or NaN where it must be finite."""


class InvalidTaskError(FlexPlannerError):
    """The parts of a task do not go together, or not with the arm."""


class HoldingError(InvalidTaskError):
    """
    A motor is too weak to hold the arm at a goal where it comes to rest.

    Parameters
    ----------
    joint : int
        Index of the joint, from 0.
    torque, stall : float
        What it needs, with its sign, and the stall torque of its motor [N m].
    unit : str
        Of both, N of a joint that slides.

    """

    def __init__(self, joint: int, torque: float, stall: float, unit: str = 'N m') -> None:
        self.joint, self.torque, self.stall, self.unit = joint, torque, stall, unit
        super().__init__(joint, torque, stall, unit)  # so that it can be pickled

    def __str__(self) -> str:
        return (f'joint {self.joint + 1} needs {abs(self.torque):.4g} {self.unit} to hold the '
                f'arm with its payload at the goal, but the stall torque of its motor is '
                f'{self.stall:.4g} {self.unit}')


class UnreachableError(FlexPlannerError):
    """The arm cannot place its tip at a point: condition (I) of the paper, first part."""


class SingularError(FlexPlannerError):
    """The arm loses a direction of motion at a point: condition (I), second part."""


class NoEquilibriumError(InvalidTaskError):
    """The links are so soft that the arm does not come to rest under its load."""


class RecordingError(FlexPlannerError):
    """A recording cannot be written or read."""


class ValueFileError(FlexPlannerError):
    """A file of saved values is damaged, or holds something else."""
