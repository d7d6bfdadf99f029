"""CPU times of plans and searches of one version as JSON; runs on earlier versions, too."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
import inspect
import json
import math
import sys
import time
from typing import Any

from flex_planner.paper import cases
import numpy as np

REPEATS, LEAST_SECONDS = 9, 0.5
# this module has both in every version, wherever they are defined
PLAN_PATH: Callable[..., Any] = vars(cases)['plan_path']
FIND_MAX_PAYLOAD: Callable[..., Any] = vars(cases)['find_max_payload']


def seconds(call: Callable[[], Any]) -> dict[str, Any]:
    """Return the median CPU time of this process, after a call that loads what it takes."""
    times: list[float] = []
    call()
    while len(times) < REPEATS and (len(times) < 3 or sum(times) < REPEATS * LEAST_SECONDS):
        began = time.process_time()
        found = call()
        times.append(time.process_time() - began)
    value = getattr(found, 'payload', None)
    return {'seconds': float(np.median(times)), 'solved': bool(found.solved),
            'value': float(found.cost if value is None else value)}


def straight(function: Callable[..., Any]) -> dict[str, str]:
    """Return the option that leaves out other kinds of motion, which earlier versions lack."""
    return {'search': 'fast'} if 'search' in inspect.signature(function).parameters else {}


def plan(rigidity: float, payload: float, *, warm: bool = False) -> dict[str, Any]:
    """Return figures of a plan of the paper's motion, or of one with 0.5 % more payload."""
    task = cases.point_to_point(cases.paper_arm(rigidity), payload)
    option = straight(PLAN_PATH)
    if not warm:
        return seconds(lambda: PLAN_PATH(task, **option))
    first, near = PLAN_PATH(task, **option), replace(task, payload_mass=1.005 * payload)
    return seconds(lambda: PLAN_PATH(near, start_from=first, **option))


def search(rigidity: float) -> dict[str, Any]:
    """Return figures of a search for the largest payload to 1e-3 kg."""
    task = cases.point_to_point(cases.paper_arm(rigidity), 1.0)
    option = straight(FIND_MAX_PAYLOAD)
    return seconds(lambda: FIND_MAX_PAYLOAD(task, accuracy=1e-3, **option))


def three_links() -> dict[str, Any]:
    """Return figures of three links with two modes each that turn by 0.6 rad in 2 s."""
    paper = cases.paper_arm()
    motor = replace(paper.joints[0].motor, stall_torque=1e3, no_load_speed=math.inf)
    arm = replace(paper, links=paper.links[:1] * 3, nodes=paper.nodes[:1] * 4,
                  joints=(replace(paper.joints[0], motor=motor),) * 3)
    start = np.array([0.5, -0.8, 0.5])
    make_task = type(cases.point_to_point(paper, 1.0))
    task = make_task(arm=arm, start_positions=start, goal_positions=start + 0.6, duration=2.0,
                     payload_mass=1.0)
    return seconds(lambda: PLAN_PATH(task, **straight(PLAN_PATH)))


def clamped(rigidity: float, modes: int) -> dict[str, Any]:
    """Return figures of a plan of the paper's motion with clamped links."""
    task = cases.point_to_point(cases.paper_arm(rigidity, modes, 'clamped_free'), 1.0)
    return seconds(lambda: PLAN_PATH(task, **straight(PLAN_PATH)))


JOBS: dict[str, Callable[[], dict[str, Any]]] = {
    'cold, 1 kg': lambda: plan(50.0, 1.0),
    'warm, 1 kg': lambda: plan(50.0, 1.0, warm=True),
    'cold, 5.5 kg': lambda: plan(50.0, 5.5),
    'warm, 5.5 kg': lambda: plan(50.0, 5.5, warm=True),
    'largest payload, rigid': lambda: search(math.inf),
    'largest payload, EI 50': lambda: search(50.0),
    'largest payload, EI 5': lambda: search(5.0),
    'three links, two modes each': three_links,
    'clamped, EI 50, one mode each': lambda: clamped(50.0, 1)}

if __name__ == '__main__':
    print(json.dumps(JOBS[sys.argv[1]]()))
