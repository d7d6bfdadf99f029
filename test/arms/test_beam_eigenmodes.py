"""Clamped beams: textbook eigenvalues, limits, published frequencies, the beam equation."""

from __future__ import annotations

import math

from flex_planner.arms.beam_eigenmodes import (
    clamped_eigenvalue,
    ClampedMode,
    eigenvalues_below,
    frequency_equation,
    TipLoad,
)
from flex_planner.base.errors import InvalidValueError
from flex_planner.base.validation import Array
from hypothesis import given, settings
from hypothesis import strategies as st
import mpmath
import numpy as np
import pytest

# Blevins, Formulas for Natural Frequency and Mode Shape, table 8-1: clamped-free
CLAMPED_FREE = [1.875104068711961, 4.694091132974175, 7.854757438237613, 10.995540734875467,
                14.13716839, 17.27875953]
# same table, clamped-pinned and clamped-clamped
CLAMPED_PINNED = [3.92660231, 7.06858275, 10.21017612, 13.35176878, 16.49336143]
CLAMPED_CLAMPED = [4.73004074, 7.85320462, 10.9956079, 14.1371655, 17.2787597]
# clamped-guided: tan b + tanh b = 0
CLAMPED_GUIDED = [2.36502037, 5.49780392, 8.63937983, 11.78097245]
# De Luca, Siciliano 1991: links of 0.1 kg and 0.5 m, the second with its hub and the payload at
# the tip of the first; frequency [Hz], tip deflection, tip slope, as printed
FIRST = TipLoad(mass_ratio=1.2 / 0.1,
                inertia_ratio=(0.1 + 0.1 * 0.5**2 / 3 + 0.1 * 0.5**2 + 0.0005) / (0.1 * 0.5**2))
SECOND = TipLoad(mass_ratio=0.1 / 0.1, inertia_ratio=0.0005 / (0.1 * 0.5**2))
DE_LUCA = [(FIRST, 1, 0.48, 0.186, 0.657), (FIRST, 2, 1.80, 0.215, -0.560),
           (SECOND, 1, 2.18, 0.883, 2.641), (SECOND, 2, 15.91, -0.069, -10.853)]

ratios = st.one_of(st.just(0.0), st.floats(-6, 6).map(lambda power: 10**power))
orders = st.integers(1, 8)
modes_of_any_load = given(mass=ratios, inertia=ratios, order=orders)
STATIONS = np.linspace(0, 1, 41)


@pytest.mark.parametrize(('order', 'expected'), list(enumerate(CLAMPED_FREE, 1)))
def test_eigenvalues_of_a_cantilever_are_those_of_the_textbook(order: int,
                                                               expected: float) -> None:
    # the digits printed: 16 for the first four, 10 for the others
    tolerance = 1e-15 if order <= 4 else 5e-10
    assert clamped_eigenvalue(order, TipLoad()) == pytest.approx(expected, rel=tolerance)


def exact_frequency_equation(value: mpmath.mpf, load: TipLoad) -> mpmath.mpf:
    """Return the textbook's equation without division by cosh, at mpmath's precision."""
    c, s, ch, sh = (f(value) for f in (mpmath.cos, mpmath.sin, mpmath.cosh, mpmath.sinh))
    mass, inertia = load.mass_ratio * value, load.inertia_ratio * value**3
    return (1 + c * ch - mass * (s * ch - c * sh) - inertia * (s * ch + c * sh)
            + mass * inertia * (1 - c * ch))


@settings(max_examples=150)
@modes_of_any_load
def test_eigenvalue_is_a_root_of_the_frequency_equation(mass: float, inertia: float,
                                                        order: int) -> None:
    load = TipLoad(mass_ratio=mass, inertia_ratio=inertia)
    with mpmath.workdps(50):
        value = mpmath.mpf(clamped_eigenvalue(order, load))
        residual = exact_frequency_equation(value, load)
        slope = mpmath.diff(lambda b: exact_frequency_equation(b, load), value)
        # distance to the root, by Newton; 3e-14 at worst, for 5e5 times the beam's mass
        assert abs(residual / slope / value) <= 1e-13


@settings(max_examples=200)
@modes_of_any_load
def test_frequency_equation_changes_sign_at_the_eigenvalue(mass: float, inertia: float,
                                                           order: int) -> None:
    load = TipLoad(mass_ratio=mass, inertia_ratio=inertia)
    value = clamped_eigenvalue(order, load)
    sides = [frequency_equation(value * (1 + step), load) for step in (-1e-9, 1e-9)]
    assert sides[0] * sides[1] < 0


