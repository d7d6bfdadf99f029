"""From a request message to an outcome: the part of the node that runs in the worker thread."""

from __future__ import annotations

from collections.abc import Callable
from copy import copy
from dataclasses import replace
import logging
from pathlib import Path
import shutil
import time

from flex_planner.base.errors import FlexPlannerError, InvalidTaskError
from flex_planner.base.progress import Monitor, StoppedError, StopReason
from flex_planner.base.sentences import say_reason
from flex_planner.base.text import printable
from flex_planner.capacity.max_payload import find_max_payload
from flex_planner.optimal_control.arm_model import ArmModel
from flex_planner.optimal_control.task import Task
from flex_planner.planning.feedback.find_gains import find_feedback_gains, GainSettings
from flex_planner.planning.feedback.gains import FeedbackGains
from flex_planner.planning.plan import Plan
from flex_planner.planning.plan_path import plan_kind
from flex_planner.planning.robustness import assess_robustness
from flex_planner.planning.sampling import judge_execution, sample_plan
from flex_planner.planning.strategies.initial_guesses import WARM_START
from flex_planner.planning.uncertainty import ASSUMED, Uncertainty
from flex_planner.planning.warnings import WarningKind
from flex_planner.ros.messages.measured_starts import ArmStateError, starts_at_arm, with_start
from flex_planner.ros.messages.payload_searches import (
    report_from_search,
    search_message,
    search_options,
    search_without_result,
)
from flex_planner.ros.messages.plans import (
    add_execution,
    error_code,
    objectives_from_message,
    planning_time_limit,
    report_from_plan,
    report_trajectory,
    STATUS_CODES,
    STOP_CODES,
    task_from_message,
)
from flex_planner.ros.messages.replacements import check_alone
from flex_planner.ros.messages.spaces import add_space
from flex_planner.ros.messages.times import time_ns
from flex_planner.ros.messages.trajectory_rules import trajectory_violations
from flex_planner.ros.planner.arm_state import ArmState
from flex_planner.ros.planner.late_recorder import LateRecorder, once
from flex_planner.ros.planner.map_starts import Starts
from flex_planner.ros.planner.outcome import (
    enter_times,
    failure_outcome,
    name_plan,
    Outcome,
    unknown_failure,
)
from flex_planner.ros.planner.recorder import OutcomeRecorder
from flex_planner.ros.planner.replanner import Replanner
from flex_planner.ros.planner.request_state import RequestState
from flex_planner.ros.planner.running_plan import RunningPlans
from flex_planner.ros.settings.planner import PlannerSettings
from flex_planner_interfaces.msg import (
    FlexibleTrajectory,
    MotionTask,
    PayloadSearch,
    PlanReport,
)
from flex_planner_interfaces.srv import FindMaxPayload

_LOG = logging.getLogger(__name__)


