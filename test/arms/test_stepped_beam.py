"""Modes of links in sections against uniform beams, closed forms and published frequencies."""

from __future__ import annotations

from dataclasses import replace
import math

from flex_planner.arms.arm import Arm, BeamSection, Joint, Link
from flex_planner.arms.beam_eigenmodes import TipLoad
from flex_planner.arms.mode_shapes import LinkModes
from flex_planner.arms.stepped_beam import Pieces, stepped_modes
from flex_planner.base.errors import InvalidValueError
from flex_planner.base.validation import Array
from flex_planner.simulation.mismatch import AS_GIVEN, Mismatch
import numpy as np
import pytest
from scipy.optimize import brentq

LENGTH = 0.8
INTEGRALS = ('area', 'moment', 'gram', 'stiffness', 'tip_deflection', 'tip_slope')
STATIONS = np.linspace(0, LENGTH, 37)


def link(*sections: tuple[float, float, float], modes: int = 8, family: str = 'clamped_free',
         mass: float = 0.0, inertia: float = 0.0) -> Link:
    """Return a link of 0.8 m and 1.6 kg with sections (share, density, rigidity)."""
    return Link(length=LENGTH, linear_density=2.0, flexural_rigidity=1.0, modes=modes,
                mode_family=family, shape_mass=mass, shape_inertia=inertia,
                sections=tuple(BeamSection(share=a, density=b, rigidity=c)
                               for a, b, c in sections))


def frequencies(pieces: list[tuple[float, float, float]], count: int, **load: float) -> Array:
    """Return frequencies of a cantilever in units of sqrt(EI / (rho L^4))."""
    found = stepped_modes(Pieces(*np.array(pieces, dtype=float).T), count, TipLoad(**load))
    assert found is not None
    return found.frequencies


EQUAL = {1: (1.0,), 3: (0.3, 0.5, 0.2), 16: (1 / 16,) * 16}


@pytest.mark.parametrize('count', EQUAL)
@pytest.mark.parametrize(('family', 'mass', 'inertia'), [
    ('pinned_pinned', 0.0, 0.0), ('clamped_free', 0.0, 0.0), ('clamped_mass', 0.0, 0.0),
    ('clamped_mass', 3.0, 0.4), ('clamped_mass', 1e3, 0.0)])
def test_equal_pieces_have_the_modes_of_a_uniform_link(
        count: int, family: str, mass: float, inertia: float) -> None:
    uniform = link(family=family, mass=mass, inertia=inertia).mode_shapes()
    pieces = [(share, 1.0, 1.0) for share in EQUAL[count]]
    stepped = link(*pieces, family=family, mass=mass, inertia=inertia).mode_shapes()
    for name in INTEGRALS:
        expected = getattr(uniform, name)
        size = np.sqrt(np.abs(np.diag(expected))) if expected.ndim == 2 else None
        scale = np.outer(size, size) if size is not None else np.abs(expected).max() or 1.0
        np.testing.assert_allclose(getattr(stepped, name) / scale, expected / scale, atol=1e-10)
    np.testing.assert_allclose(stepped.shape(STATIONS), uniform.shape(STATIONS), atol=1e-10)
    bends = np.abs(uniform.curvature(STATIONS)).max(0)
    np.testing.assert_allclose(stepped.curvature(STATIONS) / bends,
                               uniform.curvature(STATIONS) / bends, atol=1e-10)


def transfer_determinant(frequency: float, pieces: list[tuple[float, float, float]]) -> float:
    """Return what is 0 at the frequencies of a cantilever, by matrices of states at its ends."""
    state = np.eye(4)[:, 2:]  # moment and shear at the clamp are free
    for share, density, rigidity in pieces:
        system = np.zeros((4, 4))
        system[0, 1] = system[2, 3] = 1.0
        system[1, 2], system[3, 0] = 1 / rigidity, density * frequency**2
        rates, vectors = np.linalg.eig(system)
        step = (vectors * np.exp(rates * share)) @ np.linalg.inv(vectors)
        state = step.real @ state
    return float(np.linalg.det(state[2:]))


@pytest.mark.parametrize('seed', range(4))
def test_frequencies_are_roots_of_transfer_matrices(seed: int) -> None:
    rng = np.random.default_rng(seed)
    shares, densities = rng.dirichlet(np.ones(3)), rng.uniform(0.2, 3, 3)
    pieces = list(zip(shares, densities / (shares @ densities), rng.uniform(1, 20, 3),
                      strict=True))
    for found in frequencies(pieces, 4):
        root = brentq(transfer_determinant, found * (1 - 1e-6), found * (1 + 1e-6), (pieces,),
                      xtol=1e-14, rtol=1e-14)
        assert found == pytest.approx(root, rel=1e-10)


def test_steps_tend_to_a_wedge() -> None:
    # of constant width and a depth that falls to 0 (Kirchhoff 1879): 5.315 sqrt(EI / (rho L^4))
    coarse, fine = (frequencies([(1 / k, x, x**3) for x in 1 - (np.arange(k) + 0.5) / k], 1)[0]
                    for k in (16, 32))
    assert fine + (fine - coarse) / 3 == pytest.approx(5.315, rel=5e-4)  # errors of second order


