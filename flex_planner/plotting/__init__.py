"""
Pictures of motions as planned and as carried out, of payloads and of arms.

Functions that begin with ``draw_`` return a Matplotlib figure, which `save` writes and notebooks
show, or draw in the axes that they are given.

"""

from __future__ import annotations

from flex_planner.plotting import backend  # noqa: F401 - before the others load Matplotlib
from flex_planner.plotting.arm import draw_arm
from flex_planner.plotting.comparison import draw_comparison
from flex_planner.plotting.effort_front import draw_effort_front
from flex_planner.plotting.figures import save
from flex_planner.plotting.motion import (
    draw_angles,
    draw_distance,
    draw_modes,
    draw_motion,
    draw_speeds,
    draw_tip,
    draw_torques,
    Execution,
    Motion,
)
from flex_planner.plotting.payload import draw_max_payload
from flex_planner.plotting.posture import draw_posture

__all__ = ['Execution', 'Motion', 'draw_angles', 'draw_arm', 'draw_comparison', 'draw_distance',
           'draw_effort_front', 'draw_max_payload', 'draw_modes', 'draw_motion', 'draw_posture',
           'draw_speeds', 'draw_tip', 'draw_torques', 'save']
