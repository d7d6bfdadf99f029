"""The paper, recomputed: a reduced run as a whole, and its parts."""

from __future__ import annotations

from collections.abc import Iterator
import math
from pathlib import Path
import signal
import subprocess
import sys
import time
from typing import NamedTuple

from flex_planner.cli import main
from flex_planner.optimal_control.arm_model import ArmModel
from flex_planner.optimal_control.motion_problem import task_parameters
from flex_planner.optimal_control.torque_limits import TorqueLimits
from flex_planner.paper.cases import (
    NoPlanError,
    paper_arm,
    plan_certified,
    point_to_point,
    turn,
    turning_arm,
)
from flex_planner.paper.diagrams import joint_panels, runs_on_limit
from flex_planner.paper.document import document
from flex_planner.paper.evidence import Claim, judge, Section, Table, Verdict
from flex_planner.paper.run import compute_sections, STUDIES
from flex_planner.paper.sections.slips import PrintedProblem
from flex_planner.plotting.diagrams import Curve, Panel, Picture
from flex_planner.plotting.figures import save
from flex_planner.plotting.panels import draw_picture
import numpy as np
import pytest
import yaml

GOLDEN = yaml.safe_load((Path(__file__).parents[1] / 'data' / 'paper.yaml').read_text())
FIGURES = [*range(4, 15), *range(16, 21)]


class Run(NamedTuple):
    """A reduced run: where it wrote, and what it found."""

    folder: Path
    sections: dict[str, Section]
    reports: list[tuple[str, int, int]]


@pytest.fixture(scope='module')
def run(tmp_path_factory: pytest.TempPathFactory) -> Run:
    folder, reports = tmp_path_factory.mktemp('paper'), []
    sections = compute_sections(list(STUDIES), reduced=True, processes=2, pictures=folder,
                                report=lambda *report: reports.append(report))
    return Run(folder, sections, reports)


@pytest.fixture(scope='module')
def values(run: Run) -> dict[str, float]:
    return {name: value for section in run.sections.values()
            for name, value in section.values.items()}


@pytest.mark.parametrize('name', GOLDEN)
def test_value_is_that_of_its_source(values: dict[str, float], name: str) -> None:
    expected, tolerance, source = GOLDEN[name]
    assert values[name] == pytest.approx(expected, abs=tolerance), source


def test_printed_costate_equation_is_no_hamiltonian_system(values: dict[str, float]) -> None:
    assert values['printed_drift'] > 1e4 * values['right_drift']
    assert values['appendix_j_r12'] > 0.1


def test_price_on_modal_rates_calms_both_links(values: dict[str, float]) -> None:
    for link in (1, 2):
        before, after = (values[f'vibration_rms_{weight}_link_{link}'] for weight in (0, 500))
        assert after < 0.7 * before


def test_every_section_is_told_of_once_and_in_its_order(run: Run) -> None:
    assert list(run.sections) == list(STUDIES)
    assert sorted(key for key, _, _ in run.reports) == sorted(STUDIES)
    assert [done for _, done, _ in run.reports] == list(range(1, len(STUDIES) + 1))
    for key, section in run.sections.items():
        assert section.key == key
        assert all(len(row) == len(table.header) for table in section.tables
                   for row in table.rows)


def test_every_figure_of_the_paper_is_drawn(run: Run) -> None:
    drawn = {path.name for path in run.folder.glob('*.png')}
    assert {f'fig{number:02}.png' for number in FIGURES} <= drawn
    assert drawn == {f'{picture.name}.png' for section in run.sections.values()
                     for picture in section.pictures}


def test_independent_method_agrees_in_every_section(run: Run) -> None:
    for key in ('5.2', '5.4', '5.5'):
        compared = 0
        for table in run.sections[key].tables:
            ours = next(k for k, name in enumerate(table.header) if name in ('J', 'J, rigid'))
            theirs = table.header.index('J, IPOPT')
            for row in table.rows:
                if row[theirs]:
                    assert float(row[theirs]) == pytest.approx(float(row[ours]), rel=1e-5)
                    compared += 1
        assert compared
    largest = run.sections['5.3'].tables[-1]
    for row in largest.rows:
        assert float(row[largest.header.index('IPOPT [kg]')]) == pytest.approx(
            float(row[2]), abs=2e-3)


