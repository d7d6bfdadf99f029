"""The subject of a map: an arm, a quantity, a motion, and the axes that change them."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from functools import partial
from itertools import product
import math
import os
from pathlib import Path

from flex_planner.arms.arm import Arm, Joint
from flex_planner.base.errors import (
    FlexPlannerError,
    InvalidValueError,
    SingularError,
    UnreachableError,
)
from flex_planner.base.paths import expand_path, PathError
from flex_planner.base.text import LONGEST_NAME, printable
from flex_planner.base.text_files import say_file
from flex_planner.base.validation import Array, integer, number
from flex_planner.base.yaml_files import read_yaml, YamlFileError, YamlSection
from flex_planner.maps.axes import Axis, Block, tiles
from flex_planner.maps.cell_results import CellCode, CellResult
from flex_planner.maps.end_points import middle_posture
from flex_planner.maps.quantities import check_axes, check_motors, Quantity
from flex_planner.maps.simulated_arm import SimulatedArm
from flex_planner.maps.study_files import read_fields
from flex_planner.maps.study_limits import check_limit_axis
from flex_planner.maps.study_motion import StudyMotion
from flex_planner.optimal_control.task import Task
from flex_planner.simulation.mismatch import Mismatch
import numpy as np

MAX_CELL_TIME = 3600.0


class StudyError(FlexPlannerError):
    """A study file cannot be found, read or understood; the message names file and field."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Study:
    """
    A map that is to be computed: every combination of the values of its axes is a cell.

    Parameters
    ----------
    name : str
        For titles.
    arm : Arm
        n joints; as planned for, but for what axes change.
    quantity : Quantity
        What is computed.
    axes : tuple of Axis
        1 to 4, at most 10^8 cells; a cell's index has one entry per axis.
    motion : StudyMotion
        Of every cell.
    accuracy : float
        Of the search, in the quantity's unit; NaN for a quantity that is not searched.
    cell_time_limit : float
        > 0 and at most 3600 [s].
    block_shape : tuple of int
        Cells of a block along each axis; empty for `tiles`.
    simulated : SimulatedArm
        Carries out the plans, for RESIDUAL_VIBRATION.
    keep_motions : bool
        Whether the motions are kept with the numbers, as starts for others; those of
        MIN_DURATION, or with limits on the way, never are.
    text : str
        The study file as read.

    Raises
    ------
    InvalidValueError
        Naming the field as in a study file.

    """

    name: str
    arm: Arm
    quantity: Quantity
    axes: tuple[Axis, ...]
    motion: StudyMotion
    accuracy: float = math.nan
    cell_time_limit: float = 60.0
    block_shape: tuple[int, ...] = ()
    simulated: SimulatedArm = field(default_factory=SimulatedArm)
    keep_motions: bool = True
    text: str = ''
    _start: Array | None = field(init=False, default=None, repr=False)
    _near: Array | None = field(init=False, default=None, repr=False)

    def __post_init__(self) -> None:
        object.__setattr__(self, 'name', printable(self.name, LONGEST_NAME))
        check_motors(self.quantity, self.arm)
        check_axes(self.quantity, self.arm, self.axes)
        check_limit_axis(self.motion.limits, self.axes)
        for end in self.motion.ends:
            end.check(self.arm, self.axes)
        self._check_numbers()
        sides = self.block_shape or tiles(self.shape)
        if len(sides) != len(self.axes):
            raise InvalidValueError('block', list(sides), f'{len(self.axes)} sizes, one per axis')
        object.__setattr__(self, 'block_shape', tuple(
            integer(f'block.{axis.name}', side, at_least=1, at_most=axis.values.size)
            for axis, side in zip(self.axes, sides, strict=True)))
        self._check_ends()

    def _check_ends(self) -> None:
        """Refuse an end that no cell reaches, and keep the start if no axis moves it."""
        motion, names = self.motion, {axis.name for axis in self.axes}
        near = motion.goal.angles if motion.goal.angles.size else middle_posture(
            self.arm, motion.start, self.axes, motion.elbow)
        object.__setattr__(self, '_near', near)
        if not names & set(motion.start.axes):
            start = motion.start.posture(self.arm, {}, motion.elbow, near)
            object.__setattr__(self, '_start', start)
        if not names & set(motion.goal.axes):
            motion.goal.posture(self.arm, {}, motion.elbow, self._start)

    def _check_numbers(self) -> None:
        """Check what does not depend on the cell."""
        if self.motion.elbow not in (-1, 1):
            raise InvalidValueError('elbow', self.motion.elbow, '+1 or -1')
        posture = np.clip(np.zeros(self.arm.n_joints), *self.arm.angle_limits())
        self._task(self.values((0,) * len(self.axes)), posture, posture)
        self.quantity.check_accuracy(self.accuracy)
        number('cell_time_limit', self.cell_time_limit, above=0, at_most=MAX_CELL_TIME, unit='s')
        self.simulated.check(self.arm)
        self._check_payload_scale()

    def _check_payload_scale(self) -> None:
        """Refuse an axis payload_scale that contradicts another field, or has no effect."""
        names = [axis.name for axis in self.axes]
        if 'payload_scale' not in names:
            return
        if self.simulated.has_payload:
            raise InvalidValueError('mismatch.payload_mass', self.simulated.payload_mass,
                                    'left out: the axis payload_scale gives it')
        if 'payload_mass' not in names and not self.motion.payload_mass:
            raise InvalidValueError('payload_mass', self.motion.payload_mass,
                                    '> 0, or the axis payload_scale changes nothing')

    @property
    def shape(self) -> tuple[int, ...]:
        """Return the number of cells along each axis."""
        return tuple(axis.values.size for axis in self.axes)

    @property
    def keeps_motions(self) -> bool:
        """
        Return whether motions are kept: those of shortest duration start no requests.

        Nor do those that limits bend: requests without such limits would follow their kind.

        """
        return (self.keep_motions and self.quantity is not Quantity.MIN_DURATION
                and not self.motion.limits)

    def values(self, index: tuple[int, ...]) -> dict[str, float]:
        """Return the values of the axes at a cell, by name."""
        return {axis.name: float(axis.values[i])
                for axis, i in zip(self.axes, index, strict=True)}

    def task(self, index: tuple[int, ...]) -> Task:
        """
        Return the task of a cell.

        The task's arm is `arm` itself unless an axis changes it, and then differs in nothing
        that is compiled: one `ArmModel` of `arm` does for all cells.

        Raises
        ------
        UnreachableError, SingularError
            Saying of which end.
        InvalidValueError
            If a value of the cell breaks its bound.

        """
        values = self.values(index)
        return self._task(values, *self._postures(values))

    def _postures(self, values: Mapping[str, float]) -> tuple[Array, Array]:
        """Return the joint angles (n,) at start and goal [rad]."""
        motion, start = self.motion, self._start
        if start is None:
            start = motion.start.posture(self.arm, values, motion.elbow, self._near)
        return start, motion.goal.posture(self.arm, values, motion.elbow, start)

    def _task(self, values: Mapping[str, float], start: Array, goal: Array) -> Task:
        """Return the task of given postures."""
        return self.motion.task(self._arm(values), values, start, goal)

    def _arm(self, values: Mapping[str, float]) -> Arm:
        """Return the arm with its links and motors scaled."""
        arm = self.arm
        if 'stiffness_scale' in values:
            arm = Mismatch(rigidity_scale=values['stiffness_scale']).apply(arm)
        if 'motor_scale' in values:
            stronger = partial(_with_stronger_motor, factor=values['motor_scale'])
            arm = replace(arm, joints=tuple(map(stronger, arm.joints)))
        return arm

    def plant(self, index: tuple[int, ...]) -> tuple[Arm, float]:
        """Return the arm that is simulated at a cell, and what it carries [kg]."""
        values, simulated = self.values(index), self.simulated
        carried = simulated.payload_mass if simulated.has_payload else self.motion.payload(values)
        return (simulated.mismatch.apply(self._arm(values)),
                values.get('payload_scale', 1.0) * carried)

    def known_failures(self, block: Block | None = None) -> list[CellResult]:
        """
        Return the cells that fail without any solve, in the order of their indices.

        In the plane with up to two links these are all that `task` refuses. Elsewhere, where
        postures take an iteration, only points out of the workspace are.

        Parameters
        ----------
        block : tuple of slice, optional
            Where to look; default: everywhere.

        """
        parts = block or (slice(None),) * len(self.axes)
        cells = [range(*part.indices(size)) for part, size in zip(parts, self.shape, strict=True)]
        # whether an end is reached does not depend on the other axes
        moving = {name for end in self.motion.ends for name in end.axes}
        moves = [axis.name in moving for axis in self.axes]
        found: list[CellResult] = []
        for corner in product(*(along if moved else along[:1]
                                for along, moved in zip(cells, moves, strict=True))):
            failure = self._failure(corner)
            if failure:
                alike = product(*((i,) if moved else along for i, along, moved
                                  in zip(corner, cells, moves, strict=True)))
                found += [replace(failure, index=index) for index in alike]
        return sorted(found, key=lambda result: result.index)

    def _failure(self, index: tuple[int, ...]) -> CellResult | None:
        """Return the result of a cell that has no motion, None if it may have one."""
        values = self.values(index)
        quick = self.arm.dimension == 2 and self.arm.n_joints <= 2
        if not quick and not any(end.is_too_far(self.arm, values) for end in self.motion.ends):
            return None
        try:
            self._postures(values)
        except (UnreachableError, SingularError) as error:
            return CellResult(index=index, code=CellCode.UNREACHABLE, message=str(error))
        except InvalidValueError as error:
            return CellResult(index=index, code=CellCode.INVALID, message=str(error))
        return None


def _with_stronger_motor(joint: Joint, factor: float) -> Joint:
    """Return a joint with a stronger motor of the same no-load speed."""
    motor = joint.motor
    cap = None if motor.max_torque is None else factor * motor.max_torque
    return replace(joint, motor=replace(motor, stall_torque=factor * motor.stall_torque,
                                        max_torque=cap))


def load_study(path: str | os.PathLike[str]) -> Study:
    """
    Return the study that a file describes, see ``docs/maps.md``.

    Raises
    ------
    StudyError
        If the file is missing, is no YAML, or a field is unknown, missing, out of bounds or makes
        no sense with the others.

    """
    try:
        file = expand_path(path)
        text, content = read_yaml(file)
        top = YamlSection('', content)
        # a pipe has no folder that its writer meant
        folder = file.parent if file.is_file() else Path()
        study: Study = top.build(Study, text=text, **read_fields(top, folder))
    except (PathError, YamlFileError) as error:
        raise StudyError(str(error)) from None
    except FlexPlannerError as error:
        raise StudyError(f'{say_file(file)}: {error}') from error
    return study
