"""From options to a task, with errors that name the options."""

from __future__ import annotations

import argparse
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, replace
import re
from typing import Any

from flex_planner.arms.arm import Arm
from flex_planner.arms.arm_files import load_arm
from flex_planner.arms.joint_units import units_of
from flex_planner.base.errors import (
    InvalidTaskError,
    InvalidValueError,
    SingularError,
    UnreachableError,
)
from flex_planner.base.sentences import count_of, say_reason
from flex_planner.base.validation import Array, number
from flex_planner.capacity.results import MaxPayload
from flex_planner.cli.controller_options import sampling_settings
from flex_planner.cli.options import (
    add_arm,
    integer_argument,
    number_argument,
    numbers,
    positions,
)
from flex_planner.cli.payload_options import add_payload_shape, take_payload_shape
from flex_planner.cli.via_options import add_via_points, via_points
from flex_planner.control.joint_controller import JointController
from flex_planner.logs.identified_uncertainty import find_uncertainty
from flex_planner.optimal_control.ends_at_points import ends_at_points
from flex_planner.optimal_control.goal_in_pose import posture_in_pose
from flex_planner.optimal_control.path_constraints import FORMS, read_constraint
from flex_planner.optimal_control.task import Task
from flex_planner.planning.objectives import Objectives
from flex_planner.planning.plan import Plan, PlanStatus
from flex_planner.planning.point_times import MAX_SAMPLES
from flex_planner.planning.robust.objective import Robustness
from flex_planner.planning.sampling import SamplingSettings
from flex_planner.planning.uncertainty import ASSUMED, Uncertainty
from flex_planner.reports.motion import list_failures
import numpy as np

MAX_TIME_LIMIT, _TIME_LIMIT = 3600.0, 60.0  # [s]
# names of the core that are not those of options, which have - for _
_POINTS = {'start_point': '--from', 'goal_point': '--to'}
_ANGLES = {'start_positions': '--from-angles', 'goal_positions': '--to-angles'}
_RENAMED = {**_POINTS, 'payload_mass': '--payload', 'goal_orientation': '--to-orientation',
            'payload_tensor': '--payload-inertia'}


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Request:
    """
    The request of a command line.

    Attributes
    ----------
    task : Task
        The motion.
    elbow : int
        Branch of the inverse kinematics.
    time_limit : float
        [s].
    objectives : Objectives or None
        What the motion must keep besides.
    sampled : SamplingSettings
        For which joint controller the trajectory is.
    uncertainty : Uncertainty
        Of the arm: identified, if a file beside that of the arm says so.

    """

    task: Task
    elbow: int
    time_limit: float
    objectives: Objectives | None = None
    sampled: SamplingSettings = SamplingSettings()
    uncertainty: Uncertainty = ASSUMED

    @classmethod
    def of(cls, options: argparse.Namespace) -> Request:
        """
        Return the request of a command line with the options of `add_task`.

        Raises
        ------
        FlexPlannerError
            Naming option, value and bound.

        """
        arm = load_arm(options.arm)
        if options.duration is None:
            raise InvalidTaskError('--duration is missing: how long the motion takes [s]')
        with translate_errors():
            arm, inertia = take_payload_shape(options, arm)
            limit = number('time_limit', options.time_limit, above=0, at_most=MAX_TIME_LIMIT,
                           unit='s')
            task = Task(
                arm=arm, **_ends(options, arm, inertia), **_start(options, arm),
                duration=options.duration,
                payload_mass=options.payload_mass, payload_inertia=inertia,
                tolerance=options.tolerance, allow_large_bending=options.allow_large_bending,
                via_points=via_points(options.via_points, arm),
                path_constraints=[read_constraint('--limit', text) for text in options.limits],
                **_weights(options, arm))
            sampled = sampling_settings(options, arm)
            objectives = _objectives(options, task, sampled.controller)
        return cls(task=task, elbow=options.elbow, time_limit=limit,
                   objectives=objectives, sampled=sampled,
                   uncertainty=find_uncertainty(options.arm, arm))

    @property
    def sampling(self) -> SamplingSettings:
        """Return the settings of the sampling: close, within the largest number of samples."""
        shortest = self.task.duration / (MAX_SAMPLES - 1)
        return replace(self.sampled, longest_step=max(self.sampled.longest_step, shortest))

    def __str__(self) -> str:
        """Return the motion in words."""
        ends = ' to '.join(_say_end(self.task, name) for name in ('start', 'goal'))
        count = len(self.task.via_points)
        via = f' by {count_of(count, "via point")}' if count else ''
        return f'{ends}{via} in {self.task.duration:g} s'


