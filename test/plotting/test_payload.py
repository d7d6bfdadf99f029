"""Pictures of searches for the largest payload."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from flex_planner.arms.arm import Arm
from flex_planner.capacity.incremental import PayloadTrial
from flex_planner.capacity.results import MaxPayload, PayloadFront, PayloadMethod
from flex_planner.optimal_control.task import Task
from flex_planner.planning.plan import PlanStatus
from flex_planner.plotting import draw_max_payload, save
import numpy as np
from plotting_support import motion, pixels
import pytest


def search(arm: Arm, method: PayloadMethod, **found: Any) -> MaxPayload:
    """Return a search, whether or not it would have gone like that."""
    task = Task(arm=arm, start_positions=[0, 1], goal_positions=[1, 1], duration=1.0)
    return MaxPayload(task=task, method=method, message='', **{
        'status': PlanStatus.SOLVED, 'payload': 2.0, 'local_upper': 2.001, **found})


def trials(*outcomes: tuple[float, bool, float]) -> tuple[PayloadTrial, ...]:
    return tuple(PayloadTrial(payload=payload, step=1.0, solved=solved, boundary_error=error,
                              result=None) for payload, solved, error in outcomes)


FRONT = PayloadFront(payloads=np.array([1.0, 1.9, 2.0]), efforts=np.array([1.0, 3.0, 4.0]),
                     prices=np.array([1.0, 20.0, 300.0]))
MET = {'front': FRONT}
TRIED = {'trials': trials((1, True, 1e-18), (2, True, 0.0), (3, False, np.inf), (2.5, False, 1))}
FAILED = {'status': PlanStatus.NOT_CONVERGED, 'payload': 0.0, 'local_upper': np.inf}


@pytest.mark.parametrize(('method', 'found'), [
    (PayloadMethod.DIRECT, MET), (PayloadMethod.INCREMENTAL, TRIED),
    (PayloadMethod.DIRECT, FAILED), (PayloadMethod.INCREMENTAL, FAILED),
    (PayloadMethod.INCREMENTAL, {'trials': trials((1, False, np.inf)), **FAILED})])
def test_search_for_the_largest_payload_is_drawn(tmp_path: Path, rigid_arm: Arm,
                                                 method: PayloadMethod,
                                                 found: dict[str, Any]) -> None:
    path = tmp_path / 'payload.png'
    carried = motion(rigid_arm) if 'status' not in found else None
    save(draw_max_payload(search(rigid_arm, method, **found), carried), path)
    assert np.ptp(pixels(path)[..., :3]) > 0.9  # not blank
