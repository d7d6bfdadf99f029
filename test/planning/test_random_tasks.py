"""Whatever is asked: a plan that says solved is, and everything else is told in words."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
import math
import re
from typing import Any

from flex_planner.arms.arm import Arm, Motor
from flex_planner.base.errors import HoldingError, InvalidTaskError
from flex_planner.base.progress import Monitor
from flex_planner.optimal_control.arm_model import ArmModel
from flex_planner.optimal_control.task import Task
from flex_planner.planning.certificate import CertificateLimits
from flex_planner.planning.plan import Plan, PlanStatus
from flex_planner.planning.plan_path import plan_path
from hypothesis import given, Phase, settings
from hypothesis import strategies as st
import numpy as np
from plan_checks import problem_of, says_nothing, solution_of, tip_miss
import pytest

# [s], of a plan: what takes longer is stopped, which is an outcome like others
LIMIT = 1.0
REFUSED = (PlanStatus.LIMIT_VIOLATED, PlanStatus.BENT_TOO_FAR)  # though certified
WITH_SOLUTION = (PlanStatus.SOLVED, PlanStatus.CERTIFICATE_FAILED, *REFUSED)
# of a tip, as SciPy has it [m]; the certificate's limit
TOLERANCE = 1e-5


def motors(stall: float) -> st.SearchStrategy[Motor]:
    limited = st.builds(Motor, stall_torque=st.floats(stall, 3 * stall),
                        no_load_speed=st.floats(2.5, 6.0) | st.just(math.inf))
    return limited | st.just(Motor())


@st.composite
def changed(draw: st.DrawFn, arm: Arm, stall: float) -> Arm:
    """Return an arm with other motors and stiffness, which need no other compiled functions."""
    factor = draw(st.floats(0.5, 4.0))
    links = tuple(replace(link, flexural_rigidity=factor * link.flexural_rigidity)
                  for link in arm.links)
    joints = tuple(replace(joint, motor=draw(motors(stall))) for joint in arm.joints)
    return replace(arm, links=links, joints=joints)


@st.composite
def tasks(draw: st.DrawFn, arms: dict[str, Arm]) -> Task:
    """Return a motion of some arm; where there is gravity, not far from hanging."""
    arm = draw(changed(arms[draw(st.sampled_from(sorted(arms)))], 4.0))
    hanging = bool(arm.gravity.any())
    reach = 0.5 if hanging else 1.5

    def entries(low: float, high: float) -> list[float]:
        return draw(st.lists(st.floats(low, high), min_size=2, max_size=2))

    start = np.array(entries(-reach, reach)) + (-np.pi / 2 * hanging, 0.0)
    bending = st.floats(-2e-3, 2e-3)
    optional: dict[str, Any] = {
        'start_modal_displacements': draw(st.lists(bending, min_size=arm.n_modes,
                                                   max_size=arm.n_modes)),
        'effort_weights': entries(0.1, 2.0), 'velocity_weights': entries(0.0, 20.0),
        'start_velocities': entries(-0.5, 0.5), 'goal_velocities': entries(-0.3, 0.3),
        'goal_position_weights': [draw(st.floats(1.0, 1e4)), math.inf],
        'goal_velocity_weights': [math.inf, draw(st.floats(0.0, 1e3))],
        'time_weight': draw(st.floats(0.1, 10.0)), 'payload_inertia': draw(st.floats(0.0, 0.05))}
    chosen = draw(st.sets(st.sampled_from(sorted(optional)), max_size=3))
    return Task(arm=arm, start_positions=start, duration=draw(st.floats(0.6, 2.0)),
                goal_positions=start + entries(-reach, reach),
                payload_mass=draw(st.floats(0.0, 1.0 if hanging else 6.0)),
                **{name: optional[name] for name in chosen})


@pytest.fixture(scope='module')
def arms(request: pytest.FixtureRequest) -> dict[str, Arm]:
    """Return arms whose functions are compiled already."""
    names = ('rigid', 'single_mode', 'ei5', 'workshop', 'crane')
    return {name: request.getfixturevalue(f'{name}_model').arm for name in names}


@pytest.fixture(scope='module')
def planned(arms: dict[str, Arm]) -> Callable[[Task], Plan | None]:
    """Plan, or return None where the goal cannot be held."""
    def plan(task: Task) -> Plan | None:
        try:
            problem_of(ArmModel(task.arm), task)
        except HoldingError:
            check_unsolved(proved := plan_path(task))
            assert '(HOLDING)' in proved.message
            return None
        except InvalidTaskError:
            with pytest.raises(InvalidTaskError):
                plan_path(task)
            return None
        return plan_path(task, monitor=Monitor(time_limit=LIMIT))

    return plan


def check_solved(plan: Plan) -> None:
    """Check a motion by means that did not find it."""
    choice = (f'; the cheapest of {len(plan.kinds)} kinds of motion found from {plan.starts} '
              r'starts \(J = .*\)')
    assert re.fullmatch(PlanStatus.SOLVED.value + (choice if len(plan.kinds) > 1 else ''),
                        plan.message)
    assert plan.mesh_intervals > 0
    limits = CertificateLimits(boundary_error=plan.task.tolerance)
    assert limits.violations(plan.certificate) == []
    assert tip_miss(plan, rtol=1e-8) <= TOLERANCE
    samples = plan.uniform_samples(201)
    assert (samples.torques <= samples.upper_bounds + 1e-9).all()
    assert (samples.torques >= samples.lower_bounds - 1e-9).all()
    problem, n_t = plan.problem, plan.arm.n_coordinates
    ends = np.hstack([samples.coordinates, samples.rates])[[0, -1]]
    given_goal = np.isinf(problem.goal_weights)
    np.testing.assert_allclose(ends[0], problem.start, atol=1e-12)
    np.testing.assert_allclose(ends[1][given_goal], problem.goal[given_goal], atol=1e-12)
    assert problem.task.duration == plan.task.duration == samples.times[-1]
    assert plan.cost >= 0
    assert samples.coordinates.shape == (201, n_t)


def check_unsolved(plan: Plan) -> None:
    """Check that a failure says why, and nothing that could pass for a solution."""
    assert plan.message
    assert (plan.solution is None) == (plan.status not in WITH_SOLUTION)
    if plan.solution is None:
        assert says_nothing(plan)
    else:
        violations = CertificateLimits().violations(plan.certificate)
        assert bool(violations) == (plan.status not in REFUSED)
        solution_of(plan)
    if plan.status is PlanStatus.INFEASIBLE:
        check_proof(plan)


def check_proof(plan: Plan) -> None:
    """Check that a motion is impossible by what is proved, which goes beyond what was asked."""
    proof = re.fullmatch(r'.* \((HOLDING|POWER|ENERGY)\)', plan.message)
    assert proof, plan.message
    if proof[1] == 'HOLDING':
        more, less = re.findall(r'needs (\S+) N m to .* its motor gives (\S+):', plan.message)[0]
    else:
        # of a duration that is only a guess nothing is proved
        assert not plan.task.time_weight
        more, less = re.findall(r'at least (\S+) s, and (\S+) s were asked for', plan.message)[0]
        assert float(less) == pytest.approx(plan.task.duration, rel=1e-3)
    assert float(more) > float(less)


# a failure is not shrunk: that takes minutes, and the task is told anyway
@settings(max_examples=18, phases=[Phase.generate])
@given(data=st.data())
def test_plans_of_random_tasks_keep_their_word(
        arms: dict[str, Arm], planned: Callable[[Task], Plan | None], data: st.DataObject) -> None:
    plan = planned(data.draw(tasks(arms)))
    if plan is None:
        return
    (check_solved if plan.solved else check_unsolved)(plan)


@settings(max_examples=12, phases=[Phase.generate])
@given(data=st.data())
def test_motions_from_rest_to_rest_without_limits_are_solved(
        arms: dict[str, Arm], planned: Callable[[Task], Plan | None], data: st.DataObject) -> None:
    # and without gravity: there is always one
    task = data.draw(tasks({name: arms[name] for name in ('rigid', 'single_mode', 'ei5')}))
    free = replace(task.arm, joints=tuple(replace(joint, motor=Motor())
                                          for joint in task.arm.joints))
    plan = planned(Task(arm=free, start_positions=task.start_positions,
                        goal_positions=task.goal_positions, duration=task.duration,
                        payload_mass=task.payload_mass, velocity_weights=task.velocity_weights,
                        effort_weights=task.effort_weights))
    assert plan is not None
    assert plan.solved, plan.message
