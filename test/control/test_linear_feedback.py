"""Linear laws, and an arm that moves under one, against the same step by step."""

from __future__ import annotations

from flex_planner.arms.arm import Arm
from flex_planner.base.errors import InvalidSizeError, InvalidValueError
from flex_planner.base.progress import Monitor, StoppedError
from flex_planner.base.validation import Array
from flex_planner.control import feedback_motion
from flex_planner.control.feedback_motion import Course, FeedbackArm
from flex_planner.control.joint_controller import EffortHold, Gains
from flex_planner.control.joint_reference import JointReference
from flex_planner.control.linear_feedback import joint_feedback, LinearFeedback, pd_feedback
from flex_planner.dynamics.arm_dynamics import ArmDynamics
from flex_planner.dynamics.physical_parameters import PhysicalParameters
from flex_planner.dynamics.statics import equilibrium
from flex_planner.optimal_control.torque_limits import TorqueLimits
import numpy as np
import pytest
from scipy.integrate import solve_ivp

START = np.array([-1.3, 0.3])
RESOLUTION = 1e-3
GAINS = Gains(stiffness=np.array([60.0, 30.0]), damping=np.array([4.0, 2.0]))


@pytest.fixture(scope='module')
def arm(workshop_arm: Arm) -> FeedbackArm:
    parameters = PhysicalParameters.of_arm(workshop_arm, payload_mass=0.3)
    return FeedbackArm(dynamics=ArmDynamics.of(workshop_arm), parameters=parameters,
                       law=random_law(), resolution=RESOLUTION)


def random_law(rate: float = 400.0) -> LinearFeedback:
    rng = np.random.default_rng(5)
    A, B, C, D, E = (rng.normal(size=shape) for shape in ((3, 3), (3, 2), (2, 3), (2, 2), (3, 2)))
    return LinearFeedback(A=0.2 * A, B=B, C=10 * C, D=-30 * np.eye(2) + D, E=0.01 * E, rate=rate)


@pytest.fixture(scope='module')
def start(arm: FeedbackArm) -> Array:
    rest, _ = equilibrium(arm.dynamics, START, arm.parameters)
    return np.concatenate([rest, np.zeros_like(rest)])


@pytest.fixture(scope='module')
def course(start: Array) -> Course:
    rng = np.random.default_rng(7)
    return Course(angles=START + 0.02 * rng.normal(size=(8, 2)),
                  efforts=[16.0, 6.0] * rng.uniform(-1, 1, (8, 2)))


def step_by_step(arm: FeedbackArm, course: Course, state: Array) -> tuple[Array, Array]:
    """Return the last state and the last torque, by SciPy, period by period."""
    law, n_t = arm.law, state.size // 2
    xi, limits = np.zeros(law.order), TorqueLimits.of(arm.dynamics.arm)
    rate = arm.dynamics.state_rate(arm.parameters.physical)
    for angles, effort in zip(course.angles, course.efforts, strict=True):
        error = np.floor(state[:2] / RESOLUTION + 0.5) * RESOLUTION - angles
        torque = np.clip(effort + law.C @ xi + law.D @ error,
                         *limits.bounds(state[n_t:n_t + 2]))
        xi = law.A @ xi + law.B @ error + law.E @ (torque - effort)
        state = solve_ivp(lambda _, x, u: rate(x, u).copy(), (0, law.period), state,
                          args=(torque,), rtol=1e-10, atol=1e-12, method='DOP853').y[:, -1]
    return state, torque


def test_arm_under_a_law_moves_as_scipy_has_it(arm: FeedbackArm, course: Course,
                                               start: Array) -> None:
    motion = arm.follow(course, start)
    state, torque = step_by_step(arm, course, start)
    np.testing.assert_allclose(motion.states[-1], state, rtol=0, atol=1e-6)
    np.testing.assert_allclose(motion.torques[-1], torque, rtol=0, atol=1e-4)
    lower, upper = arm.limits.bounds(motion.states[:-1, 5:7])
    assert (np.isclose(motion.torques, lower) | np.isclose(motion.torques, upper)).any()


