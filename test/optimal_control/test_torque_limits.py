"""Limits of the motors, eqs. (13) to (15): the same for numbers and symbols, and derived."""

from __future__ import annotations

import casadi as ca
from flex_planner.arms.arm import Arm, Joint, Motor
from flex_planner.base.validation import Array
from flex_planner.optimal_control.torque_limits import free_torque, TorqueLimits
import numpy as np
import pytest

COUNT = 300
LIMITS = TorqueLimits(np.array([9.0, 5.0]), np.array([2.25, 5 / 6]), np.full(2, np.inf))
# one below the torque of the line at standstill, one above
CAPPED = TorqueLimits(LIMITS.stall, LIMITS.slope, np.array([6.0, 7.0]))
WEIGHTS = np.array([0.5, 0.125])


@pytest.fixture(scope='module')
def points() -> tuple[Array, Array]:
    """Return free torques and speeds; some within the bounds, most beyond one or the other."""
    rng = np.random.default_rng(3)
    return rng.normal(size=(COUNT, 2)) * [20.0, 10.0], rng.normal(size=(COUNT, 2)) * 3.0


def by_symbols(limits: TorqueLimits, points: tuple[Array, Array]) -> list[Array]:
    """Return lower and upper bounds, bounded torques and multipliers, one point at a time."""
    free, speeds, stall, slope, cap, weights = (
        ca.SX.sym(name, 2) for name in ('free', 'speeds', 'stall', 'slope', 'cap', 'weights'))
    symbols = TorqueLimits(stall, slope, cap)
    function = ca.Function('limits', [free, speeds, stall, slope, cap, weights], [
        *symbols.bounds(speeds), symbols.bound(free, speeds),
        symbols.multiplier(weights, free, speeds)])
    given = limits.stall, limits.slope, limits.cap, WEIGHTS
    rows = [function(*point, *given) for point in zip(*points, strict=True)]
    return [np.hstack([np.array(value) for value in column]).T
            for column in zip(*rows, strict=True)]


@pytest.mark.parametrize('limits', [LIMITS, CAPPED], ids=['line', 'capped'])
def test_numbers_and_symbols_agree(points: tuple[Array, Array], limits: TorqueLimits) -> None:
    free, speeds = points
    torque = limits.bound(free, speeds)
    ours = *limits.bounds(speeds), torque, limits.multiplier(WEIGHTS, free, speeds)
    for one, other in zip(ours, by_symbols(limits, points), strict=True):
        # rounding: products may be taken in another order
        np.testing.assert_allclose(one, other, rtol=1e-15, atol=1e-15)
    # the points tell them apart: free, at the upper and at the lower bound
    assert all(20 < (torque == bound).sum() for bound in (free, *limits.bounds(speeds)))


def test_cap_holds_in_all_quadrants_as_the_line_lets_it(points: tuple[Array, Array]) -> None:
    stall, slope, cap = CAPPED.stall, CAPPED.slope, CAPPED.cap
    speeds = np.vstack([points[1], [[0.0, 0.0], [20.0, -30.0]]])
    lower, upper = CAPPED.bounds(speeds)
    for k, i in np.ndindex(speeds.shape):
        line = stall[i] - slope[i] * speeds[k, i]
        # a motor that is driven faster than that cannot do with less than the line says
        wanted = max(min(cap[i], line), line - 2 * stall[i])
        assert upper[k, i] == pytest.approx(wanted, abs=1e-12)
        assert lower[k, i] == pytest.approx(
            min(max(-cap[i], line - 2 * stall[i]), line), abs=1e-12)
    assert CAPPED.standstill.tolist() == [6.0, 5.0]


def test_bounds_fall_with_the_speed_from_the_stall_torque_to_none_at_the_no_load_speed(
        workshop_arm: Arm) -> None:
    limits = TorqueLimits.of(workshop_arm)
    still, fast = limits.bounds(np.zeros(2)), limits.bounds(np.array([4.0, 6.0]))
    assert [bound.tolist() for bound in still] == [[-9.0, -5.0], [9.0, 5.0]]
    # rounding of K_1 - K_2 times the no-load speed; a motor brakes with its stall torque at most
    np.testing.assert_allclose(fast, [[-9.0, -5.0], [0.0, 0.0]], atol=1e-14)
    lines = limits.lines(np.array([4.0, 6.0]))
    np.testing.assert_allclose(lines, [[-18.0, -10.0], [0.0, 0.0]], atol=1e-14)


def test_line_that_does_not_fall_is_a_cap(workshop_arm: Arm) -> None:
    motors = (Motor(stall_torque=3.0), Motor(max_torque=2.0),
              Motor(stall_torque=3.0, max_torque=2.0), Motor())
    limits = TorqueLimits.of(Arm(
        name='four', links=workshop_arm.links[:1] * 4,
        joints=tuple(Joint(motor=motor) for motor in motors)))
    assert limits.stall.tolist() == limits.standstill.tolist() == [3.0, 2.0, 2.0, np.inf]
    assert not limits.capped.any()


