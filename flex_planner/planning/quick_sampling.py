"""Samples of a plan that is needed at once: looked at by one simulation, not by many."""

from __future__ import annotations

from dataclasses import replace

from flex_planner.base.progress import Monitor
from flex_planner.control.held_periods import HeldPeriods
from flex_planner.optimal_control.constrained_motion import way_slacks_of
from flex_planner.planning.executed_limits import find_executed_slack
from flex_planner.planning.execution import Execution, ExecutionCertificate
from flex_planner.planning.plan import Plan
from flex_planner.planning.point_times import point_times
from flex_planner.planning.sampling import SampledPlan, SamplingSettings, take_samples


def sample_quickly(plan: Plan, settings: SamplingSettings,
                   monitor: Monitor | None = None) -> SampledPlan:
    """
    Return samples of a solved plan that ends at rest, and what its controller makes of them.

    They are as close as the torque tolerance says, and no closer: where the arm arrives with them
    is found out, and not compared with infinitely many. Of the `execution` only tip error,
    residual vibration and limits on the way are known. There is no `start_hold`.

    Parameters
    ----------
    plan : Plan
        With a solution.
    settings : SamplingSettings
        Of the samples and the controller.
    monitor : Monitor, optional
        May stop it.

    Raises
    ------
    StoppedError
        If the monitor stopped it.

    """
    watch, controller = monitor or Monitor(), settings.controller_of(plan)
    motion = settings.motion_of(plan)
    sampled = take_samples(motion, controller, *point_times(
        motion, settings.longest_step, settings.torque_tolerance, watch))
    execution = Execution.of(plan, controller)
    # in a fraction of the time of `Execution.carry_out`, and 1e-4 mm from it at the arrival
    carried_out = HeldPeriods(sampled.reference, controller, execution.duration).follow(
        execution.arm, execution.start, watch)
    arrived = carried_out.states[-1]
    return replace(sampled, execution=ExecutionCertificate(
        controller=controller, tip_error=execution.tip_error(arrived),
        residual_vibration=execution.vibration(arrived),
        limits=find_executed_slack(way_slacks_of(plan.problem), carried_out)))
