"""Maps are drawn from their stores: every kind of axes, finished or not, solved or not."""

from __future__ import annotations

from collections.abc import Callable
import itertools
from pathlib import Path
from typing import Any

from flex_planner.arms.arm_files import find_arm_file
from flex_planner.base.errors import FlexPlannerError
from flex_planner.maps import draw_map as drawing
from flex_planner.maps.cell_results import CellCode, CellResult
from flex_planner.maps.draw_map import save_map
from flex_planner.maps.pictures import panels
from flex_planner.maps.store import cells, MapStore, open_map
from flex_planner.maps.study import load_study, Study
from matplotlib import image
from matplotlib.axes import Axes
from matplotlib.colors import LogNorm
from matplotlib.figure import Figure
import numpy as np
import pytest
import yaml
import zarr

GRID = {'from': -1.0, 'to': 1.0, 'count': 9}
PLANE = {'goal_x': GRID, 'goal_y': GRID}
GOAL = {'goal': [0.5, 0.5]}
SECOND = {'duration': 1.0}
FAILURES = [code for code in CellCode
            if code not in (CellCode.PENDING, CellCode.SOLVED, CellCode.UNREACHABLE)]
Outcome = Callable[[tuple[int, ...], dict[str, float]], 'float | CellCode']


def study(folder: Path, axes: dict[str, Any], **fields: Any) -> Study:
    """Return a study of the arm of the paper, as read from a file."""
    start = {} if 'start_x' in axes else {'start': [0.5, 0.0]}
    content = {'name': 'a map', 'quantity': 'max_payload', 'arm': 'korayem_rigid', 'axes': axes,
               **start, **fields}
    (folder / 'study.yaml').write_text(yaml.safe_dump(content, sort_keys=False))
    return load_study(folder / 'study.yaml')


def value(index: tuple[int, ...], values: dict[str, float]) -> float:
    return 1.0 + sum(index)


def written(folder: Path, of: Study, outcome: Outcome = value, share: float = 1.0) -> Path:
    """Return the store of a map with a share of its blocks written, whoever computed them."""
    known = {result.index: result for result in of.known_failures()}
    sides = zip(of.shape, of.block_shape, strict=True)
    blocks = list(itertools.product(*([slice(at, min(at + side, size))
                                       for at in range(0, size, side)] for size, side in sides)))
    with MapStore.create(folder / 'map.zarr', of) as store:
        for block in blocks[:round(share * len(blocks))]:
            store.write(block, [known.get(index) or result(of, index, outcome)
                                for index in cells(block)])
    return folder / 'map.zarr'


def result(of: Study, index: tuple[int, ...], outcome: Outcome) -> CellResult:
    found = outcome(index, of.values(index))
    if isinstance(found, CellCode):
        return CellResult(index=index, code=found, message='said so')
    return CellResult(index=index, code=CellCode.SOLVED, value=found)


def every_failure(index: tuple[int, ...], values: dict[str, float]) -> float | CellCode:
    if sum(index) % 3 == 0:
        return FAILURES[(index[0] + 2 * index[-1]) % len(FAILURES)]
    return value(index, values)


def figures(store: Path, monkeypatch: pytest.MonkeyPatch) -> dict[str, Figure]:
    """Return the pictures of a map by their names, instead of files."""
    drawn: dict[str, Figure] = {}
    monkeypatch.setattr(drawing, 'save', lambda figure, path: drawn.update({path.stem: figure}))
    save_map(store, Path('nowhere'))
    return drawn


def title(figure: Figure) -> str:
    return figure.get_suptitle()


def entries(figure: Figure) -> list[str]:
    return [text.get_text() for legend in figure.legends for text in legend.get_texts()]


def diagrams(figure: Figure, label: str = 'x') -> list[Axes]:
    """Return the diagrams with something on their x axis."""
    return [axes for axes in figure.axes if label in axes.get_xlabel()]