def test_distances_change_their_sign_where_a_motor_reaches_or_leaves_its_limit() -> None:
    speeds = np.tile([1.2, -2.0], (2, 1))
    for bound, which in zip(LIMITS.bounds(speeds), (1, 0), strict=True):
        # a billionth to either side of the bound
        free = bound + 1e-9 * np.array([[-1.0], [1.0]])
        distance = LIMITS.distances(free, speeds)[which]
        saturated = LIMITS.bound(free, speeds) != free
        assert np.sign(distance).tolist() == [[-1, -1], [1, 1]]
        # above the upper bound, below the lower one
        assert np.array_equal(saturated, distance > 0 if which == 0 else distance < 0)


def test_distances_have_the_signs_of_saturation_everywhere(points: tuple[Array, Array]) -> None:
    free, speeds = points
    above, below = LIMITS.distances(free, speeds)
    assert np.array_equal((above > 0) | (below < 0), LIMITS.bound(free, speeds) != free)


def test_distances_tell_which_limit_holds(points: tuple[Array, Array]) -> None:
    free, speeds = points
    on_line, below_line, on_cap, below_cap = CAPPED.distances(free, speeds)
    torque, (lowest, highest) = CAPPED.bound(free, speeds), CAPPED.lines(speeds)
    inside = (speeds < 4).all(axis=1)  # where the line takes more than the cap it is the limit
    for limit, value, sign in ((on_line, highest, 1), (below_line, lowest, -1),
                               (on_cap, CAPPED.cap, 1), (below_cap, -CAPPED.cap, -1)):
        held = (torque == value)[inside]
        assert np.array_equal(sign * limit[inside] > 0, held & (free != torque)[inside])
        assert held.any()


def test_no_change_of_the_limit_that_holds_is_missed() -> None:
    # random walks, also where a motor is driven so fast that the line takes over from the cap
    rng = np.random.default_rng(4)
    walk = np.cumsum(rng.normal(size=(20000, 2)), axis=0) * 0.3
    speeds, free = 12 * np.sin(0.1 * walk), 30 * np.sin(0.07 * walk[::-1])
    lowest, highest = CAPPED.lines(speeds)
    torque, cap = CAPPED.bound(free, speeds), np.broadcast_to(CAPPED.cap, speeds.shape)
    held = np.select([torque == free, torque == highest, torque == lowest, torque == cap],
                     list(range(4)), 4)
    signs = np.array(CAPPED.distances(free, speeds)) >= 0
    changes = held[1:] != held[:-1]
    assert (signs[:, 1:] != signs[:, :-1]).any(axis=0)[changes].all()
    assert len(np.unique(held)) == 5 and changes.sum() > 500
    driven = np.abs(speeds) > (CAPPED.stall + CAPPED.cap) / CAPPED.slope
    assert changes[driven[1:] != driven[:-1]].any()


@pytest.mark.parametrize('limits', [LIMITS, CAPPED], ids=['line', 'capped'])
def test_multiplier_is_the_slope_of_the_hamiltonian_along_a_bound(
        points: tuple[Array, Array], limits: TorqueLimits) -> None:
    free, speeds = points
    step = 1e-4

    def share(rates: Array) -> Array:
        """Return what of H depends on the torque: R u^2 / 2 - R u_free u, for each joint."""
        torque = limits.bound(free, rates)
        found: Array = WEIGHTS * (torque**2 / 2 - free * torque)
        return found

    clear = (np.abs(limits.distances(free, speeds)) > 10 * step).all(axis=0)
    slope = (share(speeds + step) - share(speeds - step)) / (2 * step)
    found = limits.multiplier(WEIGHTS, free, speeds)
    # a parabola in the speed: rounding of some hundred joules over the step
    np.testing.assert_allclose(found[clear], -slope[clear], atol=1e-9)
    assert 100 < np.count_nonzero(found[clear]) < found[clear].size


def test_bound_toward_a_torque_is_the_one_that_it_would_reach() -> None:
    torque, speeds = np.array([[3.0, -3.0], [-3.0, 3.0]]), np.array([[1.0, 1.2], [1.0, 1.2]])
    # K_1 - K_2 q' forwards, K_1 + K_2 q' backwards
    np.testing.assert_allclose(LIMITS.toward(torque, speeds), [[6.75, 6.0], [11.25, 4.0]])


def test_free_torque_makes_the_hamiltonian_stationary() -> None:
    y = np.array([0.7, -1.3])
    torque = free_torque(WEIGHTS, y)
    # eq. (13): R u + y = 0, exact in powers of two
    assert (WEIGHTS * torque + y).tolist() == [0.0, 0.0]


def test_motors_without_limits_never_saturate() -> None:
    unlimited = TorqueLimits(np.full(2, np.inf), np.zeros(2), np.full(2, np.inf))
    free = np.array([[1e9, -1e9]])
    assert unlimited.bound(free, np.array([[50.0, -50.0]])).tolist() == free.tolist()
    assert not unlimited.multiplier(WEIGHTS, free, free).any()
