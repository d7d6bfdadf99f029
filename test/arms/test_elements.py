"""Links of finite elements: integrals of a beam of elements are those of the beam."""

from __future__ import annotations

from dataclasses import fields, replace
from pathlib import Path
from typing import Any

from beam_elements import beam_arrays, beam_model
import casadi as ca
from flex_planner.arms.arm_files import (
    arm_from_mapping,
    arm_from_plain,
    ArmFileError,
    load_arm,
    plain_arm,
)
from flex_planner.arms.elements import ElementModel
from flex_planner.arms.kinematics import link_points, tip_position
from flex_planner.arms.mechanism import FlexibleBody
from flex_planner.arms.spatial_arm import SpatialArm
from flex_planner.arms.spatial_beam import SpatialBeam
from flex_planner.arms.spatial_body import Point
from flex_planner.arms.spatial_link import SpatialLink
from flex_planner.base.errors import InvalidValueError
from flex_planner.base.validation import Array
from flex_planner.base.yaml_text import format_yaml, parse_yaml
from flex_planner.dynamics.build_chain import build_chain
from flex_planner.dynamics.cache_key import describe_fields
from flex_planner.dynamics.dynamics_functions import physical_symbols
from flex_planner.dynamics.physical_parameters import PhysicalParameters
from flex_planner.optimal_control.path_constraints.bending_constraints import (
    BendingMoment,
    Deflection,
)
from flex_planner.optimal_control.path_constraints.spatial_points import express_point
from flex_planner.optimal_control.task import Task
from flex_planner.planning.kinds.effort import SearchEffort
from flex_planner.planning.plan_path import plan_path
from flex_planner.planning.robust.differing_arms import has_all_modes
from flex_planner.reports.spatial_arm import describe_spatial_links
import numpy as np
import pytest
from scipy.linalg import eigh
from spatial_arms import without_friction, yaw_pitch

LENGTH = 0.7
URDF = Path(__file__).parents[1] / 'data' / 'spatial' / 'branched.urdf'
BEAM = SpatialBeam(linear_density=0.6, flexural_rigidity=(60.0, 90.0), torsional_rigidity=40.0,
                   polar_inertia=1e-3, modes=(2, 1), twist_modes=1, damping_ratio=0.01)
# of fields that are sums over nodes
SUMS = {'inertia_slope', 'inertia_bend', 'cross_moment', 'spin'}


def errors(count: int) -> dict[str, float]:
    """Return by how much integrals differ from those of the beam, of their largest entry."""
    found = beam_model(BEAM, LENGTH, count, np.eye(3)).reduce((LENGTH, 0, 0), 0.01)
    body, exact = found.flexible_body(), BEAM.flexible_body(LENGTH)
    rigidity = BEAM.reference_rigidity
    exact = replace(exact, stiffness=rigidity * exact.stiffness,
                    damping=rigidity**0.5 * exact.damping)
    names = [one.name for one in fields(FlexibleBody) if 'shortening' not in one.name]
    # what sums over nodes miss of the moment counts by the size of the moment
    sizes = {name: np.abs(getattr(exact, 'moment' if name == 'spin' else name)).max()
             for name in names}
    return {name: np.abs(getattr(body, name) - getattr(exact, name)).max() / sizes[name]
            for name in names}


def arms(count: int, beam: SpatialBeam = BEAM, end: Point = (0.4, 0.3, -0.5),
         ) -> tuple[SpatialArm, SpatialArm]:
    """Return an arm whose last link is a beam, and the same of finite elements."""
    whole = yaw_pitch()
    link = SpatialLink(end=end, beam=beam, body=whole.links[1].body,
                       tip_body=whole.links[1].tip_body)
    model = beam_model(beam, link.length, count, link.axes())
    made = replace(link, beam=None, elements=model.reduce(end, beam.damping_ratio))
    return (replace(whole, links=(whole.links[0], link)),
            replace(whole, links=(whole.links[0], made)))


