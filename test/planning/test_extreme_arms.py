"""Arms at the ends of all ranges: an answer or a sentence, never a traceback, NaN or warning."""

from __future__ import annotations

from collections.abc import Iterator
import logging
import math
from typing import Any
import warnings

from flex_planner.arms.arm import Arm
from flex_planner.arms.arm_files import arm_from_mapping
from flex_planner.arms.quantities import QUANTITIES
from flex_planner.base import compiled_library
from flex_planner.base.compiler import CompilerError
from flex_planner.base.errors import FlexPlannerError, InvalidTaskError, InvalidValueError
from flex_planner.base.progress import Monitor
from flex_planner.control.default_gains import default_gains
from flex_planner.optimal_control.arm_model import ArmModel
from flex_planner.optimal_control.motion_problem import MotionProblem, task_parameters
from flex_planner.optimal_control.task import MAX_PAYLOAD, Task
from flex_planner.planning.plan_path import plan_path
from flex_planner.reports.arm import describe_arm, standard_postures
from hypothesis import given, HealthCheck, settings
from hypothesis import strategies as st
import numpy as np
import pytest

# the fixture holds for all examples alike
RANDOM = {'suppress_health_check': [HealthCheck.function_scoped_fixture, HealthCheck.too_slow]}


@pytest.fixture(autouse=True)
def without_compiler(monkeypatch: pytest.MonkeyPatch,
                     tmp_path_factory: pytest.TempPathFactory) -> Iterator[None]:
    """Let no arm be compiled, which would take a second for each, and warnings be errors."""
    def find_none() -> list[str]:
        raise CompilerError('left out')

    monkeypatch.setenv('XDG_CACHE_HOME', str(tmp_path_factory.mktemp('cache')))
    monkeypatch.setattr(compiled_library, 'find_compiler', find_none)
    logging.disable(logging.WARNING)
    with warnings.catch_warnings():
        warnings.simplefilter('error')
        yield
    logging.disable(logging.NOTSET)


def values(kind: str, *, zero: bool = False) -> st.SearchStrategy[float]:
    """Return values of a quantity: its ends, 1 where it is between, and any magnitude."""
    least, most, _ = QUANTITIES[kind]
    between = st.floats(math.log(least), math.log(most)).map(
        lambda power: min(max(math.exp(power), least), most))
    return st.sampled_from([least, most, 1.0, *([0.0, 5e-324, 1e-200] if zero else [])]) | between


def links(family: str) -> st.SearchStrategy[dict[str, Any]]:
    loads = {'shape_mass': values('mass', zero=True),
             'shape_inertia': values('inertia', zero=True)}
    return st.fixed_dictionaries({
        'length': values('length'), 'linear_density': values('linear_density'),
        'modes': st.integers(0, 2), 'flexural_rigidity': values('flexural_rigidity'),
        'mode_family': st.just(family), 'damping_ratio': st.sampled_from([0.0, 1e-300, 0.999]),
        **(loads if family == 'clamped_mass' else {})})


JOINTS = st.fixed_dictionaries({}, optional={
    'motor': st.fixed_dictionaries(
        {'stall_torque': values('torque')},
        optional={'no_load_speed': values('speed'), 'max_speed': values('speed')}),
    'viscous_friction': values('viscous_friction', zero=True)})
NODES = st.fixed_dictionaries({'mass': values('mass', zero=True),
                               'inertia': values('inertia', zero=True)})


@st.composite
def arm_files(draw: st.DrawFn) -> dict[str, Any]:
    n = draw(st.integers(1, 2))
    family = draw(st.sampled_from(['pinned_pinned', 'clamped_free', 'clamped_mass']))
    weight = st.sampled_from([0.0, -9.81, 5e-324, 1e-200, 1e3])
    return {'name': 'extreme', 'gravity': draw(st.tuples(weight, weight)),
            'links': draw(st.lists(links(family), min_size=n, max_size=n)),
            'joints': draw(st.lists(JOINTS, min_size=n, max_size=n)),
            'nodes': draw(st.just([]) | st.lists(NODES, min_size=n + 1, max_size=n + 1))}


