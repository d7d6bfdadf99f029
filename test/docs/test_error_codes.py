"""The page of error codes has every code, status and warning, and no other."""

from __future__ import annotations

import re

from documents import DOCS
from flex_planner.planning.plan import PlanStatus
from flex_planner.planning.warnings import WarningKind
from flex_planner.recording import definition_folder, MessageTypes

TEXT = (DOCS / 'error_codes.md').read_text(encoding='utf-8')


def test_every_error_code_has_a_cause() -> None:
    types = MessageTypes.load([definition_folder('flex_planner_interfaces')])
    rows = re.findall(r'^\| (\d+) \| `(\w+)` \| (.*?) \| (.*?) ?\|$', TEXT, re.MULTILINE)
    codes = types.constants('flex_planner_interfaces/msg/PlanReport')
    assert {name: int(code) for code, name, *_ in rows} == codes
    assert all(cause for *_, cause, _ in rows)
    without = {name for _, name, _, cure in rows if not cure}
    assert without == {'NONE', 'CANCELED', 'EXECUTION_CANCELED'}


def test_every_status_of_a_plan_is_named() -> None:
    listed = TEXT.partition('`Plan.status` is a `PlanStatus`:')[2].partition(', with')[0]
    assert set(re.findall(r'`(\w+)`', listed)) == set(PlanStatus.__members__)


def test_every_warning_is_explained() -> None:
    pages = ''.join((DOCS / name).read_text(encoding='utf-8')
                    for name in ('solver.md', 'execution.md', 'ros_node.md', 'troubleshooting.md',
                                 'recordings.md'))
    message = (DOCS.parent / 'flex_planner_interfaces/msg/PlanReport.msg').read_text()
    for kind in WarningKind:
        assert kind.name in message
        assert kind.name in pages or 'SENSITIVE' in kind.name or 'UNSTABLE' in kind.name
