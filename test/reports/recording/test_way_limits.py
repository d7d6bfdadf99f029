"""Limits on the way and via points of a recorded motion, in tables, plots and the moving arm."""

from __future__ import annotations

from pathlib import Path
from types import SimpleNamespace
from typing import Any

from flex_planner.base.errors import RecordingError
from flex_planner.optimal_control.arm_model import ArmModel
from flex_planner.optimal_control.path_constraints import Circle
from flex_planner.planning.region_outlines import outline_region
from flex_planner.reports.recording import (
    check_motion,
    contents,
    RecordedRequest,
    report_page,
)
from flex_planner.reports.recording.contents import RecordedMotion
from flex_planner.reports.recording.findings import CheckLimits
from flex_planner.reports.recording.tables import tables
from flex_planner.reports.recording.way_limits import (
    find_active_limits,
    limit_findings,
    limit_tables,
)
import numpy as np
import pytest
from report_support import Page, recorded

POST = Circle(center=(0.52, 0.25), radius=0.1)
VIA = (0.55, 0.2)


@pytest.fixture(scope='module')
def limited(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return recorded(tmp_path_factory.mktemp('limited'), 'plan', 'korayem_rigid', '--payload', '1',
                    '--limit', 'keep_out:0.52,0.25,0.1;name=post', '--limit', 'joint_speed:2,2',
                    '--limit', 'joint_range:2,-2.6,0', '--search', 'fast')


@pytest.fixture(scope='module')
def request_within(limited: Path) -> RecordedRequest:
    return RecordedRequest.read(limited)


def motion_of(request: RecordedRequest) -> RecordedMotion:
    assert request.motion is not None
    return request.motion


def test_limit_is_active_while_the_tip_is_at_the_post(request_within: RecordedRequest) -> None:
    motion = motion_of(request_within)
    found = dict(find_active_limits(request_within, motion))
    away = np.linalg.norm(motion.tip - POST.center, axis=1) - POST.radius
    (first, last), = found.pop('tip from post')
    assert 0 < first <= last < 1
    between = (motion.times >= first) & (motion.times <= last)
    # distances are in radii
    assert away[between].max() < 0.01 * POST.radius < away[~between].min()
    assert set(found) == {f'speed of joint 2 {way}' for way in ('forwards', 'backwards')} | {
        f'{side} limit of joint 2' for side in ('upper', 'lower')}
    assert not any(found.values())


def test_table_has_each_limit_with_its_margin(request_within: RecordedRequest) -> None:
    (table,) = limit_tables(request_within)
    assert table in tables(request_within)
    rows = {row[0]: row[1:] for row in table.rows}
    report = request_within.report
    assert list(rows)[:-1] == list(report.limit_names)
    margin, share, time, span = rows['tip from post']
    assert margin.endswith(' m') and abs(float(margin.split()[0])) < 1e-5
    assert float(share[:-1]) < 0.01 and span.count(' to ') == 1
    low, high = map(float, span.split(' to '))
    assert low <= float(time) <= high
    turned = np.abs(motion_of(request_within).rates[:, 1]).max()
    nearest = min(float(rows[f'speed of joint 2 {way}'][0].split()[0])
                  for way in ('forwards', 'backwards'))
    assert nearest == pytest.approx(2 - turned, abs=1e-3)
    assert rows['speed of joint 2 forwards'][-1] == '–'


def test_check_finds_limits_that_the_samples_do_not_keep(request_within: RecordedRequest,
                                                         rigid_model: ArmModel) -> None:
    check = check_motion(request_within, rigid_model)
    assert check.passed, [str(one) for one in check.findings if not one.passed]
    passed, less = limit_findings(request_within, motion_of(request_within), CheckLimits())
    assert passed.name == 'nearest limit, tip from post, passed by'
    assert passed.value == 0 and less.value < 1e-6
    texts = request_within.task.path_constraints
    request_within.task.path_constraints = [*texts[:1], 'joint_speed:2,0.9', *texts[2:]]
    try:
        failed = [one for one in check_motion(request_within, rigid_model).findings
                  if not one.passed]
    finally:
        request_within.task.path_constraints = texts
    fastest = np.abs(motion_of(request_within).rates[:, 1]).max()
    assert [one.name.partition(' joint')[0] for one in failed] == [
        'nearest limit, speed of', 'limits on the way, less left than reported']
    assert failed[0].value == pytest.approx(fastest / 0.9 - 1, rel=1e-9)


def test_check_finds_a_report_that_claims_more_room(request_within: RecordedRequest) -> None:
    shares = request_within.report.limit_shares
    request_within.report.limit_shares = np.asarray(shares) + 0.01
    try:
        found = limit_findings(request_within, motion_of(request_within), CheckLimits())
    finally:
        request_within.report.limit_shares = shares
    assert [one.passed for one in found] == [True, False]


def test_page_draws_regions_bounds_and_active_times(request_within: RecordedRequest) -> None:
    data = Page(report_page(request_within)).data
    plots = {plot['key']: plot for plot in data['plots']}
    post = plots['tip']['series'][-1]
    outline = np.array([data['axes'][post['x']], post['y']]).T
    np.testing.assert_allclose(np.linalg.norm(outline - POST.center, axis=1), 0.1)
    assert post['name'] == 'post' and post['filled']
    np.testing.assert_allclose(np.array(data['arm']['keep_outs']).reshape(-1, 2),
                               1e3 * outline_region(POST, 1.0), atol=1e-3)
    bounds = {key: {line['name']: set(line['y']) for line in plots[key]['series'][2:]}
              for key in ('positions', 'speeds')}
    assert bounds['speeds'] == {'joint2 limit': {2.0}, 'joint2 limit backwards': {-2.0}}
    np.testing.assert_allclose(list(bounds['positions']['joint2 lower limit']), np.degrees(-2.6))
    spans = dict(find_active_limits(request_within, motion_of(request_within)))['tip from post']
    for key in ('torques', 'positions', 'speeds', 'position_costates'):
        assert plots[key]['bands']['labels'] == ['tip from post']
        np.testing.assert_array_equal(plots[key]['bands']['ranges'], spans)


def test_nothing_is_added_without_limits(request_of_plan: RecordedRequest) -> None:
    assert not limit_tables(request_of_plan)
    data = Page(report_page(request_of_plan)).data
    assert data['arm']['keep_outs'] == []
    plots = {plot['key']: plot for plot in data['plots']}
    assert [len(plots[key]['series']) for key in ('positions', 'speeds', 'tip')] == [2, 2, 3]
    assert all(plots[key]['bands'] is None for key in ('torques', 'positions', 'speeds'))


def test_via_points_are_dots_where_they_are_passed(tmp_path: Path) -> None:
    request = RecordedRequest.read(recorded(
        tmp_path, 'plan', 'korayem_rigid', '--payload', '1', '--via', f'{VIA[0]},{VIA[1]}'))
    data = Page(report_page(request)).data
    plots = {plot['key']: plot for plot in data['plots']}
    (dot,) = (line for line in plots['tip']['series'] if line['name'] == 'via points')
    # a trajectory has a sample there
    np.testing.assert_allclose([data['axes'][dot['x']][0], dot['y'][0]], VIA, atol=2e-5)
    angles = [line for line in plots['positions']['series'] if line['dots']]
    assert [line['name'] for line in angles] == ['joint1 at via points', 'joint2 at via points']
    assert data['axes'][angles[0]['x']] == pytest.approx(list(request.report.via_times))


class Changed:
    """A message of which some fields are others."""

    def __init__(self, message: Any, **fields: Any) -> None:
        self.__dict__.update(message=message, **fields)

    def __getattr__(self, name: str) -> Any:
        return getattr(self.message, name)


@pytest.mark.parametrize(('part', 'fields'), [
    ('report', {'limit_times': [1.0]}), ('task', {'path_constraints': ['keep_out:1']}),
    ('task', {'path_constraints': ['joint_speed:7,1']})])
def test_recording_whose_limits_make_no_sense_is_refused(
        part: str, fields: dict[str, Any], limited: Path,
        monkeypatch: pytest.MonkeyPatch) -> None:
    motion_task = {'task': 'MotionTask', 'report': 'PlanReport'}[part]
    read = contents._Messages.read

    def spoilt(path: Path) -> Any:
        found = read(path)
        changed = Changed(found.messages[motion_task], **fields)
        return SimpleNamespace(messages={**found.messages, motion_task: changed},
                               left_out=found.left_out)

    monkeypatch.setattr(contents._Messages, 'read', spoilt)
    with pytest.raises(RecordingError, match='contradicts itself: .*(limits on the way|path_con)'):
        RecordedRequest.read(limited)
