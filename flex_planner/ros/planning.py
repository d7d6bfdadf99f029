"""From a request message to an outcome: the part of the node that runs in the worker thread."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
import logging
import time

from flex_planner.errors import FlexPlannerError
from flex_planner.model import ArmModel
from flex_planner.path import plan_path
from flex_planner.plan import Plan
from flex_planner.progress import Monitor, StoppedError
from flex_planner.reference import Reference, sample_reference
from flex_planner.ros.conversions import (
    add_reference,
    duration_message,
    error_code,
    failure_report,
    flexible_trajectory,
    joint_trajectory,
    planning_time_limit,
    report_from_plan,
    STOP_CODES,
    task_from_message,
)
from flex_planner.ros.recorder import OutcomeRecorder
from flex_planner.ros.settings import PlannerSettings
from flex_planner.trajectory_rules import trajectory_violations
from flex_planner_interfaces.msg import FlexibleTrajectory, MotionTask, PlanReport

_LOG = logging.getLogger(__name__)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Outcome:
    """
    What a request led to.

    Attributes
    ----------
    report : PlanReport
        Always filled.
    trajectory : FlexibleTrajectory
        Empty unless there is a plan.
    plan, reference : Plan, Reference or None
        What the trajectory was made of.

    """

    report: PlanReport
    trajectory: FlexibleTrajectory
    plan: Plan | None = None
    reference: Reference | None = None

    @property
    def publishable(self) -> bool:
        """Whether a controller may have the trajectory."""
        return bool(self.report.error_code == PlanReport.NONE)


class Planning:
    """
    Plans requests for one arm; never raises.

    Parameters
    ----------
    model : ArmModel
        The arm.
    recorder : OutcomeRecorder
        Where outcomes are kept.

    """

    def __init__(self, model: ArmModel, recorder: OutcomeRecorder) -> None:
        self._model, self._recorder = model, recorder

    def plan(self, message: MotionTask, settings: PlannerSettings,
             canceled: Callable[[], bool], waited_ns: int = 0) -> Outcome:
        """
        Plan a request and record it with its outcome.

        Parameters
        ----------
        message : MotionTask
            The request.
        settings : PlannerSettings
            Parameters when it arrived.
        canceled : callable
            Returns True once planning should stop.
        waited_ns : int
            How long ago the request was accepted [ns].

        """
        accepted, stamp = time.monotonic_ns() - waited_ns, time.time_ns() - waited_ns
        try:
            outcome = self._planned(message, settings, canceled)
        except FlexPlannerError as error:
            outcome = _failure(error_code(error), str(error))
        except StoppedError as stop:
            outcome = _failure(STOP_CODES[stop.reason], stop.reason.value)
        except Exception as error:
            _LOG.exception('planning failed')
            outcome = unknown_failure(error)
        outcome.report.planning_time = duration_message(time.monotonic_ns() - accepted)
        return self._recorded(message, settings, outcome, stamp, canceled)

    def _planned(self, message: MotionTask, settings: PlannerSettings,
                 canceled: Callable[[], bool]) -> Outcome:
        """Plan a request; errors are exceptions."""
        task = task_from_message(message, self._model.arm, settings)
        monitor = Monitor(time_limit=planning_time_limit(message, settings), canceled=canceled)
        plan = plan_path(task, model=self._model, settings=settings.solver(), monitor=monitor)
        report = report_from_plan(plan)
        if not plan.solved:
            return Outcome(report=report, trajectory=FlexibleTrajectory(), plan=plan)
        reference = sample_reference(plan, settings.sampling(), monitor)
        add_reference(report, plan, reference)
        joints = joint_trajectory(reference, settings.joint_names)
        broken = trajectory_violations(joints, settings.joint_names)
        if broken:
            raise RuntimeError(f'the trajectory would be refused: {"; ".join(broken)}')
        trajectory = flexible_trajectory(plan, reference, joints, settings.base_frame)
        return Outcome(report=report, trajectory=trajectory, plan=plan, reference=reference)

    def _recorded(self, message: MotionTask, settings: PlannerSettings, outcome: Outcome,
                  stamp: int, canceled: Callable[[], bool]) -> Outcome:
        """Record an outcome; a plan that cannot be recorded is a failure with a trajectory."""
        if not settings.record:
            return outcome
        try:
            path = self._recorder.write(
                settings, stamp, message, outcome.report, outcome.trajectory, outcome.plan,
                outcome.reference, canceled)
        except Exception as error:
            foreseen = isinstance(error, FlexPlannerError)
            _LOG.error('recording failed: %s', error, exc_info=not foreseen)
            outcome.report.recording = ''
            if outcome.report.error_code != PlanReport.NONE:
                return outcome
            outcome.report.error_code = PlanReport.RECORDING_FAILED
            outcome.report.error_msg = f'the plan could not be recorded: {error}'
            return outcome
        outcome.report.recording = str(path)
        return outcome


def _failure(code: int, sentence: str) -> Outcome:
    return Outcome(report=failure_report(code, sentence), trajectory=FlexibleTrajectory())


def unknown_failure(error: Exception) -> Outcome:
    """Return the outcome of an exception that nobody foresaw."""
    return _failure(PlanReport.UNKNOWN, f'{type(error).__name__}: {error}')


def busy(queue_length: int) -> Outcome:
    """Return the outcome of a request that finds the queue full."""
    return _failure(PlanReport.BUSY, f'{queue_length} requests are waiting already; '
                                     'the parameter queue_length allows no more')
