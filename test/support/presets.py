"""Names of presets by kind."""

from __future__ import annotations

from flex_planner.arms.arm_files import load_arm, preset_files

SPATIAL_PRESETS = [name for name in sorted(preset_files()) if load_arm(name).dimension == 3]
PLANAR_PRESETS = [name for name in sorted(preset_files()) if name not in SPATIAL_PRESETS]
