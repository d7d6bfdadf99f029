"""Motions that pass via points, at given and at free times."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
import math
from pathlib import Path
from typing import Any

from flex_planner import find_max_payload, find_min_duration, Plan, plan_path
from flex_planner.base.errors import FlexPlannerError, InvalidTaskError
from flex_planner.base.progress import Monitor
from flex_planner.collocation import CollocationResult, solve, SolverSettings
from flex_planner.optimal_control.task import Task
from flex_planner.optimal_control.via_points import ViaPoint
from flex_planner.paper.cases import paper_arm, point_to_point
from flex_planner.planning.certificate import CertificateLimits, certify
from flex_planner.planning.objectives import Objectives
from flex_planner.planning.plan import peaks
from flex_planner.planning.sampling import sample_plan, SamplingSettings
from flex_planner.planning.strategies.strategy import Strategy
from flex_planner.planning.strategies.via_homotopy import move_via_points
from flex_planner.reports.motion import certificate_rows, motion_rows
import numpy as np
import pytest
from stacked_phases import StackedPhases

RIGID, BENDING = math.inf, 50.0
ANGLES = np.radians([70.0, -125.0])


def task(rigidity: float, vias: Sequence[ViaPoint], payload: float = 1.0, **fields: Any) -> Task:
    return replace(point_to_point(paper_arm(rigidity, 1), payload), via_points=vias, **fields)


def at_angles(time: float | None = None) -> list[ViaPoint]:
    return [ViaPoint(positions=ANGLES, time=time)]


def at_point(time: float | None = None) -> list[ViaPoint]:
    return [ViaPoint(point=[0.40, 0.25], time=time)]


# costs by stacked phases, and times, computed apart from this project with a prototype of theirs
@pytest.mark.parametrize(('rigidity', 'vias', 'cost', 'time'), [
    (BENDING, at_angles(0.5), 1.596696, 0.5),
    (RIGID, at_angles(), 0.66630, 0.28451),
    (RIGID, at_point(), 0.93368, 0.62287)])
def test_costs_and_times_are_those_of_stacked_phases(
        rigidity: float, vias: list[ViaPoint], cost: float, time: float) -> None:
    plan = plan_path(task(rigidity, vias))
    assert plan.solved
    assert plan.cost == pytest.approx(cost, abs=6e-6)
    assert plan.via_times == pytest.approx([time], abs=6e-6)
    stacked = StackedPhases(plan.problem)
    assert plan.solution is not None
    other = solve(stacked, stacked.guess(plan.solution), SolverSettings(error_tolerance=1e-8))
    assert other.converged
    assert stacked.cost(other.solution) == pytest.approx((plan.cost, plan.via_times[0]), rel=1e-7)


def test_a_saturated_motion_agrees_with_direct_collocation() -> None:
    vias = [ViaPoint(positions=np.radians([np.nan, -130.0]), time=0.3)]
    plan = plan_path(task(RIGID, vias, payload=5.5))
    assert plan.solved
    assert plan.saturation.max() > 0.1
    assert plan.cost == pytest.approx(6.12089, abs=1e-5)  # IPOPT, fine Gauss transcription


def test_a_via_point_on_the_free_motion_changes_nothing() -> None:
    free = plan_path(task(BENDING, []))
    there = free.sample([0.4]).coordinates[0, :2]
    plan = plan_path(task(BENDING, [ViaPoint(positions=there, time=0.4)]))
    assert plan.cost == pytest.approx(free.cost, rel=1e-9)
    later = plan_path(task(BENDING, [ViaPoint(positions=there)]))
    assert later.via_times == pytest.approx([0.4], abs=1e-6)
    assert later.cost == pytest.approx(free.cost, rel=1e-9)


def test_only_position_costates_of_what_is_given_jump() -> None:
    vias = [ViaPoint(positions=np.radians([np.nan, -130.0]), time=0.3)]
    plan = plan_path(task(BENDING, vias))
    assert plan.solution is not None
    jump = (plan.solution(plan.via_times) - plan.solution.before(plan.via_times))[0]
    n_t = plan.arm.n_coordinates
    assert abs(jump[2 * n_t + 1]) > 0.1
    jump[2 * n_t + 1] = 0
    assert np.abs(jump / plan.problem.scale).max() < 1e-9


def test_the_jump_of_h_is_what_another_time_would_spare() -> None:
    def cost(time: float) -> float:
        return plan_path(task(RIGID, at_point(time))).cost

    plan = plan_path(task(RIGID, at_point(0.5)))
    assert plan.solution is not None
    z = np.vstack([plan.solution.before(plan.via_times), plan.solution(plan.via_times)])
    before, after = plan.model.controls(z, plan.problem.p).hamiltonian
    slope = (cost(0.5001) - cost(0.4999)) / 0.0002
    assert before - after == pytest.approx(slope, rel=1e-4)
    best = plan_path(task(RIGID, at_point()))
    time = float(best.via_times[0])
    assert best.cost < min(cost(time - 0.02), cost(time + 0.02))
    assert best.certificate.hamiltonian_drift < 1e-8


def test_several_points_of_both_kinds_are_passed() -> None:
    vias = [ViaPoint(positions=np.radians([65.0, -122.0])), ViaPoint(point=[0.55, 0.2], time=0.5),
            ViaPoint(positions=np.radians([85.0, -110.0]))]
    plan = plan_path(task(RIGID, vias))
    assert plan.solved, plan.message
    assert (np.diff(plan.via_times) > 0).all()
    samples = plan.sample(plan.via_times)
    assert samples.tip[1] == pytest.approx([0.55, 0.2], abs=1e-9)
    for k in (0, 2):
        assert samples.coordinates[k, :2] == pytest.approx(vias[k].positions, abs=1e-9)
    assert plan.certificate.via_error < 1e-9
    assert 'free times' in plan.strategy  # those of the free motion are too demanding


def test_the_certificate_tells_a_motion_that_misses_its_via_point() -> None:
    free, asked = plan_path(task(RIGID, [])), plan_path(task(RIGID, at_angles(0.5)))
    assert free.solution is not None
    missed = replace(CollocationResult.failed(free.solution, ''), errors=np.zeros(8))
    certificate = certify(asked.problem, missed, Monitor())
    assert certificate.via_error > 0.01
    assert any('via error' in each for each in CertificateLimits().violations(certificate))
    assert free.certificate.via_error == 0


def test_a_plan_starts_from_one_with_other_via_points() -> None:
    first = plan_path(task(BENDING, at_point()))
    plan = plan_path(task(BENDING, [ViaPoint(point=[0.41, 0.25])], payload=1.1),
                     start_from=first)
    cold = plan_path(task(BENDING, [ViaPoint(point=[0.41, 0.25])], payload=1.1))
    assert plan.strategy == 'warm start'
    assert plan.cost == pytest.approx(cold.cost, rel=1e-7)
    assert plan.iterations < cold.iterations


def test_the_largest_payload_by_a_via_point_is_bracketed() -> None:
    loaded = task(RIGID, at_angles(0.3))
    found, free = find_max_payload(loaded), find_max_payload(task(RIGID, []))
    assert found.solved
    assert found.kinds == ()  # they are looked for without via points
    assert found.local_upper - found.payload <= 1e-3
    assert 5.5 < found.payload < free.payload
    assert found.plan is not None
    assert found.plan.certificate.via_error < 1e-8
    assert found.proved_upper >= found.local_upper


def test_published_points_have_one_at_each_via_point() -> None:
    plan = plan_path(task(BENDING, at_point()))
    sampled = sample_plan(plan, SamplingSettings())
    at = np.abs(sampled.times_ns * 1e-9 - plan.via_times[0]).argmin()
    assert sampled.times_ns[at] * 1e-9 == pytest.approx(plan.via_times[0], abs=1e-9)
    assert sampled.samples.tip[at] == pytest.approx([0.40, 0.25], abs=1e-8)


def test_a_saved_plan_keeps_its_via_points(tmp_path: Path) -> None:
    plan = plan_path(task(RIGID, at_point()))
    plan.save(tmp_path / 'plan')
    loaded = Plan.load(tmp_path / 'plan')
    assert loaded.via_times == pytest.approx(plan.via_times, abs=0)
    assert loaded.task.via_points[0].point == pytest.approx([0.40, 0.25])


def test_a_report_names_via_points_and_by_how_much_they_are_missed() -> None:
    plan = plan_path(task(RIGID, at_point()))
    rows = motion_rows(plan, peaks(plan, plan.uniform_samples(11)))
    assert ('passes', '(0.4, 0.25) m at 0.622866 s (free)') in rows
    assert 'via points missed by' in certificate_rows(plan.certificate)[-1][0]


def test_velocity_weights_and_objectives_go_with_given_times_only() -> None:
    limit = Objectives(max_joint_speeds=[1.2, 10.0])
    plan = plan_path(task(RIGID, at_angles(0.3)), objectives=limit)
    assert plan.solved
    assert plan.certificate.via_error < 1e-8
    assert np.abs(plan.uniform_samples(501).rates[:, 0]).max() <= 1.2 + 1e-6
    with pytest.raises(InvalidTaskError, match='a via point has no time'):
        plan_path(task(RIGID, at_angles()), objectives=limit)


@pytest.mark.parametrize(('search', 'sentence'), [
    (find_max_payload, 'a via point has no time, but must have one'),
    (find_min_duration, 'via_points must be empty')])
def test_searches_refuse_what_they_cannot_answer(search: Any, sentence: str) -> None:
    with pytest.raises(FlexPlannerError, match=sentence):
        search(task(RIGID, at_angles()))


def test_a_hard_via_point_is_reached_by_moving_one_that_is_passed() -> None:
    asked = task(BENDING, [ViaPoint(positions=np.radians([70.0, -125.0]), time=0.3)], payload=5.0)
    moved = plan_path(asked, strategies=(Strategy('moved', move_via_points),))
    assert moved.solved
    assert moved.cost == pytest.approx(plan_path(asked).cost, rel=1e-7)
