"""
Motions of spatial arms from cold: what they cost, and what a direct method says of it.

    tools/run python -m bench.spatial [--direct] [CASE ...]

For every case: CPU time to plan with the compiled functions at hand, and the cost J. With
``--direct``, too, the cost that IPOPT finds without costates from a straight line on a Gauss mesh
of 60 intervals, where it may find another kind of motion, and the one that it finds from the plan.
That takes minutes for arms of more than ten coordinates.

"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
import math
import sys
import time
from typing import Any, NamedTuple

from flex_planner import Arm, load_arm, plan_path, Task
from flex_planner.arms.joint import Elasticity
from flex_planner.arms.spatial_arm import SpatialArm
from flex_planner.optimal_control.arm_model import ArmModel
from flex_planner.optimal_control.direct.ipopt import DirectProblem, DirectSettings
from flex_planner.planning.plan import Plan
import numpy as np

_INTERVALS, _RUNS = 60, 2


class Case(NamedTuple):
    """
    A motion: arm, joint positions at both ends [rad], duration [s] and payload [kg].

    The bar is the CPU time that planning should take at most, where one was set beforehand [s].

    """

    make: Callable[[], Arm]
    start: list[float]
    goal: list[float]
    duration: float
    payload: float
    bar: float | None = None


def with_modes(modes: int, twist: int) -> Arm:
    """Return the arm of three joints with other modes per plane, and of twisting."""
    arm = load_arm('spatial_3r')
    assert isinstance(arm, SpatialArm)
    links = []
    for link in arm.links:
        beam = link.beam and replace(link.beam, modes=(modes, modes), twist_modes=twist,
                                     torsional_rigidity=720.0)
        links.append(replace(link, beam=beam))
    return replace(arm, links=tuple(links))


def with_springs(name: str, stiffness: float) -> Arm:
    """Return an arm whose wrist is elastic, too, with damping of 2e-4 s times the stiffness."""
    arm, spring = load_arm(name), Elasticity(stiffness=stiffness, damping=2e-4 * stiffness)
    joints = [joint if joint.elasticity else replace(joint, elasticity=spring)
              for joint in arm.joints]
    return replace(arm, joints=tuple(joints))


def panda(elastic: int = 4) -> Arm:
    """Return the Panda with four joints elastic, or all seven."""
    return load_arm('panda_elastic') if elastic == 4 else with_springs('panda_elastic', 8000.0)


def without_limits(arm: Arm) -> Arm:
    """Return an arm whose joints turn as far and as fast as their motors make them."""
    return replace(arm, joints=tuple(replace(
        joint, lower_limit=-math.inf, upper_limit=math.inf,
        motor=replace(joint.motor, max_speed=math.inf)) for joint in arm.joints))


_UR5 = [0, -1.2, 1.2, -1.5, -1.5, 0.0], [1.0, -0.8, 0.9, -1.0, -1.2, 0.5]
_3R = [0, -0.3, 0.9], [1.2, -0.6, 0.4]
_PANDA = [0, -0.785, 0, -2.356, 0, 1.571, 0.785]
_NEAR, _FAR = [0.5, -0.5, 0.3, -2.0, 0.2, 1.8, 1.0], [1.2, 0.3, 0.5, -1.5, 0.4, 2.0, 1.2]
CASES: dict[str, Case] = {
    '3R': Case(lambda: load_arm('spatial_3r'), *_3R, 1.0, 0.5),
    '3R, 1 kg in 1.5 s': Case(lambda: load_arm('spatial_3r'), *_3R, 1.5, 1.0),
    '3R with torsion': Case(lambda: with_modes(1, 1), *_3R, 1.0, 0.5, 2.0),
    '3R, two modes per plane': Case(lambda: with_modes(2, 0), *_3R, 1.0, 0.5, 3.0),
    'TUDOR-like': Case(lambda: load_arm('tudor_like'), [0, -0.5, 1.0], [1.0, -1.0, 0.6], 1.0, 0.1),
    'UR5, rigid': Case(lambda: load_arm('ur5_elastic').rigid(), *_UR5, 1.2, 2.0, 1.0),
    'UR5, joints 1 to 3 elastic': Case(lambda: load_arm('ur5_elastic'), *_UR5, 1.2, 1.5, 1.0),
    'UR5, all joints elastic': Case(lambda: with_springs('ur5_elastic', 4000.0), *_UR5, 1.2, 1.5,
                                    1.0),
    'Panda, joints 1 to 4 elastic, near': Case(panda, _PANDA, _NEAR, 0.8, 1.0, 1.0),
    'Panda, joints 1 to 4 elastic, far': Case(panda, _PANDA, _FAR, 1.2, 1.0, 1.0),
    'Panda, joints 1 to 4 elastic, far, without joint limits': Case(
        lambda: without_limits(panda()), _PANDA, _FAR, 1.2, 1.0, 1.0),
    'Panda, all joints elastic, near': Case(lambda: panda(7), _PANDA, _NEAR, 0.8, 1.0, 1.0),
    'Panda, all joints elastic, far': Case(lambda: panda(7), _PANDA, _FAR, 1.2, 1.0, 1.0),
    'Panda, all joints elastic, far, without joint limits': Case(
        lambda: without_limits(panda(7)), _PANDA, _FAR, 1.2, 1.0, 1.0),
    'SCARA': Case(lambda: load_arm('scara_elastic'), [-0.7, 1.05, -0.05, 0],
                  [0.9, 1.4, -0.15, 1.57], 0.6, 2.0),
    'gantry': Case(lambda: load_arm('gantry_beam'), [0.5, 0.5], [2.0, 1.2], 1.5, 2.0),
}


def task_of(case: Case) -> Task:
    """Return the task of a case, with effort weighed by the motors' torques."""
    arm = case.make()
    stall = np.array([joint.motor.stall_torque for joint in arm.joints])
    return Task(arm=arm, start_positions=case.start, goal_positions=case.goal,
                duration=case.duration, payload_mass=case.payload,
                effort_weights=(100 / stall)**2 / 100)


