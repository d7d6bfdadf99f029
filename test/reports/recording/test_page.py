"""The page of a recording: what it says, what its plots hold, and that a browser agrees."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path
import re
import shutil
import subprocess
from types import SimpleNamespace
from typing import Any

from flex_planner.arms.kinematics import link_points
from flex_planner.base.errors import RecordingError
from flex_planner.cli import main
from flex_planner.reports.recording import RecordedRequest, report_page, write_report
import numpy as np
import pytest
from report_support import Page, recorded

BROWSER = next(filter(None, map(shutil.which, (
    'chromium', 'chromium-browser', 'google-chrome', 'google-chrome-stable'))), None)
in_browser = pytest.mark.skipif(BROWSER is None, reason='no Chromium is installed')


@pytest.fixture(scope='module')
def search(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return recorded(tmp_path_factory.mktemp('search'), 'payload', 'korayem_rigid', '--accuracy',
                    '0.1')


# On the command line


def test_report_on_the_command_line(plan: Path, failure: Path, tmp_path: Path,
                                    monkeypatch: pytest.MonkeyPatch,
                                    capsys: pytest.CaptureFixture[str]) -> None:
    monkeypatch.chdir(tmp_path)
    assert main(['report', str(plan), '--check']) == 0
    assert 'the check of the recording passed' in capsys.readouterr().out
    assert main(['report', str(next(failure.glob('*.mcap')))]) == 0
    assert 'Failed, error 304' in capsys.readouterr().out
    assert {path.name for path in (tmp_path / 'output').iterdir()} == {
        f'{plan.name}.html', f'{failure.name}_0.html'}
    for arguments, complaint in ((['/nowhere'], 'cannot read /nowhere'),
                                 ([__file__], 'is damaged or not an MCAP file'),
                                 ([str(plan), '--output', '/nowhere/x.html'], 'cannot write'),
                                 ([str(failure), '--check'], 'no motion to check: impossible')):
        assert main(['report', *arguments]) == 1
        assert complaint in capsys.readouterr().err


def test_report_of_a_folder_of_recordings_is_that_of_the_newest(
        plan: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    for name in ('plan_path_20260101T000000_000000000_0002', 'my_own',
                 'find_max_payload_20260101T000000_000000001_0001'):
        shutil.copytree(plan, tmp_path / name)
        (tmp_path / name / f'{plan.name}_0.mcap').rename(tmp_path / name / f'{name}_0.mcap')
        metadata = tmp_path / name / 'metadata.yaml'
        metadata.write_text(metadata.read_text().replace(plan.name, name))
    # what cannot be read is no recording yet
    (tmp_path / 'plan_path_20270101T000000_000000000_0001').mkdir()
    page = tmp_path / 'page.html'
    assert main(['report', str(tmp_path), '--output', str(page)]) == 0
    told = capsys.readouterr().out
    assert 'find_max_payload_20260101T000000_000000001_0001' in told.splitlines()[0]
    assert page.name in {path.name for path in tmp_path.iterdir()}


# The page


@dataclass(frozen=True)
class Drawn:
    """A plot in the data of a page."""

    xs: list[np.ndarray[Any, Any]]
    ys: list[np.ndarray[Any, Any]]
    names: list[str]


def drawn(page: Page) -> dict[str, Drawn]:
    data = page.data
    return {plot['key']: Drawn(
        [np.array(data['axes'][line['x']], dtype=float) for line in plot['series']],
        [np.array(line['y'], dtype=float) for line in plot['series']],
        [line['name'] for line in plot['series']]) for plot in data['plots']}


def test_plots_show_the_recorded_numbers(request_of_plan: RecordedRequest) -> None:
    motion, found = request_of_plan.motion, drawn(Page(report_page(request_of_plan)))
    assert motion is not None
    n = 2
    for name, values in (('torques', motion.torques),
                         ('positions', np.degrees(motion.coordinates[:, :n])),
                         ('speeds', motion.rates[:, :n]),
                         ('modes', 1e3 * motion.coordinates[:, n:]),
                         ('modal_rates', 1e3 * motion.rates[:, n:]),
                         ('position_costates', motion.position_costates),
                         ('velocity_costates', motion.velocity_costates)):
        plot = found[name]
        # written with nine digits
        np.testing.assert_allclose(np.array(plot.ys[:values.shape[1]]).T, values, rtol=1e-8)
        np.testing.assert_allclose(plot.xs[0], motion.times, rtol=1e-8)
    np.testing.assert_allclose(np.array([found['tip'].xs[0], found['tip'].ys[0]]).T, motion.tip,
                               rtol=1e-8)
    assert found['torques'].names[2:] == [
        f'{joint} {end}' for end in ('lowest', 'highest') for joint in ('joint1', 'joint2')]


def test_moving_arm_is_that_of_the_recording(request_of_plan: RecordedRequest) -> None:
    motion, arm = request_of_plan.motion, request_of_plan.arm
    assert motion is not None
    found = Page(report_page(request_of_plan)).data['arm']
    times = np.array(found['times'])
    assert (times[0], times[-1]) == (motion.times[0], motion.times[-2])  # the last one holds
    links = np.array(found['links']).reshape(times.size, arm.n_joints, -1, 2)
    for k in (0, 77, times.size - 1):
        posture = np.array([np.interp(times[k], motion.times, column)
                            for column in motion.coordinates.T])
        # to a tenth of a micrometre, and times to a microsecond
        np.testing.assert_allclose(links[k], 1e3 * link_points(arm, posture, 13), atol=1e-2)
    np.testing.assert_allclose(links[-1, -1, -1], 1e3 * motion.tip[-1], atol=1e-3)
    np.testing.assert_allclose(links[:, 1:, 0], links[:, :-1, -1])  # a link begins where one ends
    middle = links[:, 0, 6] - (links[:, 0, 0] + links[:, 0, -1]) / 2
    assert np.abs(middle).max() > 0.05  # [mm]: the links are drawn bent
    left, low, width, height = found['box']
    inside = (links >= (left, low)) & (links <= (left + width, low + height))
    assert inside.all()


def test_page_of_a_failure_has_no_arm(failure: Path) -> None:
    assert Page(report_page(RecordedRequest.read(failure))).data['arm'] is None


def test_coordinates_keep_their_colours_from_plot_to_plot(
        request_of_plan: RecordedRequest) -> None:
    plots = {plot['key']: [line['colour'] for line in plot['series']]
             for plot in Page(report_page(request_of_plan)).data['plots']}
    joints, modes = plots['positions'], plots['modes']
    assert len({*joints, *modes}) == len(joints) + len(modes)
    assert plots['torques'] == 3 * joints  # bounds, too
    assert plots['position_costates'] == [*joints, *modes] == plots['velocity_costates']
    assert plots['modal_rates_spectrum'] == modes


def test_page_tells_what_a_controller_makes_of_the_trajectory(
        request_of_plan: RecordedRequest) -> None:
    tables = {table['title']: dict(table['rows']) for table in Page(
        report_page(request_of_plan)).data['tables'] if not table['columns']}
    carried = tables['Published trajectory, carried out']
    assert carried['published trajectory'].endswith('at 1000 Hz, effort_hold end')
    assert carried['  executed tip error'].endswith(' mm')
    others = tables['Residual vibration with feedback if ...']
    assert list(others) == ['2 more modes per link', 'stiffness +-10%', 'payload +-10%',
                            'nothing differs']
    found = request_of_plan.report.vibration_if_stiffness_differs
    assert others['stiffness +-10%'] == f'{found * 1e3:.2g} mm'
    assert 'residual vibration if stiffness differs' in tables['Warnings'][
        'sensitive to the stiffness']


def test_plots_of_searches_show_front_and_trials(search: Path, trials: Path) -> None:
    message = RecordedRequest.read(search).search
    front = drawn(Page(report_page(RecordedRequest.read(search))))['front']
    np.testing.assert_allclose(front.xs[0], message.front_payloads, rtol=1e-8)
    np.testing.assert_allclose(front.ys[0], message.front_efforts, rtol=1e-8)
    message = RecordedRequest.read(trials).search
    tried = drawn(Page(report_page(RecordedRequest.read(trials))))['trials']
    np.testing.assert_allclose(tried.ys[0], message.tried_payloads, rtol=1e-8)
    assert tried.names == ['tried', 'carried', 'not carried']


def test_page_loads_nothing_and_names_nothing_by_its_content(plan: Path, failure: Path) -> None:
    for path in (plan, failure):
        request = RecordedRequest.read(path)
        request.report.error_msg = '</script><script>alert(1)</script> <b>&'
        text = report_page(request)
        page = Page(text)
        assert [tag for tag, _ in page.tags].count('script') == 2
        assert not [name for _, attributes in page.tags for name in attributes
                    if name in ('src', 'href')]
        assert not re.search(r'https?:|import\(|@import|url\(', text)


def test_page_lists_the_warnings_and_older_recordings_have_none(
        request_of_plan: RecordedRequest) -> None:
    def warned(request: RecordedRequest) -> list[list[str]]:
        found = Page(report_page(request)).data['tables']
        return [row for table in found if table['title'] == 'Warnings' for row in table['rows']]

    rows = dict(warned(request_of_plan))
    assert rows.keys() == {'the torque jumps', 'sensitive to the stiffness'}
    assert rows['the torque jumps'].startswith('the torque jumps by shares of the stall torque: ')
    older = SimpleNamespace(**{name: getattr(request_of_plan.report, name)
                               for name in dir(request_of_plan.report) if name[0] != '_'
                               and not name.startswith('warning')})
    assert warned(replace(request_of_plan, report=older)) == []


def test_page_tells_where_the_arm_was_and_what_its_controller_did(
        request_of_plan: RecordedRequest) -> None:
    def rows(**fields: object) -> dict[str, str]:
        report = SimpleNamespace(**{name: getattr(request_of_plan.report, name)
                                    for name in dir(request_of_plan.report) if name[0] != '_'})
        vars(report).update(fields)
        page = Page(report_page(replace(request_of_plan, report=report)))
        return {row[0]: row[1] for table in page.data['tables'] for row in table['rows']}

    assert not {'arm measured at', 'controller'} & rows().keys()
    took = SimpleNamespace(sec=1, nanosec=250_000_000)
    told = rows(measured_positions=[0.0, np.pi / 2], execution_time=took, execution_accepted=True,
                execution_error_code=-4, execution_error_string='joint2 is 0.3 rad off')
    assert told['arm measured at'] == '(0, 90) deg'
    assert told['controller'] == 'accepted, ended after 1.250 s, error -4 joint2 is 0.3 rad off'


def test_page_of_a_failure_tells_the_error(failure: Path) -> None:
    page = Page(report_page(RecordedRequest.read(failure)))
    assert page.data['plots'] == []
    rows = {row[0]: row[1] for table in page.data['tables'] for row in table['rows']}
    assert rows['error code'] == '304'
    assert rows['error'].startswith('impossible for every motion: the motors give at most ')
    assert rows['payload'] == '100 kg, 0 kg m²'


def test_report_replaces_an_older_one_only_when_it_is_complete(
        request_of_plan: RecordedRequest, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    page = tmp_path / 'page.html'
    page.write_text('older')

    def full(self: Path, *arguments: Any, **options: Any) -> int:
        raise OSError(28, 'No space left on device')

    with monkeypatch.context() as patch:
        patch.setattr(Path, 'write_text', full)
        with pytest.raises(RecordingError, match=r'cannot write .*/page.html: No space left'):
            write_report(page, request_of_plan)
    assert page.read_text() == 'older'
    write_report(page, request_of_plan)
    assert page.read_text().startswith('<!DOCTYPE html>')
    assert [path.name for path in tmp_path.iterdir()] == ['page.html']


# In a browser


USER = """
<script>
const result = document.body.dataset;
const canvas = document.querySelector('#torques canvas');
const box = () => canvas.getBoundingClientRect();
function mouse(kind, share) {
  canvas.dispatchEvent(new PointerEvent(kind, {
    clientX: box().left + share * box().width, clientY: box().top + 60, pointerId: 1 }));
}
canvas.setPointerCapture = () => {};
const first = canvas.toDataURL();
const other = document.querySelector('#speeds canvas');
const second = other.toDataURL();
mouse('pointermove', 0.5);
result.readouts = [...document.querySelectorAll('#torques output')].map((o) => o.textContent);
mouse('pointerleave', 0.5);
mouse('pointerdown', 0.4);
mouse('pointermove', 0.6);
mouse('pointerup', 0.6);
result.zoomed = first !== canvas.toDataURL() && second !== other.toDataURL();
canvas.dispatchEvent(new MouseEvent('dblclick'));
mouse('pointerleave', 0.5);
result.restored = first === canvas.toDataURL() && second === other.toDataURL();
document.querySelector('#torques button').click();
result.hidden = first !== canvas.toDataURL();
const slider = document.querySelector('#arm input');
const shapes = () => [...document.querySelectorAll('#arm polyline')].slice(-2)
  .map((line) => line.getAttribute('points'));
