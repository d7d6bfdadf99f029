"""Requests that replace the plan that is carried out, without a node and by a clock of our own."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

from factories import PlanFactory
from flex_planner.base.errors import InvalidTaskError
from flex_planner.base.progress import Monitor
from flex_planner.planning.plan import Plan
from flex_planner.planning.sampling import sample_plan, SamplingSettings
from flex_planner.ros.messages.measured_states import AngleTrack, state_from_estimate
from flex_planner.ros.messages.request_error import RequestError
from flex_planner.ros.messages.times import time_message, time_ns
from flex_planner.ros.messages.trajectory_bytes import encode_joint_trajectory
from flex_planner.ros.planner.arm_bending import ArmBending
from flex_planner.ros.planner.outcome import Outcome
from flex_planner.ros.planner.replanner import Replanner
from flex_planner.ros.planner.running_plan import RunningPlan, RunningPlans, Track
from flex_planner.ros.settings.planner import PlannerSettings
from flex_planner_interfaces.msg import MotionTask, PlanReport
import numpy as np
import pytest
from sensor_msgs.msg import JointState

BEGIN = 1_700_000_000_000_000_000  # [ns]
JOINTS, MODES = ['joint1', 'joint2'], ['mode1', 'mode2', 'mode3', 'mode4']


def at(seconds: float) -> int:
    """Return a time of the clock after the begin of the plan [ns]."""
    return BEGIN + round(seconds * 1e9)


@pytest.fixture(scope='module')
def plan(plan_of: PlanFactory) -> Plan:
    return plan_of('ei50')


@pytest.fixture(scope='module')
def settings(plan: Plan) -> PlannerSettings:
    return PlannerSettings.for_arm(plan.arm)


@pytest.fixture(scope='module')
def first(plan: Plan) -> RunningPlan:
    reference = sample_plan(plan, SamplingSettings())
    track = Track.of(reference, BEGIN)
    return RunningPlan(plan_id='first', plan=plan, begin_ns=BEGIN, track=track)


@pytest.fixture
def running(first: RunningPlan) -> RunningPlans:
    plans = RunningPlans()
    plans.begin(first)
    return plans


def ask(plan: Plan, settings: PlannerSettings, running: RunningPlans, now: int,
        bending: ArmBending | None = None, **fields: Any) -> Outcome:
    """Return what a request leads to that wants the goal moved by 0.1 rad."""
    goal = (plan.problem.goal[:2] + 0.1).tolist()
    message = MotionTask(**{'replaces': 'first', 'goal_positions': goal, **fields})
    lazy = replace(settings, replan_lead=10.0)  # so that a busy machine is in time
    monitor = Monitor(time_limit=30.0)
    return Replanner(running, lambda: now, bending).plan(message, lazy, monitor)[1]


def test_new_plan_begins_on_the_one_before(plan: Plan, settings: PlannerSettings,
                                           running: RunningPlans, first: RunningPlan) -> None:
    outcome = ask(plan, settings, running, at(-10), start_time=time_message(at(0.3)),
                  torque_rate_weight=[1e-5])
    report, begin = outcome.report, outcome.trajectory.joint_trajectory.points[0]
    assert (report.error_code, report.continuation, report.bending_source) == (
        PlanReport.NONE, 'REPLANNED', 'PLAN')
    assert time_ns(report.start_time) == outcome.start_ns == at(0.3)
    assert report.replaced_plan == 'first'
    there = plan.sample(0.3)
    np.testing.assert_allclose(begin.positions, there.coordinates[0, :2], rtol=0, atol=1e-9)
    np.testing.assert_allclose(begin.velocities, there.rates[0, :2], rtol=0, atol=1e-9)
    np.testing.assert_allclose(begin.effort, there.torques[0], rtol=0, atol=1e-6)
    np.testing.assert_allclose(report.torque_step, 0.0, atol=1e-9)


def test_published_trajectory_has_the_rest_of_the_plan_before_it(
        plan: Plan, settings: PlannerSettings, running: RunningPlans, first: RunningPlan) -> None:
    outcome = ask(plan, settings, running, at(-10), start_time=time_message(at(0.3)))
    whole = first.replaced_by(outcome, at(0.25))
    shown = whole.part(at(0.25))
    message = shown.trajectory(JOINTS)
    assert shown.encoded(JOINTS) == encode_joint_trajectory(message)
    begin = time_ns(message.header.stamp)
    assert at(0.24) < begin <= at(0.25) and whole.begin_ns <= at(0.01)
    times = np.array([point.time_from_start.sec * 10**9 + point.time_from_start.nanosec
                      for point in message.points])
    assert times[0] == 0 and (np.diff(times) > 0).all()
    assert np.array_equal(times, shown.times_ns)
    old = begin + times < at(0.3)
    assert old.sum() > 4 and begin + times[old][-1] == at(0.3) - 1000
    there = plan.sample((begin + times[old] - BEGIN) * 1e-9)
    positions = np.array([point.positions for point in message.points])
    np.testing.assert_allclose(positions[old], there.coordinates[:, :2], rtol=0, atol=1e-8)
    assert len(positions[~old]) == len(outcome.trajectory.joint_trajectory.points)
    goal = outcome.plan
    assert goal is not None
    np.testing.assert_allclose(positions[-1], goal.problem.goal[:2], atol=1e-12)


def test_plans_are_replaced_one_after_another(plan: Plan, settings: PlannerSettings,
                                              running: RunningPlans, first: RunningPlan) -> None:
    outcome = ask(plan, settings, running, at(-10), start_time=time_message(at(0.2)))
    assert outcome.plan is not None
    second = RunningPlan(plan_id='second', plan=outcome.plan, begin_ns=at(0.2),
                         track=first.replaced_by(outcome, at(0.1)))
    running.begin(second)
    again = ask(plan, settings, running, at(-9), start_time=time_message(at(0.5)),
                replaces='second')
    begin = again.trajectory.joint_trajectory.points[0]
    np.testing.assert_allclose(begin.positions, second.plan.sample(0.3).coordinates[0, :2],
                               rtol=0, atol=1e-9)
    track = second.replaced_by(again, at(0.35))
    assert track.begin_ns <= at(0.06)  # of what was before, as much as an observer needs
    assert (np.diff(track.times_ns) > 0).all()
    for stale in ('first', 'third'):
        with pytest.raises(InvalidTaskError, match=f"replaces is '{stale}', but the plan that was "
                           'published last is second'):
            ask(plan, settings, running, at(0.4), replaces=stale)
    running.drop('first')  # ended long ago
    running.drop('second')
    with pytest.raises(InvalidTaskError, match='but no plan is carried out'):
        ask(plan, settings, running, at(0.4), replaces='second')


def test_times_that_are_over_are_refused(plan: Plan, settings: PlannerSettings,
                                         running: RunningPlans) -> None:
    with pytest.raises(RequestError, match='start_time is 0.1 s ago') as caught:
        ask(plan, settings, running, at(0.4), start_time=time_message(at(0.3)))
    assert caught.value.code == PlanReport.START_TIME_PASSED
    with pytest.raises(InvalidTaskError, match='start_time is 1.5 s after the begin of the plan'):
        ask(plan, settings, running, at(0.4), start_time=time_message(at(1.5)))
    clock = [at(-10)]
    planner = Replanner(running, lambda: clock[0])
    outcome = ask(plan, settings, running, at(-10), start_time=time_message(at(0.3)))
    planner.check(outcome)
    clock[0] = at(0.31)  # it took too long
    with pytest.raises(RequestError, match='start_time is 0.01 s ago'):
        planner.check(outcome)


@pytest.mark.parametrize(('fields', 'code', 'course'), [
    ({'keep_time': True}, PlanReport.LIMIT_VIOLATED, 'GOES_ON'),
    ({'keep_time': True, 'on_failure': MotionTask.STOP}, PlanReport.STOPS, 'STOPS'),
    ({}, PlanReport.NONE, 'LATER')])
def test_goal_that_is_too_far_is_told_with_what_happens_instead(
        plan: Plan, settings: PlannerSettings, running: RunningPlans, fields: dict[str, Any],
        code: int, course: str) -> None:
    far = (plan.problem.goal[:2] + [0.5, -0.5]).tolist()
    outcome = ask(plan, settings, running, at(-10), start_time=time_message(at(0.5)),
                  goal_positions=far, torque_rate_weight=[1e-5], **fields)
    report = outcome.report
    assert (report.error_code, report.continuation) == (code, course)
    assert outcome.publishable == (course != 'GOES_ON') == bool(outcome.trajectory.points)
    assert report.continuation_reason
    assert (report.arrival_delay > 0.1) == (course == 'LATER')
    if course == 'GOES_ON':
        assert report.error_msg.endswith('; the plan before goes on')
    assert running.take('first').plan is plan


# How the arm is bent


def estimate(plan: Plan, time: float, bent: float = 0.0) -> JointState:
    sample = plan.sample(time)
    position, velocity = sample.coordinates[0].copy(), sample.rates[0]
    position[2] += bent
    message = JointState(name=[*MODES, *JOINTS], position=np.roll(position, -2).tolist(),
                         velocity=np.roll(velocity, -2).tolist())
    message.header.stamp = time_message(at(time))
    return message


def bending_of(message: JointState | None, angles: AngleTrack | None = None) -> ArmBending:
    return ArmBending('/planner/state_estimate', [*JOINTS, *MODES], angles or AngleTrack(JOINTS),
                      lambda: message)


def test_estimate_of_the_bending_is_carried_on_to_the_start(
        plan: Plan, settings: PlannerSettings, running: RunningPlans, first: RunningPlan) -> None:
    bending = bending_of(estimate(plan, 0.29, 2e-3))
    found = bending.find(first, at(0.3), at(0.29), settings)
    assert found.source == 'ESTIMATE'
    assert 1e-4 < abs(found.off[2]) < 4e-3
    message = MotionTask(replaces='first', goal_positions=plan.problem.goal[:2].tolist(),
                         start_time=time_message(at(0.3)))
    outcome = Replanner(running, lambda: at(0.29), bending).plan(
        message, replace(settings, state_estimate_timeout=1.0), Monitor())[1]
    assert outcome.report.bending_source == 'ESTIMATE'
    np.testing.assert_allclose(outcome.report.bending_error[:4], found.off[2:6], atol=1e-12)
    new = outcome.plan
    assert new is not None
    there = plan.sample(0.3).coordinates[0]
    np.testing.assert_allclose(new.problem.start[2:6], there[2:] + found.off[2:6], atol=1e-12)
    np.testing.assert_allclose(new.problem.start[:2], there[:2], atol=1e-12)


def test_estimates_that_are_old_give_way_to_the_angles_of_joint_states(
        plan: Plan, settings: PlannerSettings, first: RunningPlan) -> None:
    angles = AngleTrack(JOINTS)
    for time in np.arange(0.1, 0.3, 0.002):
        message = estimate(plan, float(time))
        angles.hear(JointState(header=message.header, name=['gripper', *JOINTS],
                               position=[0.1, *message.position[4:]]))
    old = estimate(plan, 0.05, 2e-3)
    assert bending_of(old, angles).find(first, at(0.35), at(0.3), settings).source == 'OBSERVER'
    assert bending_of(old).find(first, at(0.35), at(0.3), settings).source == 'PLAN'
    late = bending_of(old, angles).find(first, at(0.95), at(0.9), settings)
    assert late.source == 'PLAN' and not late.off.any()


def test_arm_that_is_not_on_the_plan_is_no_place_to_begin(plan: Plan, settings: PlannerSettings,
                                                          first: RunningPlan) -> None:
    message = estimate(plan, 0.29)
    message.position[4] += 0.2
    with pytest.raises(RequestError, match=r'joint1 is 0\.\d+ rad from the plan') as caught:
        bending_of(message).find(first, at(0.295), at(0.29), settings)
    assert caught.value.code == PlanReport.NOT_AT_START
    free = replace(settings, check_start=False)
    assert bending_of(message).find(first, at(0.295), at(0.29), free).source == 'ESTIMATE'


@pytest.mark.parametrize(('changes', 'sentence'), [
    ({'name': ['joint1']}, 'does not name joint2, mode1'),
    ({'velocity': []}, 'has not one position and one velocity per name'),
    ({'position': [np.nan] * 6}, 'has nan among its numbers')])
def test_estimates_that_say_too_little_are_refused(plan: Plan, changes: dict[str, Any],
                                                   sentence: str) -> None:
    message = estimate(plan, 0.2)
    for name, value in changes.items():
        setattr(message, name, value)
    with pytest.raises(RequestError, match=f'the estimate on /topic {sentence}') as caught:
        state_from_estimate(message, [*JOINTS, *MODES], '/topic')
    assert caught.value.code == PlanReport.ARM_STATE_UNKNOWN


def test_angles_are_kept_by_their_stamps_and_not_for_long(plan: Plan) -> None:
    track = AngleTrack(JOINTS)
    track.hear(JointState(name=JOINTS, position=[0.0, 0.0]))  # no stamp
    for time in np.arange(0.0, 0.6, 0.001):
        track.hear(estimate(plan, float(time)))
    stamps, angles = track.since(0)
    assert stamps[0] >= at(0.349 - 0.005) and stamps[-1] >= at(0.594)
    assert np.diff(stamps).min() >= 4_000_000
    np.testing.assert_allclose(angles, plan.sample((stamps - BEGIN) * 1e-9).coordinates[:, :2],
                               rtol=0, atol=1e-12)
    assert len(track.since(at(0.5))[0]) < len(stamps)
    track.hear(estimate(plan, 0.1))  # the clock was set back
    assert track.since(0)[0].tolist() == [at(0.1)]
