"""The compiled dynamics of an arm: pickled without machine code, and without optimality."""

from __future__ import annotations

from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from pathlib import Path
import pickle
import subprocess
import sys
import time
from typing import Any

from flex_planner.arms.arm import Arm, Joint, Link
from flex_planner.base import compiler
from flex_planner.dynamics import arm_dynamics, compiled_functions
from flex_planner.dynamics.arm_dynamics import ArmDynamics
from flex_planner.dynamics.cache_key import cache_key
from flex_planner.dynamics.physical_parameters import PhysicalParameters
from flex_planner.optimal_control import pontryagin
from flex_planner.optimal_control.arm_model import ArmModel
import numpy as np
import pytest

STATES, TORQUES = np.array([[0.1, 0.2, 0.3, 0.4]]), np.array([[1.0, -2.0]])
both = pytest.mark.parametrize('kind', [ArmDynamics, ArmModel])


@pytest.fixture
def no_optimality(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Forbid to derive optimality conditions; nothing is kept, and nothing compiled."""
    def refuse(arm: Arm) -> Any:
        raise AssertionError('optimality conditions are derived')

    monkeypatch.setenv('XDG_CACHE_HOME', str(tmp_path))
    monkeypatch.setattr(compiler.shutil, 'which', lambda name: None)
    monkeypatch.setattr(pontryagin, 'build_optimality_functions', refuse)


@pytest.mark.usefixtures('no_optimality')
def test_dynamics_need_no_optimality_conditions(rigid_arm: Arm) -> None:
    physical = PhysicalParameters.of_arm(rigid_arm, payload_mass=1.0).physical
    dynamics = ArmDynamics(rigid_arm)
    assert np.isfinite(dynamics.forward_dynamics(STATES, TORQUES, physical)).all()
    assert np.isfinite(dynamics.mass_and_energy(STATES, physical)[0]).all()
    # the model of the same arm does need them: the patch is where it counts
    with pytest.raises(AssertionError, match='optimality conditions are derived'):
        ArmModel(rigid_arm)


def test_dynamics_import_nothing_of_optimal_control() -> None:
    code = ('import sys, flex_planner.dynamics.integration\n'
            'print([name for name in sys.modules if name.startswith((\n'
            "    'flex_planner.optimal_control', 'flex_planner.collocation', 'casadi'))])")
    found = subprocess.run([sys.executable, '-c', code], text=True, capture_output=True,
                           check=True)
    assert found.stdout == '[]\n'


@both
def test_pickle_keeps_the_arm_and_no_machine_code(rigid_arm: Arm, kind: type[Any]) -> None:
    found = kind(rigid_arm)
    data = pickle.dumps(found)
    again = pickle.loads(data)
    assert found._loaded  # else there would be nothing to leave behind
    assert (type(again), again._loaded) == (kind, {})
    assert pickle.dumps(again.arm) == pickle.dumps(rigid_arm)
    # its class and its name besides
    assert len(data) < len(pickle.dumps(rigid_arm)) + 200


@both
def test_unpickled_functions_give_the_same_values(rigid_arm: Arm, kind: type[Any]) -> None:
    first = kind(rigid_arm)
    again = pickle.loads(pickle.dumps(first))
    physical = PhysicalParameters.of_arm(rigid_arm, payload_mass=1.0).physical
    assert np.array_equal(again.forward_dynamics(STATES, TORQUES, physical),
                          first.forward_dynamics(STATES, TORQUES, physical))
    assert again._loaded


def test_unpickling_loads_nothing_until_a_function_is_needed(
        rigid_arm: Arm, monkeypatch: pytest.MonkeyPatch) -> None:
    data, loads = pickle.dumps(ArmDynamics(rigid_arm)), list[str]()

    def watched(key: str, build: Any) -> Any:
        loads.append(key)
        return compiled_functions.load_functions(key, build)

    monkeypatch.setattr(arm_dynamics, 'load_functions', watched)
    again = pickle.loads(data)
    assert loads == []
    for _ in range(2):
        again.static_forces(STATES[:, :2], PhysicalParameters.of_arm(rigid_arm).physical)
        again.inverse_dynamics(STATES, TORQUES, PhysicalParameters.of_arm(rigid_arm).physical)
    assert loads == [cache_key(rigid_arm, 'dynamics')]  # once for all of them


def test_steps_under_controllers_are_derived_when_they_are_wanted(
        rigid_arm: Arm, monkeypatch: pytest.MonkeyPatch) -> None:
    loads, physical = list[set[str]](), PhysicalParameters.of_arm(rigid_arm).physical

    def watched(key: str, build: Any) -> Any:
        found = compiled_functions.load_functions(key, build)
        loads.append(set(found))
        return found

    monkeypatch.setattr(arm_dynamics, 'load_functions', watched)
    dynamics = ArmDynamics(rigid_arm)
    after, feedback, _, _ = dynamics.controlled_steps(
        STATES[0], np.array([[0.1, 0.2, 0.3, 0.4, *TORQUES[0], *TORQUES[0]]]),
        np.array([[1e-3, 1.0]]), np.full(10, 10.0), physical)
    # no error to feed back: a step under the efforts alone
    alone = dynamics.runge_kutta_steps(physical)(STATES[0], np.tile(TORQUES, 12), 1e-3)[0]
    np.testing.assert_allclose(after, alone, rtol=1e-14)
    assert not feedback.any()
    assert [load & {'controlled_step', 'feedback_step'} for load in loads] == [
        set(), {'controlled_step'}]


@both
def test_equal_arm_has_the_same_functions_and_another_arm_others(rigid_arm: Arm,
                                                                 kind: type[Any]) -> None:
    first, equal = kind.of(rigid_arm), kind.of(replace(rigid_arm))
    assert first is equal
    assert type(first) is kind
    renamed = kind.of(replace(rigid_arm, name='another'))
    assert renamed is not first
    assert renamed.arm.name == 'another'
    assert kind.of(rigid_arm) is first


def test_dynamics_and_model_of_an_arm_are_kept_apart(rigid_arm: Arm) -> None:
    assert type(ArmDynamics.of(rigid_arm)) is ArmDynamics
    assert type(ArmModel.of(rigid_arm)) is ArmModel
    assert type(ArmDynamics.of(rigid_arm)) is ArmDynamics


def test_arms_used_last_are_kept_and_the_oldest_forgotten(
        rigid_arm: Arm, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(arm_dynamics, '_kept', arm_dynamics.OrderedDict())
    monkeypatch.setattr(arm_dynamics, '_MOST_KEPT', 2)
    arms = [replace(rigid_arm, name=str(number)) for number in range(3)]
    first, second = (ArmDynamics.of(arm) for arm in arms[:2])
    assert ArmDynamics.of(arms[0]) is first  # used again, so the second is the oldest
    ArmDynamics.of(arms[2])
    assert ArmDynamics.of(arms[0]) is first
    assert ArmDynamics.of(arms[1]) is not second


def test_equal_arm_has_the_same_functions_whether_its_links_are_one_object_or_two() -> None:
    def link() -> Link:
        return Link(length=0.5, linear_density=6.0)

    one, joints = link(), (Joint(), Joint())
    shared, apart = (Arm(name='x', links=links, joints=joints)
                     for links in ((one, one), (link(), link())))
    assert ArmDynamics.of(shared) is ArmDynamics.of(apart)


def test_threads_that_ask_at_once_share_one_set_of_functions(
        monkeypatch: pytest.MonkeyPatch) -> None:
    arm = Arm(name='asked at once', links=(Link(length=0.5, linear_density=6.1),),
              joints=(Joint(),))
    made: list[Arm] = []

    def prepare(self: ArmDynamics) -> None:
        made.append(self.arm)
        time.sleep(0.05)  # the others come meanwhile

    monkeypatch.setattr(ArmDynamics, 'prepare', prepare)
    with ThreadPoolExecutor(4) as pool:
        found = list(pool.map(ArmDynamics.of, [arm] * 4))
    assert made == [arm]
    assert len({id(one) for one in found}) == 1
