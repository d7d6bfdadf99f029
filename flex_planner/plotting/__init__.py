"""Pictures of motions as planned and as carried out, of payloads and of arms."""

from __future__ import annotations

from flex_planner.plotting import backend  # noqa: F401 - before the others load Matplotlib
from flex_planner.plotting.arm import draw_arm
from flex_planner.plotting.comparison import draw_comparison
from flex_planner.plotting.motion import draw_motion, Execution, Motion
from flex_planner.plotting.payload import draw_max_payload

__all__ = ['Execution', 'Motion', 'draw_arm', 'draw_comparison', 'draw_max_payload',
           'draw_motion']
