"""Recordings of a plan, a failure and both kinds of search."""

from __future__ import annotations

from pathlib import Path

from flex_planner.reports.recording import RecordedRequest
import pytest
from report_support import recorded


@pytest.fixture(scope='session')
def plan(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return recorded(tmp_path_factory.mktemp('plan'), 'plan', 'korayem_ei50', '--payload', '0.8',
                    '--velocity-weights', '0.5,0.25')


@pytest.fixture(scope='session')
def failure(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return recorded(tmp_path_factory.mktemp('failure'), 'plan', 'korayem_rigid', '--payload',
                    '100')


@pytest.fixture(scope='session')
def trials(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return recorded(tmp_path_factory.mktemp('trials'), 'payload', 'korayem_rigid', '--method',
                    'incremental', '--accuracy', '2', '--step', '3')


@pytest.fixture(scope='session')
def request_of_plan(plan: Path) -> RecordedRequest:
    return RecordedRequest.read(plan)
