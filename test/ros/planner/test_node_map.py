"""The planner node with a capacity map to start from."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

from flex_planner_interfaces.msg import PlanReport
from geometry_msgs.msg import Point
from map_support import filled
import pytest
from ros_support import Planner


@pytest.fixture(scope='module')
def store(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return filled(tmp_path_factory.mktemp('map'))[1]


@pytest.fixture(scope='module')
def planner(store: Path, tmp_path_factory: pytest.TempPathFactory) -> Iterator[Planner]:
    folder = tmp_path_factory.mktemp('node')
    with Planner(folder, 'korayem_rigid', map_store=store) as planner:
        yield planner
        assert planner.process.process.poll() is None
        assert 'Traceback' not in planner.log()


def test_search_near_a_cell_says_where_it_started_and_is_shorter(planner: Planner) -> None:
    near = planner.search(goal_point=Point(x=0.49, y=0.49)).report
    far = planner.search(goal_point=Point(x=0.3, y=0.3)).report
    assert near.error_code == far.error_code == PlanReport.NONE
    assert near.map_cell == 'goal_x = 0.5 m, goal_y = 0.5 m of map.zarr'
    assert far.map_cell == ''
    assert near.iterations < far.iterations / 2
    assert f'4 motions of {planner.parameter("map_store")}' in planner.log()


def test_plan_that_no_cell_is_near_is_made_as_ever(planner: Planner) -> None:
    report = planner.report()
    assert (report.error_code, report.map_cell) == (PlanReport.NONE, '')
    assert report.strategy == 'cold start'


def test_map_that_is_damaged_costs_nothing_but_time(tmp_path: Path) -> None:
    path = filled(tmp_path)[1]
    with Planner(tmp_path, 'korayem_rigid', 'damaged', map_store=path) as planner:
        planner.wait('ready', lambda: 'ready to plan' in planner.log(), 60)
        for chunk in (path / 'motions' / 'motion').glob('0*'):
            chunk.write_bytes(b'damaged')
        report = planner.search().report
        assert (report.error_code, report.map_cell) == (PlanReport.NONE, '')
        assert 'the map cannot be read' in planner.log()


@pytest.mark.parametrize(('arm', 'name', 'reason'), [
    ('korayem_rigid', 'nowhere.zarr', 'there is no map'),
    ('korayem_ei50', '', 'is of another arm')])
def test_node_does_not_start_with_a_map_that_is_none_of_its_own(
        store: Path, tmp_path: Path, arm: str, name: str, reason: str) -> None:
    path = tmp_path / name if name else store
    with Planner(tmp_path, arm, 'stranger', map_store=path) as planner:
        assert planner.process.process.wait(60) == 1
        assert f"map_store is '{path}', but" in planner.log()
        assert reason in planner.log()
        assert 'Traceback' not in planner.log()
