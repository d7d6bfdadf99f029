"""Small vibrations of whole arms: mode families against each other and against finite elements."""

from __future__ import annotations

from dataclasses import replace

from finite_elements import frequencies
from flex_planner.arms.arm import Arm, Joint, Link, Node
from flex_planner.arms.arm_files import load_arm
from flex_planner.arms.beam_eigenmodes import clamped_eigenvalue, TipLoad
from flex_planner.base.validation import Array
from flex_planner.dynamics.statics import natural_modes
from flex_planner.optimal_control.parameters import Parameters
from light_model import LightModel
import numpy as np
import pytest

GOAL = np.radians([90.0, -90.0])  # of section 5.2
HERTZ = 2 * np.pi
Payload = tuple[float, float]


def with_shapes(arm: Arm, family: str, count: int, payload: Payload = (0.0, 0.0)) -> Arm:
    """Return the arm with other shapes; loaded ones know what each link carries, stretched."""
    links, (mass, inertia) = [], payload
    for link, node in zip(arm.links[::-1], arm.nodes[:0:-1], strict=True):
        mass, inertia = mass + node.mass, inertia + node.inertia
        loads = ({'shape_mass': mass, 'shape_inertia': inertia} if family == 'clamped_mass'
                 else {})
        links.insert(0, replace(link, mode_family=family, modes=count, **loads))
        # what hangs on the next link inwards: parallel axes
        inertia += link.mass * link.length**2 / 3 + mass * link.length**2
        mass += link.mass
    return replace(arm, links=tuple(links))


def found(arm: Arm, positions: Array, payload: Payload, *, locked: bool) -> Array:
    """Return the frequencies of the assumed modes, straight about a posture [rad/s]."""
    parameters = Parameters.of(arm, payload_mass=payload[0], payload_inertia=payload[1])
    coordinates = np.concatenate([positions, np.zeros(arm.n_modes)])
    return natural_modes(LightModel(arm), coordinates, parameters, locked=locked)[0]


@pytest.fixture(scope='module')
def paper(ei50_arm: Arm) -> Arm:
    return ei50_arm


@pytest.fixture(scope='module')
def loaded_arm() -> Arm:
    """Return three unlike links with masses and inertias at every node."""
    links = tuple(Link(length=length, linear_density=density, flexural_rigidity=rigidity, modes=1)
                  for length, density, rigidity in ((0.6, 4.0, 60.0), (0.4, 2.5, 30.0),
                                                    (0.3, 1.5, 10.0)))
    nodes = (Node(mass=2.0, inertia=0.05), Node(mass=1.5, inertia=0.02),
             Node(mass=0.8, inertia=0.01), Node(mass=0.4, inertia=0.01))
    return Arm(name='loaded', links=links, joints=(Joint(),) * 3, nodes=nodes)


@pytest.mark.parametrize(('family', 'expected'), [
    # two modes per link, no payload, joints free
    ('pinned_pinned', [19.69, 28.38]), ('clamped_free', [19.87, 28.37])])
def test_families_give_the_arm_of_the_paper_nearly_the_same_frequencies(
        paper: Arm, family: str, expected: list[float]) -> None:
    values = found(with_shapes(paper, family, 2), GOAL, (0.0, 0.0), locked=False)
    np.testing.assert_allclose(values[2:4] / HERTZ, expected, atol=0.005)  # digits written


@pytest.mark.parametrize(('family', 'tolerance'), [
    # measured 4e-6, 2e-4 and 4e-7: the closer a shape is to the free joint and the load
    ('pinned_pinned', 1e-5), ('clamped_free', 3e-4), ('clamped_mass', 1e-5)])
def test_every_family_tends_to_the_finite_elements_with_free_joints(
        paper: Arm, family: str, tolerance: float) -> None:
    # rotations of the joints come first: two, of frequency 0
    exact = frequencies(paper, GOAL, locked=False)[2:4]
    errors = [np.max(found(with_shapes(paper, family, count), GOAL, (0.0, 0.0),
                           locked=False)[2:4] / exact - 1) for count in (2, 4, 6, 8)]
    assert (np.diff(errors) < 0).all()
    assert errors[-1] < tolerance