KINDS: dict[str, tuple[dict[str, Any], dict[str, Any], set[str]]] = {
    'workspace': (PLANE, SECOND, {'max_payload_map'}),
    'workspace and durations': ({**PLANE, 'duration': [0.5, 1, 2]}, {},
                                {'max_payload_map', 'max_payload_slices'}),
    'starts': ({'start_x': GRID, 'start_y': GRID},
               {**GOAL, **SECOND, 'quantity': 'min_duration'}, {'min_duration_map'}),
    'payload against duration': (
        {'payload_mass': [0, 1, 2], 'duration': [1, 2, 3]}, {**GOAL, 'quantity': 'min_effort'},
        {'min_effort_slices'}),
    'line': ({'duration': [1, 2, 3]}, GOAL, {'max_payload_line'}),
    'point': ({'duration': [1]}, GOAL, {'max_payload_line'}),
    'other plane': ({'motor_scale': [1, 2, 4], 'goal_x': [0.3, 0.4]}, {**GOAL, **SECOND},
                    {'max_payload_map'}),
    'four axes': ({**PLANE, 'duration': [1, 2], 'motor_scale': [1, 2]}, {},
                  {'max_payload_map', 'max_payload_slices'}),
    'row of goals': ({'goal_x': GRID, 'goal_y': [0.2]}, SECOND, {'max_payload_line'}),
}


@pytest.mark.parametrize('outcome', [value, every_failure, lambda *_: CellCode.TIMEOUT])
@pytest.mark.parametrize('kind', KINDS)
def test_map_is_drawn_as_suits_its_axes(tmp_path: Path, kind: str, outcome: Outcome,
                                        monkeypatch: pytest.MonkeyPatch) -> None:
    axes, fields, names = KINDS[kind]
    store = written(tmp_path, study(tmp_path, axes, **fields), outcome)
    solved = outcome((0,), {}) == 1.0
    drawn = set(figures(store, monkeypatch))
    assert drawn == names if solved else drawn <= names


@pytest.mark.parametrize('kind', ['workspace and durations', 'payload against duration'])
def test_pictures_are_png_and_not_blank(tmp_path: Path, kind: str) -> None:
    axes, fields, names = KINDS[kind]
    store = written(tmp_path, study(tmp_path, axes, **fields), every_failure)
    paths = save_map(store, tmp_path / 'new' / 'pictures')
    assert {path.name for path in paths} == {f'{name}.png' for name in names}
    for path in paths:
        assert np.ptp(image.imread(path)[..., :3]) > 0.9


def test_workspace_shows_the_arm_and_its_reach(tmp_path: Path,
                                               monkeypatch: pytest.MonkeyPatch) -> None:
    store = written(tmp_path, study(tmp_path, PLANE, **SECOND))
    figure = figures(store, monkeypatch)['max_payload_map']
    axes, bar = figure.axes
    assert entries(figure)[:3] == ['reach of the arm', 'arm at the start', 'arm at the best goal']
    assert [patch.get_radius() for patch in axes.patches] == [1.0]
    tips = {tuple(np.round([line.get_xdata()[0], line.get_ydata()[0]], 9))
            for line in axes.lines if len(line.get_xdata()) == 1}
    assert tips == {(0.5, 0.0), (0.5, 0.75)}  # where `value` is largest among what is reached
    assert axes.get_aspect() == 1.0
    assert (axes.get_xlabel(), bar.get_ylabel()) == ('x of the goal [m]', 'maximum payload [kg]')


def test_colors_are_the_values_of_the_store(tmp_path: Path,
                                            monkeypatch: pytest.MonkeyPatch) -> None:
    axes = {'goal_x': [0.2, 0.3, 0.6], 'goal_y': [0.3, 0.5]}
    store = written(tmp_path, study(tmp_path, axes, **SECOND))
    mesh = figures(store, monkeypatch)['max_payload_map'].axes[0].collections[0]
    np.testing.assert_array_equal(np.ravel(mesh.get_array()), [1, 2, 3, 2, 3, 4])
    corners = mesh.get_coordinates()
    np.testing.assert_allclose(corners[0, :, 0], [0.15, 0.25, 0.45, 0.75])
    np.testing.assert_allclose(corners[:, 0, 1], [0.2, 0.4, 0.6])