PAYLOADS = st.sampled_from([0.0, 5e-324, 1.0, MAX_PAYLOAD])
TASKS = st.fixed_dictionaries({
    'payload_mass': PAYLOADS, 'payload_inertia': PAYLOADS,
    'duration': st.sampled_from([1e-9, 1.0, 1000.0]),
    'effort_weight': st.sampled_from([1e-18, 1.0, 1e18]),
    'velocity_weight': st.sampled_from([0.0, 5e-324, 1e18])})


def make_task(arm: Arm, given: dict[str, float]) -> Task:
    n = arm.n_joints
    return Task(arm=arm, start_positions=[0.0] * n, goal_positions=[0.5] * n,
                duration=given['duration'], payload_mass=given['payload_mass'],
                payload_inertia=given['payload_inertia'],
                effort_weights=[given['effort_weight']] * n,
                velocity_weights=[given['velocity_weight']] * n)


@settings(max_examples=60, **RANDOM)
@given(content=arm_files(), given=TASKS)
def test_extreme_arm_is_described_or_refused(content: dict[str, Any],
                                             given: dict[str, float]) -> None:
    try:
        arm = arm_from_mapping(content)
        model = ArmModel(arm)
        assert 'nan' not in describe_arm(model, standard_postures(arm), given['payload_mass'])
        gains = default_gains(model)
        assert np.isfinite([gains.stiffness, gains.damping]).all()
        task = make_task(arm, given)
        problem = MotionProblem(model, task, task_parameters(task))
        assert np.isfinite(problem.start).all()
        assert (problem.scale > 0).all()
        assert np.isfinite(problem.scale).all()
    except FlexPlannerError as error:
        assert str(error)


@settings(max_examples=15, **RANDOM)
@given(content=arm_files(), given=TASKS)
def test_motion_of_extreme_arm_ends_in_a_status(content: dict[str, Any],
                                                given: dict[str, float]) -> None:
    try:
        arm = arm_from_mapping(content)
        plan = plan_path(make_task(arm, given), model=ArmModel(arm),
                         monitor=Monitor(time_limit=0.3), search='fast')
    except FlexPlannerError as error:
        assert str(error)
    else:
        assert plan.solved or plan.message


@pytest.mark.parametrize(('changes', 'message'), [
    ({'duration': 1e-300}, 'duration is 1e-300, but must be a number >= 1e-09 s'),
    ({'tolerance': 5e-324}, 'tolerance is 5e-324, but must be a number >= 1e-15'),
    ({'effort_weights': [1e-300, 1]}, r'effort_weights\[0\] is 1e-300, .* >= 1e-18'),
    ({'effort_weights': [1, 1e300]}, r'effort_weights\[1\] is 1e\+300, .* <= 1e\+18'),
    ({'velocity_weights': [1e308, 0]}, r'velocity_weights\[0\] is 1e\+308, .* <= 1e\+18'),
    ({'goal_position_weights': [1e308, 0]}, r'goal_position_weights\[0\] is 1e\+308'),
    ({'start_point': [1e200, 0]}, r'start_point\[0\] is 1e\+200, .* <= 1e\+06 m')])
def test_extreme_task_is_named_with_its_range(rigid_arm: Arm, changes: dict[str, Any],
                                              message: str) -> None:
    fields = {'start_positions': [0, 1], 'goal_positions': [1, 1], 'duration': 1.0, **changes}
    with pytest.raises(InvalidValueError, match=message):
        Task(arm=rigid_arm, **fields)


def test_links_too_unequal_to_compute_with_get_a_sentence() -> None:
    arm = arm_from_mapping({'name': 'unequal', 'joints': [{}, {}], 'links': [
        {'length': 1e-5, 'linear_density': 1e6}, {'length': 1e4, 'linear_density': 1.0}]})
    task = Task(arm=arm, start_positions=[0.0, 0.0], goal_positions=[0.5, 0.5], duration=1.0)
    for compute in (lambda: plan_path(task), lambda: default_gains(ArmModel(arm)),
                    lambda: describe_arm(ArmModel(arm), standard_postures(arm), 0.0)):
        with pytest.raises(InvalidTaskError, match='inertia of the lightest is lost in rounding'):
            compute()
