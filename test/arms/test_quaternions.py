"""Rotations as quaternions, against SciPy's."""

from __future__ import annotations

from flex_planner.arms.quaternions import axes_of_quaternion, quaternion_of
from flex_planner.base.errors import InvalidValueError
import numpy as np
import pytest
from scipy.spatial.transform import Rotation


def test_quaternions_are_those_of_scipy_both_ways() -> None:
    turns = [*Rotation.random(20, random_state=1), Rotation.from_euler('z', np.pi),
             Rotation.identity(), Rotation.from_euler('x', 1e-9)]
    for turn in turns:
        found = np.array(quaternion_of(turn.as_matrix()))
        assert found[3] >= 0
        np.testing.assert_allclose(abs(found @ turn.as_quat()), 1, rtol=1e-14)
        np.testing.assert_allclose(axes_of_quaternion('q', (3 * found).tolist()),
                                   turn.as_matrix(), atol=1e-14)


@pytest.mark.parametrize('parts', [[0, 0, 0, 0], [0, 0, float('nan'), 1], [float('inf'), 0, 0, 0]])
def test_what_is_no_rotation_is_refused(parts: list[float]) -> None:
    with pytest.raises(InvalidValueError, match='q is .* must be a quaternion'):
        axes_of_quaternion('q', parts)