def direct_costs(plan: Plan) -> list[str]:
    """Return the cost that IPOPT finds from a straight line, and from the plan."""
    problem = plan.problem
    direct = DirectProblem(problem.model, DirectSettings(intervals=_INTERVALS))
    costs = []
    for guess in (None, plan.solution):
        found = direct.solve(problem.parameters, problem.start, problem.goal,
                             plan.task.duration, guess=guess)
        costs.append(f'{found.cost:.6f}' if found.converged else 'not found')
    return costs


def plan_case(case: Case) -> tuple[Plan, float]:
    """Return the plan of a case, and the CPU time that it takes, the functions at hand [s]."""
    task = task_of(case)
    ArmModel.of(task.arm)
    if task.arm.n_passive:
        ArmModel.of(task.arm.rigid())
    before = time.process_time()
    plan = plan_path(task, search='fast')
    return plan, time.process_time() - before


def measure() -> list[dict[str, Any]]:
    """Return a row of figures for each case, of the quicker one of two runs."""
    rows = []
    for name, case in CASES.items():
        plan, seconds = min((plan_case(case) for _ in range(_RUNS)), key=lambda run: run[1])
        rows.append({'case': name, 'coordinates': plan.arm.n_coordinates, 'seconds': seconds,
                     'bar': case.bar, 'cost': plan.cost if plan.solved else None,
                     'strategy': plan.strategy if plan.solved else plan.status.value})
        print(rows[-1], flush=True)
    return rows


def table(rows: list[dict[str, Any]]) -> str:
    """Return the figures as a table."""
    lines = ['| motion | coordinates | CPU s | bar | J | strategy |', '|---|---|---|---|---|---|']
    for row in rows:
        bar = '' if row['bar'] is None else f'{row["bar"]:g}'
        cost = 'none' if row['cost'] is None else f'{row["cost"]:.6f}'
        lines.append(f'| {row["case"]} | {row["coordinates"]} | {row["seconds"]:.2f} | {bar} | '
                     f'{cost} | {row["strategy"]} |')
    return '\n'.join(lines)


def main(arguments: list[str]) -> None:
    """Plan cases and print a line for each."""
    names = [name for name in arguments if name != '--direct'] or list(CASES)
    direct = '--direct' in arguments
    print('case | CPU [s] | J | strategy' + ' | IPOPT, cold | IPOPT, from the plan' * direct)
    for name in names:
        plan, seconds = plan_case(CASES[name])
        row = [name, f'{seconds:.2f}', f'{plan.cost:.6f}' if plan.solved else plan.status.value,
               plan.strategy, *(direct_costs(plan) if plan.solved and direct else [])]
        print(' | '.join(row), flush=True)


if __name__ == '__main__':
    main(sys.argv[1:])
