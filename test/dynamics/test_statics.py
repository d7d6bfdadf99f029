"""Arms at rest: textbook deflections of cantilevers, and arms too soft to come to rest."""

from __future__ import annotations

from dataclasses import replace

from flex_planner.arms.arm import Arm, Joint, Link
from flex_planner.arms.beam_eigenmodes import clamped_eigenvalue, TipLoad
from flex_planner.arms.kinematics import tip_position
from flex_planner.base.errors import NoEquilibriumError
from flex_planner.base.validation import Array
from flex_planner.dynamics.arm_dynamics import ArmDynamics
from flex_planner.dynamics.integration import simulate
from flex_planner.dynamics.physical_parameters import PhysicalParameters
from flex_planner.dynamics.statics import equilibrium, natural_modes, residual_vibration
from flex_planner.optimal_control.parameters import Parameters
from light_model import LightModel
import numpy as np
import pytest

RHO, EI, LENGTH, G = 2.0, 40.0, 0.8, 9.81


def cantilever(count: int, family: str = 'clamped_free', mass: float = 0.0) -> Arm:
    link = Link(length=LENGTH, linear_density=RHO, flexural_rigidity=EI, modes=count,
                mode_family=family, shape_mass=mass)
    return Arm(name='cantilever', links=(link,), joints=(Joint(),), gravity=[0.0, -G])


def at_rest(arm: Arm, payload_mass: float) -> tuple[Array, Array]:
    """Return coordinates and torque of the level arm."""
    parameters = Parameters.of(arm, payload_mass=payload_mass)
    return equilibrium(LightModel(arm), np.zeros(arm.n_joints), parameters)  # type: ignore


def sag(arm: Arm, payload_mass: float) -> float:
    """Return how far the tip hangs down [m]."""
    return -float(tip_position(arm, at_rest(arm, payload_mass)[0])[1])


def test_cantilever_sags_under_its_weight_as_in_the_textbook() -> None:
    expected = RHO * G * LENGTH**4 / (8 * EI)
    errors = [abs(sag(cantilever(count), 0.0) / expected - 1) for count in range(1, 9)]
    # the series of modes goes as b^-5 and alternates: measured 1.3e-2 to 4e-6
    assert errors[0] < 0.02
    assert errors[-1] < 1e-5
    assert (np.diff(errors) < 0).all()


def test_cantilever_sags_under_a_load_at_its_tip_as_in_the_textbook() -> None:
    def share(arm: Arm) -> float:
        return sag(arm, 3.0) - sag(arm, 0.0)

    expected = 3.0 * G * LENGTH**3 / (3 * EI)
    errors = np.array([1 - share(cantilever(count)) / expected for count in range(1, 9)])
    # each mode carries 12 / b^4; what is left out makes the beam too stiff
    carried = [12 / clamped_eigenvalue(order, TipLoad())**4 for order in range(1, 9)]
    np.testing.assert_allclose(errors, 1 - np.cumsum(carried), rtol=0, atol=1e-13)  # rounding
    assert (errors > 0).all()
    assert (np.diff(errors) < 0).all()


def test_one_shape_that_knows_its_load_is_better_than_one_that_does_not() -> None:
    expected = 3.0 * G * LENGTH**3 / (3 * EI) + RHO * G * LENGTH**4 / (8 * EI)
    plain, knowing = (abs(sag(cantilever(1, family, 3.0), 3.0) / expected - 1)
                      for family in ('clamped_free', 'clamped_mass'))
    assert knowing < plain / 10


@pytest.mark.parametrize('family', ['clamped_free', 'clamped_mass', 'pinned_pinned'])
def test_joint_of_a_level_link_bears_the_moment_of_its_weight(family: str) -> None:
    # linear beams: deflections do not move the weight inwards
    _, torque = at_rest(cantilever(3, family), 1.5)
    np.testing.assert_allclose(torque, [G * (RHO * LENGTH**2 / 2 + 1.5 * LENGTH)], rtol=1e-12)


