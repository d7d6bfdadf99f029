"""Study files: what the fields of the YAML mean, read as strictly as those of arms."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

from flex_planner.arms.arm import Arm, MAX_MODES
from flex_planner.arms.arm_files import (
    arm_from_mapping,
    ArmFileError,
    is_arm_path,
    load_arm,
    preset_files,
)
from flex_planner.base.errors import InvalidValueError
from flex_planner.base.paths import expand_path, PathError, STANDARD_INPUT
from flex_planner.base.suggestions import one_of
from flex_planner.base.validation import Array, integer, number, vector
from flex_planner.base.yaml_files import YamlSection
from flex_planner.control.joint_controller import Gains
from flex_planner.maps.axes import Axis, read_axes
from flex_planner.maps.end_points import axes_of, End
from flex_planner.maps.quantities import Quantity
from flex_planner.maps.simulated_arm import SimulatedArm
from flex_planner.maps.study_motion import StudyMotion
from flex_planner.simulation.mismatch import AS_GIVEN, Mismatch
import numpy as np

# of searches, as find_max_payload and find_min_duration have them
_ACCURACIES = {Quantity.MAX_PAYLOAD: 1e-3, Quantity.MIN_DURATION: 1e-4}
_GIVEN_BY = {'duration': 'duration', 'payload_mass': 'payload_mass',
             'velocity_weights': 'velocity_weight'}


def read_fields(top: YamlSection, folder: Path) -> dict[str, Any]:
    """
    Return the arguments of `Study` that a file gives; paths are relative to its folder.

    Raises
    ------
    FlexPlannerError
        Naming the field by its path in the file.

    """
    name, quantity = top.text('name'), _quantity(top)
    arm = _arm(top, folder)
    axes = read_axes(top.section('axes'))
    _refuse_given_twice(top, axes, arm.dimension)
    motion = _motion(top, axes, arm.dimension)
    limit = {key: top.take(key) for key in ('cell_time_limit',) if top.has(key)}
    return {'name': name, 'arm': arm, 'quantity': quantity, 'axes': axes, 'motion': motion,
            **limit,
            'accuracy': top.take('accuracy', _ACCURACIES.get(quantity, math.nan)),
            'block_shape': _block_shape(top, axes),
            'keep_motions': top.flag('keep_motions', True),
            'simulated': _simulated_arm(top, quantity, arm.n_joints)}


def _quantity(top: YamlSection) -> Quantity:
    """Return the quantity by its key."""
    given = top.text('quantity')
    kinds = {quantity.key: quantity for quantity in Quantity}
    if given not in kinds:
        raise InvalidValueError('quantity', given, one_of(given, kinds))
    return kinds[given]


def _arm(top: YamlSection, folder: Path) -> Arm:
    """Return the arm: a preset, a file or a mapping, with another number of modes if given."""
    given = top.take('arm')
    if isinstance(given, str):
        try:
            arm = load_arm(_arm_path(given, folder))
        except (ArmFileError, PathError) as error:
            raise ArmFileError(f'arm: {error}') from error
    else:
        arm = arm_from_mapping(given, 'arm')
    if not top.has('modes'):
        return arm
    modes = integer('modes', top.take('modes'), at_least=0, at_most=MAX_MODES)
    if modes and not arm.n_modes:
        raise InvalidValueError('modes', modes, 'left out: every link of the arm is rigid')
    return Mismatch(modes=modes).apply(arm)


def _arm_path(given: str, folder: Path) -> str:
    """Return the name of a preset as it is, and a path from the folder of the study."""
    if given != STANDARD_INPUT and is_arm_path(given):
        return str(folder / expand_path(given))
    # as on the command line, a file needs no suffix, but a preset of its name comes first
    is_file = given not in preset_files() and (folder / given).is_file()
    return str(folder.absolute() / given) if is_file else given


def _refuse_given_twice(top: YamlSection, axes: tuple[Axis, ...], dimension: int) -> None:
    """Refuse a field whose value an axis gives."""
    names = {axis.name for axis in axes}
    for key, axis in _GIVEN_BY.items():
        if axis in names and top.has(key):
            raise InvalidValueError(key, top.take(key), f'left out: the axis {axis} gives it')
    for key in ('start', 'goal'):
        moving = axes_of(key, dimension)
        if set(moving) <= names and top.has(key):
            raise InvalidValueError(key, top.take(key), 'left out: the axes '
                                    f'{", ".join(moving[:-1])} and {moving[-1]} give it')


def _motion(top: YamlSection, axes: tuple[Axis, ...], dimension: int) -> StudyMotion:
    """Return the motion of all cells."""
    start, goal = (_end(top, name, axes, dimension) for name in ('start', 'goal'))
    given: dict[str, Any] = {key: top.take(key) for key in (
        'duration', 'payload_mass', 'effort_weights', 'velocity_weights', 'tolerance', 'elbow')
        if top.has(key)}
    if 'duration' not in {*given, *(axis.name for axis in axes)}:
        raise InvalidValueError('duration', None, 'given')
    if top.has('limits'):
        given['limits'] = _texts('limits', top.take('limits'))
    return StudyMotion(start=start, goal=goal, **given)


def _end(top: YamlSection, name: str, axes: tuple[Axis, ...], dimension: int) -> End:
    """Return the start or the goal, given as a point, as angles or by axes."""
    angles = f'{name}_angles'
    if top.has(angles):
        if top.has(name):
            raise InvalidValueError(angles, top.take(angles), f'left out where {name} is given')
        return End(name=name, angles=_numbers(angles, top.take(angles)))
    if set(axes_of(name, dimension)) <= {axis.name for axis in axes}:
        return End(name=name, point=np.full(dimension, np.nan))
    if not top.has(name):
        raise InvalidValueError(f'{name} or {angles}', None,
                                f'given, exactly one of them{top.misspelt(name, angles)}')
    point = _numbers(name, top.take(name))
    if point.size != dimension:
        raise InvalidValueError(name, point.tolist(),
                                f'a point [{", ".join("xyz"[:dimension])}] in m')
    return End(name=name, point=point)


def _numbers(field: str, values: object) -> Array:
    """Return a list of numbers."""
    if not isinstance(values, list) or not values or not all(
            isinstance(entry, (int, float)) and not isinstance(entry, bool) for entry in values):
        raise InvalidValueError(field, values, 'a list of numbers')
    return np.array(values, dtype=np.float64)


def _texts(field: str, values: object) -> tuple[str, ...]:
    """Return a list of texts."""
    if not isinstance(values, list) or not all(isinstance(entry, str) for entry in values):
        raise InvalidValueError(field, values, 'a list of texts such as keep_out:0.52,0.25,0.1')
    return tuple(values)


def _block_shape(top: YamlSection, axes: tuple[Axis, ...]) -> tuple[int, ...]:
    """Return the sizes of blocks, 1 along axes that are left out; empty if none are given."""
    if not top.has('block'):
        return ()
    sides = top.section('block')
    shape = tuple(integer(f'block.{axis.name}', sides.take(axis.name, 1), at_least=1,
                          at_most=axis.values.size) for axis in axes)
    sides.finish()
    return shape


def _simulated_arm(top: YamlSection, quantity: Quantity, joints: int) -> SimulatedArm:
    """Return the simulated arm; only residual vibrations have one."""
    if quantity is not Quantity.RESIDUAL_VIBRATION:
        for key in ('mismatch', 'gains', 'settling'):
            if top.has(key):
                raise InvalidValueError(key, top.take(key), 'left out: only residual_vibration '
                                                            'has a simulated arm')
        return SimulatedArm()
    fields: dict[str, Any] = {}
    if top.has('mismatch'):
        fields = _mismatch(top.section('mismatch'), joints)
    if top.has('gains'):
        part = top.section('gains')
        gains = {key: _per_joint(part, key, joints) for key in ('stiffness', 'damping')}
        fields['gains'] = part.build(Gains, **gains)
    if top.has('settling'):
        fields['settling'] = top.take('settling')
    return SimulatedArm(**fields)


def _mismatch(part: YamlSection, joints: int) -> dict[str, Any]:
    """Return the differences of the simulated arm and of its payload."""
    fields: dict[str, Any] = {}
    if part.has('payload_mass'):
        fields['payload_mass'] = part.number('payload_mass', at_least=0, unit='kg')
    friction = (_per_joint(part, 'added_friction', joints) if part.has('added_friction')
                else np.zeros(0))
    fields['mismatch'] = part.build(
        Mismatch, modes=part.take('modes', AS_GIVEN), added_friction=friction,
        rigidity_scale=part.take('rigidity_scale', 1.0))
    return fields


def _per_joint(part: YamlSection, key: str, joints: int) -> Array:
    """Return a list with one entry per joint; a number stands for all of them."""
    given, field = part.take(key), part.name(key)
    if not isinstance(given, list):
        return np.full(joints, number(field, given))
    return vector(field, _numbers(field, given), joints)
