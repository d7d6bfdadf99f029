"""
Section 5.1 of the paper: the arm swings under gravity, and stiffens into the rigid one.

Angles are counted from the horizontal x axis, so that the paper's start of (-1.5, -0.5) rad is an
arm that almost hangs.

"""

from __future__ import annotations

from dataclasses import replace

from flex_planner.arms.arm import Arm
from flex_planner.arms.arm_files import load_arm
from flex_planner.base.validation import Array
from flex_planner.optimal_control.arm_model import ArmModel
from flex_planner.optimal_control.parameters import Parameters
from light_model import LightModel
import numpy as np
import pytest
from scipy.integrate import solve_ivp

DURATION = 2.0  # [s]
TIMES = np.linspace(0, DURATION, 201)
# E I [N m^2] and the largest distances of both joint angles from the rigid arm's [rad], rounded
# up from those measured: (0.0012, 0.0031), (0.0057, 0.0151), (0.0229, 0.0606); the angles swing
# through 0.44 and 0.99 rad
DISTANCES = [(100.0, (0.0015, 0.004)), (20.0, (0.007, 0.02)), (5.0, (0.03, 0.07))]


def swing(model: ArmModel, rigidity: float | None = None, duration: float = DURATION) -> Array:
    """Return states (k, 2 n_t) of free motion from rest, the links unbent."""
    arm, parameters = model.arm, Parameters.of(model.arm)
    if rigidity is not None:
        parameters = replace(parameters, rigidity=np.full(2, rigidity))
    rate, start = model.state_rate(parameters.physical), np.zeros(2 * arm.n_coordinates)
    start[:2] = -1.5, -0.5
    motion = solve_ivp(lambda t, x: rate(x, np.zeros(2)).copy(), (0, duration), start,
                       method='DOP853', t_eval=TIMES[TIMES <= duration], rtol=1e-9, atol=1e-11)
    states: Array = motion.y.T.copy()
    return states


@pytest.fixture(scope='module')
def model() -> ArmModel:
    return ArmModel(load_arm('korayem_hanging'))


@pytest.fixture(scope='module')
def rigid(model: ArmModel) -> Array:
    return swing(ArmModel(model.arm.rigid()))[:, :2]


def test_preset_is_the_arm_of_section_5_1(model: ArmModel) -> None:
    arm = model.arm
    assert arm.flexural_rigidities().tolist() == [100.0, 100.0]
    assert [(link.length, link.mass, link.modes) for link in arm.links] == [(0.5, 3.0, 2)] * 2
    assert arm.gravity.tolist() == [0.0, -9.81]
    assert {link.mode_family for link in arm.links} == {'pinned_pinned'}


def test_rigid_arm_swings_about_hanging_straight_down(rigid: Array) -> None:
    # -pi/2 and 0, by about as much as it was turned aside at first
    assert rigid[:, 0].min() < -np.pi / 2 - 0.05
    assert rigid[:, 0].max() > -np.pi / 2 + 0.05
    assert -0.52 < rigid[:, 1].min() < -0.49
    assert 0.3 < rigid[:, 1].max() < 0.6


@pytest.mark.parametrize(('rigidity', 'bounds'), DISTANCES)
def test_flexible_arm_stays_as_close_to_the_rigid_one_as_its_rigidity_says(
        model: ArmModel, rigid: Array, rigidity: float, bounds: tuple[float, float]) -> None:
    distances = np.abs(swing(model, rigidity)[:, :2] - rigid).max(axis=0)
    assert (distances < bounds).all()
    assert (distances > np.array(bounds) / 2).all()  # and the bound is not a loose one


def test_distance_from_the_rigid_arm_goes_as_the_compliance(model: ArmModel,
                                                            rigid: Array) -> None:
    distances = [np.abs(swing(model, rigidity)[:, :2] - rigid).max()
                 for rigidity in (5.0, 20.0, 100.0)]
    np.testing.assert_allclose(np.divide(distances[:-1], distances[1:]), [4.0, 5.0], rtol=0.1)


@pytest.mark.parametrize('rigidity', [5.0, 20.0, 100.0])
def test_energy_of_the_swinging_arm_is_constant(model: ArmModel, rigidity: float) -> None:
    states = swing(model, rigidity)
    p = replace(Parameters.of(model.arm), rigidity=np.full(2, rigidity)).physical
    _, kinetic, potential = model.mass_and_energy(states, p)
    assert kinetic.max() > 0.7  # [J], of its fall
    assert np.ptp(kinetic + potential) < 1e-8  # of the integrator, over hundreds of steps


@pytest.mark.parametrize('family', ['clamped_free', 'clamped_mass'])
def test_arm_with_clamped_links_stiffens_into_the_rigid_one(model: ArmModel, rigid: Array,
                                                            family: str) -> None:
    # unlike chords, frames that are tangent at the hubs turn by the slopes as well
    links = tuple(replace(link, modes=1, mode_family=family, shape_mass=3.0, shape_inertia=0.2)
                  for link in model.arm.links)
    clamped = LightModel(replace(model.arm, links=links))
    distances = [np.abs(states[:, :2] - rigid[:len(states)]).max()
                 for states in (swing(clamped, rigidity, 0.3)  # type: ignore
                                for rigidity in (100.0, 400.0, 1600.0))]
    assert distances[-1] < 2e-4  # [rad], measured 1.1e-4
    np.testing.assert_allclose(np.divide(distances[:-1], distances[1:]), 4.0, rtol=0.15)


def test_arm_hanging_straight_down_stays(model: ArmModel) -> None:
    arm: Arm = model.arm
    x = np.zeros((1, 2 * arm.n_coordinates))
    x[0, 0] = -np.pi / 2
    rate = model.forward_dynamics(x, np.zeros((1, 2)), Parameters.of(arm).physical)
    np.testing.assert_allclose(rate, 0, atol=1e-12)  # rounding of cos(pi / 2)
