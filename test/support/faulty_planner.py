"""The planner node, where 13 kg, 17 kg, and publishing 2 s raise what nobody foresaw."""

from __future__ import annotations

from typing import Any

from flex_planner.optimal_control.task import Task
from flex_planner.planning.plan import Plan
from flex_planner.planning.sampling import SampledPlan
from flex_planner.ros.planner import node, plan_topics, request_planner

plan_kind, motion_markers = request_planner.plan_kind, plan_topics.motion_markers


def faulty_plan(task: Task, number: int, **options: Any) -> Plan:
    if task.payload_mass == 13:
        raise ZeroDivisionError('while planning')
    if task.payload_mass == 17:
        raise MemoryError
    return plan_kind(task, number, **options)


def faulty_markers(arm: Any, reference: SampledPlan, frame: str, *rest: Any) -> Any:
    if reference.times_ns[-1] > 1.5e9:
        raise KeyError('while publishing')
    return motion_markers(arm, reference, frame, *rest)


if __name__ == '__main__':
    request_planner.plan_kind = faulty_plan
    plan_topics.motion_markers = faulty_markers
    node.main()
