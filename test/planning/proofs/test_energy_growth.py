"""Growth of an energy below lines: time and way are those of the worst growth, by quadrature."""

from __future__ import annotations

from flex_planner.planning.proofs.energy_growth import EnergyGrowth, EnergyLimits
import numpy as np
import pytest
from scipy.integrate import quad

SLOPES, OFFSETS = np.array([0.0, 8.0, 1.0, 3.0, 0.5]), np.array([6.0, 0.5, 3.0, np.inf, 9.0])
NONE = EnergyGrowth.below(np.zeros(0), np.zeros(0))


@pytest.fixture
def growth() -> EnergyGrowth:
    return EnergyGrowth.below(SLOPES, OFFSETS)


def worst_rate(energy: float) -> float:
    """Return the least of all lines."""
    return float((SLOPES * energy + OFFSETS).min())


def test_pieces_are_the_least_of_the_lines(growth: EnergyGrowth) -> None:
    assert growth.slopes.tolist() == [8.0, 1.0, 0.0]
    for low, high, slope, offset in zip(growth.edges[:-1], growth.edges[1:], growth.slopes,
                                        growth.offsets, strict=True):
        for energy in (low, low + 1e-3, min(high, 1e4)):
            assert slope * energy + offset == pytest.approx(worst_rate(energy), rel=1e-12)


def test_lower_of_parallel_lines_counts() -> None:
    growth = EnergyGrowth.below(np.array([1.0, 1.0]), np.array([2.0, 1.0]))
    assert (growth.edges.tolist(), growth.offsets.tolist()) == ([0.0, np.inf], [1.0])


@pytest.mark.parametrize('begin', [0.0, 0.2, 5.0])
@pytest.mark.parametrize('energy', [1e-9, 0.1, 0.7, 30.0])
def test_time_and_way_are_integrals(growth: EnergyGrowth, begin: float, energy: float) -> None:
    kinks = [edge for edge in growth.edges[1:-1] if begin < edge < energy]

    def integral(power: float) -> float:
        if energy <= begin:
            return 0.0
        ends = [begin, *kinks, energy]
        return sum(quad(lambda E: E**power / worst_rate(E), low, high, epsabs=0,
                        epsrel=1e-12)[0] for low, high in zip(ends[:-1], ends[1:], strict=True))

    energies = np.array([energy])
    # the way is a difference of primitives, exact to 1e-11 of the larger one
    assert growth.time(energies, begin)[0] == pytest.approx(integral(0.0), rel=1e-11)
    assert growth.travel(energies, begin)[0] == pytest.approx(integral(0.5), rel=1e-10)


def test_slopes_hardly_matter_to_small_energies() -> None:
    # on both sides of where the arc tangent is replaced by its series
    growth = EnergyGrowth.below(np.array([1.0]), np.array([1.0]))
    around = growth.travel(np.array([0.99999e-4, 1.00001e-4]), 0.0)
    assert around[1] / around[0] == pytest.approx((1.00001 / 0.99999)**1.5, rel=1e-8)


def test_growth_without_a_bound_takes_no_time() -> None:
    limits = EnergyLimits(NONE, NONE, 0.0, 0.0)
    assert (limits.least_time(3.0), limits.change_time(5.0)) == (0.0, 0.0)


@pytest.mark.parametrize(('start', 'goal'), [(0.0, 0.0), (0.3, 0.0), (0.0, 2.0), (1.5, 1.5)])
def test_least_time_is_that_of_the_way(growth: EnergyGrowth, start: float, goal: float) -> None:
    limits = EnergyLimits(growth, EnergyGrowth.below(np.array([2.0]), np.array([1.0])), start,
                          goal)
    peak = np.array([3.0])
    way = float((growth.travel(peak, start) + limits.braking.travel(peak, goal))[0])
    time = float((growth.time(peak, start) + limits.braking.time(peak, goal))[0])
    # found to a millionth, from below
    assert time * (1 - 1e-5) < limits.least_time(way) <= time
    # from rest at 6 W all the way: T = (3 d / 2)^(2/3) / 6^(1/3)
    alone = EnergyLimits(EnergyGrowth.below(np.zeros(1), np.array([6.0])), NONE, 0.0, 0.0)
    assert alone.least_time(way) == pytest.approx((1.5 * way)**(2 / 3) / 6**(1 / 3), rel=1e-5)


def test_no_way_takes_no_time(growth: EnergyGrowth) -> None:
    assert EnergyLimits(growth, NONE, 0.0, 0.0).least_time(0.0) == 0.0


def test_energy_of_the_higher_end_takes_its_time(growth: EnergyGrowth) -> None:
    limits = EnergyLimits(growth, growth, 0.1, 0.8)
    assert limits.change_time(0.8) == growth.time(np.array([0.8]), 0.1)[0]
    # either end may be the higher one
    assert EnergyLimits(growth, growth, 0.8, 0.1).change_time(0.8) == limits.change_time(0.8)