@settings(max_examples=200)
@modes_of_any_load
def test_eigenvalues_below_counts_the_eigenvalues(mass: float, inertia: float,
                                                  order: int) -> None:
    load = TipLoad(mass_ratio=mass, inertia_ratio=inertia)
    value = clamped_eigenvalue(order, load)
    # 1e-6 apart, the count resolves what its own rounding blurs
    assert eigenvalues_below(value * (1 - 1e-6), load) == order - 1
    assert eigenvalues_below(value * (1 + 1e-6), load) == order


def test_count_of_the_plain_cantilever_is_that_of_the_textbook_over_a_scan() -> None:
    for value in np.linspace(0.05, 18.7, 400):
        expected = sum(eigenvalue < value for eigenvalue in CLAMPED_FREE)
        assert eigenvalues_below(float(value), TipLoad()) == expected


@settings(max_examples=200)
@given(mass=ratios, inertia=ratios, more=st.floats(1.01, 100), order=orders)
def test_more_load_lowers_every_frequency_but_not_below_the_next_one(
        mass: float, inertia: float, more: float, order: int) -> None:
    light = TipLoad(mass_ratio=mass, inertia_ratio=inertia)
    for heavy in (TipLoad(mass_ratio=mass * more + 1e-3, inertia_ratio=inertia),
                  TipLoad(mass_ratio=mass, inertia_ratio=inertia * more + 1e-3)):
        # Rayleigh: a load of rank one moves each eigenvalue down, at most to the one before
        value = clamped_eigenvalue(order, heavy)
        assert value <= clamped_eigenvalue(order, light) * (1 + 1e-14)
        if order > 1:
            assert value >= clamped_eigenvalue(order - 1, light) * (1 - 1e-14)


@pytest.mark.parametrize(('load', 'first', 'expected'), [
    # the ends that a huge mass, a huge inertia and both tend to; the order where they begin
    (TipLoad(mass_ratio=1e9), 2, CLAMPED_PINNED),
    (TipLoad(inertia_ratio=1e9), 2, CLAMPED_GUIDED),
    (TipLoad(mass_ratio=1e9, inertia_ratio=1e9), 3, CLAMPED_CLAMPED)])
def test_huge_loads_hold_the_tip(load: TipLoad, first: int, expected: list[float]) -> None:
    found = [clamped_eigenvalue(first + i, load) for i in range(len(expected))]
    np.testing.assert_allclose(found, expected, rtol=1e-8)  # 9 digits printed, 1 / ratio


@pytest.mark.parametrize(('load', 'stiffness'), [
    # massless springs: force over deflection 3 E I / L^3, moment over slope E I / L
    (TipLoad(mass_ratio=1e6), 3.0), (TipLoad(inertia_ratio=1e6), 1.0)])
def test_beam_under_a_huge_load_is_a_spring(load: TipLoad, stiffness: float) -> None:
    expected = (stiffness / (load.mass_ratio + load.inertia_ratio))**0.25
    # the beam's own mass: 33/140 of it for the first, at most a third for the second
    assert clamped_eigenvalue(1, load) == pytest.approx(expected, rel=1e-6)


@pytest.mark.parametrize(('load', 'order', 'frequency', 'deflection', 'slope'), DE_LUCA)
def test_frequencies_are_those_of_de_luca_and_siciliano(
        load: TipLoad, order: int, frequency: float, deflection: float, slope: float) -> None:
    # E I = 1 N m^2, rho = 0.2 kg/m, L = 0.5 m
    value = clamped_eigenvalue(order, load)
    found = value**2 * math.sqrt(1.0 / (0.2 * 0.5**4)) / (2 * math.pi)
    assert found == pytest.approx(frequency, abs=0.005)  # half of the last digit printed


@pytest.mark.parametrize(('load', 'order', 'frequency', 'deflection', 'slope'), DE_LUCA)
def test_tips_of_the_shapes_are_those_of_de_luca_and_siciliano(
        load: TipLoad, order: int, frequency: float, deflection: float, slope: float) -> None:
    mode, tip = ClampedMode.of(order, load), np.array([1.0])
    found = mode(tip, 1)[0] / 0.5 / mode(tip)[0]
    # half of the last digit of numerator and denominator
    printing = 0.0005 / abs(deflection) + 0.0005 / abs(slope)
    assert found == pytest.approx(slope / deflection, rel=printing)