def test_hub_without_mass_leaves_a_short_cantilever() -> None:
    hub = frequencies([(0.4, 0.0, math.inf), (0.6, 1 / 0.6, 1.0)], 3)
    bare = frequencies([(1.0, 1.0, 1.0)], 3)
    # EI / (rho l^4) of the flexible length with all of the mass
    np.testing.assert_allclose(hub, bare / math.sqrt(0.6**3), rtol=1e-12)


def test_massless_spring_with_a_rigid_tip_has_its_closed_form() -> None:
    # a light beam of length b with a rod of mass 1 and length c: 2 by 2 stiffness of a cantilever
    b, c = 0.7, 0.3
    stiffness = np.array([[12 / b**3, -6 / b**2], [-6 / b**2, 4 / b]])
    mass = np.array([[1.0, c / 2], [c / 2, c**2 / 3]])
    expected = np.sqrt(np.sort(np.linalg.eigvals(np.linalg.solve(mass, stiffness)).real))
    pieces = [(b, 0.0, 1.0), (c, 1 / c, math.inf)]
    np.testing.assert_allclose(frequencies(pieces, 2), expected, rtol=1e-11)
    with pytest.raises(InvalidValueError, match='modes'):
        link(*pieces, modes=3)


def inner_products(modes: LinkModes, sections: tuple[BeamSection, ...]) -> tuple[Array, Array]:
    """Return gram and stiffness by quadrature of the shapes."""
    points, weights = np.polynomial.legendre.leggauss(40)
    ends = LENGTH * np.cumsum([0.0, *(one.share for one in sections)])
    gram, stiffness = np.zeros((2, modes.count, modes.count))
    for one, low, high in zip(sections, ends[:-1], ends[1:], strict=True):
        x, rule = low + (high - low) * (points + 1) / 2, weights * (high - low) / 2
        gram += one.density * (modes.shape(x).T * rule) @ modes.shape(x)
        if math.isfinite(one.rigidity):
            bend = modes.curvature(x)
            stiffness += one.rigidity * (bend.T * rule) @ bend
    return gram, stiffness


@pytest.mark.parametrize('family', ['clamped_free', 'clamped_mass', 'pinned_pinned'])
def test_integrals_are_those_of_the_shapes(family: str) -> None:
    given = link((0.1, 0.0, math.inf), (0.4, 1.75, 8.0), (0.3, 0.5, 1.0), (0.2, 0.75, math.inf),
                 modes=4, family=family, mass=0.5 * (family == 'clamped_mass'))
    modes = given.mode_shapes()
    gram, stiffness = inner_products(modes, given.sections)
    for found, expected in ((modes.gram, gram), (modes.stiffness, stiffness)):
        size = np.sqrt(np.diag(expected))
        np.testing.assert_allclose(found / np.outer(size, size), expected / np.outer(size, size),
                                   atol=1e-11)
    h = 1e-3 * LENGTH  # in the rigid tip shapes are straight
    near, end = modes.shape(np.array([LENGTH - h, LENGTH]))
    if family == 'pinned_pinned':
        np.testing.assert_allclose([end, modes.shape(np.zeros(1))[0]], 0, atol=1e-13)
        assert not modes.tip_deflection.any() and not modes.tip_slope.any()
    else:
        np.testing.assert_allclose(modes.tip_deflection, end, rtol=1e-12)
        np.testing.assert_allclose(modes.tip_slope, (end - near) / h, rtol=1e-9)


def test_shapes_have_the_mean_square_of_uniform_ones() -> None:
    sections = (0.4, 1.5, 3.0), (0.6, 2 / 3, 1.0)
    points, weights = np.polynomial.legendre.leggauss(60)
    for family, expected in (('clamped_free', 1.0), ('pinned_pinned', 0.5)):
        modes, square = link(*sections, family=family, modes=3).mode_shapes(), np.zeros(3)
        for low, high in ((0.0, 0.4), (0.4, 1.0)):
            x = LENGTH * (low + (high - low) * (points + 1) / 2)
            square += (high - low) / 2 * weights @ modes.shape(x)**2
        np.testing.assert_allclose(square, expected, rtol=1e-12)


def test_further_modes_are_damped_as_the_last_and_end_where_there_are_none() -> None:
    bending = replace(link((0.5, 1.5, 2.0), (0.5, 0.5, 1.0), modes=2), damping_ratio=(0.07, 0.03))
    assert bending.with_more_modes(2).damping_ratio == (0.07, 0.03, 0.03, 0.03)
    assert bending.with_modes(1).damping_ratio == (0.07,)
    assert bending.with_modes(0).damping_ratios.size == 0
    assert bending.with_more_modes(9).modes == 8
    # a spring without mass that carries a rigid piece has two modes
    spring = link((0.7, 0.0, 1.0), (0.3, 1 / 0.3, math.inf), modes=1)
    assert spring.with_more_modes(3).modes == 2


def test_simulated_arm_may_have_other_numbers_of_modes() -> None:
    given = replace(link((0.5, 1.5, 2.0), (0.5, 0.5, 1.0), modes=2), damping_ratio=(0.07, 0.03))
    arm = Arm(name='one', links=(given,), joints=(Joint(),))
    for modes, ratios in ((AS_GIVEN, (0.07, 0.03)), (3, (0.07, 0.03, 0.03)), (0, 0.0)):
        changed = Mismatch(modes=modes, rigidity_scale=2.0).apply(arm).links[0]
        assert (changed.damping_ratio, changed.flexural_rigidity) == (ratios, 2.0)
        assert changed.sections == given.sections
