"""The Jacobian by its structure against that of CasADi, with motors within and on their limits."""

from __future__ import annotations

from collections.abc import Callable

import casadi as ca
from data_sheet_arms import data_sheet_arm
from flex_planner.arms.arm import Arm
from flex_planner.arms.arm_files import load_arm
from flex_planner.dynamics.build_chain import build_chain
from flex_planner.dynamics.physical_parameters import coulomb_frictions
from flex_planner.optimal_control.parameters import Parameters, ParameterSymbols
from flex_planner.optimal_control.pontryagin import derive_conditions
import numpy as np
from presets import PLANAR_PRESETS
import pytest
from spatial_arms import yaw_pitch


@pytest.mark.parametrize('name', [*PLANAR_PRESETS, 0, 1, yaw_pitch])
def test_structured_jacobian_is_the_derivative_of_the_conditions(
        name: str | int | Callable[[], Arm]) -> None:
    arm = (load_arm(name) if isinstance(name, str) else data_sheet_arm(name)
           if isinstance(name, int) else name())
    chain = build_chain(arm)
    symbols = ParameterSymbols.of(chain)
    found = derive_conditions(chain, symbols)
    function = ca.Function('f', [found.z, ca.vertcat(*symbols.stack())], [
        found.jacobian.assemble(), ca.jacobian(found.rate, found.z),
        found.torque - found.free_torque])
    rng, n, n_t = np.random.default_rng(0), arm.n_joints, arm.n_coordinates
    limited = 0
    for _ in range(20):
        z = np.concatenate([rng.uniform(-np.pi, np.pi, n), rng.uniform(-0.05, 0.05, n_t - n),
                            rng.normal(size=3 * n_t)])
        p = Parameters(
            **coulomb_frictions(arm),
            payload_mass=1.3, payload_inertia=0.07, rigidity=arm.flexural_rigidities(),
            stall_torque=10**rng.uniform(-1, 6, n), torque_slope=rng.uniform(0.1, 0.5, n),
            max_torque=rng.choice([np.inf, 1e3, 1.0, 0.3], n),
            effort_weights=rng.uniform(0.5, 2.0, n), position_weights=rng.uniform(0, 1, n_t),
            velocity_weights=rng.uniform(0, 1, n_t))
        structured, plain, cut = (np.array(value) for value in function(z, p.stack()))
        # mass matrices of clamped links on joints without inertia are close to singular
        rounding = 1e-11 if name == 'de_luca_siciliano' else 1e-12
        np.testing.assert_allclose(structured, plain, rtol=0, atol=rounding * np.abs(plain).max())
        limited += np.count_nonzero(cut)
    assert 0 < limited < 20 * n  # some motors are within their limits, some on them