@pytest.mark.parametrize('locked', [True, False])
@pytest.mark.parametrize('payload', [(0.0, 0.0), (1.0, 0.0), (1.0, 0.1)])
@pytest.mark.parametrize('positions', [GOAL, np.array([0.3, 0.9])])
def test_loaded_clamped_shapes_agree_with_finite_elements(
        paper: Arm, positions: Array, payload: Payload, locked: bool) -> None:
    exact = frequencies(paper, positions, payload=payload, locked=locked)
    arm = with_shapes(paper, 'clamped_mass', 8, payload)
    first = 0 if locked else 2
    values = found(arm, positions, payload, locked=locked)
    # of 16 elements, as their number shows; 24 agree within 2e-6
    np.testing.assert_allclose(values[first:first + 4], exact[first:first + 4], rtol=3e-5)


@pytest.mark.parametrize('locked', [True, False])
def test_masses_and_inertias_of_nodes_act_where_finite_elements_put_them(
        loaded_arm: Arm, locked: bool) -> None:
    positions, payload = np.array([0.3, -0.8, 1.3]), (0.7, 0.03)
    exact = frequencies(loaded_arm, positions, payload=payload, locked=locked)
    arm = with_shapes(loaded_arm, 'clamped_mass', 6, payload)
    first = 0 if locked else 3
    values = found(arm, positions, payload, locked=locked)
    np.testing.assert_allclose(values[first:first + 3], exact[first:first + 3], rtol=1e-5)


def test_mixed_families_agree_with_finite_elements(loaded_arm: Arm) -> None:
    positions, payload = np.array([0.3, -0.8, 1.3]), (0.7, 0.03)
    # a chord as frame is as good where joints are free, but does not bend what turns with it
    plain = replace(loaded_arm, nodes=(Node(mass=2.0), *loaded_arm.nodes[1:]))
    pinned, clamped = (with_shapes(plain, family, 6, payload).links
                       for family in ('pinned_pinned', 'clamped_mass'))
    exact = frequencies(plain, positions, payload=payload, locked=False)
    arm = replace(plain, links=(pinned[0], *clamped[1:]))
    values = found(arm, positions, payload, locked=False)
    np.testing.assert_allclose(values[3:6], exact[3:6], rtol=1e-4)


@pytest.mark.parametrize('family', ['clamped_free', 'clamped_mass'])
@pytest.mark.parametrize('count', [1, 2, 3, 5])
def test_assumed_modes_are_never_softer_than_the_beam(loaded_arm: Arm, family: str,
                                                      count: int) -> None:
    # Rayleigh and Ritz: a restricted motion raises every frequency
    positions, payload = np.array([0.3, -0.8, 1.3]), (0.7, 0.03)
    exact = frequencies(loaded_arm, positions, payload=payload, locked=True)
    values = found(with_shapes(loaded_arm, family, count, payload), positions, payload,
                   locked=True)
    # the elements are too stiff as well, and rounded: 1e-6 in the first three
    assert (values[:3] >= exact[:3] * (1 - 1e-5)).all()


def test_finite_elements_agree_with_the_closed_form_of_a_cantilever() -> None:
    link = Link(length=0.5, linear_density=0.2, flexural_rigidity=1.0, modes=1)
    arm = Arm(name='beam', links=(link,), joints=(Joint(),))
    for payload in ((0.0, 0.0), (0.1, 0.0005)):
        load = TipLoad(mass_ratio=payload[0] / 0.1, inertia_ratio=payload[1] / (0.1 * 0.25))
        expected = [clamped_eigenvalue(order, load)**2 for order in (1, 2, 3)]
        exact = frequencies(arm, np.zeros(1), payload=payload, locked=True)
        np.testing.assert_allclose(exact[:3], np.array(expected) * np.sqrt(1 / 0.2) / 0.25,
                                   rtol=5e-5)  # (b / 16)^4 / 720 of the third mode