def test_clamped_links_carry_less_if_they_are_soft() -> None:
    section = STUDIES['6.2']()  # the reduced run leaves these searches out
    assert section.values['clamped_limit_50'] == pytest.approx(5.687, abs=1e-3)
    assert section.values['clamped_limit_5'] == pytest.approx(3.128, abs=1e-3)
    assert [claim.verdict for claim in section.claims] == [Verdict.CORRECTED]


def test_statements_that_a_number_decides(run: Run) -> None:
    verdicts = {claim.said: claim.verdict for section in run.sections.values()
                for claim in section.claims}
    assert verdicts['The rigid arm carries 5.85 kg.'] is Verdict.CONFIRMED
    assert verdicts['Other weights lead to other, smaller largest payloads: 4.6 kg with '
                    'w_2 = 1000.'] is Verdict.CORRECTED
    assert set(verdicts.values()) == set(Verdict)


def test_page_has_everything(run: Run) -> None:
    page = document(list(run.sections.values()), 'images/paper', 'Made here.')
    for section in run.sections.values():
        assert f'## {section.key} {section.title}' in page
        for table in section.tables:
            assert table.title in page
        for claim in section.claims:
            assert claim.said in page
            assert claim.found in page
        for picture in section.pictures:
            assert f'](images/paper/{picture.name}.png)' in page
    assert page.endswith('Made here.\n')
    assert 'inf' not in page.replace('infeasible', '').split()
    assert 'nan' not in page.split()
    assert 'did not converge' not in page


def test_grid_keeps_its_columns_whatever_is_in_a_cell() -> None:
    table = Table(title='t', header=('a', 'b'), rows=(('x|y', 'z'),))
    page = document([Section(key='1', title='s', text='', tables=(table,))], '.', '')
    assert '| x\\|y | z |' in page


def test_verdict_follows_the_number() -> None:
    assert judge(holds=True) is Verdict.CONFIRMED
    assert judge(holds=False) is Verdict.CORRECTED
    claim = Claim(said='s', found='f', verdict=Verdict.CORRECTED)
    page = document([Section(key='1', title='s', text='', claims=(claim,))], '.', '')
    assert 'Of 1 statements put to the test: 0 confirmed, 1 corrected, 0 not reproducible' in page


@pytest.fixture
def heavy() -> Iterator[PrintedProblem]:
    plan = plan_certified(point_to_point(paper_arm(math.inf), 5.5))
    yield PrintedProblem(plan.model, plan.task, task_parameters(plan.task))


def test_printed_problem_has_the_jacobian_of_its_rate(heavy: PrintedProblem) -> None:
    plan = plan_certified(heavy.task)
    assert plan.solution is not None
    t = np.array([0.05, 0.3, 0.7, 0.95])
    z = plan.solution(t)
    rate, jacobian = heavy.rate_jacobian(t, z)
    np.testing.assert_array_equal(rate, heavy.rate(t, z))
    for k in range(heavy.size):
        step = np.zeros(heavy.size)
        step[k] = 1e-5 * heavy.scale[k]
        slope = (heavy.rate(t, z + step) - heavy.rate(t, z - step)) / (2 * step[k])
        np.testing.assert_allclose(jacobian[:, :, k], slope, rtol=1e-5,
                                   atol=1e-5 * np.abs(slope).max() + 1e-9)


def test_term_that_the_paper_omits_is_there_on_the_limit_only(heavy: PrintedProblem) -> None:
    plan = plan_certified(heavy.task)
    assert plan.solution is not None
    samples = plan.uniform_samples(201)
    ours = plan.problem.rate(samples.times, plan.solution(samples.times))
    printed = heavy.rate(samples.times, plan.solution(samples.times))
    differ = np.abs(ours - printed)[:, -2:] > 1e-9
    bound = np.minimum(samples.upper_bounds - samples.torques,
                       samples.torques - samples.lower_bounds) < 1e-9
    np.testing.assert_array_equal(differ, bound)
    np.testing.assert_array_equal(ours[:, :-2], printed[:, :-2])


