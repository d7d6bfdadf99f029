"""
What it costs to forgive errors of the model, against the plain plan.

``python -m bench.robust`` plans four motions with and without a limit of residual bending, by
turns, and prints CPU times, the least of some rounds; ``python -m bench.robust 7 fast`` keeps to
one kind of motion.

"""

from __future__ import annotations

from collections.abc import Callable
import sys
import time

from flex_planner import load_arm, Objectives, plan_path, Task
from flex_planner.arms.arm import Arm
from flex_planner.control.joint_controller import Gains, JointController
from flex_planner.planning.plan import Plan
from flex_planner.planning.robust.objective import Robustness

ROUNDS = 7


def _paper(name: str, gains: tuple[float, float], limit: float) -> tuple[Task, Robustness]:
    """Return the paper's motion with 1 kg."""
    task = Task.between_points(load_arm(name), (0.5, 0.0), (0.5, 0.5), elbow=-1, duration=1.0,
                               payload_mass=1.0, effort_weights=[1 / 8, 1 / 8])
    return task, _within(task.arm, gains, limit)


def _muroran(limit: float) -> tuple[Task, Robustness]:
    """Return a motion of Muroran's arm under gravity."""
    task = Task(arm=load_arm('muroran_vertical'), start_positions=[-1.2, 0.6],
                goal_positions=[-0.4, 0.9], duration=0.8, payload_mass=0.2)
    return task, _within(task.arm, (30.0, 2.0), limit)


def _within(arm: Arm, gains: tuple[float, float], limit: float) -> Robustness:
    return Robustness(max_residual=limit,
                      controller=JointController(gains=Gains.of(arm.n_joints, *gains)))


CASES: dict[str, Callable[[], tuple[Task, Robustness]]] = {
    'korayem_ei5': lambda: _paper('korayem_ei5', (100.0, 10.0), 1e-3),
    'korayem_ei50': lambda: _paper('korayem_ei50', (100.0, 10.0), 1e-4),
    'clamped_motors': lambda: _paper('clamped_motors', (40.0, 4.0), 1.65e-3),
    'muroran_vertical': lambda: _muroran(2e-3)}


def measure(name: str, rounds: int, search: str) -> str:
    """Return a row of the table."""
    task, robustness = CASES[name]()
    spent: dict[str, list[float]] = {'plain': [], 'robust': []}
    plans = dict[str, Plan]()
    for _ in range(rounds + 1):  # the first ones compile
        for kind, objectives in (('plain', None), ('robust', Objectives(robustness=robustness))):
            began = time.process_time()
            plans[kind] = plan_path(task, objectives=objectives, search=search)
            spent[kind].append(time.process_time() - began)
    plain, robust = (min(spent[kind][1:]) for kind in ('plain', 'robust'))
    found = plans['robust']
    assert found.objectives is not None and found.objectives.robust is not None
    search = found.objectives.robust
    growth = found.cost / plans['plain'].cost - 1
    return (f'| `{name}` | {1e3 * search.plain_residual:.3g} | {1e3 * search.residual:.3g} '
            f'| {100 * growth:.2g} % | {len(search.trials) - 1} | {len(search.errors)} '
            f'| {plain:.3f} | {robust:.3f} | {robust / plain:.1f} |')


def main(rounds: int, search: str) -> None:
    """Print the table."""
    print('| arm | residual [mm] | forgiving | more J | plans more | arms | plain [s] '
          '| forgiving [s] | ratio |\n|---|---|---|---|---|---|---|---|---|')
    for name in CASES:
        print(measure(name, rounds, search), flush=True)


if __name__ == '__main__':
    main(int(sys.argv[1]) if len(sys.argv) > 1 else ROUNDS,
         sys.argv[2] if len(sys.argv) > 2 else 'normal')