def test_link_with_its_load_rings_with_the_eigenvalues_of_its_shapes() -> None:
    arm = load_arm('single_link')  # its shapes expect a payload of 0.1 kg and 0.0005 kg m^2
    values = found(arm, np.zeros(1), (0.1, 0.0005), locked=True)
    load = TipLoad(mass_ratio=1.0, inertia_ratio=0.02)
    expected = [clamped_eigenvalue(order, load)**2 for order in (1, 2, 3, 4)]
    np.testing.assert_allclose(values, np.array(expected) * np.sqrt(1 / 0.2) / 0.25, rtol=1e-11)
    np.testing.assert_allclose(values[:2] / HERTZ, [2.18, 15.91], atol=0.005)  # as printed


def test_de_luca_and_siciliano_s_arm_has_their_links() -> None:
    arm = load_arm('de_luca_siciliano')
    for link, expected in zip(arm.links, ([0.48, 1.80], [2.18, 15.91]), strict=True):
        shapes = link.mode_shapes()
        mass = (link.linear_density * shapes.gram
                + link.shape_mass * np.outer(shapes.tip_deflection, shapes.tip_deflection)
                + link.shape_inertia * np.outer(shapes.tip_slope, shapes.tip_slope))
        squares = np.diag(link.flexural_rigidity * shapes.stiffness) / np.diag(mass)
        np.testing.assert_allclose(np.sqrt(squares) / HERTZ, expected, atol=0.005)  # as printed


def test_natural_modes_are_orthonormal_in_the_mass_matrix(loaded_arm: Arm) -> None:
    arm = with_shapes(loaded_arm, 'clamped_mass', 2)
    model, parameters = LightModel(arm), Parameters.of(arm)
    q = np.concatenate([[0.3, -0.8, 1.3], np.zeros(6)])
    values, vectors = natural_modes(model, q, parameters, locked=False)
    mass = model.mass_and_energy(np.pad(q, (0, 9))[None], parameters.physical)[0][0]
    stiffness = model.static_forces(q[None], parameters.physical)[1][0]
    np.testing.assert_allclose(vectors.T @ mass @ vectors, np.eye(9), atol=1e-11)
    np.testing.assert_allclose(vectors.T @ stiffness @ vectors, np.diag(values**2),
                               atol=1e-11 * values[-1]**2)
    assert values[:3].tolist() == [0.0, 0.0, 0.0]  # free joints in a horizontal plane
    assert (np.diff(values) >= 0).all()


def test_rigid_rod_swings_as_a_pendulum_or_falls() -> None:
    arm = Arm(name='rod', links=(Link(length=0.8, linear_density=2.0),), joints=(Joint(),),
              gravity=[0.0, -9.81])
    model, parameters = LightModel(arm), Parameters.of(arm)
    hanging, _ = natural_modes(model, np.array([-np.pi / 2]), parameters, locked=False)
    assert hanging == pytest.approx([np.sqrt(1.5 * 9.81 / 0.8)], rel=1e-12)  # 3 g / (2 L)
    upright, _ = natural_modes(model, np.array([np.pi / 2]), parameters, locked=False)
    assert np.isnan(upright).tolist() == [True]
    assert natural_modes(model, np.zeros(1), parameters, locked=True)[0].size == 0


def test_inertia_on_a_pinned_link_turns_with_its_chord(paper: Arm) -> None:
    # so that these shapes miss how it bends the link: the first of 8.24 Hz is not there
    exact = frequencies(paper, GOAL, payload=(1.0, 0.1), locked=False) / HERTZ
    pinned = found(with_shapes(paper, 'pinned_pinned', 6), GOAL, (1.0, 0.1), locked=False) / HERTZ
    clamped = found(with_shapes(paper, 'clamped_mass', 6, (1.0, 0.1)), GOAL, (1.0, 0.1),
                    locked=False) / HERTZ
    assert exact[2] == pytest.approx(8.240, abs=1e-3)
    assert clamped[2] == pytest.approx(8.240, abs=1e-3)
    assert pinned[2] > 19