def say_failure(outcome: Plan | MaxPayload, time_limit: float) -> str:
    """Return why there is no result, with the time limit if that was it [s]."""
    reason = outcome.message
    if outcome.status is PlanStatus.TIMEOUT:
        reason = f'--time-limit is {time_limit:g} s'
    sentence = say_reason(outcome.status.value, reason)
    return list_failures(sentence, outcome) if isinstance(outcome, Plan) else sentence


def add_task(parser: argparse.ArgumentParser, payload: str, *, recorded: bool = False) -> None:
    """
    Add the options that describe a motion; `payload` says what the payload is for.

    With `recorded` a recording may be given in place of the arm, and then there are none.

    """
    add_arm(parser, recorded=recorded)
    add = parser.add_argument
    add('--from', dest='start_point', metavar='X,Y',
        help='tip at the start, where it rests as gravity bends the arm [m]; X,Y,Z of a spatial '
        'arm')
    add('--to', dest='goal_point', metavar='X,Y',
        help='tip at the goal, where it rests likewise [m]')
    add('--from-angles', dest='start_positions', metavar='DEG,DEG,...',
        help='joint angles at the start, instead of a point')
    add('--to-angles', dest='goal_positions', metavar='DEG,DEG,...',
        help='joint angles at the goal')
    add_via_points(parser)
    add('--start-velocities', metavar='V,V,...',
        help='velocities at the start, one per joint [rad/s] or one per coordinate, modes too '
        '[m/s] (default: zeros)')
    add('--start-modal-displacements', metavar='M,M,...',
        help='modal displacements at the start, with --from-angles (default: those at rest)')
    add('--elbow', type=integer_argument, default=-1, metavar='SIGN',
        help='sign of the second joint angle at the points, 1 or -1 (default: -1)')
    add('--duration', type=number_argument, required=not recorded, metavar='S',
        help='duration of the motion [s]')
    add('--payload', dest='payload_mass', type=number_argument, default=0.0, metavar='KG',
        help=payload)
    add_payload_shape(parser)
    for name, what in (('effort', 'torques, R in the cost (default: ones)'),
                       ('velocity', 'velocities, W_2 in the cost (default: zeros)'),
                       ('position', 'positions, W_1 in the cost (default: zeros)')):
        add(f'--{name}-weights', metavar='W,W,...', help=f'weights of the squared {what}')
    add('--torque-rate-weight', metavar='W,W,...',
        help='weights of the squared rates of the torques, one per joint or one for all: torques '
        'have no jumps then, and start and end at what holds the arm (default: they may jump)')
    add('--max-torque-rate', metavar='NM/S,NM/S,...',
        help='largest rates of the torques, one per joint or one for all, inf for none; likewise '
        'without jumps')
    add('--tolerance', type=number_argument, default=1e-3, metavar='EPS',
        help='largest allowed boundary error, half the squared error of the final state '
        '(default: 0.001)')
    add('--allow-large-bending', action='store_true',
        help='accept links that bend by more than 0.3 of their length, beyond what '
        'the beam model is made for')
    add('--limit', dest='limits', action='append', default=[], metavar='KIND:VALUES',
        help='limit that holds on the whole way, in SI units and radians; may be given several '
        'times: ' + '; '.join(f'{kind}:{meaning.replace(", ", ",")}'
                              for kind, (_, meaning, _) in FORMS.items())
        + '. Keep-outs take ;stations=4 (points per link), ;tip_radius=, ;link_radius=, ;name= '
        'after the values')
    add('--time-limit', type=number_argument, default=_TIME_LIMIT, metavar='S',
        help=f'give up after this time (default: %(default)g, at most {MAX_TIME_LIMIT:g})')


