"""
A report as one HTML file that needs nothing else.

The plots are drawn by ``plots.js`` and the moving arm by ``arm.js`` or, in space, ``space.js``
beside this module, which are copied into the page: a library like plotly would make it 4 MB
larger, and would be one more dependency.

"""

from __future__ import annotations

from dataclasses import asdict
from html import escape
import json
import math
from pathlib import Path
from string import Template
from typing import Any

from flex_planner.base.errors import RecordingError
from flex_planner.base.paths import expand_path
from flex_planner.base.text import printable
from flex_planner.base.text_files import write_text
from flex_planner.base.validation import Array
from flex_planner.base.version import VERSION
from flex_planner.recording import shown_path
from flex_planner.reports.recording.animation import animation
from flex_planner.reports.recording.contents import RecordedRequest
from flex_planner.reports.recording.findings import MotionCheck
from flex_planner.reports.recording.frequencies import NaturalFrequencies
from flex_planner.reports.recording.plot_data import Plot, Series
from flex_planner.reports.recording.plots import plots
from flex_planner.reports.recording.report_table import ReportTable
from flex_planner.reports.recording.tables import tables, verdict

_FOLDER = Path(__file__).parent
_SCRIPTS = ('player.js', 'arm.js', 'space.js', 'plots.js')
_DIGITS = 9
_PLAIN = ('key', 'title', 'x_label', 'y_label', 'group', 'log', 'equal', 'least')


def report_page(request: RecordedRequest, check: MotionCheck | None = None) -> str:
    """Return the report of a recording as HTML."""
    frequencies = NaturalFrequencies.of(request)
    drawn = plots(request, check, frequencies)
    template = Template((_FOLDER / 'page.html').read_text(encoding='utf-8'))
    passed = request.solved and (check is None or check.passed)
    kind = 'find_max_payload' if request.search is not None else 'plan_path'
    return template.substitute(
        title=_escape(f'{kind}: {request.arm.name}'), kind='' if passed else 'failed',
        file=_escape(f'{shown_path(request.path.name)}, report of flex_planner {VERSION}'),
        verdict=_escape(verdict(request, check)), hidden='' if drawn else 'hidden',
        data=_json(_content(tables(request, check, frequencies), drawn) | {
            'arm': request.motion and animation(request.arm, request.motion,
                                                request.path_constraints)}),
        script=''.join((_FOLDER / name).read_text(encoding='utf-8') for name in _SCRIPTS))


def write_report(path: Path, request: RecordedRequest, check: MotionCheck | None = None) -> None:
    """
    Write the report of a recording, in place of an older one only when it is complete.

    Raises
    ------
    RecordingError
        If the system refuses.

    """
    path = expand_path(path)
    try:
        write_text(path, report_page(request, check))
    except OSError as error:
        raise RecordingError(f'cannot write {path}: {error.strerror or error}') from error


def _content(shown_tables: list[ReportTable], drawn: list[Plot]) -> dict[str, Any]:
    """Return tables and plots; the arrays along x are shared."""
    axes: dict[str, list[float | None]] = {}
    names: dict[bytes, str] = {}

    def axis(values: Array) -> str:
        """Return the name of an array along x."""
        name = names.setdefault(values.tobytes(), f'x{len(names)}')
        if name not in axes:
            axes[name] = _numbers(values)
        return name

    def line(series: Series) -> dict[str, Any]:
        """Return a line of a plot."""
        return {'name': series.name, 'x': axis(series.x), 'y': _numbers(series.y),
                'colour': series.colour, 'dashed': series.dashed,
                'dots': series.dots, 'bound': series.bound, 'filled': series.filled}

    shown = [{**{name: getattr(plot, name) for name in _PLAIN},
              'bands': None if plot.bands is None else asdict(plot.bands),
              'series': [line(series) for series in plot.series]} for plot in drawn]
    return {'tables': [asdict(table) for table in shown_tables], 'axes': axes, 'plots': shown}


def _numbers(values: Array) -> list[float | None]:
    """Return numbers as JSON has them: nine digits, none where there is no number."""
    return [float(f'{value:.{_DIGITS}g}') if math.isfinite(value) else None
            for value in values.tolist()]


def _json(content: dict[str, Any]) -> str:
    """Return JSON that cannot end the element it stands in."""
    text = json.dumps(_shown(content), ensure_ascii=False, allow_nan=False,
                      separators=(',', ':'))
    return text.replace('<', '\\u003c')


def _escape(text: str) -> str:
    """Return text as HTML."""
    return escape(printable(text))


def _shown(content: Any) -> Any:
    """Return content with escapes in its texts for what has no place in them."""
    if isinstance(content, str):
        return printable(content)
    if isinstance(content, dict):
        return {_shown(name): _shown(entry) for name, entry in content.items()}
    return [_shown(entry) for entry in content] if isinstance(content, (list, tuple)) else content
