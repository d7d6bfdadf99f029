"""The notebooks run from the first cell to the last, and show what they say."""

from __future__ import annotations

import asyncio
from pathlib import Path
import re
from typing import Any
import warnings

from documents import ROOT
import pytest

FOLDER = ROOT / 'examples' / 'notebooks'
NOTEBOOKS = sorted(FOLDER.glob('*.ipynb'))
SAID = {'first_plan': ('solved and certified', 'kind of motion: '),
        'payload_map': ('30 cells in', '27 cells: SOLVED', 'from the map: ')}
PICTURES = {'first_plan': 3, 'payload_map': 1}


def read(path: Path) -> Any:
    """Return a notebook."""
    with warnings.catch_warnings():
        warnings.simplefilter('ignore')  # what its libraries import is deprecated
        nbformat = pytest.importorskip('nbformat')
    return nbformat.read(path, as_version=4)


def test_every_notebook_is_known() -> None:
    assert {path.stem for path in NOTEBOOKS} == SAID.keys() == PICTURES.keys()


@pytest.mark.parametrize('path', NOTEBOOKS, ids=lambda path: path.stem)
def test_notebook_is_kept_without_output_and_links_lead_somewhere(path: Path) -> None:
    notebook = read(path)
    assert not any(cell.get('outputs') for cell in notebook.cells)
    for cell in notebook.cells:
        for target in re.findall(r'\]\(([^)]*)\)', cell.source):
            assert (FOLDER / target).exists()


@pytest.mark.parametrize('path', NOTEBOOKS, ids=lambda path: path.stem)
def test_notebook_runs_and_shows_pictures(path: Path, tmp_path: Path) -> None:
    notebook = read(path)
    with warnings.catch_warnings():
        warnings.simplefilter('ignore')
        client = pytest.importorskip('nbclient').NotebookClient(
            notebook, timeout=200, resources={'metadata': {'path': str(tmp_path)}})
        asyncio.run(client.async_execute())
    outputs = [output for cell in notebook.cells for output in cell.get('outputs', ())]
    text = ''.join(output.get('text', '') for output in outputs)
    assert [part for part in SAID[path.stem] if part not in text] == []
    pictures = [output for output in outputs if 'image/png' in output.get('data', {})]
    assert len(pictures) == PICTURES[path.stem]
    assert not any(output.get('name') == 'stderr' for output in outputs), outputs