def equations(arm: SpatialArm, coordinates: Array, rates: Array) -> tuple[Array, Array]:
    """Return mass matrix and bias of an arm without payload."""
    chain = build_chain(arm)
    physical = PhysicalParameters.of_arm(arm, payload_mass=0.0, payload_inertia=0.0).physical
    function = ca.Function('f', [chain.coordinates, chain.rates, physical_symbols(chain)],
                           [chain.mass_matrix(), chain.bias()])
    mass, bias = function(coordinates, rates, physical)
    return mass.full(), bias.full()[:, 0]


def test_integrals_of_a_beam_of_elements_tend_to_those_of_the_beam() -> None:
    coarse, fine = errors(12), errors(24)
    assert max(error for name, error in fine.items() if name not in SUMS) < 1e-5
    for name in SUMS:
        assert coarse[name] / fine[name] == pytest.approx(4, abs=0.1)  # of second order
        assert fine[name] < 6e-3


@pytest.mark.parametrize('end', [(0.7, 0, 0), (0.4, 0.3, -0.5)])
def test_arm_of_elements_moves_as_that_of_the_beam(end: Point) -> None:
    pair = arms(32, end=end)
    rng = np.random.default_rng(2)
    q, rates = (np.concatenate([rng.normal(size=2), size * rng.normal(size=4)])
                for size in (0.02, 1.0))
    (mass, bias), (made_mass, made_bias) = (equations(arm, q, rates) for arm in pair)
    size = np.sqrt(np.diag(mass))
    np.testing.assert_allclose(made_mass / size / size[:, None], mass / size / size[:, None],
                               atol=5e-4)
    np.testing.assert_allclose(made_bias / size, bias / size, atol=5e-4 * max(abs(bias / size)))
    (rest, _), (made_rest, _) = (equations(arm, np.zeros(6), np.zeros(6)) for arm in pair)
    frequencies = [eigh(link.flexural_rigidity * link.flexible_body().stiffness, whole[2:, 2:],
                        eigvals_only=True) for link, whole in zip(
        (arm.links[1] for arm in pair), (rest, made_rest), strict=True)]
    np.testing.assert_allclose(*frequencies, rtol=1e-4)
    exact, made = pair
    q[2:] = 0.02 * rng.normal(size=4)
    np.testing.assert_allclose(tip_position(made, q), tip_position(exact, q), atol=1e-14)
    np.testing.assert_allclose(link_points(made, q, 33), link_points(exact, q, 33), atol=1e-14)
    np.testing.assert_allclose(link_points(made, q, 20), link_points(exact, q, 20), atol=1e-4)


def test_few_elements_lose_no_energy() -> None:
    _, arm = arms(3, replace(BEAM, damping_ratio=0.0))
    arm = without_friction(replace(arm, gravity=[0, 0, 0]))
    rng = np.random.default_rng(4)
    q, rates, h = 0.3 * rng.normal(size=6), rng.normal(size=6), 1e-3
    behind, before, after, ahead = (equations(arm, q + h * step * rates, rates)[0]
                                    for step in (-2, -1, 1, 2))
    _, bias = equations(arm, q, rates)
    _, bending = equations(arm, q, np.zeros(6))
    change = (8 * (after - before) - (ahead - behind)) / (12 * h)
    growth = rates @ change @ rates / 2
    assert rates @ (bias - bending) == pytest.approx(growth, rel=1e-7)


