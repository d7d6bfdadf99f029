"""From a request for the maximum payload to the core's call and back, without a middleware."""

from __future__ import annotations

from dataclasses import replace
import math
from typing import Any

from flex_planner.arms.arm import Arm
from flex_planner.base.errors import FlexPlannerError, InvalidValueError, NotFiniteError
from flex_planner.base.progress import Monitor
from flex_planner.capacity.max_payload import find_max_payload
from flex_planner.capacity.results import MaxPayload, PayloadMethod
from flex_planner.optimal_control.arm_model import ArmModel
from flex_planner.optimal_control.task import Task
from flex_planner.planning.plan import PlanStatus
from flex_planner.ros.messages.payload_searches import (
    fill_response,
    METHODS,
    report_from_search,
    search_message,
    search_options,
    search_without_result,
    SearchOptions,
)
from flex_planner.ros.messages.plans import add_kinds, report_from_plan, STATUS_CODES
from flex_planner.ros.settings.planner import MAX_ACCURACY, MIN_ACCURACY, PlannerSettings
from flex_planner_interfaces.msg import PayloadSearch, PlanReport
from flex_planner_interfaces.srv import FindMaxPayload
import numpy as np
import pytest
from ros_support import search_request

OPTIONS = SearchOptions(method=PayloadMethod.DIRECT, accuracy=2e-3, step=0.25)
OUTSIDE = np.nextafter([MIN_ACCURACY, MAX_ACCURACY], [0.0, math.inf]).tolist()


@pytest.fixture(scope='module')
def settings(rigid_arm: Arm) -> PlannerSettings:
    return replace(PlannerSettings.for_arm(rigid_arm), payload_accuracy=0.01, payload_step=0.5)


@pytest.fixture(scope='module')
def paper(rigid_arm: Arm, paper_task: Any) -> Task:
    return paper_task(rigid_arm, payload_mass=4.0)


@pytest.fixture(scope='module')
def direct(paper: Task, rigid_model: ArmModel) -> MaxPayload:
    return find_max_payload(paper, model=rigid_model)


@pytest.fixture(scope='module')
def incremental(paper: Task, rigid_model: ArmModel) -> MaxPayload:
    return find_max_payload(paper, model=rigid_model, method=PayloadMethod.INCREMENTAL,
                            accuracy=1.0)


# Requests


def test_zeros_take_the_defaults_of_the_parameters(settings: PlannerSettings) -> None:
    assert search_options(FindMaxPayload.Request(), settings) == SearchOptions(
        method=PayloadMethod.DIRECT, accuracy=0.01, step=0.5)


def test_options_that_are_given_count(settings: PlannerSettings) -> None:
    request = search_request(method=1, payload_accuracy=1e-4, payload_step=0.2)
    assert search_options(request, settings) == SearchOptions(
        method=PayloadMethod.INCREMENTAL, accuracy=1e-4, step=0.2)


def test_default_step_is_never_less_than_the_accuracy(settings: PlannerSettings) -> None:
    assert search_options(search_request(payload_accuracy=3.0), settings).step == 3.0


@pytest.mark.parametrize(('fields', 'error', 'text'), [
    ({'method': 2}, InvalidValueError, 'method is 2, but must be 0 .DIRECT. or 1 .INCREMENTAL.'),
    ({'payload_accuracy': -1.0}, InvalidValueError, 'payload_accuracy is -1.0, .* <= 1000 kg'),
    ({'payload_accuracy': OUTSIDE[0]}, InvalidValueError, 'payload_accuracy is .* >= 1e-06'),
    ({'payload_accuracy': OUTSIDE[1]}, InvalidValueError, 'payload_accuracy is .* <= 1000 kg'),
    ({'payload_accuracy': math.nan}, NotFiniteError, 'payload_accuracy is nan'),
    ({'payload_step': 0.0099}, InvalidValueError, 'payload_step is 0.0099, .* >= 0.01 and'),
    ({'payload_step': 1.1e6}, InvalidValueError, 'payload_step is 1100000.0, .* <= 1e.06 kg'),
    ({'payload_step': -math.inf}, NotFiniteError, 'payload_step is -inf')])
def test_bad_option_raises_with_the_name_of_its_field(settings: PlannerSettings,
                                                      fields: dict[str, Any], text: str,
                                                      error: type[FlexPlannerError]) -> None:
    with pytest.raises(error, match=text) as caught:
        search_options(search_request(**fields), settings)
    assert type(caught.value) is error


def test_accuracies_of_requests_are_those_that_the_library_takes(
        settings: PlannerSettings, paper: Task, rigid_model: ArmModel) -> None:
    for accuracy in (MIN_ACCURACY, MAX_ACCURACY):
        options = search_options(search_request(payload_accuracy=accuracy), settings)
        found = find_max_payload(paper, model=rigid_model, monitor=Monitor(time_limit=0.0),
                                 accuracy=options.accuracy, step=options.step)
        assert found.status is PlanStatus.TIMEOUT
    for accuracy in OUTSIDE:
        with pytest.raises(InvalidValueError, match='accuracy'):
            find_max_payload(paper, model=rigid_model, accuracy=accuracy, step=1e4)


