"""Plans and limits as notebooks show them."""

from __future__ import annotations

from dataclasses import replace
from typing import Any
import xml.etree.ElementTree as ElementTree

from flex_planner.arms.arm import Arm
from flex_planner.arms.kinematics import link_points
from flex_planner.arms.motion_svg import motion_svg
from flex_planner.base.html_view import html_view
from flex_planner.capacity.max_payload import find_max_payload
from flex_planner.capacity.min_duration import find_min_duration
from flex_planner.optimal_control.task import Task
from flex_planner.planning.plan import Plan
from flex_planner.planning.plan_path import plan_path
import numpy as np
import pytest


@pytest.fixture(scope='module')
def task() -> Task:
    from flex_planner.arms.arm_files import load_arm

    arm = replace(load_arm('korayem_rigid'), name='<b>$arm$ & "others"')
    return Task.between_points(arm, (0.5, 0.0), (0.5, 0.5), duration=1.0)


@pytest.fixture(scope='module')
def plan(task: Task) -> Plan:
    return plan_path(task, search='fast')


def shown(result: Any) -> tuple[dict[str, str], list[ElementTree.Element]]:
    """Return the rows and the lines of a view, which must be well-formed."""
    tree = ElementTree.fromstring(result._repr_html_())
    rows = {row[0].text or '': row[1].text or '' for row in tree.iter('tr')}
    return rows, list(tree.iter('polyline'))


def test_plan_is_a_table_beside_a_picture(plan: Plan) -> None:
    rows, lines = shown(plan)
    assert rows['arm'] == '<b>$arm$ & "others"'
    assert rows['cost J'] == f'{plan.cost:.6g}'
    assert rows['motion'] == '1 s with 0 kg'
    assert len(lines) == 7  # four postures on the way, the path of the tip, both ends


def test_plan_without_a_solution_says_why(task: Task) -> None:
    rows, lines = shown(plan_path(replace(task, duration=0.05)))
    assert rows['why'].startswith('the motors give at most')
    assert lines == []


def test_limits_are_shown_with_their_brackets(task: Task) -> None:
    rows, lines = shown(find_max_payload(task, accuracy=0.1, search='fast'))
    assert rows['largest payload'].startswith('5.8')
    assert rows['this kind of motion ends at'].endswith(' kg')
    assert len(lines) == 7
    rows, lines = shown(find_min_duration(task, accuracy=0.1, search='fast'))
    assert float(rows['shortest duration'].removesuffix(' s')) < 1.0
    assert len(lines) == 7


def test_picture_shows_links_as_they_bend(ei50_arm: Arm) -> None:
    coordinates = np.zeros((3, ei50_arm.n_coordinates))
    coordinates[2] = [0.5, 1.0, 0.05, 0.0, 0.02, 0.0]
    tree = ElementTree.fromstring(motion_svg(ei50_arm, coordinates))
    last = [[float(value) for value in point.split(',')]
            for point in list(tree.iter('polyline'))[-1].attrib['points'].split()]
    # to a tenth of a millimetre
    np.testing.assert_allclose(last, link_points(ei50_arm, coordinates[2], 13).reshape(-1, 2),
                               atol=5.1e-5)


def test_table_escapes_what_it_shows() -> None:
    assert '<script>' not in html_view([('<script>', '\x1b[31m<script>')])