def add_objectives(parser: argparse.ArgumentParser) -> None:
    """Add the options that limit a motion, by weights that are found."""
    for name, unit, what in (
            ('joint-speeds', 'RAD/S', 'joint speeds, kept by velocity weights'),
            ('torque-shares', 'SHARE', 'torques by their limits, kept by effort weights'),
            ('modal-rates', 'M/S', 'modal rates, kept by velocity weights')):
        parser.add_argument(f'--max-{name}', metavar=f'{unit},{unit},...',
                            help=f'limits of the {what} that are searched for; inf for no limit')
    parser.add_argument('--max-residual', type=number_argument, metavar='M',
                        help='largest residual bending, peak to peak in the second after the '
                        'arrival, of arms that differ from the model as --robust says [m]')
    parser.add_argument('--robust', metavar='STIFFNESS,PAYLOAD',
                        help='shares by which stiffness and payload may differ from the model, '
                        'up and down (default: 0.1,0.1 with --max-residual)')


@contextmanager
def translate_errors() -> Iterator[None]:
    """Let errors of the core name options instead of its own fields."""
    try:
        yield
    except InvalidValueError as error:
        raise type(error)(_option(error.field), error.value, error.bound) from None
    except (UnreachableError, SingularError) as error:
        name, _, reason = str(error).partition(': ')
        raise type(error)(f'{_POINTS.get(name, _via_option(name))}: {reason}') from None


def _option(field: str) -> str:
    """Return the option that a field comes from."""
    if field.startswith('via_points'):
        return _via_option(field)
    name, bracket, index = field.partition('[')
    if name.startswith('--'):
        return field
    if name in _ANGLES:
        return f'{_ANGLES[name]}{bracket}{index} in radians'
    if name.startswith('path_constraints'):
        return f'--limit {field.removeprefix("path_constraints")}'
    return _RENAMED.get(name, f'--{name.replace("_", "-")}') + bracket + index


def _via_option(field: str) -> str:
    """Return which of the options for via points a field comes from."""
    found = re.fullmatch(r'via_points\[(\d+)\](?:\.(\w+))?(.*)', field)
    if found is None:
        return field.replace('via_points', '--via and --via-angles')
    number, name, entry = int(found[1]) + 1, found[2] or '', found[3]
    part = {'positions': f', angles{entry} in radians', 'time': ', its time'}.get(name, '')
    return f'via point {number} of --via and --via-angles{part}'


def _ends(options: argparse.Namespace, arm: Arm, inertia: float | None) -> dict[str, Any]:
    """Return start and goal as they are given, with the postures that belong to points."""
    ends = {**_POINTS, **_ANGLES}
    given = [name for name in ends if getattr(options, name) is not None]
    if given not in (['start_point', 'goal_point'], ['start_positions', 'goal_positions'],
                     ['goal_point', 'start_positions']):
        found = ', '.join(ends[name] for name in given) or 'none of them'
        raise InvalidTaskError('start and goal must be given by --from and --to, by --from-angles '
                               f'and --to-angles, or by --from-angles and --to, but the command '
                               f'has {found}')
    fields: dict[str, Any] = {name: positions(_ANGLES[name], getattr(options, name), arm)
                              for name in given if name in _ANGLES}
    points = {name: numbers(_POINTS[name], getattr(options, name), arm.dimension, 'm')
              for name in given if name in _POINTS}
    in_pose = getattr(options, 'goal_orientation', None) is not None
    goal = points.get('goal_point')
    fields |= ends_at_points(arm, points.get('start_point'), None if in_pose else goal,
                             options.elbow, fields.get('start_positions'))
    return fields | (_goal_in_pose(options, arm, goal, fields, inertia) if in_pose else {})