def test_every_method_has_its_constant_in_both_messages() -> None:
    assert set(METHODS.values()) == set(PayloadMethod)
    for kind in (PayloadSearch, FindMaxPayload.Request):
        assert METHODS[kind.DIRECT] is PayloadMethod.DIRECT
        assert METHODS[kind.INCREMENTAL] is PayloadMethod.INCREMENTAL


# Outcomes


def test_message_of_a_direct_search_has_every_number(direct: MaxPayload) -> None:
    message = search_message(direct, OPTIONS)
    assert (message.method, message.payload_accuracy, message.payload_step) == (0, 2e-3, 0.25)
    assert (message.payload, message.payload_upper) == (direct.payload, direct.local_upper)
    assert (message.limiting_joint, message.held) == (0, False)
    assert message.front_payloads.tolist() == direct.front.payloads.tolist() != []
    assert message.front_efforts.tolist() == direct.front.efforts.tolist()
    assert message.front_prices.tolist() == direct.front.prices.tolist()
    assert not (message.tried_payloads or message.tried_solved or message.tried_errors)


def test_message_of_an_incremental_search_has_every_trial(incremental: MaxPayload) -> None:
    message = search_message(incremental, OPTIONS)
    trials = incremental.trials
    assert (message.method, message.payload, message.payload_upper) == (1, 5.0, 6.0)
    assert message.tried_payloads.tolist() == [5.0, 6.0]
    assert message.tried_solved == [True, False]
    assert message.tried_errors.tolist() == [trial.boundary_error for trial in trials]
    assert not (message.front_payloads or message.front_efforts or message.front_prices)


def test_message_tells_the_joint_that_holds_no_more(direct: MaxPayload) -> None:
    message = search_message(replace(direct, held=True, limiting_joint=1), OPTIONS)
    assert (message.limiting_joint, message.held) == (1, True)


def test_failed_search_keeps_the_payload_that_it_had_but_has_no_cost(direct: MaxPayload) -> None:
    failed = replace(direct, status=PlanStatus.NOT_CONVERGED, limiting_joint=None)
    message, report = search_message(failed, OPTIONS), report_from_search(failed)
    assert (message.payload, message.payload_upper) == (direct.payload, direct.local_upper)
    assert message.limiting_joint == -1
    assert message.front_payloads.tolist() == direct.front.payloads.tolist()
    assert (report.error_code, report.cost) == (PlanReport.NOT_CONVERGED, math.inf)


def test_search_without_result_repeats_the_request() -> None:
    request = search_request(method=9, payload_accuracy=-1.0, payload_step=0.5)
    assert search_without_result(request) == PayloadSearch(
        method=9, payload_accuracy=-1.0, payload_step=0.5, payload_upper=math.inf,
        payload_local_upper=math.inf, payload_proved_upper=math.inf, limiting_joint=-1)


def test_report_of_a_search_is_that_of_its_plan(direct: MaxPayload) -> None:
    assert direct.plan is not None
    report, expected = report_from_search(direct), report_from_plan(direct.plan)
    assert report.strategy == f'{direct.method.value}; {direct.plan.strategy}'
    expected.strategy, expected.iterations = report.strategy, direct.iterations
    add_kinds(expected, direct.kinds, direct.starts)
    assert report == expected
    assert (report.error_code, report.error_msg) == (PlanReport.NONE, '')


def test_report_of_a_search_has_the_warnings_of_its_plan_or_of_the_arm(
        direct: MaxPayload, crane_arm: Arm) -> None:
    report = report_from_search(direct)
    assert report.warning_kinds == ['TORQUE_JUMPS', 'BRAKING_TORQUE']
    assert report.warnings == [one.sentence for one in direct.warnings]
    light = replace(crane_arm, nodes=())
    task = Task(arm=light, start_positions=[0, 1], goal_positions=[1, 1], duration=1.0)
    failed = MaxPayload(task=task, method=PayloadMethod.DIRECT, status=PlanStatus.NOT_CONVERGED,
                        message='lost')
    assert report_from_search(failed).warning_kinds == ['JOINT_WITHOUT_INERTIA']


@pytest.mark.parametrize('status', [s for s in PlanStatus if s is not PlanStatus.SOLVED])
def test_report_of_a_failed_search_says_why(paper: Task, status: PlanStatus) -> None:
    report = report_from_search(MaxPayload(task=paper, method=PayloadMethod.INCREMENTAL,
                                           status=status, message='too heavy', iterations=7))
    assert report.error_code == STATUS_CODES[status] != PlanReport.NONE
    assert report.error_msg == f'{status.value}: too heavy'
    assert report.strategy == 'payload raised step by step'
    assert (report.iterations, report.cost, report.tip_error) == (7, math.inf, math.inf)


@pytest.mark.parametrize('search', ['direct', 'incremental'])
def test_response_repeats_every_field_of_the_search(request: pytest.FixtureRequest,
                                                    search: str) -> None:
    message = search_message(request.getfixturevalue(search), OPTIONS)
    response = FindMaxPayload.Response()
    fill_response(response, message)
    asked = FindMaxPayload.Request.get_fields_and_field_types().keys()
    answered = PayloadSearch.get_fields_and_field_types().keys() - asked
    assert answered | {'report', 'trajectory'} == response.get_fields_and_field_types().keys()
    for name in answered:
        assert getattr(response, name) == getattr(message, name), name