def test_elements_with_displacements_alone_turn_their_end_by_three_nodes() -> None:
    nodes = np.array([[0, 0, 0], [0.5, 0.1, 0], [0.5, -0.1, 0.1], [0.5, 0, -0.1]])
    angle = 0.01
    modes = np.zeros((4, 3, 1))
    modes[1:, :, 0] = [0, 0, 0.2] + angle * np.cross([0, 1, 0], nodes[1:] - [0.6, 0, 0])
    model = ElementModel(nodes=nodes, mass=np.eye(12), stiffness=np.eye(12), root_nodes=[0],
                         modes=modes.reshape(12, 1), tip_nodes=[1, 2, 3])
    body = model.reduce((0.6, 0, 0)).body
    np.testing.assert_allclose(body.tip_displacement[:, 0], [0, 0, 0.2], atol=1e-14)
    np.testing.assert_allclose(body.tip_turn[:, 0], [0, angle, 0], atol=1e-14)
    with pytest.raises(InvalidValueError, match='tip_nodes is .* say how the end turns'):
        replace(model, tip_nodes=[1, 2]).reduce((0.6, 0, 0))


@pytest.mark.parametrize(('change', 'message'), [
    (lambda x: {'nodes': x['nodes'][:, :2]}, r'nodes has shape \(5, 2\), .* shape \(k, 3\)'),
    (lambda x: {'mass': x['mass'][:-1, :-1]}, r'mass has shape \(29, 29\), .*\(15, 15\) or'),
    (lambda x: {'stiffness': np.eye(3)}, r'stiffness has shape \(3, 3\)'),
    (lambda x: {'modes': x['modes'][:-1]}, r'modes has shape \(29, 4\), .* \(30, m\)'),
    (lambda x: {'mass': np.triu(x['mass'])}, 'mass is .*unsymmetric.* must be symmetric'),
    (lambda x: {'stiffness': -x['stiffness']}, 'stiffness is .* must be positive semidefinite'),
    (lambda x: {'nodes': x['nodes'] * np.nan}, 'nodes is .* must be finite'),
    (lambda x: {'root_nodes': [1]}, 'modes is .*moving root_nodes by up to .* clamped link'),
    (lambda x: {'tip_nodes': [5]}, r'tip_nodes\[0\] is 5'),
    (lambda x: {'root_nodes': []}, 'root_nodes has no node'),
    (lambda x: {'line_nodes': [3, 1]}, 'line_nodes is .* in the order'),
    (lambda x: {'modes': x['modes'][:, [0, 0]]}, 'modes is .*dependent'),
    (lambda x: {'mass': np.diag(np.arange(30.0))}, 'mass is .*along x, y, z.* in all directions')])
def test_wrong_elements_are_refused_by_name(change: Any, message: str) -> None:
    arrays = beam_arrays(BEAM, LENGTH, 4, np.eye(3))
    with pytest.raises(InvalidValueError, match=message):
        ElementModel(**{**arrays, **change(arrays)}).reduce((LENGTH, 0, 0))


def of_file(folder: Path, arrays: dict[str, Any]) -> SpatialArm:
    """Return the arm of an arm file that names a file with some arrays."""
    np.savez(folder / 'boom.npz', **arrays)
    return load_arm(write_arm(folder))


def write_arm(folder: Path) -> str:
    """Write an arm file of one link, which names a file beside it; return its path."""
    file = folder / 'boom.yaml'
    file.write_text(format_yaml({
        'name': 'boom', 'kind': 'spatial', 'joints': [{'axis': [0, 1, 0]}],
        'tip': {'xyz': [LENGTH, 0, 0]}, 'links': [
            {'elements': {'file': 'boom.npz', 'damping_ratio': 0.01}, 'tip_body': {'mass': 0.2}}],
    }))
    return str(file)


