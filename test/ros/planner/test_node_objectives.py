"""Objectives over ROS: from the fields of a request to weights, codes and reports."""

from __future__ import annotations

import math
from typing import Any

from flex_planner.ros.planner.outcome import Outcome
from flex_planner.ros.planner.request_planner import RequestPlanner
from flex_planner.ros.planner.request_state import RequestState
from flex_planner.ros.settings.planner import PlannerSettings
from flex_planner_interfaces.msg import PlanReport
import pytest
from ros_support import search_request, task

inf = math.inf


def plan_task(worker: RequestPlanner, settings: PlannerSettings, **fields: Any) -> Outcome:
    return worker.plan(task(**fields), RequestState(settings=settings))


def test_request_with_a_speed_limit_gets_the_weights_that_keep_it(
        worker: RequestPlanner, settings: PlannerSettings) -> None:
    outcome = plan_task(worker, settings, max_joint_speeds=[0.8, 0.8])
    report = outcome.report
    assert report.error_code == PlanReport.NONE, report.error_msg
    assert 0.79 < max(report.peak_speeds) <= 0.8
    # condition (II): the last adequate weight is within 1 % of one that is too small
    tried = dict(zip(report.tried_weights, report.tried_shares, strict=True))
    weight = report.velocity_weights[0]
    assert weight == report.velocity_weights[1] == min(w for w, s in tried.items() if s <= 1)
    assert weight <= 1.01 * max(w for w, s in tried.items() if s > 1)
    assert set(report.tried_objectives) == {'joint speeds'}
    assert outcome.trajectory.points


def test_request_without_objectives_keeps_its_weights(worker: RequestPlanner,
                                                      settings: PlannerSettings) -> None:
    report = plan_task(worker, settings, velocity_weights=[1.0, 2.0]).report
    assert list(report.velocity_weights) == [1.0, 2.0]
    assert not report.tried_weights


def test_limit_that_cannot_be_kept_is_an_error_without_a_trajectory(
        worker: RequestPlanner, settings: PlannerSettings) -> None:
    outcome = plan_task(worker, settings, max_joint_speeds=[0.5, inf])
    assert outcome.report.error_code == PlanReport.OBJECTIVE_NOT_MET
    assert 'joint 1 reaches 0.55' in outcome.report.error_msg
    assert 'must be <= 0.5' in outcome.report.error_msg
    assert not outcome.trajectory.points
    assert not outcome.publishable
    assert min(outcome.report.tried_shares) > 1


@pytest.mark.parametrize(('fields', 'code', 'text'), [
    ({'max_joint_speeds': [0.8]}, PlanReport.INVALID_SIZE,
     'max_joint_speeds has 1 entries, but must be a list of 2 numbers'),
    ({'max_torque_shares': [0.5, 0.0]}, PlanReport.OUT_OF_RANGE,
     'max_torque_shares[1] is 0.0, but must be > 0, or inf for no limit'),
    ({'max_joint_speeds': [math.nan, 1.0]}, PlanReport.NOT_FINITE,
     'max_joint_speeds[0] is nan, but must be > 0, or inf for no limit'),
    ({'max_modal_rates': [0.1]}, PlanReport.INVALID_SIZE,
     'max_modal_rates has 1 entries, but must be empty: the links are rigid')])
def test_limits_that_make_no_sense_are_refused(
        worker: RequestPlanner, settings: PlannerSettings, fields: dict[str, Any], code: int,
        text: str) -> None:
    outcome = plan_task(worker, settings, **fields)
    assert (outcome.report.error_code, outcome.report.error_msg) == (code, text)


def test_search_for_the_maximum_payload_takes_no_objectives(worker: RequestPlanner,
                                                            settings: PlannerSettings) -> None:
    request = search_request()
    request.task.max_joint_speeds = [0.8, 0.8]
    outcome = worker.find_max_payload(request, RequestState(settings=settings))
    assert outcome.report.error_code == PlanReport.INVALID_TASK
    assert 'cannot be combined with a search for the maximum payload' in outcome.report.error_msg
