"""Arms and tasks refuse nonsense in words, and derive the quantities that others use."""

from __future__ import annotations

from collections.abc import Callable
import dataclasses
import math
from typing import Any

from flex_planner.arms.arm import Arm, Joint, Link, MAX_LINKS, MAX_MODES, Motor, Node
from flex_planner.arms.mode_shapes import pinned_pinned
from flex_planner.base.errors import (
    InvalidSizeError,
    InvalidValueError,
    NotFiniteError,
    SingularError,
    UnreachableError,
)
from flex_planner.optimal_control.task import postures_from_points, Task
from flex_planner.optimal_control.torque_limits import TorqueLimits
import numpy as np
import pytest

LINK = {'length': 0.5, 'linear_density': 6.0}
ARM = {'name': 'arm', 'links': (Link(**LINK),) * 2, 'joints': (Joint(),) * 2}


def build_task(**values: Any) -> Task:
    arm = Arm(name='arm', links=(Link(**LINK, flexural_rigidity=5.0, modes=1), Link(**LINK)),
              joints=(Joint(), Joint()))
    defaults = {'arm': arm, 'start_positions': [0.0, 1.0], 'goal_positions': [1.0, 1.0],
                'duration': 1.0}
    return Task(**{**defaults, **values})


def build_link(**values: Any) -> Link:
    return Link(**{**LINK, **values})


def build_flexible_link(**values: Any) -> Link:
    return Link(**{**LINK, 'flexural_rigidity': 5.0, 'modes': 2, **values})


def build_arm(**values: Any) -> Arm:
    return Arm(**{**ARM, **values})


NUMBERS: list[tuple[Callable[..., object], str, list[float], str]] = [
    # what is built, field, finite values out of bounds, the bound in the message
    (build_link, 'length', [0.0, -0.5], '> 0 m'),
    (build_link, 'linear_density', [0.0, -6.0], '> 0 kg/m'),
    (build_link, 'flexural_rigidity', [0.0, -1.0], '> 0 N m^2'),
    (Motor, 'stall_torque', [0.0, -8.0], '> 0 N m'),
    (Motor, 'no_load_speed', [0.0, -3.5], '> 0 rad/s'),
    (Motor, 'max_speed', [0.0, -2.0], '> 0 rad/s'),
    (Joint, 'viscous_friction', [-0.1], '>= 0 N m s/rad'),
    (Node, 'mass', [-1.0], '>= 0 kg'),
    (Node, 'inertia', [-1.0], '>= 0 kg m^2'),
    (build_task, 'duration', [0.0, -1.0, 1000.1], '> 0 and <= 1000 s'),
    (build_task, 'payload_mass', [-0.1, 1.1e6], '>= 0 and <= 1e+06 kg'),
    (build_task, 'tolerance', [0.0, 1.1], '> 0 and <= 1'),
]
INFINITE = {'flexural_rigidity', 'stall_torque', 'no_load_speed', 'max_speed'}
VECTORS = [
    # task field, its length, a bad entry, the bound in the message
    ('start_positions', 2, 100.1, '>= -100 and <= 100 rad'),
    ('goal_positions', 2, -100.1, '>= -100 and <= 100 rad'),
    ('effort_weights', 2, 0.0, '> 0 and <= 1e+18'),
    ('position_weights', 3, -1.0, '>= 0 and <= 1e+18'),
    ('velocity_weights', 3, -1.0, '>= 0 and <= 1e+18'),
]


@pytest.mark.parametrize(('build', 'field', 'value', 'bound'), [
    (build, field, value, bound) for build, field, values, bound in NUMBERS for value in values])
def test_number_out_of_bounds_is_refused_by_name_value_and_bound(
        build: Callable[..., object], field: str, value: float, bound: str) -> None:
    with pytest.raises(InvalidValueError) as caught:
        build(**{field: value})
    assert (caught.value.field, caught.value.value) == (field, value)
    assert str(caught.value).startswith(f'{field} is {value!r}, but must be a number {bound}')


@pytest.mark.parametrize('value', [math.nan, math.inf, -math.inf])
@pytest.mark.parametrize(('build', 'field'), [entry[:2] for entry in NUMBERS])
def test_number_that_is_not_finite_is_refused(build: Callable[..., object], field: str,
                                              value: float) -> None:
    if value == math.inf and field in INFINITE:
        return
    with pytest.raises(InvalidValueError, match=rf'^{field} is {value!r}, but must be a'):
        build(**{field: value})


@pytest.mark.parametrize('value', ['1.0', None, True, [1.0], 1j, np.ones(1)])
@pytest.mark.parametrize(('build', 'field'), [entry[:2] for entry in NUMBERS])
def test_number_of_another_type_is_refused(build: Callable[..., object], field: str,
                                           value: object) -> None:
    with pytest.raises(InvalidValueError, match=f'^{field} is .* must be a number'):
        build(**{field: value})


