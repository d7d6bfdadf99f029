"""The command that plans the two motions to record for an identification."""

from __future__ import annotations

import argparse
from dataclasses import replace

from flex_planner.base.errors import InvalidTaskError
from flex_planner.base.progress import Monitor
from flex_planner.base.text_files import say_file, write_text
from flex_planner.cli.options import add_folder, Commands, path_argument
from flex_planner.cli.outputs import check_folder
from flex_planner.cli.progress_line import run_with_progress
from flex_planner.cli.request import add_task, Request, say_failure, translate_errors
from flex_planner.control.joint_controller import JointController
from flex_planner.control.joint_reference import JointReference
from flex_planner.identification.excitation import predict_identification, Prediction
from flex_planner.logs.drive_file import load_drive
from flex_planner.optimal_control.arm_model import ArmModel
from flex_planner.optimal_control.task import Task
from flex_planner.planning.plan_path import plan_path
from flex_planner.planning.sampling import sample_plan, SamplingSettings
from flex_planner.reports.motion import columns, table
import numpy as np

_NAMES = ('there', 'back')


def add_command(commands: Commands) -> None:
    """Add ``flex-planner excite``."""
    parser = commands.add_parser(
        'excite', help='plan two motions whose logs tell the parameters of an arm',
        description='Plan a motion there and back, say how well logs of the two would tell each '
        'parameter, and write what the drive is to follow as CSV: with the measured angles as '
        'further columns q1, ... they are logs for flex-planner identify.')
    add_task(parser, payload='mass at the tip, as assumed (default: 0)')
    parser.add_argument('--drive', type=path_argument, required=True, metavar='YAML',
                        help='law of the drive, see identify')
    add_folder(parser)
    parser.set_defaults(run=_run)


def _run(options: argparse.Namespace) -> int:
    """Plan both motions, predict, and write them."""
    request = Request.of(options)
    task = request.task
    drive = load_drive(options.drive, task.arm.n_joints)
    check_folder(options.output)
    options.output.mkdir(parents=True, exist_ok=True)
    settings = SamplingSettings(controller=JointController(
        gains=drive.gains, rate=drive.rate, hold=drive.hold))

    def work(model: ArmModel, monitor: Monitor) -> tuple[list[JointReference],
                                                         tuple[Prediction, ...]]:
        with translate_errors():
            references = [_plan(one, model, settings, request.time_limit, monitor)
                          for one in (task, _back(task))]
            return references, predict_identification(
                task.arm, references, drive, payload_mass=task.payload_mass, monitor=monitor)

    references, predictions = run_with_progress(task.arm, request.time_limit, work)
    print(f'{_prediction_table(predictions)}\n')
    rows = [('motion', f'{request}, and back')]
    if weak := [one.parameter.name for one in predictions if one.is_weak]:
        rows.append(('hardly told', f'{", ".join(weak)}: try a shorter duration, a longer way, '
                     'or a heavier payload; or leave them out with --free'))
    for name, reference in zip(_NAMES, references, strict=True):
        path = options.output / f'{name}.csv'
        write_text(path, _format_csv(reference, drive.rate))
        rows.append((name, say_file(path)))
    print(table(rows))
    return 0


def _back(task: Task) -> Task:
    """Return the way back."""
    if not (task.starts_at_rest and task.ends_at_rest) or task.via_points:
        raise InvalidTaskError('the motion must go from rest to rest without via points: it is '
                               'planned back, too')
    return replace(task, start_positions=task.goal_positions,
                   goal_positions=task.start_positions, start_point=task.goal_point,
                   goal_point=task.start_point)


def _plan(task: Task, model: ArmModel, settings: SamplingSettings, limit: float,
          monitor: Monitor) -> JointReference:
    """Return what the drive is to follow."""
    plan = plan_path(task, model=model, monitor=monitor)
    if not plan.solved:
        raise InvalidTaskError(say_failure(plan, limit))
    return sample_plan(plan, settings, monitor).reference


def _prediction_table(predictions: tuple[Prediction, ...]) -> str:
    """Return how well each parameter would be told, a line each."""
    return columns(('parameter', 'assumed', '95 %', 'unit'), [
        (one.parameter.name, f'{one.value:.5g}', f'+-{one.half_width:.2g}',
         one.parameter.unit or '-') for one in predictions])


def _format_csv(reference: JointReference, rate: float) -> str:
    """Return a motion, and a second at rest after it, at every period of the drive."""
    n = reference.positions.shape[1]
    times = np.arange(0, reference.times[-1] + 1, 1 / rate)
    rows = np.column_stack([times, *reference.motion(times), reference.torque(times)])
    names = ['t', *(f'{letters}{i}' for letters in ('qd', 'vd', 'ff') for i in range(1, n + 1))]
    lines = [','.join(names), *(','.join(f'{value:.9g}' for value in row) for row in rows)]
    return '\n'.join(lines) + '\n'
