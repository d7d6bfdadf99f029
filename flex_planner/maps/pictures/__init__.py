"""The pictures of a map: what they need of its store, and their parts."""

from __future__ import annotations

import flex_planner.plotting  # noqa: F401 - before others load Matplotlib