@pytest.mark.parametrize('build', [build_link, build_task])
def test_integer_too_large_for_a_float_is_refused_by_name(
        build: Callable[..., object]) -> None:
    field = 'length' if build is build_link else 'start_positions'
    value = 10**400 if build is build_link else [10**400, 0]
    with pytest.raises(InvalidValueError) as caught:
        build(**{field: value})
    assert caught.value.field.startswith(field)


@pytest.mark.parametrize(('field', 'size', 'bad', 'bound'), VECTORS)
def test_task_vector_names_the_entry_that_is_out_of_bounds(field: str, size: int, bad: float,
                                                           bound: str) -> None:
    entries = [1.0] * (size - 1) + [bad]
    with pytest.raises(InvalidValueError) as caught:
        build_task(**{field: entries})
    assert str(caught.value) == f'{field}[{size - 1}] is {bad}, but must be a number {bound}'


@pytest.mark.parametrize('bad', [math.nan, math.inf])
@pytest.mark.parametrize(('field', 'size'), [entry[:2] for entry in VECTORS])
def test_task_vector_refuses_entries_that_are_not_finite(field: str, size: int,
                                                         bad: float) -> None:
    with pytest.raises(NotFiniteError, match=rf'^{field}\[0\] is {bad}'):
        build_task(**{field: [bad] + [1.0] * (size - 1)})


@pytest.mark.parametrize(('entries', 'given'), [
    ([1.0], '1 number'), ([1.0] * 4, '4 numbers'), ([[1.0, 1.0]], 'shape (1, 2)'),
    (1.0, 'shape ()')])
@pytest.mark.parametrize('field', [entry[0] for entry in VECTORS])
def test_task_vector_of_the_wrong_size_is_refused(field: str, entries: object,
                                                  given: str) -> None:
    with pytest.raises(InvalidSizeError) as caught:
        build_task(**{field: entries})
    assert (caught.value.field, caught.value.value) == (field, given)
    assert 'a list of ' in caught.value.bound


def test_task_vector_of_text_is_refused() -> None:
    with pytest.raises(InvalidValueError, match='^start_positions is .* a list of 2 numbers'):
        build_task(start_positions=['a', 'b'])


@pytest.mark.parametrize('value', [-1, MAX_MODES + 1, 1.0, '1', True, None])
def test_number_of_modes_is_an_integer_from_0_to_8(value: object) -> None:
    with pytest.raises(InvalidValueError) as caught:
        build_link(modes=value)
    assert (caught.value.field, caught.value.bound) == ('modes', 'an integer from 0 to 8')


def test_flexible_link_needs_a_finite_rigidity() -> None:
    with pytest.raises(NotFiniteError, match='flexural_rigidity is inf.*needed for a link with'):
        build_link(modes=1)


@pytest.mark.parametrize('family', ['clamped', '', None, ['pinned_pinned'], {}])
def test_unknown_mode_family_is_refused_with_the_known_ones(family: object) -> None:
    with pytest.raises(InvalidValueError, match='^mode_family is .*pinned_pinned') as caught:
        build_link(mode_family=family)
    assert caught.value.value == family


def test_speed_limit_needs_a_torque_limit() -> None:
    with pytest.raises(InvalidValueError, match='no_load_speed is 3.5.*stall_torque'):
        Motor(no_load_speed=3.5)


@pytest.mark.parametrize(('values', 'field', 'bound'), [
    ({'links': ()}, 'number of links', 'an integer from 1 to 8'),
    ({'links': (Link(**LINK),) * (MAX_LINKS + 1)}, 'number of links', 'an integer from 1 to 8'),
    ({'joints': (Joint(),)}, 'number of joints', '2, one per link'),
    ({'nodes': (Node(),) * 2}, 'number of nodes', '0 or 3, one per joint and one for the tip'),
    ({'gravity': [0.0]}, 'gravity', 'a list of 2 numbers'),
    ({'gravity': [0.0, math.nan]}, 'gravity[1]', 'a finite number in m/s^2'),
    ({'gravity': 'down'}, 'gravity', 'a list of 2 numbers')])
def test_arm_of_parts_that_do_not_fit_is_refused(values: dict[str, Any], field: str,
                                                 bound: str) -> None:
    with pytest.raises(InvalidValueError) as caught:
        build_arm(**values)
    assert (caught.value.field, caught.value.bound) == (field, bound)


def test_arm_without_nodes_gets_massless_ones() -> None:
    assert build_arm().nodes == (Node(mass=0.0, inertia=0.0),) * 3


def test_arm_does_not_share_the_gravity_it_was_given() -> None:
    given = np.array([0.0, -9.81])
    arm = build_arm(gravity=given)
    given[1] = 0.0
    assert arm.gravity[1] == -9.81
    with pytest.raises(ValueError, match='read-only'):
        arm.gravity[1] = 0.0


