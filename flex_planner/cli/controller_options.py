"""Options that say which joint controller a trajectory is for, and how sure the model is."""

from __future__ import annotations

import argparse
from dataclasses import replace

from flex_planner.arms.arm import Arm
from flex_planner.base.errors import InvalidValueError
from flex_planner.base.validation import number, vector
from flex_planner.cli.options import number_argument, numbers
from flex_planner.control.default_gains import default_gains
from flex_planner.control.joint_controller import (
    EffortHold,
    Gains,
    JointController,
    MAX_RATE,
    MIN_RATE,
)
from flex_planner.dynamics.arm_dynamics import ArmDynamics
from flex_planner.planning.feedback.find_gains import RESOLUTION
from flex_planner.planning.sampling import MAX_PERIOD, SamplingSettings
from flex_planner.planning.uncertainty import Uncertainty

_RATE = 1000.0  # [Hz]


def add_controller(parser: argparse.ArgumentParser) -> None:
    """Add the options of the joint controller."""
    group = parser.add_argument_group(
        'joint controller', 'The controller that the trajectory is for. With it, the model '
        'carries out every plan before it is published.')
    add = group.add_argument
    add('--controller-rate', type=number_argument, metavar='HZ',
        help=f'rate of its updates [Hz] (default: {_RATE:g})')
    add('--effort-hold', choices=[hold.value for hold in EffortHold],
        help='effort of the trajectory that it applies from one update to the next: that at the '
        'end of this time, as joint_trajectory_controller does (default), at its start, in its '
        'middle, or interpolated linearly')
    add('--controller-stiffness', metavar='P,P,...', help='proportional gains [N m/rad] '
        '(default: 100 for each joint, or what suits the arm)')
    add('--controller-damping', metavar='D,D,...', help='derivative gains [N m s/rad] '
        '(default: 10 for each joint, or what suits the arm)')
    add('--controller-period', type=number_argument, metavar='S',
        help='time for which it holds an effort; efforts are shifted by half of it, so that '
        'their mean is right (default: 1 / rate; 0: no shift)')
    add('--start-hold', type=number_argument, metavar='S',
        help='time before the motion in which the arm is held, so that the controller can lead '
        'it to the start [s] (default: 0)')


def add_encoders(parser: argparse.ArgumentParser) -> None:
    """Add the resolution of the encoders."""
    parser.add_argument(
        '--encoder-resolution', type=number_argument, default=RESOLUTION, metavar='RAD',
        help='of the encoders of the joints [rad] (default: %(default).2g, 16 bits)')


def add_errors(parser: argparse.ArgumentParser) -> None:
    """Add the options of errors that the model may have."""
    for name, what in (('stiffness', 'stiffness of links'), ('payload', 'payload')):
        parser.add_argument(
            f'--{name}-error', type=number_argument, metavar='SHARE',
            help=f'by which share the {what} may be off, 0 to 0.5 (default: as identified, else '
            '0.1)')


def given_uncertainty(options: argparse.Namespace, known: Uncertainty) -> Uncertainty:
    """
    Return the errors that options give, those that are known where they do not.

    Raises
    ------
    InvalidValueError
        If one breaks its bound.

    """
    given = {name: value for name in ('stiffness', 'payload')
             if (value := getattr(options, f'{name}_error')) is not None}
    if not given:
        return known
    return replace(known, **given,
                   payload_mass=None if 'payload' in given else known.payload_mass,
                   source='as given' if len(given) == 2 else f'in part {known.source}')


def sampling_settings(options: argparse.Namespace, arm: Arm) -> SamplingSettings:
    """
    Return the sampling that a command line wants, with defaults where it has no such options.

    Raises
    ------
    InvalidValueError
        Naming the option.

    """
    if not hasattr(options, 'controller_rate'):
        return SamplingSettings()
    period = options.controller_period
    if period is not None:
        period = number('--controller-period', period, at_least=0, at_most=MAX_PERIOD, unit='s')
    rate = _rate(options, _RATE)
    known = JointController(gains=default_gains(ArmDynamics.of(arm), rate), rate=rate)
    controller = given_controller(options, arm, known)
    try:
        return SamplingSettings(controller=controller, controller_period=period,
                                start_hold=options.start_hold or 0.0)
    except InvalidValueError as error:
        raise type(error)('--start-hold', error.value, error.bound) from None


def given_controller(options: argparse.Namespace, arm: Arm,
                     known: JointController) -> JointController:
    """
    Return the controller of a command line, as another one where there is no option.

    Raises
    ------
    InvalidValueError
        Naming the option.

    """
    hold = known.hold if options.effort_hold is None else EffortHold.named(options.effort_hold)
    return JointController(gains=_gains(options, arm, known.gains), hold=hold,
                           rate=_rate(options, known.rate))


def _rate(options: argparse.Namespace, known: float) -> float:
    """Return the rate that is given, else the known one [Hz]."""
    if options.controller_rate is None:
        return known
    return number('--controller-rate', options.controller_rate, at_least=MIN_RATE,
                  at_most=MAX_RATE, unit='Hz')


def _gains(options: argparse.Namespace, arm: Arm, gains: Gains) -> Gains:
    """Return the gains that are given, and the known ones where they are not."""
    for name in ('stiffness', 'damping'):
        if (text := getattr(options, f'controller_{name}')) is not None:
            option = f'--controller-{name}'
            given = vector(option, numbers(option, text, arm.n_joints), arm.n_joints, at_least=0)
            gains = replace(gains, **{name: given})
    return gains