def test_deflection_of_a_chain_leaves_no_force_on_its_modes(crane_arm: Arm) -> None:
    arm, parameters = crane_arm, Parameters.of(crane_arm, payload_mass=1.0)
    model = LightModel(arm)
    q, torque = equilibrium(model, np.array([0.3, -0.8]), parameters)  # type: ignore
    force, stiffness = model.static_forces(q[None], parameters.physical)
    np.testing.assert_allclose(force[0], [*torque, 0, 0, 0], atol=1e-10)  # of forces up to 1e3 N
    assert (np.linalg.eigvalsh(stiffness[0, 2:, 2:]) > 0).all()
    assert np.abs(q[2:]).min() > 1e-5


@pytest.mark.parametrize(('angle', 'rigidity', 'payload', 'degrees'), [
    # Newton finds nothing; an upright arm that would buckle, though it could be balanced
    (0.0, 2.0, 1.0, '0, 0'), (np.pi / 2, 5.0, 5.0, '90, 0')])
def test_arm_too_soft_for_its_load_has_no_equilibrium(angle: float, rigidity: float,
                                                      payload: float, degrees: str) -> None:
    link = Link(length=0.5, linear_density=6.0, flexural_rigidity=rigidity, modes=1,
                mode_family='clamped_free')
    arm = Arm(name='soft', links=(link, link), joints=(Joint(), Joint()), gravity=[0.0, -G])
    with pytest.raises(NoEquilibriumError, match=rf'at joint angles \({degrees}\) deg: the links '
                                                 'are too soft for their load'):
        equilibrium(LightModel(arm), np.array([angle, 0.0]),  # type: ignore
                    Parameters.of(arm, payload_mass=payload))


def test_rigid_arm_is_its_own_equilibrium(crane_arm: Arm) -> None:
    rigid = crane_arm.rigid()
    q, torque = equilibrium(LightModel(rigid), np.array([0.3, -0.8]),  # type: ignore
                            Parameters.of(rigid))
    assert q.tolist() == [0.3, -0.8]
    assert np.abs(torque).min() > 1


def test_residual_vibration_of_a_cantilever_is_that_of_its_tip() -> None:
    arm = cantilever(1)
    model, parameters = LightModel(arm), Parameters.of(arm)
    rest, shapes = np.zeros(2), arm.links[0].mode_shapes()
    frequency = natural_modes(model, rest, parameters, locked=True)[0][0]  # type: ignore
    for state in ([0.4, 0.01, 0.0, 0.0], [0.4, 0.0, 0.0, 0.01 * frequency]):
        found = residual_vibration(model, np.array(state), rest, parameters)  # type: ignore
        assert found == pytest.approx(0.01 * shapes.tip_deflection[0], rel=1e-12)  # rounding


def test_joints_that_are_stopped_jerk_the_links(crane_arm: Arm) -> None:
    # brakes that stop the joints within microseconds, which the modes move through undisturbed
    arm = replace(crane_arm, gravity=np.zeros(2), joints=tuple(
        Joint(viscous_friction=1e6) for _ in crane_arm.joints))
    model, parameters = ArmDynamics(arm), PhysicalParameters.of_arm(arm)
    rest, moving = np.zeros(5), np.zeros(10)
    moving[5:] = [0.5, -0.8, 0.02, 0.0, -0.03]
    locked = simulate(model, parameters.physical, moving, lambda time: np.zeros(2), 3e-6)
    assert np.abs(locked[5:7]).max() < 1e-4
    found = [residual_vibration(model, state, rest, parameters) for state in (moving, locked)]
    assert found[0] == pytest.approx(found[1], rel=1e-3)
    assert found[0] > 1e-3
    kept = residual_vibration(model, np.concatenate([rest, [0, 0], moving[7:]]), rest, parameters)
    assert kept != pytest.approx(found[0], rel=0.2)