class RequestPlanner:
    """
    Plans requests for one arm; never raises.

    Parameters
    ----------
    model : ArmModel
        The arm.
    recorder : OutcomeRecorder
        Where outcomes are kept.
    starts : Starts, optional
        Motions that requests near them start from.
    arm_state : ArmState, optional
        Where the arm is; without it, nobody knows and nothing is checked.
    replanner : Replanner, optional
        Plans again in motion; without it, no plan is carried out.
    uncertainty : Uncertainty
        Of the arm, a tenth by default: for what is left of a plan on other arms, and for gains.

    """

    def __init__(self, model: ArmModel, recorder: OutcomeRecorder,
                 starts: Starts | None = None, arm_state: ArmState | None = None,
                 replanner: Replanner | None = None, uncertainty: Uncertainty = ASSUMED) -> None:
        self._model, self._recorder, self._uncertainty = model, recorder, uncertainty
        self._starts = Starts('', model.arm) if starts is None else starts
        self._arm_state = arm_state
        self._replanner = replanner or Replanner(RunningPlans(), time.time_ns)
        self._report_in_work: PlanReport | None = None
        self._late = LateRecorder()

    def plan(self, message: MotionTask, state: RequestState) -> Outcome:
        """
        Plan a request and record it with its outcome.

        Parameters
        ----------
        message : MotionTask
            The request.
        state : RequestState
            Its settings, progress and cancellation.

        """
        settings = state.settings

        def plan_task(task: Task, monitor: Monitor) -> Outcome:
            monitor.payload = task.payload_mass
            cell = self._starts.near(task, searched=False)
            plan = plan_kind(task, message.kind, model=self._model, solver=settings.solver(),
                             monitor=monitor, objectives=objectives_from_message(
                                 message, settings.controller()),
                             start_from=cell.motion.solution() if cell else None,
                             search=settings.search)
            report = report_from_plan(plan)
            if cell and plan.strategy == WARM_START:
                report.map_cell = cell.place
            return self._outcome(report, plan, settings, monitor)

        return self._conclude(plan_task, message, state)

    def find_max_payload(self, request: FindMaxPayload.Request, state: RequestState) -> Outcome:
        """
        Find the maximum payload, plan the motion with it, and record both.

        Parameters
        ----------
        request : FindMaxPayload.Request
            The request, or the goal of the action, which has the same fields.
        state : RequestState
            Its settings, progress and cancellation.

        """
        settings = state.settings

        def search_payload(task: Task, monitor: Monitor) -> Outcome:
            if objectives_from_message(request.task) is not None:
                raise InvalidTaskError('objectives such as max_joint_speeds cannot be combined '
                                       'with a search for the maximum payload: leave them out')
            if len(request.task.goal_orientation):
                raise InvalidTaskError('goal_orientation cannot be combined with a search for the '
                                       'maximum payload: another payload has another pose')
            options = search_options(request, settings)
            cell = self._starts.near(task, searched=True)
            found = find_max_payload(
                task, model=self._model, solver=settings.solver(), monitor=monitor,
                method=options.method, accuracy=options.accuracy, step=options.step,
                start_from=cell.motion.start() if cell else None, search=settings.search)
            report = report_from_search(found)
            if cell and found.warm:
                report.map_cell = cell.place
            outcome = self._outcome(report, found.plan, settings, monitor)
            return replace(outcome, search=search_message(found, options))

        return self._conclude(search_payload, request.task, state, search_without_result(request))

    @property
    def records_later(self) -> bool:
        """Return whether plans that replace others are recorded after the answer."""
        return self._late.ready

    def close(self, timeout: float) -> None:
        """Write what is to be recorded after its answer; what takes longer is lost [s]."""
        left = self._late.close(timeout)
        if left:
            _LOG.error('the planner ends, and the last %d recordings are not written', left)

    def abandon(self) -> None:
        """Remove what is left of a recording that another thread had no time to finish."""
        report = self._report_in_work
        path = Path(report.recording) if report and report.recording else None
        for stage in path.parent.glob(f'.{path.name}.*') if path else ():
            shutil.rmtree(stage, ignore_errors=True)

    def _conclude(self, work: Callable[[Task, Monitor], Outcome], message: MotionTask,
                  state: RequestState, search: PayloadSearch | None = None) -> Outcome:
        """Do the work of a request and record its outcome, with `search` where it failed."""
        measured: list[float] = []
        asked = message
        try:
            if state.withdrawn:  # while it waited: only to be recorded
                raise StoppedError(StopReason.CANCELED)
            state.report(replace(state.progress, phase='start'))
            if starts_at_arm(message):
                message = self._place(message, state)
                measured = list(message.start_positions)
            monitor = Monitor(time_limit=planning_time_limit(message, state.settings),
                              canceled=state.is_canceled, report=state.report)
            if message.replaces and search is None:
                message, outcome = self._replanner.plan(message, state.settings, monitor)
            else:
                outcome = self._plan_alone(work, message, state, monitor)
            if not outcome.replaces:
                _name_limit(outcome.report, monitor)
        except FlexPlannerError as error:
            outcome = failure_outcome(error_code(error), str(error))
        except StoppedError as error:
            outcome = failure_outcome(STOP_CODES[error.reason], state.reason or error.reason.value)
            if error.reason is StopReason.TIMEOUT:  # else it may come before there is a limit
                _name_limit(outcome.report, monitor)
        except Exception as error:
            _LOG.exception('planning failed')
            outcome = unknown_failure(error)
        outcome = replace(outcome, search=outcome.search or search)
        name_plan(outcome, state)
        outcome.report.measured_positions = measured
        add_space(outcome.report, asked)
        if message.publish:
            self.check_start(outcome, state)
        enter_times(outcome.report, state)
        return self._record(message, state, outcome)

    def _plan_alone(self, work: Callable[[Task, Monitor], Outcome], message: MotionTask,
                    state: RequestState, monitor: Monitor) -> Outcome:
        """Do the work of a request that replaces no plan."""
        if message.replaces:
            raise InvalidTaskError('replaces names a plan, but a search for the maximum payload '
                                   'replaces none: leave it out')
        check_alone(message)
        start_ns = time_ns(message.start_time)
        self._replanner.check_start_time(start_ns)
        task = task_from_message(message, self._model.arm, state.settings)
        outcome = work(task, monitor)
        if outcome.trajectory.points:
            outcome.report.start_time = message.start_time
        return replace(outcome, start_ns=start_ns)

    def _outcome(self, report: PlanReport, plan: Plan | None, settings: PlannerSettings,
                 monitor: Monitor) -> Outcome:
        """Return the outcome that a report tells of, with a trajectory if it is a success."""
        if plan is None or report.error_code != PlanReport.NONE:
            return Outcome(report=report, trajectory=FlexibleTrajectory(), plan=plan)
        reference = sample_plan(plan, settings.sampling(), monitor)
        judged = judge_execution(plan, reference)
        if not judged.solved:
            add_execution(report, reference)
            report.error_code = STATUS_CODES[judged.status]
            report.error_msg = say_reason(judged.status.value, judged.message)
            return Outcome(report=report, trajectory=FlexibleTrajectory(), plan=judged)
        reference = replace(reference, robustness=assess_robustness(
            plan, reference, monitor, uncertainty=self._uncertainty))
        trajectory = report_trajectory(report, plan, reference, settings)
        broken = trajectory_violations(trajectory.joint_trajectory, settings.joint_names)
        if broken:
            raise RuntimeError(f'the trajectory would be refused: {"; ".join(broken)}')
        return Outcome(report=report, trajectory=trajectory, plan=plan, reference=reference,
                       gains=self._find_gains(plan, settings, monitor))

    def _find_gains(self, plan: Plan, settings: PlannerSettings,
                    monitor: Monitor) -> FeedbackGains | None:
        """Return gains of feedback, None where they are not asked for or the motion has none."""
        if not settings.feedback_gains:
            return None
        errors, mass = self._uncertainty, float(plan.problem.parameters.payload_mass)
        try:
            return find_feedback_gains(plan, GainSettings(
                controller=settings.controller(), stiffness_error=errors.stiffness,
                payload_error=errors.payload_error(mass)), monitor)
        except FlexPlannerError as error:
            _LOG.warning('no gains of feedback: %s', error)
            return None

    def check_start(self, outcome: Outcome, state: RequestState) -> None:
        """Make an outcome a failure if its plan begins elsewhere than the arm, or too late."""
        report = outcome.report
        if outcome.plan is None or not outcome.publishable:
            return
        try:
            self._replanner.check(outcome)
            if self._arm_state is not None and not outcome.replaces:
                measured = self._arm_state.check(outcome.plan.task, state.settings, state.motion)
                report.measured_positions = measured or report.measured_positions
        except FlexPlannerError as error:
            report.error_code, report.error_msg = error_code(error), printable(str(error))

    def record_execution(self, message: MotionTask, state: RequestState,
                         report: PlanReport) -> None:
        """Record how a plan was carried out, and enter the recording into its report."""
        if not state.settings.record:
            return
        try:
            self._recorder.write_execution(message, state, report)
        except Exception as error:
            expected = isinstance(error, FlexPlannerError)
            _LOG.error('recording failed: %s', error, exc_info=not expected)
            report.execution_recording = ''
            sentence = f'the plan was carried out, but its outcome could not be recorded: {error}'
            _say_not_recorded(report, sentence, sentence, state)

    def _place(self, message: MotionTask, state: RequestState) -> MotionTask:
        """Return the task that starts where the arm is."""
        if self._arm_state is None:
            raise ArmStateError(PlanReport.ARM_STATE_UNKNOWN, 'nobody knows where the arm is')
        state.report(replace(state.progress, phase='looking where the arm is'))
        return with_start(message, self._arm_state.find_rest(state.settings, state.is_canceled))

    def _record(self, message: MotionTask, state: RequestState, outcome: Outcome) -> Outcome:
        """Record an outcome; one that cannot be recorded has a warning, or is a failure."""
        # a node that ends has no time to record what it gave up
        given_up = outcome.report.error_code == PlanReport.CANCELED and state.stopping()
        if not state.settings.record or given_up:
            return outcome
        if (outcome.replaces and outcome.publishable and message.publish
                and self.records_later and not state.settings.recording_required):
            return self._record_later(message, state, outcome)
        self._report_in_work = outcome.report
        try:
            path = self._recorder.write(message, state, outcome)
            self._late.recover()
        except Exception as error:
            expected = isinstance(error, FlexPlannerError)
            _LOG.error('recording failed: %s', error, exc_info=not expected)
            outcome.report.recording = ''
            _say_not_recorded(outcome.report, f'the plan could not be recorded: {error}',
                              f'the request could not be recorded: {error}', state)
            return outcome
        finally:
            self._report_in_work = None
        outcome.report.recording = printable(str(path))
        return outcome

    def _record_later(self, message: MotionTask, state: RequestState,
                      outcome: Outcome) -> Outcome:
        """Return an outcome that an arm in motion waits for, which is recorded afterwards."""
        place = self._recorder.find_place(state, outcome)
        # that the node ends does not keep it from being written
        patient = replace(state, stopping=lambda: False)

        def record() -> None:
            # what is entered later, such as how it was carried out, is recorded elsewhere
            known = replace(outcome, report=copy(outcome.report))
            self._late.add(lambda: self._recorder.write(message, patient, known, place))

        return replace(outcome, record=once(record))


def _say_not_recorded(report: PlanReport, failure: str, warning: str,
                      state: RequestState) -> None:
    """Add to a report that there is no recording, which may make it a failure."""
    required = state.settings.recording_required or state.stopping()
    if required and report.error_code == PlanReport.NONE:
        report.error_code = PlanReport.RECORDING_FAILED
        report.error_msg = printable(failure)
        return
    report.warning_kinds = [*report.warning_kinds, WarningKind.NOT_RECORDED.name]
    report.warnings = [*report.warnings, printable(warning)]


def _name_limit(report: PlanReport, monitor: Monitor) -> None:
    """Say which time limit was reached, if one was."""
    if report.error_code == PlanReport.TIMEOUT:
        report.error_msg += f'; allowed_planning_time is {monitor.time_limit:g} s'
