"""The outcome of a request, as it is answered, published and recorded."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from flex_planner.base.progress import StopReason
from flex_planner.planning.feedback.gains import FeedbackGains
from flex_planner.planning.plan import Plan
from flex_planner.planning.sampling import SampledPlan
from flex_planner.ros.messages.classes import FlexibleTrajectory, PayloadSearch, PlanReport
from flex_planner.ros.messages.plans import duration_message, failure_report
from flex_planner.ros.messages.times import time_message
from flex_planner.ros.planner.request_state import RequestState


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Outcome:
    """
    The outcome of a request.

    Attributes
    ----------
    report : PlanReport
        Always filled.
    trajectory : FlexibleTrajectory
        Empty unless there is a plan.
    plan, reference : Plan, SampledPlan or None
        What the trajectory was made of.
    gains : FeedbackGains or None
        Of feedback along the trajectory, where they are asked for.
    search : PayloadSearch or None
        Result of a search for the maximum payload.
    start_ns : int
        When the motion begins, by the clock of the node; 0: when it is published [ns].
    replaces : str
        Identifier of the plan that it replaces; empty if it is a motion of its own.
    record : callable or None
        Has it recorded, once it is published; None where that is done.

    """

    report: PlanReport
    trajectory: FlexibleTrajectory
    plan: Plan | None = None
    reference: SampledPlan | None = None
    gains: FeedbackGains | None = None
    search: PayloadSearch | None = None
    start_ns: int = 0
    replaces: str = ''
    record: Callable[[], None] | None = None

    @property
    def publishable(self) -> bool:
        """Whether a controller may have the trajectory: a success, or a stop."""
        return self.report.error_code in (PlanReport.NONE, PlanReport.STOPS)


def failure_outcome(code: int, sentence: str) -> Outcome:
    """Return the outcome of a request that failed."""
    return Outcome(report=failure_report(code, sentence), trajectory=FlexibleTrajectory())


def unknown_failure(error: Exception) -> Outcome:
    """Return the outcome of an unexpected exception."""
    return failure_outcome(PlanReport.UNKNOWN, f'{type(error).__name__}: {error}')


def canceled_outcome(state: RequestState) -> Outcome:
    """Return the outcome of a request that is given up."""
    outcome = failure_outcome(PlanReport.CANCELED, state.reason or StopReason.CANCELED.value)
    enter_times(outcome.report, state)
    return outcome


def enter_times(report: PlanReport, state: RequestState) -> None:
    """Enter how long a request took until now, and how much of that it waited."""
    report.planning_time = duration_message(state.elapsed_ns)
    report.waiting_time = duration_message(state.waited_ns)


def name_plan(outcome: Outcome, state: RequestState) -> None:
    """Give a plan with a trajectory its identifier, and the trajectory the time of its start."""
    if not outcome.trajectory.points:
        return
    plan_id = f'plan_{state.stamp_ns}_{state.accepted_ns}'
    outcome.report.plan_id = state.plan_id = plan_id
    stamp = time_message(outcome.start_ns)
    outcome.trajectory.header.stamp = stamp
    outcome.trajectory.joint_trajectory.header.stamp = stamp


def busy_outcome(reason: str) -> Outcome:
    """Return the outcome of a request that finds no room in the queue."""
    return failure_outcome(PlanReport.BUSY, reason)
