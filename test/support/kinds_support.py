"""What tests of kinds of motion share: paths, made-up motions, and messages with their numbers."""

from __future__ import annotations

import re

from flex_planner.base.validation import Array
from flex_planner.collocation import GaussRule
from flex_planner.optimal_control.motion_problem import MotionProblem
from flex_planner.planning.kinds.clusters import kind_of, KindOfMotion
from flex_planner.planning.kinds.explorer import ExploredMotion
import numpy as np
import pytest

_NUMBER = re.compile(r'\d+(?:\.\d+)?')
# up to which a value stands that was explored and confirmed on a finer mesh
STANDS = 0.01


def assert_says(message: str, expected: str) -> None:
    """Check a message whose numbers are those of an exploration, which are not exact."""
    assert _NUMBER.sub('#', message) == _NUMBER.sub('#', expected)
    found, wanted = ([float(number) for number in _NUMBER.findall(text)]
                     for text in (message, expected))
    assert found == pytest.approx(wanted, rel=STANDS)


def made_up(problem: MotionProblem, value: float, angles: Array | None = None) -> ExploredMotion:
    """Return a motion of a value that nobody solved, along joint angles (17, n)."""
    solution = problem.straight_line(4, GaussRule.of(3))
    n = problem.model.arm.n_joints
    along = solution(np.linspace(0, solution.mesh[-1], 17))[:, :n]
    return ExploredMotion(value=value, price=0.0, angles=along if angles is None else angles,
                          problem=problem, solution=solution)


def made_up_kind(problem: MotionProblem, value: float) -> KindOfMotion:
    """Return the kind of a motion of a value that nobody solved."""
    return kind_of(made_up(problem, value))
