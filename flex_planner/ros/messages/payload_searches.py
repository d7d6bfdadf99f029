"""Between the messages of a search for the maximum payload and the core's call."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from flex_planner.base.errors import InvalidValueError
from flex_planner.base.sentences import say_reason
from flex_planner.base.validation import number
from flex_planner.capacity.results import MaxPayload, PayloadMethod
from flex_planner.optimal_control.task import MAX_PAYLOAD
from flex_planner.ros.messages.classes import PayloadSearch, PlanReport
from flex_planner.ros.messages.plans import (
    add_kinds,
    add_warnings,
    failure_report,
    report_from_plan,
    STATUS_CODES,
)
from flex_planner.ros.settings.planner import MAX_ACCURACY, MIN_ACCURACY, PlannerSettings

if TYPE_CHECKING:
    from flex_planner_interfaces.srv import FindMaxPayload

METHODS = {PayloadSearch.DIRECT: PayloadMethod.DIRECT,
           PayloadSearch.INCREMENTAL: PayloadMethod.INCREMENTAL}
_CODES = {method: code for code, method in METHODS.items()}

_UNKNOWN = float('inf')


@dataclass(frozen=True, slots=True, kw_only=True)
class SearchOptions:
    """
    The options of a search.

    Attributes
    ----------
    method : PayloadMethod
        See `flex_planner.capacity.max_payload.find_max_payload`.
    accuracy, step : float
        Width of the bracket, first step of the incremental method [kg].

    """

    method: PayloadMethod
    accuracy: float
    step: float


def search_options(request: FindMaxPayload.Request, settings: PlannerSettings) -> SearchOptions:
    """
    Return the options of a request's search, with the parameters' defaults filled in.

    Raises
    ------
    InvalidValueError
        Naming field, value and bound.

    """
    if request.method not in METHODS:
        raise InvalidValueError('method', request.method, '0 (DIRECT) or 1 (INCREMENTAL)')
    accuracy = number('payload_accuracy', request.payload_accuracy or settings.payload_accuracy,
                      at_least=MIN_ACCURACY, at_most=MAX_ACCURACY, unit='kg')
    step = number('payload_step', request.payload_step or max(settings.payload_step, accuracy),
                  at_least=accuracy, at_most=MAX_PAYLOAD, unit='kg')
    return SearchOptions(method=METHODS[request.method], accuracy=accuracy, step=step)


def search_without_result(request: FindMaxPayload.Request) -> PayloadSearch:
    """Return the message of a search that failed before it began."""
    return PayloadSearch(
        method=request.method, payload_accuracy=request.payload_accuracy,
        payload_step=request.payload_step, payload_upper=_UNKNOWN,
        payload_local_upper=_UNKNOWN, payload_proved_upper=_UNKNOWN, limiting_joint=-1)


def search_message(found: MaxPayload, options: SearchOptions) -> PayloadSearch:
    """Return the message of a search, successful or not."""
    front, trials, joint = found.front, found.trials, found.limiting_joint
    return PayloadSearch(
        method=_CODES[found.method], payload_accuracy=options.accuracy,
        payload_step=options.step, payload=float(found.payload),
        payload_upper=float(found.local_upper), payload_local_upper=float(found.local_upper),
        payload_proved_upper=float(found.proved_upper),
        proof='' if found.proof is None else str(found.proof),
        limiting_joint=-1 if joint is None else int(joint),
        held=bool(found.held), front_payloads=front.payloads.tolist(),
        front_efforts=front.efforts.tolist(), front_prices=front.prices.tolist(),
        tried_payloads=[float(trial.payload) for trial in trials],
        tried_solved=[bool(trial.solved) for trial in trials],
        tried_errors=[float(trial.boundary_error) for trial in trials])


def report_from_search(found: MaxPayload) -> PlanReport:
    """Return the report of a search: that of the plan found, or why there is none."""
    if found.solved and found.plan is not None:
        report = report_from_plan(found.plan)
        report.strategy = f'{found.method.value}; {found.plan.strategy}'
    else:
        report = failure_report(STATUS_CODES[found.status],
                                say_reason(found.status.value, found.message))
        report.strategy = found.method.value
        add_warnings(report, found.warnings)
    report.iterations = found.iterations
    if found.kinds:
        add_kinds(report, found.kinds, found.starts)
    return report


def fill_response(response: FindMaxPayload.Response, search: PayloadSearch) -> None:
    """Copy into a response what it shares with the message of the search."""
    for name in response.get_fields_and_field_types().keys() - {'report', 'trajectory'}:
        setattr(response, name, getattr(search, name))
