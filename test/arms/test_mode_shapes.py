"""Mode shapes: their integrals against quadrature, their ends against the family's promise."""

from __future__ import annotations

from collections.abc import Callable
from functools import cache

from flex_planner.arms.beam_eigenmodes import clamped_eigenvalue, TipLoad
from flex_planner.arms.mode_shapes import (
    clamped_free,
    clamped_mass,
    FAMILIES,
    LinkModes,
    pinned_pinned,
)
import mpmath
import numpy as np
from numpy.typing import NDArray
import pytest

Array = NDArray[np.float64]

LENGTH = 0.7  # [m], not 1 and not 0.5, so that no power of it is mistaken for another
COUNT = 8
# 40 Gauss points integrate sin^2(8 pi x / L) to rounding
POINTS, WEIGHTS = np.polynomial.legendre.leggauss(40)
STATIONS, LENGTHS = LENGTH * (POINTS + 1) / 2, LENGTH * WEIGHTS / 2

INTEGRALS: dict[str, Callable[[Array, Array], Array]] = {
    # name of the constant: the integral it stands for, from phi and phi'' at the stations
    'area': lambda phi, _: LENGTHS @ phi,
    'moment': lambda phi, _: (LENGTHS * STATIONS) @ phi,
    'gram': lambda phi, _: np.einsum('k,ki,kj->ij', LENGTHS, phi, phi),
    'stiffness': lambda _, phi_xx: np.einsum('k,ki,kj->ij', LENGTHS, phi_xx, phi_xx),
}


@pytest.fixture
def modes() -> LinkModes:
    return pinned_pinned(LENGTH, COUNT)


@pytest.mark.parametrize('name', INTEGRALS)
def test_integrals_of_modes_1_to_8_agree_with_gauss_quadrature(modes: LinkModes,
                                                               name: str) -> None:
    expected = INTEGRALS[name](modes.shape(STATIONS), modes.curvature(STATIONS))
    # relative to the largest entry: entries that vanish do so only to rounding
    np.testing.assert_allclose(getattr(modes, name), expected, rtol=1e-12,
                               atol=1e-12 * np.abs(expected).max())


def test_curvature_is_the_second_derivative_of_the_shape(modes: LinkModes) -> None:
    x, h = np.linspace(0.1, 0.6, 11), 1e-4
    second = (modes.shape(x + h) - 2 * modes.shape(x) + modes.shape(x - h)) / h**2
    # truncation h^2 w^4 / 12 = 1.4e-3 for mode 8, whose curvature is 1.3e3
    np.testing.assert_allclose(second, modes.curvature(x), atol=2e-6 * np.abs(second).max())


def test_shapes_are_the_sines_of_eq_20(modes: LinkModes) -> None:
    x = np.linspace(0, LENGTH, 15)
    for j in range(1, COUNT + 1):
        # rounding of an argument up to 8 pi
        np.testing.assert_allclose(modes.shape(x)[:, j - 1], np.sin(j * np.pi * x / LENGTH),
                                   atol=1e-14)


# mass and inertia at the tip over those of the link, from none to hardly any beam at all
LOADS = [(0.0, 0.0), (0.3, 0.0), (1.0, 0.02), (12.0, 5.353), (0.0, 3.0), (500.0, 1e-3),
         (1e4, 1e4)]
loads = pytest.mark.parametrize('load', [TipLoad(mass_ratio=mass, inertia_ratio=inertia)
                                         for mass, inertia in LOADS], ids=str)


def textbook_mode(order: int, load: TipLoad) -> tuple[mpmath.mpf, mpmath.mpf]:
    """Return b and s of ``cosh bx - cos bx - s (sinh bx - sin bx)`` at mpmath's precision."""
    mass, inertia = load.mass_ratio, load.inertia_ratio

    def equation(b: mpmath.mpf) -> mpmath.mpf:
        c, s, ch, sh = mpmath.cos(b), mpmath.sin(b), mpmath.cosh(b), mpmath.sinh(b)
        return (1 + c * ch + mass * b * (c * sh - s * ch) - inertia * b**3 * (s * ch + c * sh)
                + mass * inertia * b**4 * (1 - c * ch))

    b = mpmath.findroot(equation, mpmath.mpf(clamped_eigenvalue(order, load)))
    c, s, ch, sh = mpmath.cos(b), mpmath.sin(b), mpmath.cosh(b), mpmath.sinh(b)
    # phi'' = inertia b^4 phi' at the tip
    ratio = (ch + c - inertia * b**3 * (sh + s)) / (sh + s - inertia * b**3 * (ch - c))
    return b, ratio


