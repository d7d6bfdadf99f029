"""Parameters of the optimality conditions: numbers and symbols in one order."""

from __future__ import annotations

from dataclasses import replace

import casadi as ca
from flex_planner.arms.arm import Arm
from flex_planner.dynamics.build_chain import build_chain
from flex_planner.optimal_control.arm_model import ArmModel
from flex_planner.optimal_control.parameters import (
    NAMES,
    Parameters,
    ParameterSymbols,
    payload_index,
)
import numpy as np
import pytest


@pytest.fixture(scope='module')
def parameters(workshop_arm: Arm) -> Parameters:
    """Return parameters in which no two numbers are alike."""
    n_t = workshop_arm.n_coordinates
    joints = tuple(replace(joint, coulomb_friction=0.31 + 0.01 * i,
                           coulomb_speed=0.41 + 0.01 * i,
                           motor=replace(joint.motor, max_torque=8.1 + i))
                   for i, joint in enumerate(workshop_arm.joints))
    return Parameters.of(replace(workshop_arm, joints=joints),
                         payload_mass=1.3, payload_inertia=0.07,
                         effort_weights=np.array([0.25, 0.125]),
                         position_weights=0.2 + 0.1 * np.arange(n_t),
                         velocity_weights=10.7 + 0.2 * np.arange(n_t))


def test_no_two_numbers_are_alike(parameters: Parameters) -> None:
    # or the tests below would not see that two are exchanged
    stack = parameters.stack()
    assert np.unique(stack).size == stack.size == 26


@pytest.mark.parametrize('name', NAMES)
def test_symbol_of_a_name_takes_the_number_of_that_name(workshop_arm: Arm, name: str,
                                                        parameters: Parameters) -> None:
    symbols = ParameterSymbols.of(build_chain(workshop_arm))
    pick = ca.Function('pick', [ca.vertcat(*symbols.stack())], [symbols[name]])
    found = np.array(pick(parameters.stack()))[:, 0]
    assert np.array_equal(found, np.atleast_1d(getattr(parameters, name)))


def test_limits_of_the_symbols_are_those_of_the_numbers(workshop_arm: Arm,
                                                        parameters: Parameters) -> None:
    symbols = ParameterSymbols.of(build_chain(workshop_arm))
    limits = symbols.torque_limits
    pick = ca.Function('pick', [ca.vertcat(*symbols.stack())], [limits.stall, limits.slope])
    stall, slope = (np.array(value)[:, 0] for value in pick(parameters.stack()))
    assert stall.tolist() == parameters.torque_limits.stall.tolist() == [9.0, 5.0]
    assert slope.tolist() == parameters.torque_limits.slope.tolist() == [2.25, 5 / 6]


def test_payload_is_where_its_index_says(parameters: Parameters) -> None:
    heavier = replace(parameters, payload_mass=2.5).stack()
    changed = np.flatnonzero(heavier != parameters.stack())
    assert changed.tolist() == [payload_index()]
    assert heavier[payload_index()] == 2.5


def test_compiled_conditions_read_the_payload_at_its_index(workshop_model: ArmModel,
                                                           parameters: Parameters) -> None:
    z = np.random.default_rng(0).normal(size=(3, 20))
    p = parameters.stack()
    p[payload_index()] = 2.5
    expected = workshop_model.optimality(z, replace(parameters, payload_mass=2.5).stack())
    assert np.array_equal(workshop_model.optimality(z, p), expected)
    assert not np.allclose(workshop_model.optimality(z, parameters.stack()), expected)


def test_dynamics_take_the_first_of_them_in_the_same_order(parameters: Parameters) -> None:
    physical = parameters.physical
    assert physical.tolist() == parameters.stack()[:physical.size].tolist()
    assert physical.tolist() == [1.3, 0.07, 30.0, 12.0, 0.31, 0.32, 0.41, 0.42]


def test_parameters_default_to_the_arm_and_effort_alone(workshop_arm: Arm) -> None:
    p = Parameters.of(workshop_arm)
    assert (p.payload_mass, p.rigidity.tolist()) == (0.0, [30.0, 12.0])
    assert (p.stall_torque.tolist(), p.torque_slope.tolist()) == ([9.0, 5.0], [2.25, 5 / 6])
    assert p.effort_weights.tolist() == [1.0, 1.0]
    assert p.position_weights.tolist() == p.velocity_weights.tolist() == [0.0] * 5
