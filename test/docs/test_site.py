"""The site is built from what is there, without a warning and without the network."""

from __future__ import annotations

import os
from pathlib import Path
import re
import subprocess
import sys

from documents import DOCS, ROOT
import pytest

SECONDS = 280
# what a page would fetch when it is read
REMOTE = re.compile(r'<(?:script|link|img)[^>]*(?:src|href)="(https?:)?//')


def test_site_is_built_without_a_warning_and_without_the_network(tmp_path: Path) -> None:
    pytest.importorskip('sphinx', reason='the site is not built: Sphinx is not installed')
    nowhere = dict.fromkeys(('http_proxy', 'https_proxy', 'all_proxy'), 'http://127.0.0.1:9')
    run = subprocess.run(
        [sys.executable, '-m', 'sphinx', '-b', 'html', '-W', '--keep-going', '-q', '-d',
         str(tmp_path / 'trees'), str(DOCS), str(tmp_path / 'html')],
        cwd=tmp_path, text=True, capture_output=True, timeout=SECONDS, check=False,
        env={**os.environ, **nowhere, 'PYTHONPATH': str(ROOT)})
    assert run.returncode == 0, run.stdout + run.stderr
    pages = {str(path.relative_to(tmp_path / 'html')): path.read_text(encoding='utf-8')
             for path in tmp_path.glob('html/**/*.html')}
    assert {'index.html', 'tutorials/own_arm.html', 'generated/parameters.html',
            'generated/api/flex_planner.plan_path.html'} <= pages.keys()
    assert [name for name, text in pages.items() if REMOTE.search(text)] == []
    assert '<math' in pages['theory.html'] and '$' not in re.sub(
        r'<(code|pre|script).*?</\1>', '', pages['theory.html'], flags=re.DOTALL)
    # summaries are whole sentences, also with abbreviations in them
    assert not re.search(r'\b(eqs?|fig|D\.C)\.</p>', pages['generated/python.html'])
    assert 'id="arm-simulator-modes"' in pages['generated/parameters.html']
