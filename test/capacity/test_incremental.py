"""The paper's search: the payload is raised by steps that are halved."""

from __future__ import annotations

import math

from factories import SearchFactory, TaskFactory
from flex_planner.base.progress import Monitor, Progress
from flex_planner.capacity.results import MaxPayload, PayloadMethod
from flex_planner.optimal_control.arm_model import ArmModel
from flex_planner.planning.plan import PlanStatus
from known_limits import G, HEAVIEST, lifted_to
import numpy as np
from payload_searches import assert_stopped, assert_stopped_at, moments, raised, stopped_after
import pytest

inf = math.inf


@pytest.fixture(scope='module')
def raised_search(rigid_model: ArmModel, paper_task: TaskFactory) -> MaxPayload:
    return raised(paper_task(rigid_model.arm, 5.0), model=rigid_model, step=0.5, accuracy=0.05)


def test_raised_payload_ends_in_a_narrow_bracket(raised_search: MaxPayload) -> None:
    found = raised_search
    assert found.solved, found.message
    assert found.payload <= HEAVIEST['rigid'] <= found.local_upper
    assert 0 < found.local_upper - found.payload <= 0.05
    assert found.plan is not None
    assert found.plan.task.payload_mass == found.payload
    assert found.method is PayloadMethod.INCREMENTAL


def test_steps_are_halved_from_the_first_on(raised_search: MaxPayload) -> None:
    trials = raised_search.trials
    steps = np.array([trial.step for trial in trials])
    assert trials[0].step == 0.5
    assert trials[0].payload == 5.5
    assert set(steps[1:] / steps[:-1]) <= {1.0, 0.5}
    assert not trials[1].solved
    # the bracket is never wider than the last step
    assert raised_search.local_upper - raised_search.payload <= steps[-1]


def test_trials_are_recorded_in_order(raised_search: MaxPayload) -> None:
    carried, failed = 5.0, inf
    for trial in raised_search.trials:
        assert trial.payload == carried + trial.step
        assert trial.payload < failed
        assert trial.solved is trial.result.converged
        assert not trial.interrupted
        carried, failed = (trial.payload, failed) if trial.solved else (carried, trial.payload)
    # the upper end is the least payload that failed
    assert (carried, failed) == (raised_search.payload, raised_search.local_upper)


def test_methods_fill_only_what_is_theirs(raised_search: MaxPayload,
                                          search_of: SearchFactory) -> None:
    assert (raised_search.front.payloads.size, raised_search.extremals) == (0, ())
    assert raised_search.restart_point is None
    direct = search_of('rigid')
    assert (direct.trials, direct.method) == ((), PayloadMethod.DIRECT)
    assert direct.front.payloads.size == len(direct.extremals) > 0


def test_first_step_may_be_larger_than_the_answer(rigid_model: ArmModel,
                                                  paper_task: TaskFactory) -> None:
    found = raised(paper_task(rigid_model.arm), model=rigid_model, step=10.0, accuracy=2.0)
    assert found.solved, found.message
    assert [trial.payload for trial in found.trials] == [11.0, 6.0, 3.5, 4.75]
    assert (found.payload, found.local_upper) == (4.75, 6.0)


def test_raised_payload_that_the_motor_cannot_hold_is_too_much() -> None:
    found = raised(lifted_to(0.0, 2.0), step=1.0, accuracy=0.05)
    limit = 6 / G - 0.15
    assert found.solved, found.message
    # what cannot be held is no trial, but it is an upper end
    assert all(trial.payload < limit for trial in found.trials)
    assert found.payload <= limit <= found.local_upper <= found.payload + 0.05


def test_paper_search_reports_the_payload_tried(rigid_model: ArmModel,
                                                paper_task: TaskFactory) -> None:
    reports: list[Progress] = []
    found = raised(paper_task(rigid_model.arm, 4.0), model=rigid_model, step=0.5, accuracy=0.5,
                   monitor=Monitor(report=reports.append))
    tried = dict.fromkeys(each.payload for each in reports if each.phase == 'payload raised')
    assert list(tried) == [trial.payload for trial in found.trials]
    assert len(reports) == found.iterations


def test_paper_search_is_stopped_wherever_it_is() -> None:
    task, phases = lifted_to(0.0, 2.0), ('cold start', 'payload raised',
                                         'continuation to the limit')
    assert_stopped_at(
        lambda monitor: raised(task, step=0.3, accuracy=0.3, monitor=monitor),
        {(phase, simulating): phase != 'cold start'
         for phase in phases for simulating in (False, True)})


@pytest.mark.parametrize('status', [PlanStatus.CANCELED, PlanStatus.TIMEOUT])
def test_trials_are_kept_when_a_search_is_stopped(rigid_model: ArmModel, paper_task: TaskFactory,
                                                  status: PlanStatus) -> None:
    def search(monitor: Monitor) -> MaxPayload:
        return raised(paper_task(rigid_model.arm, 4.0), model=rigid_model, step=0.25,
                      accuracy=0.25, monitor=monitor)

    # while it is seen where torques lead 6 kg
    last = moments(search)['payload raised', True]
    found = search(stopped_after(last, status))
    assert_stopped(found, status, certified=status is PlanStatus.TIMEOUT)
    tried = [trial.payload for trial in found.trials]
    assert tried[:7] == [4.25, 4.5, 4.75, 5.0, 5.25, 5.5, 5.75]
    assert all(trial.solved for trial in found.trials[:7])
    assert found.payload == (5.75 if status is PlanStatus.TIMEOUT else 0.0)
    assert found.local_upper == inf  # no payload is known to be too much
