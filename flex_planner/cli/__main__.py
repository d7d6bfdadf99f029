"""Run the console script as ``python -m flex_planner.cli``."""

from __future__ import annotations

import sys

from flex_planner.cli import main

if __name__ == '__main__':
    sys.exit(main())