def test_runs_on_the_limit_are_those_of_the_samples() -> None:
    plan = plan_certified(turn(turning_arm()))
    samples = plan.uniform_samples(2001)
    (first, last), = [runs for runs in [runs_on_limit(samples, 0)] if len(runs) == 2]
    assert first == pytest.approx((0.0, plan.switching_times[0]), abs=1e-3)
    assert last == pytest.approx((plan.switching_times[1], 2.0), abs=1e-3)
    assert runs_on_limit(samples, 1) == []
    labels = [curve.label for curve in joint_panels({'a': samples}, 'torques')[0].curves]
    assert labels == ['a', '', '', 'bounds']


def test_turning_arm_takes_its_inertias_and_motors() -> None:
    arm = turning_arm((2.0, 0.0, 1.0), limited=False)
    assert [node.inertia for node in arm.nodes] == [2.0, 0.0, 1.0]
    assert [node.mass for node in arm.nodes] == [0.0, 5.415, 0.83]
    assert not np.isfinite(TorqueLimits.of(arm).bounds(np.zeros(2))).any()
    assert [joint.viscous_friction for joint in arm.joints] == [0.05, 0.05]


def test_motion_that_cannot_be_planned_ends_the_run() -> None:
    with pytest.raises(NoPlanError, match=r'rigid, 7 kg: .*5\.849 kg'):
        plan_certified(point_to_point(paper_arm(math.inf), 7.0))


def test_model_of_the_paper_arm_is_that_of_the_preset(run: Run) -> None:
    arm = paper_arm(50.0)
    assert ArmModel(arm).arm.links[0].mass == pytest.approx(3.0)
    assert arm.links[0].flexural_rigidity == 50.0


@pytest.mark.parametrize('count', [1, 2, 3])
def test_picture_with_any_number_of_diagrams(tmp_path: Path, count: int) -> None:
    x = np.linspace(0, 1, 5)
    panels = tuple(Panel(title=f'p{k}', x_label='x', y_label='y', log=bool(k),
                         curves=(Curve(x=x, y=x + k + 1, label=f'c{k}'),))
                   for k in range(count))
    path = tmp_path / 'n.png'
    save(draw_picture(Picture(name='n', caption='c', panels=panels)), path)
    assert path == tmp_path / 'n.png'
    assert path.read_bytes().startswith(b'\x89PNG')


def test_command_writes_a_section(tmp_path: Path) -> None:
    done = subprocess.run(
        [sys.executable, '-m', 'flex_planner.cli', 'paper', '--reduced', '--section', '7',
         '--output', str(tmp_path), '--processes', '1'], capture_output=True, text=True,
        timeout=120)
    assert done.returncode == 0, done.stderr
    assert 'section 7 is done, 1 of 1' in done.stderr
    assert f'written: {tmp_path}/paper.md' in done.stdout
    assert '## 7 Slips of the paper' in (tmp_path / 'paper.md').read_text()


def test_interrupted_command_ends_at_once_and_writes_nothing(tmp_path: Path) -> None:
    log = tmp_path / 'errors.txt'
    # not a pipe: a compiler that one of its processes has started holds it until it is done
    with log.open('wb') as errors:
        process = subprocess.Popen(
            [sys.executable, '-m', 'flex_planner.cli', 'paper', '--output', str(tmp_path / 'new')],
            stderr=errors)
    end = time.monotonic() + 60
    while 'sections in' not in log.read_text():
        assert time.monotonic() < end, 'waited for the command to begin with its sections'
        time.sleep(0.05)
    time.sleep(1.0)
    process.send_signal(signal.SIGINT)
    # computing all sections would take a minute or more
    assert process.wait(timeout=30) == 130
    assert 'canceled' in log.read_text()
    assert not (tmp_path / 'new' / 'paper.md').exists()


@pytest.mark.parametrize(('arguments', 'message'), [
    (['--section', '9'], '--section is 9, but must be one of 5.1, 5.2'),
    (['--processes', '0'], '--processes is 0'),
])
def test_command_refuses_what_it_does_not_know(
        tmp_path: Path, capsys: pytest.CaptureFixture[str], arguments: list[str],
        message: str) -> None:
    assert main(['paper', '--output', str(tmp_path / 'new'), *arguments]) == 1
    assert message in capsys.readouterr().err
    assert not (tmp_path / 'new').exists()
