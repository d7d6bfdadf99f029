"""The commands that plan: a motion with a given payload, and with the largest."""

from __future__ import annotations

import argparse
from dataclasses import replace
import sys

from flex_planner.base.progress import Monitor
from flex_planner.base.validation import integer
from flex_planner.capacity.max_payload import find_max_payload
from flex_planner.capacity.results import MaxPayload, PayloadMethod
from flex_planner.cli.controller_options import add_controller
from flex_planner.cli.options import Commands, integer_argument, number_argument
from flex_planner.cli.outputs import add_outputs, Outputs
from flex_planner.cli.pictures import print_files
from flex_planner.cli.progress_line import run_with_progress
from flex_planner.cli.request import (
    add_objectives,
    add_task,
    Request,
    say_failure,
    translate_errors,
)
from flex_planner.optimal_control.arm_model import ArmModel
from flex_planner.planning.kinds.clusters import MOST_KINDS
from flex_planner.planning.kinds.effort import SearchEffort
from flex_planner.planning.plan import peaks, Plan
from flex_planner.planning.plan_path import plan_kind
from flex_planner.planning.robustness import assess_robustness, robustness_warnings
from flex_planner.planning.sampling import judge_execution, sample_plan, SampledPlan
from flex_planner.reports.execution import execution_rows, robustness_rows
from flex_planner.reports.motion import (
    motion_rows,
    payload_rows,
    plan_rows,
    Row,
    search_table,
    table,
    weights_table,
)
from flex_planner.reports.robust import robust_rows

_STEP = 1.0


def add_commands(commands: Commands) -> None:
    """Add ``flex-planner plan`` and ``flex-planner payload``."""
    plan = commands.add_parser(
        'plan', help='plan a motion', description='Plan the motion of least cost.')
    add_task(plan, payload='mass at the tip (default: 0)')
    plan.add_argument('--to-orientation', dest='goal_orientation', metavar='DEG,DEG,DEG',
                      help='of the tip at the point of --to, of a spatial arm: roll, pitch and '
                      'yaw of its frame in that of the base, as gravity bends the arm')
    add_objectives(plan)
    _add_kinds(plan)
    plan.add_argument('--kind', type=integer_argument, default=1, metavar='N',
                      help='plan the N-th of the kinds of motion that are listed, 1 to 4 '
                      '(default: 1, the best)')
    add_controller(plan)
    add_outputs(plan)
    plan.set_defaults(run=_plan)
    payload = commands.add_parser(
        'payload', help='find the largest payload',
        description='Find the largest payload that the arm can carry, and plan the motion.')
    add_task(payload, payload='smallest payload of interest (default: 0)')
    _add_search(payload)
    _add_kinds(payload)
    add_controller(payload)
    add_outputs(payload)
    payload.set_defaults(run=_payload)


def _add_search(parser: argparse.ArgumentParser) -> None:
    """Add the options of the search."""
    parser.add_argument('--method', choices=[method.name.lower() for method in PayloadMethod],
                        default='direct', help='direct: the payload is an unknown (default); '
                        'incremental: it is raised step by step as in the paper, which takes '
                        'longer')
    parser.add_argument('--accuracy', type=number_argument, default=1e-3, metavar='KG',
                        help='accuracy of the largest payload (default: 0.001)')
    parser.add_argument('--step', type=number_argument, metavar='KG',
                        help='first step of the incremental method (default: 1)')


def _add_kinds(parser: argparse.ArgumentParser) -> None:
    """Add the option for how many kinds of motion are looked for."""
    parser.add_argument('--search', choices=[effort.value for effort in SearchEffort],
                        default=SearchEffort.NORMAL.value,
                        help='effort of the search for other kinds of motion: fast follows '
                        'the first (default: %(default)s)')


def _plan(options: argparse.Namespace) -> int:
    """Plan a motion; print, draw and record it."""
    number = integer('--kind', options.kind, at_least=1, at_most=MOST_KINDS)
    request = Request.of(options)
    outputs = Outputs.of(options, request)

    def work(model: ArmModel, monitor: Monitor) -> Plan:
        with translate_errors():
            return plan_kind(request.task, number, model=model, monitor=monitor,
                             objectives=request.objectives, search=options.search)

    plan = run_with_progress(request.task.arm, request.time_limit, work)
    plan, reference, rows = _sample(request, plan)
    _print_result(request, f'with {request.task.payload_mass:g} kg',
                  [*plan_rows(plan), *robust_rows(plan), *rows])
    if text := weights_table(plan):
        print(f'\n{text}\n')
    print_files(outputs.write_plan(plan, reference if plan.solved else None))
    return _exit_code(request, plan)


def _payload(options: argparse.Namespace) -> int:
    """Find the largest payload and its motion; print, draw and record both."""
    request = Request.of(options)
    outputs = Outputs.of(options, request)
    accuracy = options.accuracy
    step = max(_STEP, accuracy) if options.step is None else options.step

    def work(model: ArmModel, monitor: Monitor) -> MaxPayload:
        with translate_errors():
            return find_max_payload(
                request.task, model=model, monitor=monitor, accuracy=accuracy, step=step,
                method=PayloadMethod[options.method.upper()], search=options.search)

    found = run_with_progress(request.task.arm, request.time_limit, work)
    rows: list[Row] = []
    reference = None
    if found.plan is not None:
        plan, reference, rows = _sample(request, found.plan)
        if plan is not found.plan:
            found = replace(found, plan=plan, status=plan.status, message=plan.message)
    _print_result(request, '', [*payload_rows(found), *rows])
    if text := search_table(found):
        print(f'\n{text}\n')
    print_files(outputs.write_search(found, accuracy, step, reference if found.solved else None))
    return _exit_code(request, found)


def _sample(request: Request, plan: Plan) -> tuple[Plan, SampledPlan | None, list[Row]]:
    """Return a plan judged by its samples, the samples, and what they show; none if unsolved."""
    if plan.solution is None:
        return plan, None, []
    reference = sample_plan(plan, request.sampling)
    plan = judge_execution(plan, reference)
    rows = [*motion_rows(plan, peaks(plan, reference.samples)),
            *execution_rows(reference.execution, plan.arm)]
    if plan.solved:
        robustness = assess_robustness(plan, reference, uncertainty=request.uncertainty)
        reference = replace(reference, robustness=robustness)
        rows += robustness_rows(robustness, plan.arm)
        rows += [('warning', warning.sentence) for warning in robustness_warnings(
            reference.execution, robustness, plan.arm.reach, plan.arm)]
    return plan, reference, rows


def _print_result(request: Request, payload: str, rows: list[Row]) -> None:
    """Print the request and its result."""
    print(table([('arm', request.task.arm.name), ('motion', f'{request} {payload}'.rstrip()),
                 *rows]), flush=True)


def _exit_code(request: Request, outcome: Plan | MaxPayload) -> int:
    """Return the exit code of a result; print the reason of a failure."""
    if outcome.solved:
        return 0
    print(f'flex-planner: {say_failure(outcome, request.time_limit)}', file=sys.stderr)
    return 1
