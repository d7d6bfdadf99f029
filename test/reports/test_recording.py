"""Reports of recordings: what is checked again, what the page shows, and that browsers agree."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from html.parser import HTMLParser
import json
from pathlib import Path
import re
import shutil
import subprocess
import sys
from typing import Any

from flex_planner.base.errors import RecordingError
from flex_planner.base.progress import Monitor, StoppedError
from flex_planner.base.validation import Array
from flex_planner.cli import main
from flex_planner.dynamics.integration import simulate
from flex_planner.optimal_control.arm_model import ArmModel
from flex_planner.recording import (
    definition_folder,
    MessageTypes,
    read_attachments,
    read_recording,
    Recording,
)
from flex_planner.reports.recording import check_motion, RecordedRequest, report_page, write_report
from flex_planner.reports.recording.check import resimulated_states
from flex_planner.reports.recording.frequencies import NaturalFrequencies
from flex_planner.reports.recording.spectra import spectrum
import numpy as np
import pytest

TASK = ['--from', '0.5,0', '--to', '0.5,0.5', '--duration', '1', '--effort-weights', '0.125,0.125',
        '--no-plot']
BROWSER = next(filter(None, map(shutil.which, (
    'chromium', 'chromium-browser', 'google-chrome', 'google-chrome-stable'))), None)
in_browser = pytest.mark.skipif(BROWSER is None, reason='no Chromium is installed')


def recorded(folder: Path, *arguments: str) -> Path:
    main([*arguments, *TASK, '--output', str(folder)])
    (path,) = (folder / 'recordings').iterdir()
    return path


@pytest.fixture(scope='module')
def plan(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return recorded(tmp_path_factory.mktemp('plan'), 'plan', 'korayem_ei50', '--payload', '0.8',
                    '--velocity-weights', '0.5,0.25')


@pytest.fixture(scope='module')
def failure(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return recorded(tmp_path_factory.mktemp('failure'), 'plan', 'korayem_rigid', '--payload',
                    '100')


@pytest.fixture(scope='module')
def search(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return recorded(tmp_path_factory.mktemp('search'), 'payload', 'korayem_rigid', '--accuracy',
                    '0.1')


@pytest.fixture(scope='module')
def trials(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return recorded(tmp_path_factory.mktemp('trials'), 'payload', 'korayem_rigid', '--method',
                    'incremental', '--accuracy', '2', '--step', '3')


@pytest.fixture(scope='module')
def request_of_plan(plan: Path) -> RecordedRequest:
    return RecordedRequest.read(plan)


def failed_findings(request: RecordedRequest, model: ArmModel) -> set[str]:
    return {finding.name for finding in check_motion(request, model).findings
            if not finding.passed}


def with_motion(request: RecordedRequest, **changes: Any) -> RecordedRequest:
    assert request.motion is not None
    return replace(request, motion=replace(request.motion, **changes))


# Reading


def test_recording_is_read_back_into_the_terms_of_the_core(
        request_of_plan: RecordedRequest, ei50_model: ArmModel) -> None:
    found, arm = request_of_plan, ei50_model.arm
    assert (found.arm.links, found.arm.joints, found.arm.nodes) == (
        arm.links, arm.joints, arm.nodes)
    assert found.motion is not None
    assert found.motion.coordinates.shape == (found.motion.times.size, 6)
    assert (found.parameters.payload_mass, found.tolerance) == (0.8, 1e-3)
    assert found.parameters.velocity_weights.tolist() == [0.5, 0.25, 0, 0, 0, 0]
    assert found.solved


@pytest.mark.parametrize('attachment', [b'', b'{arm: {}, parameters: {}}', b'a: [', b'x: 1'])
def test_recordings_of_others_are_refused(plan: Path, tmp_path: Path, attachment: bytes) -> None:
    types = MessageTypes.load([definition_folder('flex_planner_interfaces')])
    with Recording.create(tmp_path, 'other', types) as recording:
        if attachment:
            recording.attach('scenario.yaml', attachment, media_type='application/yaml')
        for entry in read_recording(plan, types, ['/flex_planner/motion_task',
                                                  '/flex_planner/plan_report']):
            recording.write(entry.topic, entry.message, entry.log_time_ns)
    with pytest.raises(RecordingError, match=r'/other (is not the rec|contradicts|has a sc)'):
        RecordedRequest.read(recording.path)


def test_recording_without_a_request_is_refused(plan: Path, tmp_path: Path) -> None:
    with Recording.create(tmp_path, 'other', MessageTypes.load()) as recording:
        recording.attach('scenario.yaml', read_attachments(plan)['scenario.yaml'], media_type='')
    with pytest.raises(RecordingError, match='it has no MotionTask with a PlanReport'):
        RecordedRequest.read(recording.path)


def test_reports_do_not_take_ros(plan: Path) -> None:
    code = ('import sys; from flex_planner.reports.recording import *; '
            f'report_page(RecordedRequest.read({str(plan)!r})); '
            'assert not {"rclpy", "casadi", "matplotlib"} & set(sys.modules)')
    subprocess.run([sys.executable, '-c', code], check=True)


# Checking


@pytest.mark.parametrize(('name', 'model'), [('plan', 'ei50_model'), ('trials', 'rigid_model')])
def test_recorded_plans_pass_their_check(name: str, model: str,
                                         request: pytest.FixtureRequest) -> None:
    recording = RecordedRequest.read(request.getfixturevalue(name))
    check = check_motion(recording, request.getfixturevalue(model))
    assert check.passed
    found = {finding.name: finding for finding in check.findings}
    # of linear interpolation between samples, whose torques differ by up to 0.02 N m
    assert found['tip error at the end'].value < 1e-4
    assert found['torques against eq. (14)'].value < 1e-9
    assert found['boundary error (eq. 17)'].recorded == recording.report.boundary_error


@pytest.mark.parametrize(('change', 'expected'), [
    (lambda motion: {'torques': 1.02 * motion.torques},
     {'tip error at the end', 'largest tip deviation', 'torques against eq. (14)'}),
    (lambda motion: {'torques': 3 * motion.torques},
     {'tip error at the end', 'largest tip deviation', 'torques against eq. (14)',
      'boundary error (eq. 17)', 'torque beyond its bounds'}),
    (lambda motion: {'payload_mass': 1.0},
     {'tip error at the end', 'largest tip deviation', 'torques against eq. (14)'}),
    (lambda motion: {'tip': motion.tip + 0.01}, {'tip error at the end', 'largest tip deviation'}),
    (lambda motion: {'rates': 1.02 * motion.rates}, {'largest joint deviation'}),
    (lambda motion: {'velocity_costates': 0.9 * motion.velocity_costates},
     {'torques against eq. (14)', 'Hamiltonian drift'}),
    (lambda motion: {'torques': np.full_like(motion.torques, 1e200)}, {
        'tip error at the end', 'largest tip deviation', 'torques against eq. (14)',
        'boundary error (eq. 17)', 'torque beyond its bounds'}),
    (lambda motion: {'rates': motion.rates + 1e-3}, {
        'deviation from rest, start', 'deviation from rest, goal'})])
def test_every_falsified_plan_is_found_out(request_of_plan: RecordedRequest, ei50_model: ArmModel,
                                           change: Callable[[Any], dict[str, Any]],
                                           expected: set[str]) -> None:
    changed = with_motion(request_of_plan, **change(request_of_plan.motion))
    assert failed_findings(changed, ei50_model) >= expected


def test_plan_of_another_task_is_found_out(request_of_plan: RecordedRequest,
                                           ei50_model: ArmModel) -> None:
    original = request_of_plan.task.goal_point
    request_of_plan.task.goal_point = type(original)(0.5, 0.4, 0.0)
    try:
        assert failed_findings(request_of_plan, ei50_model) == {'deviation from task, goal'}
    finally:
        request_of_plan.task.goal_point = original


def test_resimulation_agrees_with_an_integrator_of_another_kind(
        ei50_model: ArmModel, request_of_plan: RecordedRequest) -> None:
    motion, p = request_of_plan.motion, request_of_plan.parameters.stacked()
    assert motion is not None
    times = np.linspace(0, 0.1, 5)
    torques = np.array([np.interp(times, motion.times, column) for column in motion.torques.T]).T
    start = np.concatenate([motion.coordinates[0], motion.rates[0]])
    ours = resimulated_states(ei50_model, p, start, times, torques, Monitor())
    state = start
    for k, length in enumerate(np.diff(times)):
        slope = (torques[k + 1] - torques[k]) / length
        state = simulate(ei50_model, p, state, lambda t, u=torques[k], slope=slope: u + t * slope,
                         length, rtol=1e-10, atol=1e-12)
    assert np.abs(ours[-1] - state).max() < 1e-9


def test_check_obeys_its_monitor_and_needs_a_motion(request_of_plan: RecordedRequest,
                                                    ei50_model: ArmModel, failure: Path) -> None:
    with pytest.raises(StoppedError):
        check_motion(request_of_plan, ei50_model, Monitor(canceled=lambda: True))
    with pytest.raises(RecordingError, match='has no motion to check: impossible'):
        check_motion(RecordedRequest.read(failure))


def test_falsified_recording_fails_on_the_command_line(plan: Path, tmp_path: Path,
                                                       capsys: pytest.CaptureFixture[str]) -> None:
    types = MessageTypes.load([definition_folder('flex_planner_interfaces')])
    with Recording.create(tmp_path, 'forged', types) as recording:
        recording.attach('scenario.yaml', read_attachments(plan)['scenario.yaml'], media_type='')
        for entry in read_recording(plan, types):
            for point in getattr(getattr(entry.message, 'joint_trajectory', None), 'points', ()):
                point.effort = 1.1 * point.effort
            recording.write(entry.topic, entry.message, entry.log_time_ns)
    page = tmp_path / 'forged.html'
    assert main(['report', str(recording.path), '--check', '--output', str(page)]) == 1
    assert 'the check of the recording FAILED (tip error at the end' in capsys.readouterr().out
    assert 'class="verdict failed"' in page.read_text()


def test_report_on_the_command_line(plan: Path, failure: Path, tmp_path: Path,
                                    monkeypatch: pytest.MonkeyPatch,
                                    capsys: pytest.CaptureFixture[str]) -> None:
    monkeypatch.chdir(tmp_path)
    assert main(['report', str(plan), '--check']) == 0
    assert 'the check of the recording passed' in capsys.readouterr().out
    assert main(['report', str(next(failure.glob('*.mcap')))]) == 0
    assert 'Failed, error 304' in capsys.readouterr().out
    assert {path.name for path in tmp_path.iterdir()} == {
        f'{plan.name}.html', f'{failure.name}_0.html'}
    for arguments, complaint in ((['/nowhere'], 'cannot read /nowhere'),
                                 ([__file__], 'is damaged or not an MCAP file'),
                                 ([str(plan), '--output', '/nowhere/x.html'], 'cannot write'),
                                 ([str(failure), '--check'], 'no motion to check: impossible')):
        assert main(['report', *arguments]) == 1
        assert complaint in capsys.readouterr().err


# The page


class Page(HTMLParser):
    """Tags, and the text of scripts, of a page that opens and closes every element."""

    EMPTY = {'meta', 'br', 'link', 'img'}

    def __init__(self, text: str) -> None:
        super().__init__()
        self.tags: list[tuple[str, dict[str, str | None]]] = []
        self.scripts: list[str] = []
        self._open: list[str] = []
        self.feed(text)
        self.close()
        assert not self._open

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.tags.append((tag, dict(attrs)))
        if tag not in self.EMPTY:
            self._open.append(tag)

    def handle_endtag(self, tag: str) -> None:
        assert self._open.pop() == tag

    def handle_data(self, data: str) -> None:
        if self._open and self._open[-1] == 'script':
            self.scripts.append(data)

    @property
    def data(self) -> dict[str, Any]:
        return dict(json.loads(self.scripts[0]))


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
    for name, values in (('torques', motion.torques), ('positions', motion.coordinates[:, :n]),
                         ('speeds', motion.rates[:, :n]), ('modes', motion.coordinates[:, n:]),
                         ('modal_rates', motion.rates[:, n:]),
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


def test_page_of_a_failure_tells_the_error(failure: Path) -> None:
    page = Page(report_page(RecordedRequest.read(failure)))
    assert page.data['plots'] == []
    rows = {row[0]: row[1] for table in page.data['tables'] for row in table['rows']}
    assert rows['error code'] == '304'
    assert rows['error'].startswith('impossible within the limits of the motors')
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


@pytest.mark.parametrize('length', [400, 401])
def test_spectrum_has_the_amplitude_of_a_sine(length: int) -> None:
    times = np.arange(length) / length * 2.0
    values = 3.0 + 0.25 * np.sin(2 * np.pi * 20 * times + 0.3)
    frequencies, amplitudes = spectrum(times, values[:, None])
    assert frequencies[amplitudes[:, 0].argmax()] == pytest.approx(20)
    assert amplitudes.max() == pytest.approx(0.25, rel=1e-6)


def test_spectrum_of_uneven_times_is_that_of_even_ones() -> None:
    def signal(times: Array) -> Array:
        return np.stack([np.sin(2 * np.pi * 9 * times), 0.1 * np.cos(2 * np.pi * 24 * times)], 1)

    # the spectrum is of as many times as are four in the longest step
    even = np.arange(801) / 801 * 2
    uneven = np.sort(np.concatenate([even[::4], np.linspace(0.503, 0.508, 20)]))
    wanted, found = (spectrum(times, signal(times)) for times in (even, uneven))
    shown = min(len(wanted[0]), len(found[0]))
    assert wanted[0][shown - 1] > 24
    np.testing.assert_allclose(found[0][:shown], wanted[0][:shown], rtol=1e-9)
    np.testing.assert_allclose(found[1][:shown], wanted[1][:shown], atol=2e-3)
    assert wanted[1].max(axis=0) == pytest.approx([1, 0.1], rel=1e-3)


def test_spectrum_of_no_signals_or_a_single_time_is_empty() -> None:
    assert spectrum(np.array([0, 0.1, 0.3, 0.4]), np.ones((4, 0)))[1].shape == (0, 0)
    assert spectrum(np.zeros(1), np.ones((1, 2)))[1].shape == (0, 2)


# Natural frequencies


def test_natural_frequencies_are_those_of_the_arm_over_its_postures(
        request_of_plan: RecordedRequest) -> None:
    found = NaturalFrequencies.of(request_of_plan)
    assert found is not None
    # as flex-planner arm tells them: pinned links do not feel the payload while joints are locked
    expected = np.array([[18.14] * 2, [18.14] * 2, [72.55] * 2, [72.55] * 2])
    np.testing.assert_allclose(found.locked, expected, atol=5e-3)
    assert (found.free[:, 0] > found.locked[:, 1]).all()
    assert (np.ptp(found.free, axis=1) > 0.05).all()  # they depend on the posture


def test_spectra_peak_at_the_natural_frequencies_with_the_joints_free(
        request_of_plan: RecordedRequest) -> None:
    motion, found = request_of_plan.motion, NaturalFrequencies.of(request_of_plan)
    assert motion is not None
    assert found is not None
    lines, amplitudes = spectrum(motion.times[:-1], motion.coordinates[:-1, 2:])
    for ends in found.free.reshape(2, 4)[:, [0, 3]]:  # pairs that the spectrum cannot tell apart
        near = np.flatnonzero(np.abs(lines - ends.mean()) < 15)
        peaks = lines[near[amplitudes[near].argmax(axis=0)]]
        # a line of the spectrum is 1 Hz wide
        assert (peaks > ends[0] - 1).all()
        assert (peaks < ends[1] + 1).all()


def test_natural_frequencies_are_marked_in_the_spectra_and_named(
        request_of_plan: RecordedRequest) -> None:
    data, found = Page(report_page(request_of_plan)).data, NaturalFrequencies.of(request_of_plan)
    assert found is not None
    marked = {plot['key']: plot['bands'] for plot in data['plots'] if plot['bands']}
    assert marked.keys() == {'modes_spectrum', 'modal_rates_spectrum'}
    for bands in marked.values():
        assert bands['name'] == 'natural frequencies, joints free, over the postures of the motion'
        assert bands['labels'] == ['f1', 'f2', 'f3', 'f4']
        np.testing.assert_allclose(bands['ranges'], found.free, rtol=1e-12)
    (table,) = [table for table in data['tables'] if table['title'].startswith('Natural freq')]
    assert table['columns'] == ['', 'joints free (marked in the spectra)', 'joints locked']
    assert table['rows'][0][2] == '18.14'


def test_rigid_arms_and_failures_have_no_natural_frequencies(trials: Path, failure: Path) -> None:
    for path in (trials, failure):
        request = RecordedRequest.read(path)
        assert NaturalFrequencies.of(request) is None
        assert 'natural frequencies, joints free' not in report_page(request)


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
        worked = {attributes[name] for name in ('zoomed', 'restored', 'hidden', 'bands')}
        if worked == {'true'}:
            break
    assert attributes['plots'] == '10'
    assert worked == {'true'}
    assert all(float(value) for value in attributes['readouts'].split(','))
    assert 'Certificate when planned' in seen


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
    script = Path(__file__).parents[2] / 'flex_planner' / 'reports' / 'recording' / 'plots.js'
    subprocess.run([node, '--check', str(script)], check=True)
