"""What is said of payloads that no motion, or none that was found, carries."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
import math
from typing import Any

from flex_planner.arms.arm import Arm, Joint, Link, Motor, Node
from flex_planner.base.progress import Monitor
from flex_planner.capacity import incremental, payload_methods
from flex_planner.capacity.incremental import PayloadTrial
from flex_planner.capacity.max_payload import find_max_payload
from flex_planner.capacity.results import MaxPayload, PayloadMethod
from flex_planner.collocation import CollocationSolution
from flex_planner.optimal_control.motion_problem import MotionProblem
from flex_planner.optimal_control.task import Task
from flex_planner.planning.plan import PlanStatus
from flex_planner.planning.plan_path import plan_path
from known_limits import G, lifted_to, one_link
from payload_searches import raised
import pytest


def counterweight(payload_mass: float) -> Task:
    """Return a motion near a fold: the payload hangs behind the base and balances the elbow."""
    links = (Link(length=0.3, linear_density=4.0), Link(length=0.8, linear_density=0.5))
    arm = Arm(name='counterweight', links=links, gravity=[0, -G],
              joints=tuple(Joint(motor=Motor(stall_torque=torque)) for torque in (1.5, 30.0)),
              nodes=(Node(), Node(mass=2.0), Node()))
    return Task(arm=arm, start_positions=[0.0, math.pi], goal_positions=[0.1, math.pi - 0.1],
                duration=2.0, payload_mass=payload_mass)


@pytest.mark.parametrize('method', PayloadMethod)
def test_payload_that_is_too_light_proves_nothing_of_more(method: PayloadMethod) -> None:
    found = find_max_payload(counterweight(0.0), method=method)
    assert found.status is PlanStatus.INFEASIBLE
    assert found.message.startswith('joint 1 needs 7.215 N m to hold the arm')
    assert plan_path(counterweight(1.5), search='fast').solved
    # 2 kg need 2.6 N m the other way
    assert 1.5 < found.proved_upper < 2.0
    assert str(found.proof).startswith('joint 1 can hold no more than')


def test_bound_of_a_payload_that_is_too_heavy_is_what_can_be_held() -> None:
    found = find_max_payload(lifted_to(0.0, 2.0, payload_mass=1.0))
    assert found.status is PlanStatus.INFEASIBLE
    # but for the millionth that is given away
    assert found.proved_upper == pytest.approx(6 / G - 0.15, rel=1.1e-6)


@pytest.fixture(scope='module')
def stuck() -> MaxPayload:
    """Return a search where Newton's method fails far below the limit (random counter-example)."""
    links = (Link(length=0.8858061165531077, linear_density=0.37809465423099137),
             Link(length=0.8938447609820841, linear_density=0.24130049094195077))
    motors = Motor(stall_torque=139.43811), Motor(stall_torque=58.572479, no_load_speed=21.642611)
    arm = Arm(name='stuck', links=links, gravity=[0, -G], nodes=(Node(mass=0.4), Node(), Node()),
              joints=(Joint(motor=motors[0]), Joint(motor=motors[1], viscous_friction=0.8198349)))
    posture = [-1.53905253, 0.50591633]
    task = Task(arm=arm, start_positions=posture, goal_positions=posture, duration=0.81113877,
                payload_mass=2.4792693823528213, effort_weights=[0.12238989, 0.29529353],
                position_weights=[0.01944693, 3.13589655],
                velocity_weights=[0.05207831, 3.34062714])
    found: MaxPayload = raised(task, step=0.55, accuracy=0.05, monitor=Monitor(time_limit=60))
    return found


def test_payload_that_failed_is_tried_again_from_one_so_near(stuck: MaxPayload) -> None:
    solved = [trial.payload for trial in stuck.trials if trial.solved]
    failed = [trial.payload for trial in stuck.trials if not trial.solved]
    assert min(failed) in solved
    # from 2.5 kg on to nearly all that the motors hold at the goal
    assert stuck.solved, stuck.message
    assert stuck.held
    assert 0 < stuck.local_upper - stuck.payload <= 0.05
    assert stuck.local_upper == pytest.approx(stuck.proved_upper, rel=1.1e-6)
    assert stuck.message.endswith('kg at the goal: no motion carries more')


def test_failure_of_newtons_method_is_no_limit_of_the_motors(
        monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr('flex_planner.capacity.incremental._try_payload', fail_above(1.05))
    found = raised(one_link(2.0, payload_mass=1.0), step=0.04, accuracy=0.04)
    assert found.plan is not None
    assert found.plan.saturation.max() == 0
    assert found.status is PlanStatus.NOT_CONVERGED
    assert found.message == (
        'no motion with 0.02 kg more was found, but the motors are not on their limits: another '
        'method or first step may find more (1.04 kg are certified)')


def fail_above(most: float) -> Callable[..., PayloadTrial | None]:
    """Return a trial that knows no motion above a payload."""
    real = incremental._try_payload

    def attempt(problem: MotionProblem, start: CollocationSolution, payload: float,
                *others: Any, **options: Any) -> PayloadTrial | None:
        trial = real(problem, start, payload, *others, **options)
        return trial if trial is None or payload < most else replace(trial, solved=False)

    return attempt


def test_incremental_search_does_not_say_that_a_kind_of_motion_ends() -> None:
    found = raised(one_link(2.0), step=4.0, accuracy=1.0)
    assert found.solved
    assert f'no motion was found with {found.local_upper:.6g} kg: the motor' in found.message


@pytest.mark.parametrize(('ended', 'status', 'payload'), [
    (PlanStatus.NOT_CONVERGED, PlanStatus.NOT_CONVERGED, 1.0),
    (PlanStatus.TIMEOUT, PlanStatus.TIMEOUT, 1.0),
    (PlanStatus.CANCELED, PlanStatus.CANCELED, 0.0),
    (PlanStatus.SOLVED, PlanStatus.SOLVED, 0.5)])
def test_payload_that_was_certified_is_kept_where_a_search_ends_with_less(
        monkeypatch: pytest.MonkeyPatch, ended: PlanStatus, status: PlanStatus,
        payload: float) -> None:
    task = one_link(2.5)
    known = MaxPayload(
        task=task, method=PayloadMethod.DIRECT, status=PlanStatus.NOT_CONVERGED, payload=1.0,
        plan=plan_path(replace(task, payload_mass=1.0), search='fast'), within_limits=True,
        message='1 kg can be carried')
    monkeypatch.setattr(payload_methods, '_find_at_once', lambda *given: (
        payload_methods._AtOnce(certified=known)))
    monkeypatch.setattr(payload_methods, '_follow', lambda *given: replace(
        known, status=ended, within_limits=False, message='ended', plan=None,
        payload=0.0 if ended is PlanStatus.CANCELED else 0.5))
    found = find_max_payload(task)
    assert (found.status, found.payload) == (status, payload)
    assert (found.plan is known.plan) == (payload == 1.0)
    assert ('1 kg can be carried' in found.message) == (payload == 1.0)