def size(mode: ClampedMode) -> float:
    """Return what the derivatives of a mode are rounded relative to, over b^derivative."""
    ratio = abs(1 - mode.growing * math.exp(-mode.eigenvalue))  # of sinh - sin
    return float(max(1, ratio, np.abs(mode(STATIONS)).max()))


@settings(max_examples=150)
@modes_of_any_load
def test_mode_obeys_the_beam_equation(mass: float, inertia: float, order: int) -> None:
    mode = ClampedMode.of(order, TipLoad(mass_ratio=mass, inertia_ratio=inertia))
    fourth = mode(STATIONS, 4)
    # rounding, relative to the largest of cosh, cos and their parts
    np.testing.assert_allclose(fourth, mode.eigenvalue**4 * mode(STATIONS), rtol=0,
                               atol=1e-13 * mode.eigenvalue**4 * size(mode))


@settings(max_examples=100)
@modes_of_any_load
def test_derivatives_agree_with_a_complex_step(mass: float, inertia: float, order: int) -> None:
    mode = ClampedMode.of(order, TipLoad(mass_ratio=mass, inertia_ratio=inertia))
    for derivative in range(1, 5):
        expected = mode(STATIONS + 1e-20j, derivative - 1).imag / 1e-20
        # exact but for rounding
        np.testing.assert_allclose(mode(STATIONS, derivative), expected, rtol=0,
                                   atol=1e-13 * mode.eigenvalue**derivative * size(mode))


@settings(max_examples=150)
@modes_of_any_load
def test_mode_is_clamped_and_moves_its_load(mass: float, inertia: float, order: int) -> None:
    load = TipLoad(mass_ratio=mass, inertia_ratio=inertia)
    mode = ClampedMode.of(order, load)
    b, ends = mode.eigenvalue, np.array([0.0, 1.0])
    (start, tip), (start_slope, slope), (_, bending), (_, shear) = (
        mode(ends, derivative) for derivative in range(4))
    assert max(abs(start), abs(start_slope) / b) <= 1e-15 * size(mode)  # rounding
    # E I v''' = M v_tt and E I v'' = -J v'_tt; rounding, relative to the terms and to their
    # change by that of the eigenvalue
    for force, moved in ((shear / b**3, -mass * b * tip),
                         (bending / b**2, inertia * b**2 * slope)):
        scale = size(mode) * (1 + max(mass * b, inertia * b**3))
        assert abs(force - moved) <= 1e-13 * scale


@settings(max_examples=150)
@given(mass=ratios, inertia=ratios)
def test_modes_cross_the_axis_once_more_each(mass: float, inertia: float) -> None:
    load, x = TipLoad(mass_ratio=mass, inertia_ratio=inertia), np.linspace(1e-3, 0.999, 2000)
    slopes = [ClampedMode.of(order, load)(x, 2) for order in (1, 2, 3, 4)]
    changes = [int((np.diff(np.sign(bending)) != 0).sum()) for bending in slopes]
    assert np.diff(changes).tolist() == [1, 1, 1]


@pytest.mark.parametrize(('field', 'value'), [
    ('mass_ratio', -0.1), ('inertia_ratio', -1.0), ('mass_ratio', math.nan),
    ('inertia_ratio', math.inf)])
def test_impossible_load_is_refused_by_name(field: str, value: float) -> None:
    with pytest.raises(InvalidValueError, match=f'^{field} is {value}'):
        TipLoad(**{field: value})


def test_shape_of_a_plain_cantilever_is_that_of_the_textbook() -> None:
    # Blevins: sigma_1 = 0.734095514, and cosh - cos - sigma (sinh - sin) at the tip is +-2
    mode, b, sigma = ClampedMode.of(1, TipLoad()), CLAMPED_FREE[0], 0.7340955137
    expected = (np.cosh(b * STATIONS) - np.cos(b * STATIONS)
                - sigma * (np.sinh(b * STATIONS) - np.sin(b * STATIONS)))
    np.testing.assert_allclose(mode(STATIONS), expected, atol=5e-10)  # digits of sigma
    tips: Array = np.array([ClampedMode.of(n, TipLoad())(np.array([1.0]))[0] for n in range(1, 9)])
    np.testing.assert_allclose(tips, [2, -2] * 4, rtol=1e-13)  # rounding
