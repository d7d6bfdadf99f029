"""What a map is of: an arm, a quantity, the motion, and the axes that it is drawn over."""

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
from flex_planner.base.validation import Array, integer, number, vector
from flex_planner.base.yaml_files import read_yaml, YamlFileError, YamlSection
from flex_planner.maps.axes import Axis, Block, tiles
from flex_planner.maps.cell_results import CellCode, CellResult
from flex_planner.maps.end_points import End, middle_posture
from flex_planner.maps.quantities import check_axes, check_motors, Quantity
from flex_planner.maps.study_files import read_fields
from flex_planner.optimal_control.task import MAX_PAYLOAD, Task
from flex_planner.simulation.joint_control import Gains
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
    start, goal : End
        Of every motion; NaN in a point where an axis gives it.
    duration, payload_mass, effort_weights, velocity_weights, tolerance
        As of `Task`, where no axis gives them. The duration is a first guess for MIN_DURATION.
    elbow : int
        Of every posture, see `inverse_kinematics`.
    accuracy : float
        Of the search, in the quantity's unit; NaN for a quantity that is not searched.
    cell_time_limit : float
        > 0 and at most 3600 [s].
    block_shape : tuple of int
        Cells of a block along each axis; empty for `tiles`.
    mismatch : Mismatch
        How the simulated arm differs, for RESIDUAL_VIBRATION.
    plant_payload : float
        What it carries, >= 0 [kg]; NaN for what is planned.
    gains : Gains or None
        Of its joint controller; None for the planned torques alone.
    settling : float
        How long it is watched after its arrival, > 0 and at most 1000 [s].
    keep_motions : bool
        Whether the motions are kept with the numbers, as starts for others; those of
        MIN_DURATION never are.
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
    start: End
    goal: End
    duration: float = 1.0
    payload_mass: float = 0.0
    effort_weights: Array = field(default_factory=lambda: np.zeros(0))
    velocity_weights: Array = field(default_factory=lambda: np.zeros(0))
    tolerance: float = 1e-3
    elbow: int = -1
    accuracy: float = math.nan
    cell_time_limit: float = 60.0
    block_shape: tuple[int, ...] = ()
    mismatch: Mismatch = field(default_factory=Mismatch)
    plant_payload: float = math.nan
    gains: Gains | None = None
    settling: float = 1.0
    keep_motions: bool = True
    text: str = ''
    _start: Array | None = field(init=False, default=None, repr=False)
    _near: Array | None = field(init=False, default=None, repr=False)

    def __post_init__(self) -> None:
        check_motors(self.quantity, self.arm)
        check_axes(self.quantity, self.arm, self.axes)
        for end in (self.start, self.goal):
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
        moved = [{axis.name for axis in self.axes} & set(end.axes)
                 for end in (self.start, self.goal)]
        near = self.goal.angles if self.goal.angles.size else middle_posture(
            self.arm, self.start, self.axes, self.elbow)
        object.__setattr__(self, '_near', near)
        if not moved[0]:
            start = self.start.posture(self.arm, {}, self.elbow, near)
            object.__setattr__(self, '_start', start)
        if not moved[1]:
            self.goal.posture(self.arm, {}, self.elbow, self._start)

    def _check_numbers(self) -> None:
        """Check what does not depend on the cell."""
        if self.elbow not in (-1, 1):
            raise InvalidValueError('elbow', self.elbow, '+1 or -1')
        posture = np.clip(np.zeros(self.arm.n_joints), *self.arm.angle_limits())
        self._task(self.values((0,) * len(self.axes)), posture, posture)
        self.quantity.check_accuracy(self.accuracy)
        number('cell_time_limit', self.cell_time_limit, above=0, at_most=MAX_CELL_TIME, unit='s')
        number('settling', self.settling, above=0, at_most=1000, unit='s')
        self._check_plant()

    def _check_plant(self) -> None:
        """Check what is said about the simulated arm."""
        self.mismatch.apply(self.arm)
        names = [axis.name for axis in self.axes]
        if not math.isnan(self.plant_payload):
            number('mismatch.payload_mass', self.plant_payload, at_least=0, at_most=MAX_PAYLOAD,
                   unit='kg')
            if 'payload_scale' in names:
                raise InvalidValueError('mismatch.payload_mass', self.plant_payload,
                                        'left out: the axis payload_scale gives it')
        if 'payload_scale' in names and 'payload_mass' not in names and not self.payload_mass:
            raise InvalidValueError('payload_mass', self.payload_mass,
                                    '> 0, or the axis payload_scale changes nothing')
        if self.gains is not None:
            for name in ('stiffness', 'damping'):
                vector(f'gains.{name}', getattr(self.gains, name), self.arm.n_joints)

    @property
    def shape(self) -> tuple[int, ...]:
        """Return the number of cells along each axis."""
        return tuple(axis.values.size for axis in self.axes)

    @property
    def keeps_motions(self) -> bool:
        """Return whether motions are kept: those of shortest duration start no requests."""
        return self.keep_motions and self.quantity is not Quantity.MIN_DURATION

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
        start = self._start
        if start is None:
            start = self.start.posture(self.arm, values, self.elbow, self._near)
        return start, self.goal.posture(self.arm, values, self.elbow, start)

    def _task(self, values: Mapping[str, float], start: Array, goal: Array) -> Task:
        """Return the task of given postures."""
        weight = values.get('velocity_weight')
        return Task(
            arm=self._arm(values), start_positions=start, goal_positions=goal,
            duration=values.get('duration', self.duration),
            payload_mass=values.get('payload_mass', self.payload_mass),
            effort_weights=self.effort_weights, tolerance=self.tolerance,
            velocity_weights=(self.velocity_weights if weight is None
                              else np.full(self.arm.n_joints, weight)))

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
        values = self.values(index)
        planned = values.get('payload_mass', self.payload_mass)
        carried = planned if math.isnan(self.plant_payload) else self.plant_payload
        return (self.mismatch.apply(self._arm(values)),
                values.get('payload_scale', 1.0) * carried)

    def known_failures(self, block: Block | None = None) -> list[CellResult]:
        """
        Return the cells that fail without any solve, in the order of their indices.

        With up to two links these are all that `task` refuses. With more, where postures take an
        iteration, only points out of the workspace are.

        Parameters
        ----------
        block : tuple of slice, optional
            Where to look; default: everywhere.

        """
        parts = block or (slice(None),) * len(self.axes)
        cells = [range(*part.indices(size)) for part, size in zip(parts, self.shape, strict=True)]
        # whether an end is reached does not depend on the other axes
        moves = [axis.name in (*self.start.axes, *self.goal.axes) for axis in self.axes]
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
        quick = self.arm.n_joints <= 2 or any(end.is_too_far(self.arm, values)
                                              for end in (self.start, self.goal))
        if not quick:
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
    stall = factor * joint.motor.stall_torque
    return replace(joint, motor=replace(joint.motor, stall_torque=stall))


def load_study(path: str | os.PathLike[str]) -> Study:
    """
    Return the study that a file describes, see ``docs/maps.md``.

    Raises
    ------
    StudyError
        If the file is missing, is no YAML, or a field is unknown, missing, out of bounds or makes
        no sense with the others.

    """
    file = Path(path)
    try:
        text, content = read_yaml(file)
        top = YamlSection('', content)
        study: Study = top.build(Study, text=text, **read_fields(top, file.parent))
    except YamlFileError as error:
        raise StudyError(str(error)) from None
    except FlexPlannerError as error:
        raise StudyError(f'{file}: {error}') from error
    return study
