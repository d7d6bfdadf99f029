"""Limits of counter-examples, where a straight start does not lead to the best kind of motion."""

from __future__ import annotations

from dataclasses import replace
from functools import cache
from typing import Any

from counter_examples import HEAVIEST, level_arm, level_task
from flex_planner.base.errors import InvalidTaskError, NoEquilibriumError
from flex_planner.capacity import limit_search, payload_outcome
from flex_planner.capacity.limit_search import LimitSearch
from flex_planner.capacity.max_payload import find_max_payload
from flex_planner.capacity.min_duration import find_min_duration
from flex_planner.capacity.results import MaxPayload, PayloadMethod
from flex_planner.planning.kinds.clusters import kind_of
from flex_planner.planning.plan import Plan, PlanStatus
from flex_planner.planning.plan_problem import plan_problem
from flex_planner.planning.proofs import PayloadBound, Proof, ProofName
from known_limits import lifted_to, one_link
import numpy as np
from payload_searches import followed
import pytest

# R = 1 and R = 1 / stall torque^2
WEIGHTS = {
    name: ([1.0, 1.0], [1 / joint.motor.stall_torque**2 for joint in level_arm(name).joints])
    for name in HEAVIEST}
ACCURACY = 1e-3
# how the best motion moves
SWINGS = {'S1': 'joint 1 goes 29 deg too far and returns', 'S12': 'joint 2 swings back ',
          'S17': 'joint 2 goes 78 deg too far and returns; joint 1 swings back '}


@cache
def heaviest(name: str, weights: int) -> MaxPayload:
    """Return the largest payload, by the first or the second of the weights."""
    task = level_task(name, effort_weights=WEIGHTS[name][weights])
    return find_max_payload(task, accuracy=ACCURACY)


@pytest.mark.parametrize('name', HEAVIEST)
def test_largest_payload_is_that_of_the_best_kind_whatever_the_weights(name: str) -> None:
    found = [heaviest(name, weights) for weights in range(2)]
    for each in found:
        assert each.solved, each.message
        # half the last digit
        digit = 0.005 if name == 'S1' else 0.0005
        assert each.payload == pytest.approx(HEAVIEST[name], abs=digit + ACCURACY)
        assert 0 <= each.local_upper - each.payload <= ACCURACY
        assert each.kinds[0].sentence.startswith(SWINGS[name])
        assert_certified(each)
    assert found[0].payload == pytest.approx(found[1].payload, abs=ACCURACY)


def assert_certified(found: MaxPayload) -> None:
    assert found.plan is not None
    assert (found.plan.solved, found.plan.task.payload_mass) == (True, found.payload)
    assert (found.starts, len(found.kinds) >= 1) == (16, True)
    # values of the kinds are met at a finite price
    assert 0.98 * found.payload < found.kinds[0].value <= found.payload
    assert all(np.diff([kind.value for kind in found.kinds]) < 0)
    assert sum(kind.met for kind in found.kinds) <= found.starts


def test_search_along_one_kind_ends_at_the_end_of_that_kind_and_says_so() -> None:
    found = followed(level_task('S12'))
    assert found.solved, found.message
    assert found.local_upper < 1.13 < HEAVIEST['S12']
    assert (found.kinds, found.starts) == ((), 0)
    assert f'certified; this kind of motion ends at {found.local_upper:.6g} kg' in found.message
    # nothing is said about others
    assert found.proved_upper > HEAVIEST['S12']
    assert 'cannot' not in found.message


def test_message_tells_among_which_kinds_it_is_the_best() -> None:
    found = heaviest('S12', 1)
    assert len(found.kinds) >= 2
    assert found.message.startswith(
        f'{found.payload:.6g} kg can be carried, certified, the best of {len(found.kinds)} kinds '
        f'of motion found from 16 starts; this kind of motion ends at {found.local_upper:.6g} kg: '
        'the motor of joint 2 is on its limit for ')


def test_shortest_duration_is_that_of_the_best_kind() -> None:
    # the same front from its other side: 1.9744 kg take 1.65 s
    task = level_task('S12', 1.9744, duration=3.0)
    found = find_min_duration(task)
    assert found.solved, found.message
    assert found.local_lower <= 1.65 <= found.duration + 1e-3
    assert found.duration == pytest.approx(1.65, abs=1e-3)
    assert found.kinds[0].sentence.startswith('joint 2 swings back ')
    assert found.starts == 16
    assert 0 < found.proved_lower < found.local_lower


