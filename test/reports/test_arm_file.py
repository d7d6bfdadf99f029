"""Arm files that are written load as the arm that they were written of."""

from __future__ import annotations

import dataclasses
import math
from pathlib import Path
from typing import Any

from flex_planner.arms.arm import Arm
from flex_planner.arms.arm_files import load_arm, plain_arm
from flex_planner.reports.arm_file import format_arm_file
from presets import PLANAR_PRESETS
import pytest


def values(arm: Arm) -> dict[str, Any]:
    """Return all numbers and texts of an arm by their paths."""
    flat: dict[str, Any] = {}

    def walk(path: str, entry: Any) -> None:
        if dataclasses.is_dataclass(entry):
            entry = vars(entry)
        if isinstance(entry, dict):
            for key, one in entry.items():
                walk(f'{path}.{key}', one)
        elif isinstance(entry, (list, tuple)):
            for i, one in enumerate(entry):
                walk(f'{path}[{i}]', one)
        elif not path.endswith('family_assumed'):
            flat[path] = entry

    walk('', plain_arm(arm))
    return flat


@pytest.mark.parametrize('name', PLANAR_PRESETS)
def test_written_arm_is_the_arm(name: str, tmp_path: Path) -> None:
    arm = load_arm(name)
    path = tmp_path / 'arm.yaml'
    path.write_text(format_arm_file(arm))
    written, read = values(arm), values(load_arm(path))
    assert written.keys() == read.keys()
    for field, value in written.items():
        if isinstance(value, float) and math.isfinite(value):
            assert read[field] == pytest.approx(value, rel=1e-12, abs=1e-15), field
        else:
            assert read[field] == value, field
