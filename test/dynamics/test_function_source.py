"""Functions that another process derives are those of this one, and it ends when it should."""

from __future__ import annotations

from functools import partial
import time

from flex_planner.arms.arm import Arm
from flex_planner.base.processes import PROCESSES
from flex_planner.base.progress import Monitor, Progress, StoppedError
from flex_planner.base.validation import number
from flex_planner.dynamics.function_source import derive_beside, write_source
from flex_planner.optimal_control.arm_model import ArmModel
from flex_planner.optimal_control.barrier_conditions import build_barrier_functions
import pytest


@pytest.fixture(autouse=True)
def helpers(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv(PROCESSES, '1')


def test_another_process_derives_the_same_functions(rigid_arm: Arm) -> None:
    beside = derive_beside(partial(build_barrier_functions, rigid_arm), Monitor())
    assert beside == write_source(build_barrier_functions(rigid_arm))


def test_a_monitor_ends_the_other_process() -> None:
    with pytest.raises(StoppedError):
        derive_beside(partial(time.sleep, 600), Monitor(canceled=lambda: True))  # type: ignore


def test_what_fails_there_is_left_to_this_process() -> None:
    wrong = partial(number, 'mass', -1.0, at_least=0)
    assert derive_beside(wrong, Monitor()) is None  # type: ignore[arg-type]


def test_without_processes_there_is_no_other(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv(PROCESSES, '0')
    assert derive_beside(partial(time.sleep, 600), Monitor()) is None  # type: ignore[arg-type]


def test_functions_of_the_interior_point_are_announced_and_may_be_stopped(
        rigid_arm: Arm) -> None:
    told: list[Progress] = []
    model = ArmModel.reconstruct(rigid_arm)
    with pytest.raises(StoppedError):
        model.prepare_barrier(Monitor(canceled=lambda: True))
    model.prepare_barrier(Monitor(report=told.append))
    assert 'interior-point' in told[0].phase
    model.prepare_barrier(Monitor(canceled=lambda: True))  # they are there
