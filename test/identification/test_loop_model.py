"""Derivatives of a simulated log are those of finite differences."""

from __future__ import annotations

from dataclasses import replace

from flex_planner.arms.arm_files import load_arm
from flex_planner.identification.loop_model import LoopModel, steps_per_part
from flex_planner.identification.plant_parameters import list_parameters
from flex_planner.identification.simulated_log import DriveLaw
import numpy as np
import pytest

VALUES = np.array([0.11, 0.9, 0.01, 0.02, 0.01, 0.012, 0.003, 1.4e-3])
LAW = DriveLaw(period=1e-3, stiffness=np.array([4.0]), damping=np.array([0.3]),
               guide_stiffness=np.array([1.0]), guide_damping=np.array([0.1]), keeps=0.7)
START, STEP = 0.3, 1e-6


@pytest.fixture(scope='module')
def model() -> LoopModel:
    arm = load_arm('single_link')
    # weight makes the bending at rest depend on parameters, too
    return LoopModel(replace(arm, links=(arm.links[0].with_modes(1),), gravity=[0.0, -9.81]))


def outputs(model: LoopModel, at: np.ndarray) -> np.ndarray:
    """Return angles and torques of the guide for parameters and a start angle."""
    followed = np.zeros((300, 3))
    followed[:, 0] = START + 0.1 * np.sin(np.arange(300) * 0.02)**2
    log = model.simulate(at[-1:], followed, LAW, at[:-1], steps_per_part(1e-3, 300.0))
    return np.hstack([log.angles, log.guide])


@pytest.mark.parametrize('place', range(len(VALUES) + 1))
def test_derivatives_are_those_of_finite_differences(model: LoopModel, place: int) -> None:
    at = np.append(VALUES, START)
    step = np.zeros_like(at)
    step[place] = STEP * max(at[place], 0.1) if place != 7 else 1e-7
    expected = (outputs(model, at + step) - outputs(model, at - step)) / (2 * step[place])
    followed = np.zeros((300, 3))
    followed[:, 0] = START + 0.1 * np.sin(np.arange(300) * 0.02)**2
    log = model.simulate(at[-1:], followed, LAW, VALUES, steps_per_part(1e-3, 300.0))
    found = np.hstack([log.angle_slopes[..., place], log.guide_slopes[..., place]])
    assert found == pytest.approx(expected, abs=1e-5 * np.abs(expected).max() + 1e-9)


@pytest.mark.parametrize('place', range(3))
def test_derivatives_by_a_start_in_motion_are_those_of_finite_differences(
        model: LoopModel, place: int) -> None:
    followed, away = np.full((300, 3), START), np.array([1e-3, 0.1, 0.05])
    parts = steps_per_part(1e-3, 300.0)

    def at(apart: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        log = model.simulate(np.array([START]), followed, LAW, VALUES, parts, apart)
        return (np.hstack([log.angles, log.guide]),
                np.concatenate([log.angle_slopes, log.guide_slopes], axis=1))

    step = STEP * np.eye(3)[place]
    expected = (at(away + step)[0] - at(away - step)[0]) / (2 * STEP)
    found = at(away)[1][..., len(VALUES) + 1 + place]
    assert found == pytest.approx(expected, abs=1e-5 * np.abs(expected).max())


def test_parameters_are_as_many_as_the_vector_has() -> None:
    assert len(list_parameters(1)) == VALUES.size
