"""The command that says what a plan leaves behind on arms that differ from its model."""

from __future__ import annotations

import argparse
from dataclasses import replace
import sys

from flex_planner.base.paths import file_stem
from flex_planner.base.progress import Monitor
from flex_planner.base.text_files import say_file, write_text
from flex_planner.base.yaml_text import format_yaml
from flex_planner.cli.controller_options import add_controller
from flex_planner.cli.options import add_folder, Commands, number_argument, path_argument
from flex_planner.cli.outputs import check_folder
from flex_planner.cli.progress_line import run_with_progress
from flex_planner.cli.request import add_task, Request, say_failure, translate_errors
from flex_planner.control.default_gains import default_gains
from flex_planner.control.joint_controller import JointController
from flex_planner.logs.identified_uncertainty import read_uncertainty
from flex_planner.optimal_control.arm_model import ArmModel
from flex_planner.planning.feedback.find_gains import RESOLUTION
from flex_planner.planning.plan import Plan
from flex_planner.planning.plan_path import plan_path
from flex_planner.planning.residuals import find_residuals, Residuals
from flex_planner.planning.robustness import prepare_robustness
from flex_planner.planning.uncertainty import Uncertainty
from flex_planner.reports.motion import plan_rows, table
from flex_planner.reports.residuals import residual_rows, residual_table, residual_values


def add_command(commands: Commands) -> None:
    """Add ``flex-planner robustness``."""
    parser = commands.add_parser(
        'robustness', help='say what a motion leaves behind if the arm is not quite its model',
        description='Plan a motion, and carry it out in simulation with a controller on arms '
        'that differ: in stiffness, in payload, in both, and with two more modes per link. The '
        'errors are those of an identification where there is one beside the arm file, else a '
        'tenth.')
    add_task(parser, payload='mass at the tip (default: 0)')
    add_controller(parser)
    add = parser.add_argument
    add('--identification', type=path_argument, metavar='YAML',
        help='what flex-planner identify says of the arm (default: <arm file>_identification.yaml '
        'beside it)')
    add_errors(parser)
    add('--encoder-resolution', type=number_argument, default=RESOLUTION, metavar='RAD',
        help='of the encoders of the joints [rad] (default: %(default).2g, 16 bits)')
    add_folder(parser)
    parser.set_defaults(run=_run)


def add_errors(parser: argparse.ArgumentParser) -> None:
    """Add the options of errors that the model may have."""
    for name, what in (('stiffness', 'stiffness of links'), ('payload', 'payload')):
        parser.add_argument(
            f'--{name}-error', type=number_argument, metavar='SHARE',
            help=f'by which share the {what} may be off, 0 to 0.5 (default: as identified, else '
            '0.1)')


def given_uncertainty(options: argparse.Namespace, known: Uncertainty) -> Uncertainty:
    """Return the errors that options give, those that are known where they do not."""
    given = {name: value for name in ('stiffness', 'payload')
             if (value := getattr(options, f'{name}_error')) is not None}
    if not given:
        return known
    with translate_errors():
        return replace(known, **given,
                       payload_mass=None if 'payload' in given else known.payload_mass,
                       source='as given' if len(given) == 2 else f'in part {known.source}')


def _run(options: argparse.Namespace) -> int:
    """Plan a motion and carry it out on other arms; print and write what is left."""
    request = Request.of(options)
    check_folder(options.output)
    arm = request.task.arm
    known = (read_uncertainty(options.identification, arm) if options.identification
             else request.uncertainty)
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
    print(f'\n{residual_table(found)}\n')
    options.output.mkdir(parents=True, exist_ok=True)
    path = options.output / f'{file_stem(options.arm)}_robustness.yaml'
    write_text(path, format_yaml({'arm': arm.name, 'motion': str(request),
                                  **residual_values(found)}))
    print(table([('figures', say_file(path))]))
    return 0 if found.stable else 1
