"""Mode shapes: their integrals against quadrature, their ends against the family's promise."""

from __future__ import annotations

from collections.abc import Callable

from flex_planner.modes import FAMILIES, LinkModes, pinned_pinned
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
