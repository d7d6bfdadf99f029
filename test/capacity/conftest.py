"""Searches that several test files share."""

from __future__ import annotations

from factories import SearchFactory, TaskFactory
from flex_planner.base.processes import PROCESSES
from flex_planner.capacity.max_payload import find_max_payload
from flex_planner.capacity.results import MaxPayload
import pytest


@pytest.fixture(autouse=True)
def count_calls(monkeypatch: pytest.MonkeyPatch) -> None:
    """Let IPOPT run in this process: while a helper works, monitors are asked by the clock."""
    monkeypatch.setenv(PROCESSES, '0')


@pytest.fixture(scope='session')
def search_of(request: pytest.FixtureRequest, paper_task: TaskFactory) -> SearchFactory:
    """Search the maximum payload of the paper's motion from no payload, once for each arm."""
    known: dict[str, MaxPayload] = {}

    def search(name: str) -> MaxPayload:
        if name not in known:
            model = request.getfixturevalue(f'{name}_model')
            known[name] = find_max_payload(paper_task(model.arm, 0.0), model=model, accuracy=1e-4)
        return known[name]

    return search