const began = shapes();
slider.value = slider.max;
slider.dispatchEvent(new Event('input'));
const hand = [...document.querySelectorAll('#arm circle')].at(-1);
result.hand = `${hand.getAttribute('cx')},${hand.getAttribute('cy')}`;
result.corners = shapes()[0].split(' ').length;
result.moved = began[0] !== shapes()[0] && began[1] !== shapes()[1];
result.followed = [...document.querySelectorAll('#speeds output')].every((o) => o.textContent);
document.querySelector('#arm button').click();
result.plays = document.querySelector('#arm button').textContent === 'Pause'
  && Number(slider.value) === Number(slider.min);
const marked = document.querySelector('#modes_spectrum canvas');
const bands = marked.toDataURL();
[...document.querySelectorAll('#modes_spectrum button')].at(-1).click();
result.bands = bands !== marked.toDataURL();
</script>
</body>
"""


def opened(page: Path, *options: str) -> str:
    """Return what a browser makes of a page."""
    assert BROWSER is not None
    result = subprocess.run(
        [BROWSER, '--headless', '--no-sandbox', '--disable-gpu', '--disable-dev-shm-usage',
         f'--user-data-dir={page.parent / "profile"}', '--window-size=1200,3000', *options,
         f'file://{page}'], capture_output=True, text=True, timeout=120, check=True)
    assert 'Uncaught' not in result.stderr
    return result.stdout


@in_browser
def test_browser_draws_zooms_and_toggles(plan: Path, tmp_path: Path) -> None:
    request = RecordedRequest.read(plan)
    page = tmp_path / 'page.html'
    page.write_text(report_page(request).replace('</body>', USER), encoding='utf-8')
    for _ in range(3):  # on a busy machine the browser may not have drawn by the time it is asked
        seen = opened(page, '--enable-logging=stderr', '--dump-dom')
        attributes = dict(re.findall(r'data-(\w+)="([^"]*)"', seen))
        worked = {attributes[name] for name in (
            'zoomed', 'restored', 'hidden', 'bands', 'moved', 'followed', 'plays')}
        if worked == {'true'}:
            break
    assert attributes['plots'] == '10'
    assert worked == {'true'}
    assert all(float(value) for value in attributes['readouts'].split(','))
    assert 'Certificate when planned' in seen
    assert request.motion is not None
    hand = [float(value) for value in attributes['hand'].split(',')]
    np.testing.assert_allclose(hand, 1e3 * request.motion.tip[-1], atol=1e-3)
    assert attributes['corners'] == '26'  # of 13 points


@in_browser
def test_browser_shows_the_page_of_a_failure(failure: Path, tmp_path: Path) -> None:
    write_report(tmp_path / 'page.html', RecordedRequest.read(failure))
    picture = tmp_path / 'page.png'
    opened(tmp_path / 'page.html', f'--screenshot={picture}')
    assert picture.read_bytes().startswith(b'\x89PNG')


def test_script_is_sound() -> None:
    node = shutil.which('node')
    if node is None:
        pytest.skip('no node is installed')
    folder = Path(__file__).parents[3] / 'flex_planner' / 'reports' / 'recording'
    for name in ('player.js', 'arm.js', 'space.js', 'plots.js'):
        subprocess.run([node, '--check', str(folder / name)], check=True)


def test_lists_of_different_lengths_are_shown_as_far_as_they_go(
        request_of_plan: RecordedRequest) -> None:
    report = SimpleNamespace(**{name: getattr(request_of_plan.report, name)
                                for name in dir(request_of_plan.report) if name[0] != '_'})
    report.warnings, report.kind_values = [*report.warnings, 'one more'], [0.5, 0.6, 0.7]
    report.saturation, report.tried_objectives = [], ['speed']
    report.tried_weights, report.tried_shares = [1.0, 2.0], []
    found = Page(report_page(replace(request_of_plan, report=report))).data['tables']
    shown = {table['title'].split(',')[0]: table['rows'] for table in found}
    assert shown['Warnings'][-1] == ['nan', 'one more']
    assert len(shown['Kinds of motion']) == 3
    assert shown['Motors'][0][-1] == '–'
    assert shown['Weights tried for the objectives'][1] == ['nan', '2', 'nan']
