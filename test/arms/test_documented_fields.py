"""The fields that the documentation names are those that are read, and the other way round."""

from __future__ import annotations

from pathlib import Path
import re
from typing import Any

from flex_planner.arms.arm_files import arm_from_mapping
from flex_planner.base.errors import FlexPlannerError, InvalidValueError
import pytest

DOCS = Path(__file__).parents[2] / 'docs' / 'arm_files.md'
# one value of each field that the tables name, in a place where it means something
LINKS: list[dict[str, Any]] = [
    {'length': 0.5, 'mass': 1.0, 'flexural_rigidity': 40.0, 'modes': 2, 'hub_radius': 0.02,
     'rigid_base': 0.01, 'rigid_tip': 0.01, 'mode_family': 'clamped_mass', 'shape_mass': 0.5,
     'shape_inertia': 0.01, 'damping_ratio': [0.01, 0.02], 'allowable_moment': 50.0},
    {'length': 0.5, 'density': 2700.0, 'youngs_modulus': 7e10, 'modes': 1,
     'section': {'width': 0.04, 'thickness': 0.005}, 'mode_family': 'clamped_free',
     'allowable_stress': 1e8, 'section_modulus': 1.7e-7, 'safety_factor': 1.5},
    {'length': 0.5, 'linear_density': 1.0, 'youngs_modulus': 7e10, 'modes': 1,
     'second_moment_of_area': 1e-9, 'mode_family': 'clamped_free'},
    {'sections': [{'length': 0.2, 'linear_density': 2.0, 'rigid': True},
                  {'length': 0.3, 'linear_density': 1.0, 'flexural_rigidity': 30.0}],
     'modes': 1, 'mode_family': 'clamped_free'},
    {'length': 0.3, 'mass': 0.5, 'center_of_mass': [0.1, 0.02], 'inertia': 0.01}]
JOINTS: list[dict[str, Any]] = [
    {'motor': {'at': 'motor', 'stall_torque': 1.0, 'no_load_speed': 400.0, 'max_torque': 0.8,
               'max_speed': 420.0, 'gear_ratio': 100.0, 'gear_efficiency': 0.8,
               'rotor_inertia': 1e-5},
     'friction': {'viscous': 0.1, 'coulomb': 0.2, 'coulomb_speed': 0.05},
     'elasticity': {'stiffness': 5e3, 'damping': 1.0}, 'housing': {'mass': 0.5, 'inertia': 1e-3},
     'lower_limit': -2.0, 'upper_limit': 2.0},
    {'viscous_friction': 0.1}, {}, {}, {}]
ARM: dict[str, Any] = {
    'name': 'everything', 'source': 'made up', 'gravity': [0.0, -9.81], 'links': LINKS,
    'joints': JOINTS, 'nodes': [{'mass': 0.1, 'inertia': 1e-3}] * 6,
    'payload': {'center_of_mass': [0.02, 0.0], 'inertia': 1e-3}}


def documented() -> set[str]:
    """Return the fields in the first columns of the tables, and those in their braces."""
    text = DOCS.read_text(encoding='utf-8')
    tables = re.split(r'\n(?=\| field)', text)[1:]
    names: set[str] = set()
    for table in tables:
        for line in table.splitlines()[2:]:
            if not line.startswith('|'):
                break
            for code in re.findall(r'`([^`]+)`', line.split('|')[1]):
                names |= set(re.findall(r'\w+', code))
    return names


def used(value: object) -> set[str]:
    """Return all keys in a value of YAML."""
    if isinstance(value, dict):
        return set(value) | {name for one in value.values() for name in used(one)}
    return {name for one in value for name in used(one)} if isinstance(value, list) else set()


def test_arm_with_every_documented_field_loads() -> None:
    arm = arm_from_mapping(ARM)
    assert (arm.n_joints, arm.n_modes, arm.elastic_joints) == (5, 5, (0,))
    # `name` to `nodes` stand in the example, the others among the words of the last column
    besides = {'name', 'source', 'gravity', 'links', 'joints', 'nodes', 'payload', 'rigid',
               'viscous_friction'}
    assert used(ARM) - besides == documented()


@pytest.mark.parametrize('place', ['links', 'joints', 'nodes'])
def test_another_field_is_refused(place: str) -> None:
    changed = {**ARM, place: [{**ARM[place][0], 'weight': 1.0}, *ARM[place][1:]]}
    with pytest.raises(FlexPlannerError, match=rf'{place}\[0\].*weight'):
        arm_from_mapping(changed)


def test_field_of_the_motor_is_refused_by_its_path() -> None:
    joint = {**JOINTS[0], 'motor': {**JOINTS[0]['motor'], 'torque': 1.0}}
    with pytest.raises((InvalidValueError, FlexPlannerError), match=r'joints\[0\]\.motor.*torque'):
        arm_from_mapping({**ARM, 'joints': [joint, *JOINTS[1:]]})