def test_arm_file_names_a_file_of_elements(tmp_path: Path) -> None:
    arrays = beam_arrays(BEAM, LENGTH, 6, np.eye(3))
    arm = of_file(tmp_path, arrays)
    assert (arm.n_modes, arm.links[0].mass) == (4, pytest.approx(0.2 + 0.6 * LENGTH))
    assert arm.modal_names == ('link1_mode1', 'link1_mode2', 'link1_mode3', 'link1_mode4')
    assert '4 modes of finite elements of 0.42 kg' in '\n'.join(describe_spatial_links(arm, 0.0))
    # what is compiled, and recorded, depends on what is in the file alone
    again = arm_from_plain(parse_yaml(format_yaml(plain_arm(arm))))
    assert describe_fields(again) == describe_fields(arm)
    rigid = arm.rigid().links[0]
    assert (rigid.modes, rigid.mass) == (0, pytest.approx(arm.links[0].mass))
    assert arm.links[0].with_modes(2).modes == 2
    assert has_all_modes(arm)
    assert not has_all_modes(yaw_pitch())
    assert not has_all_modes(arm.rigid())
    for name, message in (('weights', 'elements.file: weights is .* left out'),
                          ('mass', 'elements.file: mass is missing, but must be given')):
        changed = ({**arrays, name: np.eye(3)} if name not in arrays
                   else {key: value for key, value in arrays.items() if key != name})
        with pytest.raises(ArmFileError, match=message):
            of_file(tmp_path, changed)
    (tmp_path / 'boom.npz').write_text('no arrays')
    with pytest.raises(ArmFileError, match=r"elements.file is 'boom.npz', .* numpy.savez"):
        load_arm(write_arm(tmp_path))


def test_overlay_of_a_urdf_names_a_file_of_elements(tmp_path: Path) -> None:
    np.savez(tmp_path / 'boom.npz', **beam_arrays(BEAM, 0.8, 6, np.eye(3)))
    (tmp_path / 'branched.urdf').write_text(URDF.read_text())
    content = {'urdf': 'branched.urdf', 'tip': 'tool', 'locked_joints': {'grip': 0.03}}
    boom = {'elements': {'file': 'boom.npz', 'damping_ratio': 0.01}, 'base_body': {'mass': 0.1}}
    arm = arm_from_mapping({**content, 'links': {'boom': boom}}, folder=tmp_path)
    link, notes = arm.links[1], '\n'.join(arm.notes)
    assert link.modes == 4 and link.mass == pytest.approx(0.1 + 0.8 * 0.6)
    assert 'link boom: elements, base_body and tip_body have 0.58 kg and stand for' in notes
    # the URDF has it in the middle
    away = 1e3 * 0.4 * 0.1 / 0.58
    assert f'link boom: as elements its centre of mass is {away:.3g} mm from' in notes
    with pytest.raises(InvalidValueError, match='links.boom.modes is .* no such field'):
        arm_from_mapping({**content, 'links': {'boom': {**boom, 'modes': {'across': 1}}}},
                         folder=tmp_path)


def test_bending_moments_of_elements_are_refused() -> None:
    arm = arms(4)[1]
    with pytest.raises(InvalidValueError, match='link is .*finite elements.* must be a beam'):
        BendingMoment(link=2, limit=1.0).check('limits[0]', arm)
    Deflection(link=2, limit=0.1).check('limits[0]', arm)
    exact, made = arms(32)
    at = np.array([0.25, 0.5, 1.0])
    np.testing.assert_allclose(made.links[1].bend_shapes(at), exact.links[1].bend_shapes(at),
                               atol=1e-12)
    q = np.array([0.3, -0.4, 0.01, 0.02, -0.01, 0.02])
    for share in at:
        (place,) = ca.Function('f', [], [express_point(made, ca.SX(q), 1, share)]).call([])
        np.testing.assert_allclose(place.full()[:, 0], link_points(made, q, 5)[1][int(4 * share)],
                                   atol=1e-12)


@pytest.mark.thorough
def test_plan_of_elements_is_that_of_the_beam() -> None:
    beam = replace(BEAM, modes=(1, 1), twist_modes=0)
    costs = [plan_path(Task(arm=arm, start_positions=[0, 0.3], goal_positions=[1.0, -0.4],
                            duration=0.9, payload_mass=0.2), search=SearchEffort.FAST).cost
             for arm in arms(32, beam, (0.7, 0, 0))]
    assert costs[1] == pytest.approx(costs[0], rel=1e-5)
