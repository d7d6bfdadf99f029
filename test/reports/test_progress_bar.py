"""Bars for progress in notebooks and terminals."""

from __future__ import annotations

import io
import sys

from flex_planner.arms.arm import Arm
from flex_planner.base.errors import FlexPlannerError
from flex_planner.base.progress import Monitor
from flex_planner.maps.cell_results import CellCode
from flex_planner.maps.tally import Tally
from flex_planner.optimal_control.task import Task
from flex_planner.planning.plan_path import plan_path
from flex_planner.reports.progress_bar import ProgressBar
import numpy as np
import pytest


def test_planning_shows_phase_and_share_of_the_time_limit(rigid_arm: Arm) -> None:
    seen = io.StringIO()
    task = Task(arm=rigid_arm, start_positions=[0, 1], goal_positions=[1, 1], duration=1.0)
    with ProgressBar(60.0, seen) as bar:
        assert plan_path(task, monitor=Monitor(time_limit=60, report=bar.report),
                         search='fast').solved
    assert 'cold start, iteration 1' in seen.getvalue()
    assert '/60.0 [' in seen.getvalue()


def test_map_shows_its_cells() -> None:
    seen = io.StringIO()
    tally = Tally(np.array([CellCode.SOLVED, CellCode.TIMEOUT, CellCode.PENDING], dtype=np.int8))
    with ProgressBar(stream=seen) as bar:
        bar.count(tally)
        tally.count(np.array([CellCode.PENDING], dtype=np.int8),
                    np.array([CellCode.SOLVED], dtype=np.int8))
        bar.count(tally)  # the last one is shown at once
    assert '1 failed' in seen.getvalue()
    assert '2/3' in seen.getvalue()
    assert '3/3' in seen.getvalue()


def test_missing_library_is_named(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, 'tqdm.auto', None)
    with pytest.raises(FlexPlannerError, match=r"pip install 'flex_planner\[notebooks\]'"):
        ProgressBar()