def test_compiled_motion_is_that_of_steps_one_by_one(
        arm: FeedbackArm, course: Course, start: Array,
        monkeypatch: pytest.MonkeyPatch) -> None:
    compiled = arm.follow(course, start)
    monkeypatch.setattr(feedback_motion, 'load_library', lambda: None)
    steps = arm.follow(course, start)
    # tolerances of 1e-5 in every step; the law is sampled at the same instants
    for name in ('states', 'laws', 'torques'):
        one, other = getattr(compiled, name), getattr(steps, name)
        assert one.shape == other.shape and not np.array_equal(one, other)
        assert (np.abs(one - other) <= 1e-3 * np.abs(other).max(axis=0) + 1e-6).all(), name


def test_arm_that_runs_away_is_not_a_number(arm: FeedbackArm, start: Array) -> None:
    n, course = 2, Course(angles=np.tile(START, (300, 1)), efforts=np.full((300, 2), 1e9))
    wild = FeedbackArm(dynamics=arm.dynamics, parameters=arm.parameters, law=LinearFeedback(
        A=np.eye(1) * 4, B=np.ones((1, n)), C=1e9 * np.ones((n, 1)), D=1e9 * np.eye(n),
        E=np.zeros((1, n)), rate=100.0))
    with np.errstate(all='ignore'):
        assert not np.isfinite(wild.follow(course, np.full_like(start, 1e8)).states[-1]).any()


def test_monitor_may_stop_it(arm: FeedbackArm, course: Course, start: Array) -> None:
    with pytest.raises(StoppedError):
        arm.follow(course, start, Monitor(canceled=lambda: True))


def test_speed_filter_acts_on_the_error() -> None:
    law, period = pd_feedback(Gains.of(1, 0.0, 1.0), 1000.0), 1e-3
    # the joint lags ever more behind what is planned, however that accelerates: by 2 rad/s
    errors, xi, torques = -2 * period * np.arange(100), np.zeros(2), []
    for error in errors:
        torques.append((law.C @ xi + law.D @ [error])[0])
        xi = law.A @ xi + law.B @ [error]
    assert torques[-1] == pytest.approx(2.0, rel=1e-9)
    # a filter of first order of 50 Hz
    after = np.arange(1, 100) * period
    np.testing.assert_allclose(torques[1:], 2 * (1 - np.exp(-2 * np.pi * 50 * after)), rtol=1e-9)


def test_more_entries_of_the_state_change_nothing() -> None:
    law = random_law()
    free, forced = 0.5 * np.eye(6), np.ones((6, 2))
    small, large = (np.linalg.eigvals(one.closed_loop(free, forced))
                    for one in (law, law.padded(9)))
    largest = np.sort(np.abs(large))[::-1][:small.size]
    np.testing.assert_allclose(largest, np.sort(np.abs(small))[::-1], rtol=1e-6, atol=1e-8)


def test_course_has_the_efforts_that_are_held() -> None:
    reference = JointReference(
        times=np.array([0.0, 1.0]), positions=np.zeros((2, 1)), velocities=np.zeros((2, 1)),
        accelerations=np.zeros((2, 1)), torques=np.array([[0.0], [1.0]]))
    efforts = [Course.of(reference, hold, 10.0, 0.95).efforts[-1, 0]
               for hold in (EffortHold.START, EffortHold.END, EffortHold.LINEAR)]
    np.testing.assert_allclose(efforts, [0.9, 1.0, 0.95])


def test_matrices_must_fit() -> None:
    with pytest.raises(InvalidSizeError, match=r'B has shape \(2, 1\), but must be of shape'):
        LinearFeedback(A=np.eye(2), B=np.ones((2, 1)), C=np.ones((2, 2)), D=np.eye(2),
                       E=np.ones((2, 2)), rate=100.0)
    with pytest.raises(InvalidValueError, match='cutoff is 0.0, but must be'):
        joint_feedback(np.ones((1, 2)), 100.0, 0.0)
