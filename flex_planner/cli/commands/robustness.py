"""The command that says what a plan leaves behind on arms that differ from its model."""

from __future__ import annotations

import argparse
import sys

from flex_planner.base.paths import file_stem
from flex_planner.base.progress import Monitor
from flex_planner.base.text_files import say_file, write_text
from flex_planner.base.yaml_text import format_yaml
from flex_planner.cli.controller_options import (
    add_controller,
    add_encoders,
    add_errors,
    given_uncertainty,
)
from flex_planner.cli.options import add_folder, Commands, path_argument
from flex_planner.cli.outputs import check_folder
from flex_planner.cli.progress_line import run_with_progress
from flex_planner.cli.recorded_plans import names_recording, RecordedPlan, TIME_LIMIT
from flex_planner.cli.request import add_task, Request, say_failure, translate_errors
from flex_planner.control.default_gains import default_gains
from flex_planner.control.joint_controller import JointController
from flex_planner.logs.identified_uncertainty import read_uncertainty
from flex_planner.optimal_control.arm_model import ArmModel
from flex_planner.planning.plan import Plan
from flex_planner.planning.plan_path import plan_path
from flex_planner.planning.residuals import (
    find_motion_residuals,
    find_residuals,
    Residuals,
)
from flex_planner.planning.robustness import prepare_robustness
from flex_planner.reports.motion import plan_rows, table
from flex_planner.reports.residuals import residual_rows, residual_table, residual_values


def add_command(commands: Commands) -> None:
    """Add ``flex-planner robustness``."""
    parser = commands.add_parser(
        'robustness', help='say what a motion leaves behind if the arm is not quite its model',
        description='Plan a motion, or take a recorded one, and carry it out in simulation with a '
        'controller on arms that differ: in stiffness, in payload, in both, and with two more '
        'modes per link. The errors are those of an identification where there is one beside the '
        'arm file, else a tenth.')
    add_task(parser, payload='mass at the tip (default: 0)', recorded=True)
    add_controller(parser)
    parser.add_argument(
        '--identification', type=path_argument, metavar='YAML',
        help='what flex-planner identify says of the arm (default: <arm file>_identification.yaml '
        'beside it)')
    add_errors(parser)
    add_encoders(parser)
    add_folder(parser)
    parser.set_defaults(run=_run)


def _run(options: argparse.Namespace) -> int:
    """Carry a motion out on other arms; print and write what is left."""
    return _of_recording(options) if names_recording(options) else _of_task(options)


def _of_task(options: argparse.Namespace) -> int:
    """Do so with a motion that is planned."""
    request = Request.of(options)
    check_folder(options.output)
    arm = request.task.arm
    known = (read_uncertainty(options.identification, arm) if options.identification
             else request.uncertainty)
    with translate_errors():
        uncertainty = given_uncertainty(options, known)

    def work(model: ArmModel, monitor: Monitor) -> tuple[Plan, Residuals | None]:
        with translate_errors():
            plan = plan_path(request.task, model=model, monitor=monitor)
            if not plan.solved:
                return plan, None
            prepare_robustness(plan.arm)
            monitor.phase = 'carrying it out on other arms'
            controller = request.sampling.controller or JointController(
                gains=default_gains(plan.model))
            return plan, find_residuals(plan, controller, uncertainty=uncertainty,
                                        resolution=options.encoder_resolution, monitor=monitor)

    plan, found = run_with_progress(arm, request.time_limit, work)
    payload = float(plan.problem.parameters.payload_mass)
    rows = [('arm', arm.name), ('motion', str(request)), *plan_rows(plan)]
    print(table([*rows, *(residual_rows(found, payload) if found else [])]), flush=True)
    if found is None:
        print(f'flex-planner: {say_failure(plan, request.time_limit)}', file=sys.stderr)
        return 1
    return _write(options, found, {'arm': arm.name, 'motion': str(request)})


def _of_recording(options: argparse.Namespace) -> int:
    """Do so with the trajectory of a recording, as it was published."""
    recorded = RecordedPlan(options)
    check_folder(options.output)
    arm, uncertainty = recorded.request.arm, recorded.uncertainty
    if options.identification:
        with translate_errors():
            uncertainty = given_uncertainty(options, read_uncertainty(options.identification, arm))

    def work(model: ArmModel, monitor: Monitor) -> Residuals:
        prepare_robustness(arm)
        monitor.phase = 'carrying it out on other arms'
        return find_motion_residuals(recorded.carried(model), uncertainty=uncertainty,
                                     resolution=options.encoder_resolution, monitor=monitor)

    found = run_with_progress(arm, TIME_LIMIT, work)
    payload = float(recorded.request.parameters.payload_mass)
    print(table([*recorded.rows, *residual_rows(found, payload)]), flush=True)
    return _write(options, found, dict(recorded.rows))


def _write(options: argparse.Namespace, found: Residuals, what: dict[str, str]) -> int:
    """Print what is left and write it into a file, with what it is about; return the code."""
    print(f'\n{residual_table(found)}\n')
    options.output.mkdir(parents=True, exist_ok=True)
    path = options.output / f'{file_stem(options.arm)}_robustness.yaml'
    write_text(path, format_yaml({**what, **residual_values(found)}))
    print(table([('figures', say_file(path))]))
    return 0 if found.stable else 1
