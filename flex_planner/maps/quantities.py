"""The quantities that a map can show, and the axes that suit each of them."""

from __future__ import annotations

from collections.abc import Sequence
from enum import Enum
import math

from flex_planner.arms.arm import Arm
from flex_planner.base.errors import InvalidValueError
from flex_planner.base.validation import number
from flex_planner.maps.axes import Axis, check_cells


class Quantity(Enum):
    """Quantities of maps; the value is shown to people."""

    MAX_PAYLOAD = 'maximum payload'
    MIN_EFFORT = 'minimum effort'
    MIN_DURATION = 'minimum duration'
    RESIDUAL_VIBRATION = 'residual vibration'

    @property
    def key(self) -> str:
        """Return its name in files, such as ``max_payload``."""
        return self.name.lower()

    @property
    def unit(self) -> str:
        """Return the unit of its values."""
        return _UNITS[self]

    @property
    def is_searched(self) -> bool:
        """Return whether it is found by a search, which has an accuracy."""
        return self in _ACCURACIES

    def check_accuracy(self, accuracy: float) -> None:
        """Raise InvalidValueError unless a search takes it; NaN where nothing is searched."""
        if self.is_searched:
            low, high = _ACCURACIES[self]
            number('accuracy', accuracy, at_least=low, at_most=high, unit=self.unit)
        elif not math.isnan(accuracy):
            raise InvalidValueError('accuracy', accuracy, f'left out: {self.key} is computed, '
                                                          'not searched')


_UNITS = {Quantity.MAX_PAYLOAD: 'kg', Quantity.MIN_EFFORT: 'N^2 m^2 s',
          Quantity.MIN_DURATION: 's', Quantity.RESIDUAL_VIBRATION: 'm'}
# least and largest, as of find_max_payload and find_min_duration
_ACCURACIES = {Quantity.MAX_PAYLOAD: (1e-6, 1e3), Quantity.MIN_DURATION: (1e-7, 100.0)}
_WEIGHT = 'weights shape a motion, but do not change what the motors can do at most'
_SECOND_ARM = 'only residual_vibration has a simulated arm, which may carry another payload'
_SENSELESS = {
    (Quantity.MAX_PAYLOAD, 'payload_mass'): 'the payload is what is searched for',
    (Quantity.MIN_DURATION, 'duration'): 'the duration is what is searched for',
    (Quantity.MAX_PAYLOAD, 'velocity_weight'): _WEIGHT,
    (Quantity.MIN_DURATION, 'velocity_weight'): _WEIGHT,
    (Quantity.MAX_PAYLOAD, 'payload_scale'): _SECOND_ARM,
    (Quantity.MIN_EFFORT, 'payload_scale'): _SECOND_ARM,
    (Quantity.MIN_DURATION, 'payload_scale'): _SECOND_ARM,
}


def check_axes(quantity: Quantity, arm: Arm, axes: Sequence[Axis]) -> None:
    """
    Refuse axes that make no sense for a quantity or an arm.

    Raises
    ------
    InvalidValueError
        Naming the axis and the reason.

    """
    names = [axis.name for axis in axes]
    for name in names:
        reason = _SENSELESS.get((quantity, name)) or _no_effect(arm, name)
        if reason:
            raise InvalidValueError(f'axes.{name}', 'given', f'left out: {reason}')
        if names.count(name) > 1:
            raise InvalidValueError(f'axes.{name}', 'given twice', 'given once')
    check_cells(math.prod(axis.values.size for axis in axes))


def _no_effect(arm: Arm, name: str) -> str:
    """Return the reason why an axis has no effect on an arm, or an empty text."""
    if name == 'stiffness_scale' and not arm.n_modes:
        return 'every link of the arm is rigid'
    if name == 'motor_scale' and not any(_has_limit(arm)):
        return 'no motor of the arm has a limit'
    return ''


def check_motors(quantity: Quantity, arm: Arm) -> None:
    """Refuse an arm without the motor limits that a quantity comes from."""
    limited = _has_limit(arm)
    if quantity is Quantity.MAX_PAYLOAD and not any(limited):
        raise InvalidValueError('arm', 'without a limited motor',
                                'one with a stall torque: otherwise there is no largest payload')
    if quantity is Quantity.MIN_DURATION and not all(limited):
        raise InvalidValueError('arm', 'with an unlimited motor',
                                'one with stall torques at all joints: otherwise there is no '
                                'shortest duration')


def _has_limit(arm: Arm) -> list[bool]:
    """Return for each motor whether it has a stall torque."""
    return [math.isfinite(joint.motor.standstill_torque) for joint in arm.joints]
