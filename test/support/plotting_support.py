"""A motion to draw, and the pixels of a picture."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from flex_planner.arms.arm import Arm
from flex_planner.plotting import Motion
from matplotlib import image
import numpy as np

NAMES = ['shoulder', 'elbow']
TIMES = np.linspace(0, 1, 21)


def motion(arm: Arm) -> Motion:
    """Return a smooth motion, whether or not the arm would move like that."""
    shape = (TIMES.size, arm.n_coordinates)
    wave = np.sin(np.outer(TIMES, np.linspace(1, 2, arm.n_coordinates)))
    assert wave.shape == shape
    return Motion(arm=arm, joint_names=NAMES, times=TIMES, coordinates=0.1 * wave,
                  rates=0.2 * wave, torques=wave[:, :2], tip=wave[:, :2])


def pixels(path: Path) -> Any:
    """Return a picture, read from PNG."""
    assert path.read_bytes().startswith(b'\x89PNG\r\n\x1a\n')
    return image.imread(path)