def test_data_cannot_be_changed_after_it_was_checked() -> None:
    with pytest.raises(dataclasses.FrozenInstanceError):
        build_link().length = -1.0  # type: ignore[misc]
    with pytest.raises(ValueError, match='read-only'):
        build_task().start_positions[0] = math.nan


def test_coordinates_are_joints_then_modes_link_by_link() -> None:
    links = (build_flexible_link(modes=1), build_link(), build_flexible_link(modes=3))
    arm = build_arm(links=links, joints=(Joint(),) * 3)
    assert (arm.n_joints, arm.n_modes, arm.n_coordinates) == (3, 4, 7)
    assert arm.modal_names == ('link1_mode1', 'link3_mode1', 'link3_mode2', 'link3_mode3')
    assert arm.modal_slices == (slice(3, 4), slice(4, 4), slice(4, 7))
    assert arm.reach == 1.5
    assert arm.flexural_rigidities().tolist() == [5.0, 0.0, 5.0]


def test_link_has_the_mass_and_modes_of_its_data() -> None:
    link = build_flexible_link()
    assert link.mass == 3.0
    assert np.array_equal(link.mode_shapes().gram, pinned_pinned(0.5, 2).gram)


def test_torque_bounds_follow_the_motor_line_of_eq_15(rigid_arm: Arm) -> None:
    # tau_s = 8 N m, omega_m = 3.5 rad/s (Table I): at half the no-load speed half the torque
    lower, upper = TorqueLimits.of(rigid_arm).bounds(np.array([[0.0, 1.75], [3.5, -3.5]]))
    assert upper.tolist() == [[8.0, 4.0], [0.0, 16.0]]
    assert lower.tolist() == [[-8.0, -12.0], [-16.0, 0.0]]


def test_motor_without_no_load_speed_has_constant_bounds() -> None:
    joint = Joint(motor=Motor(stall_torque=4.0))
    lower, upper = TorqueLimits.of(build_arm(joints=(joint, Joint()))).bounds(np.array([100.0,
                                                                                        -5.0]))
    assert (lower.tolist(), upper.tolist()) == ([-4.0, -math.inf], [4.0, math.inf])


def test_rigid_arm_keeps_everything_but_bending(workshop_arm: Arm) -> None:
    rigid = workshop_arm.rigid()
    assert (rigid.n_modes, rigid.nodes, rigid.joints) == (
        0, workshop_arm.nodes, workshop_arm.joints)
    assert [link.mass for link in rigid.links] == [link.mass for link in workshop_arm.links]
    assert [link.length for link in rigid.links] == [0.6, 0.4]
    assert rigid.gravity.tolist() == workshop_arm.gravity.tolist()


def test_task_weights_default_to_effort_alone() -> None:
    task = build_task()
    assert task.effort_weights.tolist() == [1.0, 1.0]
    assert task.position_weights.tolist() == task.velocity_weights.tolist() == [0.0] * 3


def test_task_weights_of_joints_leave_the_modes_free() -> None:
    task = build_task(position_weights=[1.0, 2.0], velocity_weights=[3.0, 4.0, 5.0])
    assert task.position_weights.tolist() == [1.0, 2.0, 0.0]
    assert task.velocity_weights.tolist() == [3.0, 4.0, 5.0]


@pytest.mark.parametrize(('first', 'last'), [(120.0, 145.0), (145.0, 120.0), (10.0, 20.0)])
def test_goal_angle_is_the_one_nearest_to_the_start(rigid_arm: Arm, first: float,
                                                    last: float) -> None:
    # around 132 deg the first joint angle passes 180 deg; on a circle it turns with the point
    points = [0.67 * np.array([math.cos(angle), math.sin(angle)])
              for angle in np.radians([first, last])]
    start, goal = postures_from_points(rigid_arm, points[0], points[1], elbow=-1)
    turn = np.degrees(goal - start)
    np.testing.assert_allclose(turn, [last - first, 0], atol=1e-12)  # rounding


@pytest.mark.parametrize(('start', 'goal', 'error', 'message'), [
    ((2.0, 0.0), (0.5, 0.5), UnreachableError, '^start_point: the point'),
    ((0.5, 0.0), (2.0, 0.0), UnreachableError, '^goal_point: the point'),
    ((0.5, 0.0), (1.0, 0.0), SingularError, '^goal_point: the arm is stretched'),
    ((0.5, 0.0), (math.nan, 0.0), NotFiniteError, r'^goal_point\[0\] is nan'),
    ((0.5,), (0.5, 0.5), InvalidSizeError, '^start_point has 1 number')])
def test_point_that_the_arm_cannot_take_is_named(rigid_arm: Arm, start: Any, goal: Any,
                                                 error: type[Exception], message: str) -> None:
    with pytest.raises(error, match=message):
        postures_from_points(rigid_arm, start, goal, elbow=-1)
