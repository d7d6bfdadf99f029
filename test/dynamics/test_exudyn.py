"""
The model of bending in space against geometrically exact beams of another code.

The path of the tip is by EXUDYN 1.13.6, stored as a table; bench/independent/tube_in_exudyn.py
made it and says what moves.

"""

from __future__ import annotations

import json
import math
from pathlib import Path
from typing import Any

import casadi as ca
from flex_planner.arms.kinematics import tip_position
from flex_planner.arms.spatial_arm import SpatialArm
from flex_planner.arms.spatial_beam import SpatialBeam
from flex_planner.arms.spatial_body import SpatialBody
from flex_planner.arms.spatial_joint import SpatialJoint
from flex_planner.arms.spatial_link import SpatialLink
from flex_planner.base.validation import Array
from flex_planner.dynamics.build_chain import build_chain
from flex_planner.dynamics.dynamics_functions import physical_symbols
from flex_planner.dynamics.physical_parameters import PhysicalParameters
import numpy as np
import pytest
from scipy.integrate import solve_ivp

TABLE: dict[str, Any] = json.loads((
    Path(__file__).parents[1] / 'data' / 'spatial' / 'exudyn_tube.json').read_text())


def tube(modes: int, twist: int, foreshortening: bool) -> SpatialArm:
    """Return the tube on its vertical axis."""
    area = math.pi * (TABLE['outer_radius']**2 - TABLE['inner_radius']**2)
    second = math.pi / 4 * (TABLE['outer_radius']**4 - TABLE['inner_radius']**4)
    bending, angle = TABLE['youngs_modulus'] * second, TABLE['angle']
    beam = SpatialBeam(
        linear_density=TABLE['density'] * area, flexural_rigidity=(bending, bending),
        torsional_rigidity=bending / (1 + TABLE['poissons_ratio']),
        polar_inertia=2 * TABLE['density'] * second, modes=(modes, modes), twist_modes=twist,
        mode_family='clamped_mass', shape_mass=TABLE['tip_mass'], shape_twist_inertia=1e-3,
        foreshortening=foreshortening)
    end = TABLE['length'] * np.array([math.cos(angle), 0, math.sin(angle)])
    return SpatialArm(
        name='tube', gravity=[0, 0, -TABLE['gravity']], joints=(SpatialJoint(),),
        links=(SpatialLink(
            end=tuple(end), beam=beam, body=SpatialBody(inertia=(TABLE['hub_inertia'],) * 3),
            tip_body=SpatialBody(mass=TABLE['tip_mass'], center_of_mass=tuple(TABLE['tip_at']),
                                 inertia=tuple(TABLE['tip_inertia']))),))


def simulated_tip(arm: SpatialArm) -> Array:
    """Return the path of the tip under the torque, shape (k, 3) [m]."""
    chain, n_t = build_chain(arm), arm.n_coordinates
    physical = PhysicalParameters.of_arm(arm, payload_mass=0.0, payload_inertia=0.0).physical
    function = ca.Function('f', [chain.coordinates, chain.rates, physical_symbols(chain)],
                           [chain.mass_matrix(), chain.bias()])

    def rate(time: float, x: Array) -> Array:
        mass, bias = (part.full() for part in function(x[:n_t], x[n_t:], physical))
        forces = -bias[:, 0]
        forces[0] += TABLE['torque'] * math.sin(2 * math.pi * time / TABLE['duration'])
        return np.concatenate([x[n_t:], np.linalg.solve(mass, forces)])

    found = solve_ivp(rate, (0, TABLE['duration']), np.zeros(2 * n_t), method='DOP853',
                      rtol=1e-6, atol=1e-8, t_eval=TABLE['times'])
    return tip_position(arm, found.y[:n_t].T)


@pytest.mark.thorough
def test_tip_goes_where_that_of_exact_beams_does() -> None:
    exact = np.array(TABLE['tip'])
    assert np.linalg.norm(exact - exact[0], axis=1).max() > 1.3
    shortened, plain = (np.linalg.norm(simulated_tip(tube(2, 1, given)) - exact, axis=1).max()
                        for given in (True, False))
    # [m]; the table's own tip moved by up to 0.18 mm from 8 to 16 elements, then extrapolated
    assert shortened < 2e-4
    assert shortened < 0.7 * plain
