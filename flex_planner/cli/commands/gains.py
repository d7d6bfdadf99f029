"""The command that finds gains of feedback for a motion."""

from __future__ import annotations

import argparse
from collections.abc import Iterator
from dataclasses import replace
import sys

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
from flex_planner.cli.request import add_task, Request, say_failure, translate_errors
from flex_planner.optimal_control.arm_model import ArmModel
from flex_planner.planning.feedback.find_gains import (
    find_feedback_gains,
    GainSettings,
)
from flex_planner.planning.feedback.gains import FeedbackGains
from flex_planner.planning.plan import Plan
from flex_planner.planning.plan_path import plan_path
from flex_planner.planning.robustness import assess_robustness, prepare_robustness
from flex_planner.planning.sampling import sample_plan
from flex_planner.reports.feedback import feedback_rows, feedback_table, feedback_values
from flex_planner.reports.motion import plan_rows, Row, table


def add_command(commands: Commands) -> None:
    """Add ``flex-planner gains``."""
    parser = commands.add_parser(
        'gains', help='find gains of feedback for a motion',
        description='Plan a motion, and find gains for its controller: of a PD of each joint, of '
        'all joints together, and of a regulator that estimates how links bend. Gains are '
        'handed out where they are stable on arms that differ from the model, with two more '
        'modes per link and at the rate of the controller.')
    add_task(parser, payload='mass at the tip (default: 0)')
    add_controller(parser)
    add_encoders(parser)
    add_errors(parser)
    add_folder(parser)
    parser.set_defaults(run=_gains)


def _gains(options: argparse.Namespace) -> int:
    """Plan a motion and find gains for it; print them and write them into a file."""
    request = Request.of(options)
    check_folder(options.output)

    with translate_errors():
        errors = given_uncertainty(options, request.uncertainty)
        settings = GainSettings(encoder_resolution=options.encoder_resolution,
                                stiffness_error=errors.stiffness,
                                payload_error=errors.payload_error(request.task.payload_mass))

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
    print(f'\n{feedback_table(gains)}\n')
    if not gains.found:
        print(f'flex-planner: {gains.message}', file=sys.stderr)
        return 1
    print_files(_write(options, request, plan, gains))
    return 0


def _write(options: argparse.Namespace, request: Request, plan: Plan,
           gains: FeedbackGains) -> Iterator[Row]:
    """Write the gains, and a recording for a report; yield the files as they are written."""
    options.output.mkdir(parents=True, exist_ok=True)
    path = options.output / f'{file_stem(options.arm)}_gains.yaml'
    path.write_text(format_yaml(feedback_values(gains, plan)), encoding='utf-8')
    yield 'gains', str(path)
    from flex_planner.cli.recorder import RequestRecorder

    reference = sample_plan(plan, request.sampling)
    reference = replace(reference, robustness=assess_robustness(
        plan, reference, uncertainty=request.uncertainty))
    yield 'recording', str(RequestRecorder(request, options.output / 'recordings').record_plan(
        plan, reference, gains))
