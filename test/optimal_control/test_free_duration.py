"""The duration as an unknown."""

from __future__ import annotations

from collections.abc import Callable

from flex_planner.optimal_control.free_duration import FreeDurationProblem
from flex_planner.planning.plan import Plan
from free_problems import extended
import numpy as np
from plan_checks import solution_of
import pytest

CASES = ['rigid', 'ei5', 'crane']
every_case = pytest.mark.parametrize('name', CASES)


@every_case
def test_duration_is_added_and_taken_away(saturated: Callable[[str], Plan], name: str) -> None:
    made, solution = extended(saturated(name), FreeDurationProblem)
    assert isinstance(made, FreeDurationProblem)
    assert solution.mesh[[0, -1]].tolist() == [0, 1]
    before, (_, after) = solution_of(saturated(name)), made.restrict(solution)
    np.testing.assert_allclose(after.mesh, before.mesh, rtol=1e-15)
    np.testing.assert_array_equal(after.nodes, before.nodes)
    np.testing.assert_allclose(after.stages, before.stages, rtol=1e-15)
    shorter = made.fix(0.5)
    assert (shorter.task.duration, shorter.model) == (0.5, saturated(name).model)