def test_every_kind_of_failure_is_counted(tmp_path: Path,
                                          monkeypatch: pytest.MonkeyPatch) -> None:
    store = written(tmp_path, study(tmp_path, PLANE, **SECOND), every_failure)
    codes = zarr.open_group(str(store), mode='r')['code'][...]
    shown = entries(figures(store, monkeypatch)['max_payload_map'])[3:]
    assert shown == [f'{code.name.lower().replace("_", " ")}: {(codes == code).sum()}'
                     for code in CellCode
                     if code not in (CellCode.PENDING, CellCode.SOLVED)]


@pytest.mark.parametrize(('share', 'percent'), [(0.0, '0%'), (0.5, '54%')])
def test_map_that_is_not_finished_says_so(tmp_path: Path, share: float, percent: str,
                                          monkeypatch: pytest.MonkeyPatch) -> None:
    of = study(tmp_path, {'goal_x': {'from': -1.0, 'to': 1.0, 'count': 25},
                          'goal_y': [0.2, 0.3]}, block={'goal_x': 3}, **SECOND)
    figure = figures(written(tmp_path, of, share=share), monkeypatch)['max_payload_map']
    assert title(figure).startswith('a map: maximum payload\nnot finished: ')
    assert title(figure).endswith(percent)
    assert any(entry.startswith('pending: ') for entry in entries(figure))


