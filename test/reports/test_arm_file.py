"""Arm files that are written load as the arm that they were written of."""

from __future__ import annotations

import dataclasses
import math
from pathlib import Path
from typing import Any

from flex_planner.arms.arm import Arm
from flex_planner.arms.arm_files import load_arm, plain_arm
from flex_planner.arms.spatial_arm import SpatialArm
from flex_planner.base.errors import InvalidValueError
from flex_planner.reports.arm_file import format_arm_file
from presets import PLANAR_PRESETS, SPATIAL_PRESETS
import pytest
from spatial_arms import flexible_3r, oblique


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
    check_written(load_arm(name), tmp_path)


def check_written(arm: Arm, tmp_path: Path) -> None:
    path = tmp_path / 'arm.yaml'
    path.write_text(format_arm_file(arm))
    written, read = values(arm), values(load_arm(path))
    assert written.keys() == read.keys()
    for field, value in written.items():
        if isinstance(value, float) and math.isfinite(value):
            assert read[field] == pytest.approx(value, rel=1e-12, abs=1e-15), field
        else:
            assert read[field] == value, field


SPATIAL = [flexible_3r(1, 1, foreshortening=True), oblique(), *map(load_arm, SPATIAL_PRESETS)]


@pytest.mark.parametrize('arm', SPATIAL, ids=lambda arm: arm.name)
def test_written_arm_in_space_is_the_arm(arm: SpatialArm, tmp_path: Path) -> None:
    # names and notes are those of a URDF
    check_written(dataclasses.replace(arm, notes=(), joint_names=(), frame_names=()), tmp_path)


def test_what_a_file_cannot_say_is_refused() -> None:
    tensor = dataclasses.replace(flexible_3r(), payload_inertia=1.0, payload_tensor=[1, 1, 1])
    with pytest.raises(InvalidValueError, match='payload_tensor is .* beside payload_inertia'):
        format_arm_file(tensor)