@cache
def exact_modes(load: TipLoad) -> tuple[Array, Array, Array, Array]:
    """
    Return stations, weights, shapes and curvatures of modes 1 to 8, mean square 1.

    The textbook's formula, which cancels badly, at 60 digits, and a Gauss rule of 96 points.

    """
    with mpmath.workdps(60):
        rule = mpmath.calculus.quadrature.GaussLegendre(mpmath.mp).calc_nodes(6, 200)
        x, weights = ([(1 + node) / 2 for node, _ in rule], [weight / 2 for _, weight in rule])
        columns = [textbook_values(*textbook_mode(order, load), x)
                   for order in range(1, COUNT + 1)]
        sizes = [mpmath.sqrt(mpmath.fdot(weights, [phi**2 for phi in values]))
                 for values, _ in columns]
        shapes, bends = (np.array([[float(value / size) for value in column[kind]]
                                   for column, size in zip(columns, sizes, strict=True)]).T
                         for kind in (0, 1))
        # the sign of a shape is free: ours start upwards, and so does the textbook's
        return (LENGTH * np.array(x, dtype=float), LENGTH * np.array(weights, dtype=float),
                shapes, bends / LENGTH**2)


def textbook_values(b: mpmath.mpf, ratio: mpmath.mpf,
                    stations: list[mpmath.mpf]) -> tuple[list[mpmath.mpf], list[mpmath.mpf]]:
    """Return a mode and its second derivative at stations from 0 to 1."""
    shape, bend = [], []
    for x in stations:
        c, s, ch, sh = (f(b * x) for f in (mpmath.cos, mpmath.sin, mpmath.cosh, mpmath.sinh))
        shape.append(ch - c - ratio * (sh - s))
        bend.append(b**2 * (ch + c - ratio * (sh + s)))
    return shape, bend


@loads
@pytest.mark.parametrize('name', ['area', 'moment', 'gram', 'stiffness'])
def test_integrals_of_clamped_modes_1_to_8_are_those_of_the_exact_shapes(load: TipLoad,
                                                                         name: str) -> None:
    x, weights, phi, bend = exact_modes(load)
    expected = {'area': lambda: weights @ phi, 'moment': lambda: (weights * x) @ phi,
                'gram': lambda: (phi.T * weights) @ phi,
                'stiffness': lambda: (bend.T * weights) @ bend}[name]()
    # relative to the modes' sizes: entries that vanish do so only to rounding
    size = np.sqrt(np.diag(expected)) if expected.ndim == 2 else np.abs(expected).max()
    unit = np.outer(size, size) if expected.ndim == 2 else size
    found = getattr(clamped_mass(LENGTH, COUNT, load), name)
    assert (np.abs(found - expected) / unit).max() <= 1e-12


@loads
def test_clamped_shapes_and_curvatures_are_exact(load: TipLoad) -> None:
    x, _, phi, bend = exact_modes(load)
    modes = clamped_mass(LENGTH, COUNT, load)
    np.testing.assert_allclose(modes.shape(x), phi, rtol=0, atol=1e-12 * np.abs(phi).max())
    relative = (modes.curvature(x) - bend) / np.abs(bend).max(axis=0)
    assert np.abs(relative).max() <= 1e-12


@loads
def test_clamped_modes_are_orthogonal_with_their_load(load: TipLoad) -> None:
    modes = clamped_mass(LENGTH, COUNT, load)
    tip, slope = modes.tip_deflection, modes.tip_slope
    mass = (modes.gram + load.mass_ratio * LENGTH * np.outer(tip, tip)
            + load.inertia_ratio * LENGTH**3 * np.outer(slope, slope))
    for matrix in (mass, modes.stiffness):
        size = np.sqrt(np.outer(np.diag(matrix), np.diag(matrix)))
        # rounding of the tip values, which a large load multiplies
        np.testing.assert_allclose(matrix / size, np.eye(COUNT), rtol=0,
                                   atol=1e-12 + 1e-15 * (load.mass_ratio + load.inertia_ratio))


@loads
def test_rayleigh_quotients_of_clamped_modes_are_their_eigenvalues(load: TipLoad) -> None:
    modes = clamped_mass(LENGTH, COUNT, load)
    mass = (np.diag(modes.gram) + load.mass_ratio * LENGTH * modes.tip_deflection**2
            + load.inertia_ratio * LENGTH**3 * modes.tip_slope**2)
    found = (np.diag(modes.stiffness) / mass)**0.25 * LENGTH
    expected = [clamped_eigenvalue(order, load) for order in range(1, COUNT + 1)]
    np.testing.assert_allclose(found, expected, rtol=1e-12)


