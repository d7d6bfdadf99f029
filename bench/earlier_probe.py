"""Figures of one version of flex_planner as JSON; runs on the earlier version as on this one."""

from __future__ import annotations

from contextlib import suppress
import json
import sys
import time
from typing import Any

from flex_planner import FlexPlannerError, load_arm, Monitor, plan_path, Task
from flex_planner.optimal_control.arm_model import ArmModel
from flex_planner.optimal_control.parameters import Parameters
from flex_planner.planning.strategies.catalogue import CATALOGUE
import numpy as np

POINTS, REPEATS, TIME_LIMIT = 300, 60, 20.0
PRESETS = ('korayem_rigid', 'korayem_ei50', 'korayem_ei5', 'korayem_hanging', 'korayem_table6',
           'single_link', 'de_luca_siciliano', 'three_links', 'clamped_motors')
# flexible motions: preset, start and goal [deg], duration [s], payload [kg]
LIFTED: tuple[tuple[str, list[float], list[float], float, float], ...] = (
    ('korayem_ei50', [90, 0], [30, -60], 1.3, 1.0),
    ('korayem_ei50', [90, 0], [30, -60], 2.0, 3.0),
    ('korayem_ei5', [90, 0], [30, -60], 1.3, 1.0),
    ('korayem_ei5', [0, 60], [70, 10], 1.2, 2.0),
    ('korayem_hanging', [-90, 0], [-60, 30], 1.5, 1.0),
    ('single_link', [0], [60], 1.5, 0.2),
    ('de_luca_siciliano', [0, 0], [45, 45], 2.0, 0.1),
    ('three_links', [60, -40, -30], [10, 20, 15], 1.5, 1.0),
    ('clamped_motors', [90, 0], [30, -60], 1.5, 1.0),
    ('clamped_motors', [0, 45], [40, 80], 2.0, 0.5))


def model_figures(name: str) -> dict[str, float]:
    """Return CPU time of F with its Jacobian per point [us], and of a build, if not cached [s]."""
    began = time.perf_counter()
    model = ArmModel(load_arm(name))
    z = 0.1 * np.random.default_rng(0).normal(size=(POINTS, 4 * model.arm.n_coordinates))
    p = Parameters.of(model.arm, payload_mass=1.0).stack()
    model.optimality_jacobian(z, p)
    built = time.perf_counter() - began
    times = []
    for _ in range(REPEATS):
        began = time.thread_time()
        model.optimality_jacobian(z, p)
        times.append(time.thread_time() - began)
    return {'microseconds': float(np.median(times)) / POINTS * 1e6, 'build_seconds': built}


def lift_figures(index: int) -> dict[str, Any]:
    """Return iterations and CPU time of a plan by the lifted rigid motion alone."""
    name, start, goal, duration, payload = LIFTED[index]
    lift = [one for one in CATALOGUE if one.name == 'rigid motion first']
    task = Task(arm=load_arm(name), start_positions=np.deg2rad(start),
                goal_positions=np.deg2rad(goal), duration=duration, payload_mass=payload)
    plan_path(task, strategies=lift, monitor=Monitor(time_limit=TIME_LIMIT))  # builds
    began = time.process_time()
    plan = None
    with suppress(FlexPlannerError):
        plan = plan_path(task, strategies=lift, monitor=Monitor(time_limit=TIME_LIMIT))
    return {'solved': plan is not None and plan.solved,
            'iterations': None if plan is None else plan.iterations,
            'seconds': time.process_time() - began}


if __name__ == '__main__':
    what, which = sys.argv[1:]
    print(json.dumps(model_figures(which) if what == 'model' else lift_figures(int(which))))