def test_better_kind_that_newtons_method_does_not_reach_is_told(
        monkeypatch: pytest.MonkeyPatch) -> None:
    # the search is left in the kind of a straight start
    explore = limit_search.find_kinds

    def false(*data: object) -> list[object]:
        kinds = explore(*data)  # type: ignore[arg-type]
        best = replace(kinds[0].motion, value=2 * kinds[0].value)
        return [kind_of(best), *kinds]

    monkeypatch.setattr(limit_search, 'find_kinds', false)
    found = find_max_payload(one_link(2.0))
    assert (found.status, found.solved) == (PlanStatus.NOT_CONVERGED, False)
    assert found.payload == pytest.approx(3.0, abs=2e-3)
    assert 'were found by direct collocation on two meshes' in found.message
    assert found.message.endswith(f'not certified ({found.payload:.6g} kg are certified)')
    quick = find_min_duration(one_link(2.0, payload_mass=3.0))
    assert quick.solved, quick.message  # twice the duration is no better


def test_search_that_goes_on_from_a_motion_explores_nothing() -> None:
    found = find_max_payload(one_link(2.0))
    again = find_max_payload(one_link(2.1), start_from=found)
    assert again.solved, again.message
    assert (again.warm, again.starts, again.kinds) == (True, 0, ())


def test_number_of_starts_is_what_is_asked() -> None:
    for name, starts in (('normal', 16), ('thorough', 48)):
        assert find_max_payload(one_link(2.0), search=name).starts == starts


# What is proved, and errors


def test_bound_that_is_proved_is_told(monkeypatch: pytest.MonkeyPatch) -> None:
    proof = Proof(name=ProofName.POWER, sentence='the motors give no more')
    monkeypatch.setattr(payload_outcome, 'bound_payload',
                        lambda problem, carried: PayloadBound(payload=4.5, proof=proof))
    for method in PayloadMethod:
        found = followed(one_link(2.0), method=method)
        assert found.solved, found.message
        assert (found.proved_upper, found.proof) == (4.5, proof)
        assert found.message.endswith('; no motion carries more than 4.5 kg')


@pytest.mark.parametrize('error', [
    InvalidTaskError('joint 1 needs 15.9 N m'), NoEquilibriumError('the links buckle')], ids=str)
def test_error_of_a_payload_that_was_tried_does_not_leave_the_search(
        monkeypatch: pytest.MonkeyPatch, error: Exception) -> None:
    def fail(*rest: object) -> None:
        raise error

    task = one_link(2.0, payload_mass=1.0)
    whole = followed(task)
    monkeypatch.setattr(LimitSearch, 'plan', fail)
    found = followed(task)
    assert found.status is PlanStatus.NOT_CONVERGED
    # what was met on the way is certified, and where it ends is known
    assert found.message == f'{error} ({found.payload:.6g} kg are certified)'
    assert found.payload == pytest.approx(whole.payload, abs=1e-3)
    assert found.local_upper == pytest.approx(whole.local_upper, abs=1e-3)
    quick = find_min_duration(one_link(2.0), search='fast')
    assert quick.status is PlanStatus.NOT_CONVERGED
    assert quick.message == f'{error} ({quick.duration:.6g} s are certified)'
    assert quick.duration == pytest.approx(1.0, abs=1e-4)


def test_goal_that_cannot_be_held_is_told_with_its_proof() -> None:
    found = followed(lifted_to(0.0, 2.0, payload_mass=0.5))
    assert found.status is PlanStatus.INFEASIBLE
    assert found.message.startswith('joint 1 needs 6.377 N m')


def test_plan_that_fails_its_certificate_is_replaced_by_another_or_by_one_with_less(
        monkeypatch: pytest.MonkeyPatch) -> None:
    failures = [1]

    def fail(*args: Any, **options: Any) -> Plan:
        failures[0] -= 1
        plan = plan_problem(*args, **options)
        return plan if failures[0] < 0 else replace(
            plan, status=PlanStatus.CERTIFICATE_FAILED, message='the tip misses')

    monkeypatch.setattr(limit_search, 'plan_problem', fail)
    other = followed(one_link(2.0))
    assert other.solved, other.message
    failures[0] = 1000
    less = followed(one_link(2.0))
    assert less.status is PlanStatus.NOT_CONVERGED
    assert less.plan is not None and less.plan.solved
    assert less.payload == less.plan.task.payload_mass > 0.99 * other.payload
    assert less.message.startswith('the tip misses')