def test_finished_map_says_nothing_of_it(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    store = written(tmp_path, study(tmp_path, PLANE, **SECOND))
    assert title(figures(store, monkeypatch)['max_payload_map']) == 'a map: maximum payload'


def test_nine_diagrams_at_most_and_the_title_names_the_others(
        tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    axes = {'goal_x': [0.3, 0.4], 'goal_y': [0.3, 0.4],
            'duration': {'from': 1, 'to': 2, 'count': 11}}
    figure = figures(written(tmp_path, study(tmp_path, axes)), monkeypatch)['max_payload_map']
    assert len(diagrams(figure)) == 9
    assert title(figure).endswith('left out: duration 1.3, 1.7 s')
    assert [axes.get_title() for axes in diagrams(figure)][:2] == ['duration 1 s',
                                                                   'duration 1.1 s']


def test_slices_have_a_line_a_value_and_marks_for_failures(
        tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    axes, fields, _ = KINDS['payload against duration']
    store = written(tmp_path, study(tmp_path, axes, **fields), lambda index, values: (
        CellCode.INFEASIBLE if index == (2, 0) else value(index, values)))
    figure = figures(store, monkeypatch)['min_effort_slices']
    above, below = figure.axes
    assert entries(figure) == ['payload 0 kg', 'payload 1 kg', 'payload 2 kg', 'infeasible: 1']
    np.testing.assert_array_equal([line.get_ydata() for line in above.lines],
                                  [[1, 2, 3], [2, 3, 4], [np.nan, 4, 5]])
    assert [line.get_xdata().tolist() for line in below.lines] == [[1.0]]
    assert below.lines[0].get_color() == above.lines[2].get_color()
    assert above.get_xlim() == below.get_xlim()


def test_goals_are_also_drawn_against_duration_from_the_best_to_the_worst(
        tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    axes, fields, _ = KINDS['workspace and durations']
    store = written(tmp_path, study(tmp_path, axes, **fields))
    figure = figures(store, monkeypatch)['max_payload_slices']
    first = [line.get_ydata()[0] for line in figure.axes[0].lines]
    assert first == sorted(first, reverse=True)
    assert len(first) == 7
    assert entries(figure)[0] == 'goal (0.75, 0.5) m'
    assert 'points' in title(figure)


def test_arm_is_drawn_without_its_file(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / 'arm.yaml').write_text(find_arm_file('korayem_ei50').read_text())
    store = written(tmp_path, study(tmp_path, PLANE, **SECOND, arm='arm.yaml'))
    (tmp_path / 'arm.yaml').unlink()
    assert 'arm at the start' in entries(figures(store, monkeypatch)['max_payload_map'])


@pytest.mark.parametrize('text', ['', 'start: nowhere', '[', 'start: [0.5, 0'])
def test_map_of_a_study_that_is_not_understood_is_drawn_without_arm(
        tmp_path: Path, text: str, monkeypatch: pytest.MonkeyPatch,
        caplog: pytest.LogCaptureFixture) -> None:
    store = written(tmp_path, study(tmp_path, PLANE, **SECOND))
    zarr.open_group(str(store), mode='r+').attrs['study'] = text
    zarr.consolidate_metadata(str(store))
    figure = figures(store, monkeypatch)['max_payload_map']
    assert entries(figure) == ['unreachable: 37']
    assert 'the arm is not drawn, because the study of the map cannot be read' in caplog.text


def test_arm_of_every_quantity_is_drawn(tmp_path: Path,
                                        monkeypatch: pytest.MonkeyPatch) -> None:
    for key in ('max_payload', 'min_effort', 'min_duration', 'residual_vibration'):
        scaled = {'payload_scale': [1, 2]} if key == 'residual_vibration' else {}
        store = written(tmp_path / key, study(tmp_path, {**PLANE, **scaled}, **SECOND,
                                              quantity=key, payload_mass=0.5))
        assert 'arm at the start' in entries(figures(store, monkeypatch)[f'{key}_map'])


def test_vibration_is_drawn_in_millimetres(tmp_path: Path,
                                           monkeypatch: pytest.MonkeyPatch) -> None:
    store = written(tmp_path, study(tmp_path, {'payload_scale': [0.5, 1.0]}, **GOAL, **SECOND,
                                    quantity='residual_vibration', payload_mass=1.0),
                    lambda *_: 0.002)
    axes, = figures(store, monkeypatch)['residual_vibration_line'].axes
    assert axes.get_ylabel() == 'residual vibration [mm]'
    np.testing.assert_allclose(axes.lines[0].get_ydata(), 2)


def test_values_of_different_orders_get_a_logarithmic_scale() -> None:
    assert isinstance(panels.scale(np.geomspace(0.1, 100, 20)), LogNorm)
    assert not isinstance(panels.scale(np.linspace(0.1, 100, 20)), LogNorm)
    assert not isinstance(panels.scale(np.append(0, np.geomspace(0.1, 100, 20))), LogNorm)
    same = panels.scale(np.array([np.nan, 2, 2]))
    assert (same.vmin, same.vmax) == (1.5, 2.5)


def test_values_of_contours_keep_away_from_the_arm(tmp_path: Path,
                                                   monkeypatch: pytest.MonkeyPatch) -> None:
    fine = {'from': -1.0, 'to': 1.0, 'count': 25}
    store = written(tmp_path, study(tmp_path, {'goal_x': fine, 'goal_y': fine}, **SECOND))
    axes = figures(store, monkeypatch)['max_payload_map'].axes[0]
    texts = np.array([text.get_position() for text in axes.texts])
    arms = np.concatenate([np.linspace(a, b, 20) for line in axes.lines
                           for a, b in itertools.pairwise(line.get_xydata())])
    assert len(texts) > 3
    assert np.linalg.norm(texts[:, None] - arms, axis=-1).min() > 0.1


def test_map_whose_values_are_damaged_is_drawn_as_pending(tmp_path: Path) -> None:
    store = written(tmp_path, study(tmp_path, {'duration': [1, 2]}, **GOAL))
    for chunk in (store / 'max_payload').glob('[0-9]*'):
        chunk.write_bytes(b'damaged')
    assert save_map(store, tmp_path)
    assert (open_map(store).code == CellCode.PENDING).all()


def test_map_that_is_damaged_beyond_its_blocks_is_named(tmp_path: Path) -> None:
    store = written(tmp_path, study(tmp_path, {'duration': [1, 2]}, **GOAL))
    (store / 'max_payload' / '.zarray').write_text('{')
    with pytest.raises(FlexPlannerError, match=r'map.zarr is damaged, .* max_payload'):
        save_map(store, tmp_path)


def test_what_is_no_map_or_no_folder_is_named(tmp_path: Path) -> None:
    with pytest.raises(FlexPlannerError, match='nothing.zarr'):
        save_map(tmp_path / 'nothing.zarr', tmp_path)
    store = written(tmp_path, study(tmp_path, {'duration': [1, 2]}, **GOAL))
    (tmp_path / 'file').touch()
    with pytest.raises(OSError, match='file'):
        save_map(store, tmp_path / 'file')