@loads
def test_tip_slope_of_clamped_modes_is_the_derivative_of_the_shape(load: TipLoad) -> None:
    modes = clamped_mass(LENGTH, COUNT, load)
    # a complex step: exact but for rounding, relative to the highest mode
    expected = modes.shape(np.array([LENGTH + 1e-20j]))[0].imag / 1e-20
    np.testing.assert_allclose(modes.tip_slope, expected, rtol=0,
                               atol=1e-13 * np.abs(expected).max())


def test_clamped_shapes_have_a_mean_square_of_1() -> None:
    for load in (TipLoad(), TipLoad(mass_ratio=2.0, inertia_ratio=0.1)):
        gram = clamped_mass(LENGTH, COUNT, load).gram
        np.testing.assert_allclose(np.diag(gram), LENGTH, rtol=1e-13)  # rounding


def test_clamped_free_is_clamped_mass_without_a_load() -> None:
    ignored = TipLoad(mass_ratio=3.0, inertia_ratio=1.0)
    free, plain = clamped_free(LENGTH, 4, ignored), clamped_mass(LENGTH, 4)
    for name in ('area', 'moment', 'gram', 'stiffness', 'tip_deflection', 'tip_slope'):
        assert np.array_equal(getattr(free, name), getattr(plain, name))
    assert np.abs(clamped_mass(LENGTH, 4, ignored).area - free.area).max() > 1e-2


def test_plain_cantilever_has_tip_deflections_of_twice_the_mean_square() -> None:
    # Blevins: the shapes end at +-2 and have a mean square of 1
    modes = clamped_free(LENGTH, COUNT)
    np.testing.assert_allclose(modes.tip_deflection, [2, -2] * 4, rtol=1e-13)
    # sigma_1 = 0.7340955, 2 sigma b / L of slope
    assert modes.tip_slope[0] == pytest.approx(2 * 0.734095514 * 1.875104069 / LENGTH, rel=1e-8)


@pytest.mark.parametrize('family', FAMILIES)
def test_tip_deflection_of_every_family_is_its_shape_at_the_end(family: str) -> None:
    modes = FAMILIES[family](LENGTH, COUNT)
    # rounding of sin(8 pi)
    np.testing.assert_allclose(modes.tip_deflection, modes.shape(np.array([LENGTH]))[0],
                               atol=1e-14)


def test_pinned_link_turns_the_next_frame_by_nothing(modes: LinkModes) -> None:
    # the joint angle is measured from the chord
    assert modes.tip_slope.tolist() == modes.tip_deflection.tolist() == [0.0] * COUNT


@pytest.mark.parametrize('family', FAMILIES)
def test_rigid_link_has_empty_constants_of_the_right_shape(family: str) -> None:
    modes = FAMILIES[family](LENGTH, 0)
    assert modes.count == 0
    assert modes.gram.shape == modes.stiffness.shape == (0, 0)
    assert modes.area.shape == modes.moment.shape == modes.tip_slope.shape == (0,)
    assert modes.shape(STATIONS).shape == modes.curvature(STATIONS).shape == (40, 0)


@pytest.mark.parametrize('family', FAMILIES)
def test_gram_and_stiffness_are_symmetric_positive_definite(family: str) -> None:
    modes = FAMILIES[family](LENGTH, COUNT)
    for matrix in (modes.gram, modes.stiffness):
        assert np.array_equal(matrix, matrix.T)
        np.linalg.cholesky(matrix)


def test_natural_frequencies_are_those_of_a_simply_supported_beam() -> None:
    # E I = 50 N m^2, rho = 6 kg/m, L = 0.5 m: 18.14 Hz times j^2; the text has ~72 Hz for mode 2
    modes = pinned_pinned(0.5, 4)
    squares = 50.0 * np.diag(modes.stiffness) / (6.0 * np.diag(modes.gram))
    expected = (np.arange(1, 5) * np.pi / 0.5)**2 * np.sqrt(50.0 / 6.0)
    np.testing.assert_allclose(np.sqrt(squares), expected, rtol=1e-13)  # rounding
    assert np.sqrt(squares[1]) / (2 * np.pi) == pytest.approx(72.0, abs=1.0)
