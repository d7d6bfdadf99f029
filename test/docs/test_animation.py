"""The animated picture of README.md is small, moves, and can be drawn again."""

from __future__ import annotations

from pathlib import Path

from documents import DOCS
import draw_animation
from PIL import Image
import pytest

KEPT = DOCS / 'images' / 'flexible_arm.gif'


def frames(path: Path) -> int:
    """Return the number of pictures of an animation, the first of which differs from the last."""
    with Image.open(path) as picture:
        count = getattr(picture, 'n_frames', 1)
        first = picture.convert('RGB').tobytes()
        picture.seek(count - 1)
        assert picture.convert('RGB').tobytes() != first
    return int(count)


def test_kept_picture_is_an_animation_below_a_megabyte() -> None:
    assert KEPT.stat().st_size < 1_000_000
    assert frames(KEPT) == round((1.0 + draw_animation.SETTLING) * draw_animation.RATE) + 1


def test_picture_can_be_drawn_again(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(draw_animation, 'RATE', 2)
    comparison = draw_animation.simulate()
    draw_animation.animate(comparison, tmp_path / 'arm.gif')
    assert frames(tmp_path / 'arm.gif') == 6
    rigid, flexible = (comparison.of(mode) for mode, _ in draw_animation.SIDES.values())
    # what the picture is there to show
    assert rigid.residual.tip > 0.02 and flexible.residual.tip < 0.001
