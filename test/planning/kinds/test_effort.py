"""How much work goes into a search over kinds of motion: names, and what they mean."""

from __future__ import annotations

from factories import TaskFactory
from flex_planner.arms.arm import Arm
from flex_planner.base.errors import InvalidValueError
from flex_planner.base.progress import Monitor
from flex_planner.capacity.max_payload import find_max_payload
from flex_planner.capacity.min_duration import find_min_duration
from flex_planner.planning.kinds.effort import SearchEffort
from flex_planner.planning.plan_path import plan_path
import pytest

MESSAGE = "search is 'hasty', but must be one of fast, normal, thorough"


@pytest.mark.parametrize(('name', 'starts'), [('fast', 0), ('normal', 16), ('thorough', 48)])
def test_effort_is_named_and_has_its_starts(name: str, starts: int) -> None:
    effort = SearchEffort.of(name)
    assert SearchEffort.of(effort) is effort
    assert (effort.value, effort.starts, effort.explores) == (name, starts, starts > 0)


@pytest.mark.parametrize('given', ['hasty', 'FAST', '', None, 16])
def test_other_efforts_are_refused(given: str) -> None:
    with pytest.raises(InvalidValueError, match='must be one of fast, normal, thorough'):
        SearchEffort.of(given)


@pytest.mark.parametrize('call', [plan_path, find_max_payload, find_min_duration])
def test_unknown_effort_is_refused_before_any_work(rigid_arm: Arm, paper_task: TaskFactory,
                                                   call: type[plan_path]) -> None:
    monitor = Monitor()
    with pytest.raises(InvalidValueError) as caught:
        call(paper_task(rigid_arm), monitor=monitor, search='hasty')
    assert str(caught.value) == MESSAGE
    assert monitor.iteration == 0


@pytest.mark.parametrize('call', [plan_path, find_max_payload, find_min_duration])
def test_number_of_processes_that_is_none_is_refused_before_any_work(
        monkeypatch: pytest.MonkeyPatch, rigid_arm: Arm, paper_task: TaskFactory,
        call: type[plan_path]) -> None:
    monkeypatch.setenv('FLEX_PLANNER_PROCESSES', 'two')
    monitor = Monitor()
    with pytest.raises(InvalidValueError, match="FLEX_PLANNER_PROCESSES is 'two', but must be"):
        call(paper_task(rigid_arm), monitor=monitor)
    assert monitor.iteration == 0