def _goal_in_pose(options: argparse.Namespace, arm: Arm, point: Array | None,
                  fields: dict[str, Any], inertia: float | None) -> dict[str, Any]:
    """Return the field of a goal that is a point with an orientation."""
    if point is None:
        raise InvalidTaskError('--to-orientation belongs to the point of --to, which is missing')
    turned = np.radians(numbers('--to-orientation', options.goal_orientation, 3, 'deg'))
    try:
        return {'goal_positions': posture_in_pose(
            arm, point, turned, fields['start_positions'], payload_mass=options.payload_mass,
            payload_inertia=inertia)}
    except (UnreachableError, SingularError) as error:
        raise type(error)(f'goal_point: {error}') from None


def _start(options: argparse.Namespace, arm: Arm) -> dict[str, Any]:
    """Return what is given of the state at the start besides positions."""
    sizes = {'start_velocities': sorted({arm.n_joints, arm.n_coordinates}),
             'start_modal_displacements': [arm.n_passive]}
    return {name: numbers(f'--{name.replace("_", "-")}', getattr(options, name), size)
            for name, size in sizes.items() if getattr(options, name) is not None}


def _say_end(task: Task, name: str) -> str:
    """Return start or goal in words."""
    point: Array = getattr(task, f'{name}_point')
    units = np.array([units_of(joint).scale for joint in task.arm.joints])
    values, unit = (point, 'm') if point.size else (
        units * getattr(task, f'{name}_positions'),
        ', '.join(dict.fromkeys(units_of(joint).position for joint in task.arm.joints)))
    return f'({", ".join(f"{value:.6g}" for value in values)}) {unit}'


def _objectives(options: argparse.Namespace, task: Task,
                controller: JointController | None) -> Objectives | None:
    """Return the objectives that are given."""
    given: dict[str, Any] = {
        name: numbers(f'--{name.replace("_", "-")}', value, finite=False)
        for name in ('max_joint_speeds', 'max_torque_shares', 'max_modal_rates')
        if (value := getattr(options, name, None)) is not None}
    robustness = _robustness(options, controller)
    if not given and robustness is None:
        return None
    objectives = Objectives(**given, robustness=robustness)
    objectives.check(task)
    return objectives


def _robustness(options: argparse.Namespace,
                controller: JointController | None) -> Robustness | None:
    """Return which errors of the model the motion must forgive, None if none are given."""
    limit, text = (getattr(options, name, None) for name in ('max_residual', 'robust'))
    if limit is None:
        if text is not None:
            raise InvalidTaskError('--robust is given without --max-residual, which says how much '
                                   'vibration may be left')
        return None
    stiffness, payload = (0.1, 0.1) if text is None else numbers('--robust', text, 2)
    try:
        return Robustness(max_residual=limit, stiffness_error=float(stiffness),
                          payload_error=float(payload), controller=controller)
    except InvalidValueError as error:
        if error.field == 'max_residual':
            raise
        raise type(error)(f'--robust, {error.field}', error.value, error.bound) from None


def _weights(options: argparse.Namespace, arm: Arm) -> dict[str, Any]:
    """Return the weights that are given."""
    one, any_kind = [arm.n_joints], sorted({arm.n_joints, arm.n_coordinates})
    sizes = {'effort_weights': one, 'velocity_weights': any_kind, 'position_weights': any_kind}
    given: dict[str, Any] = {
        name: numbers(f'--{name.replace("_", "-")}', getattr(options, name), size)
        for name, size in sizes.items() if getattr(options, name) is not None}
    for name in ('torque_rate_weight', 'max_torque_rate'):
        if getattr(options, name) is not None:  # may be inf, which the task says of each
            given[name] = numbers(f'--{name.replace("_", "-")}', getattr(options, name),
                                  finite=False)
    return given
