"""Pictures of what it costs to forgive errors of the model."""

from __future__ import annotations

from pathlib import Path

from flex_planner.planning.robust.effort_front import EffortFront
from flex_planner.plotting import draw_effort_front, save
import numpy as np
from plotting_support import pixels


def test_front_is_drawn_in_percent_and_millimetres(tmp_path: Path) -> None:
    front = EffortFront(weights=np.array([0.0, 1.0, 10.0]), costs=np.array([1.0, 1.01, 1.05]),
                        residuals=np.array([3e-3, 1.5e-3, 1e-3]), nominal=np.full(3, 1e-5))
    figure = draw_effort_front(front, limit=1.2e-3)
    worst, _, asked = figure.axes[0].lines
    np.testing.assert_allclose(worst.get_xydata(), [[0, 3], [1, 1.5], [5, 1]], atol=1e-9)
    np.testing.assert_allclose(asked.get_ydata(), 1.2)
    save(figure, tmp_path / 'front.png')
    assert np.ptp(pixels(tmp_path / 'front.png')[..., :3]) > 0.9  # not blank
