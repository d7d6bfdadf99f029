"""The command that finds gains of feedback for a motion."""

from __future__ import annotations

import argparse
from collections.abc import Iterator
from dataclasses import replace
from itertools import chain
import sys

from flex_planner.arms.arm import Arm
from flex_planner.base.paths import file_stem
from flex_planner.base.progress import Monitor
from flex_planner.base.yaml_text import format_yaml
from flex_planner.cli.controller_options import (
    add_controller,
    add_encoders,
    add_errors,
    given_uncertainty,
)
from flex_planner.cli.options import add_folder, Commands
from flex_planner.cli.outputs import check_folder
from flex_planner.cli.pictures import print_files
from flex_planner.cli.progress_line import run_with_progress
from flex_planner.cli.recorded_plans import names_recording, RecordedPlan, TIME_LIMIT
from flex_planner.cli.request import add_task, Request, say_failure, translate_errors
from flex_planner.optimal_control.arm_model import ArmModel
from flex_planner.planning.feedback.find_gains import (
    find_feedback_gains,
    find_motion_gains,
    GainSettings,
)
from flex_planner.planning.feedback.gains import FeedbackGains
from flex_planner.planning.plan import Plan
from flex_planner.planning.plan_path import plan_path
from flex_planner.planning.robustness import assess_robustness, prepare_robustness
from flex_planner.planning.sampling import sample_plan
from flex_planner.planning.uncertainty import Uncertainty
from flex_planner.reports.feedback import feedback_rows, feedback_table, feedback_values
from flex_planner.reports.motion import plan_rows, Row, table


def add_command(commands: Commands) -> None:
    """Add ``flex-planner gains``."""
    parser = commands.add_parser(
        'gains', help='find gains of feedback for a motion',
        description='Plan a motion, or take a recorded one, and find gains for its controller: of '
        'a PD of each joint, of all joints together, and of a regulator that estimates how links '
        'bend. Gains are '
        'handed out where they are stable on arms that differ from the model, with two more '
        'modes per link and at the rate of the controller.')
    add_task(parser, payload='mass at the tip (default: 0)', recorded=True)
    add_controller(parser)
    add_encoders(parser)
    add_errors(parser)
    add_folder(parser)
    parser.set_defaults(run=_gains)


def _gains(options: argparse.Namespace) -> int:
    """Find gains for a motion; print them and write them into a file."""
    return _of_recording(options) if names_recording(options) else _of_task(options)


def _of_task(options: argparse.Namespace) -> int:
    """Do so for a motion that is planned, and record that."""
    request = Request.of(options)
    check_folder(options.output)

    with translate_errors():
        errors = given_uncertainty(options, request.uncertainty)
        settings = _settings(options, errors, request.task.payload_mass)
        request = replace(request, uncertainty=errors)  # of all that is recorded

    def work(model: ArmModel, monitor: Monitor) -> tuple[Plan, FeedbackGains | None]:
        with translate_errors():
            plan = plan_path(request.task, model=model, monitor=monitor)
            if not plan.solved:
                return plan, None
            prepare_robustness(plan.arm)
            monitor.phase = 'looking for gains'
            chosen = replace(settings, controller=request.sampling.controller)
            return plan, find_feedback_gains(plan, chosen, monitor)

    plan, gains = run_with_progress(request.task.arm, request.time_limit, work)
    rows = [('arm', plan.arm.name), ('motion', str(request)), *plan_rows(plan)]
    print(table([*rows, *(feedback_rows(gains) if gains else [])]), flush=True)
    if gains is None:
        print(f'flex-planner: {say_failure(plan, request.time_limit)}', file=sys.stderr)
        return 1
    return _finish(gains, chain(_write(options, plan.arm, gains),
                                _record(options, request, plan, gains)))


def _of_recording(options: argparse.Namespace) -> int:
    """Do so for the trajectory of a recording, as it was published."""
    recorded = RecordedPlan(options)
    check_folder(options.output)
    arm, payload = recorded.request.arm, float(recorded.request.parameters.payload_mass)
    with translate_errors():
        settings = _settings(options, recorded.uncertainty, payload)

    def work(model: ArmModel, monitor: Monitor) -> FeedbackGains:
        prepare_robustness(arm)
        monitor.phase = 'looking for gains'
        return find_motion_gains(recorded.carried(model), settings, monitor)

    gains = run_with_progress(arm, TIME_LIMIT, work)
    print(table([*recorded.rows, *feedback_rows(gains)]), flush=True)
    return _finish(gains, _write(options, arm, gains))


def _settings(options: argparse.Namespace, errors: Uncertainty, payload: float) -> GainSettings:
    """Return what gains are made for, of an arm with a payload [kg]."""
    return GainSettings(encoder_resolution=options.encoder_resolution,
                        stiffness_error=errors.stiffness,
                        payload_error=errors.payload_error(payload))


def _finish(gains: FeedbackGains, files: Iterator[Row]) -> int:
    """Print what gains leave, and files as they are written where there are gains."""
    print(f'\n{feedback_table(gains)}\n')
    if not gains.found:
        print(f'flex-planner: {gains.message}', file=sys.stderr)
        return 1
    print_files(files)
    return 0


def _write(options: argparse.Namespace, arm: Arm, gains: FeedbackGains) -> Iterator[Row]:
    """Write the gains, and yield the file."""
    options.output.mkdir(parents=True, exist_ok=True)
    path = options.output / f'{file_stem(options.arm)}_gains.yaml'
    path.write_text(format_yaml(feedback_values(gains, arm)), encoding='utf-8')
    yield 'gains', str(path)


def _record(options: argparse.Namespace, request: Request, plan: Plan,
            gains: FeedbackGains) -> Iterator[Row]:
    """Record a plan with its gains for a report, and yield the recording."""
    from flex_planner.cli.recorder import RequestRecorder

    reference = sample_plan(plan, request.sampling)
    reference = replace(reference, robustness=assess_robustness(
        plan, reference, uncertainty=request.uncertainty))
    yield 'recording', str(RequestRecorder(request, options.output / 'recordings').record_plan(
        plan, reference, gains))
