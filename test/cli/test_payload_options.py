"""What a payload is like, from the command line and from arm files."""

from __future__ import annotations

import argparse

from flex_planner.arms.arm import Arm
from flex_planner.arms.arm_files import arm_from_mapping, load_arm
from flex_planner.arms.spatial_arm import SpatialArm
from flex_planner.base.errors import InvalidValueError
from flex_planner.cli.payload_options import add_payload_shape, take_payload_shape
import numpy as np
import pytest


def taken(arm: Arm, *arguments: str) -> tuple[Arm, float | None]:
    parser = argparse.ArgumentParser()
    add_payload_shape(parser)
    return take_payload_shape(parser.parse_args(arguments), arm)


@pytest.mark.parametrize(('text', 'tensor', 'scalar'), [
    ('0.02', np.zeros((3, 3)), 0.02),
    ('1,2,2.5', np.diag([1, 2, 2.5]), 0.0),
    ('1,2,2.5,0.1,0.2,0.3', [[1, 0.1, 0.2], [0.1, 2, 0.3], [0.2, 0.3, 2.5]], 0.0)])
def test_inertia_is_one_number_moments_or_a_tensor(text: str, tensor: object,
                                                   scalar: float) -> None:
    once, _ = taken(load_arm('spatial_3r'), '--payload-inertia', '9,9,9')
    arm, inertia = taken(once, '--payload-inertia', text)  # what was there is replaced
    assert isinstance(arm, SpatialArm)
    np.testing.assert_array_equal(arm.payload_tensor, tensor)
    assert inertia == scalar


def test_centre_of_mass_is_that_of_the_option_or_of_the_file() -> None:
    arm = load_arm('spatial_3r')
    assert taken(arm) == (arm, None)
    moved, inertia = taken(arm, '--payload-com=0.1,-0.2,0.3')
    assert inertia is None
    np.testing.assert_array_equal(moved.payload_com, [0.1, -0.2, 0.3])
    planar, _ = taken(load_arm('korayem_rigid'), '--payload-com=0.1,-0.2')
    np.testing.assert_array_equal(planar.payload_com, [0.1, -0.2])


FILE = {'name': 'one', 'kind': 'spatial', 'joints': [{'axis': [0, 0, 1]}],
        'tip': {'xyz': [0.5, 0, 0]}, 'links': [{'inertial': {'mass': 1.0}}]}


def test_files_have_tensors_too() -> None:
    arm = arm_from_mapping({**FILE, 'payload': {'inertia': [0.1, 0.2, 0.2]}})
    assert isinstance(arm, SpatialArm)
    np.testing.assert_array_equal(arm.payload_tensor, np.diag([0.1, 0.2, 0.2]))
    assert arm.payload_inertia == 0
    with pytest.raises(InvalidValueError, match='payload_tensor'):
        arm_from_mapping({**FILE, 'payload': {'inertia': [0.1, -0.2, 0.2]}})
