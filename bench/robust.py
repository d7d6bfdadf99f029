"""
What it costs to forgive errors of the model, against the plain plan.

``python -m bench.robust`` plans four motions with and without a limit of residual bending, by
turns, and prints CPU times, the least of some rounds.

"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass
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


@dataclass(frozen=True, slots=True, kw_only=True)
class Row:
    """
    A motion with and without a limit of residual bending.

    Attributes
    ----------
    arm, search : str
        Name of the preset; search effort.
    before, after : float
        Residual bending of the plain and the forgiving motion [m].
    growth : float
        Share by which the forgiving one costs more.
    trials, arms : int
        Plans that were made besides the plain one; arms that were simulated with the last one.
    plain, forgiving : float
        CPU times of the requests [s].

    """

    arm: str
    search: str
    before: float
    after: float
    growth: float
    trials: int
    arms: int
    plain: float
    forgiving: float


def measure_case(name: str, rounds: int, search: str) -> Row:
    """Return the row of a case."""
    task, robustness = CASES[name]()
    spent: dict[str, list[float]] = {'plain': [], 'robust': []}
    plans = dict[str, Plan]()
    for _ in range(rounds + 1):  # the first ones compile
        for kind, objectives in (('plain', None), ('robust', Objectives(robustness=robustness))):
            began = time.process_time()
            plans[kind] = plan_path(task, objectives=objectives, search=search)
            spent[kind].append(time.process_time() - began)
    found = plans['robust']
    assert found.objectives is not None and found.objectives.robust is not None
    report = found.objectives.robust
    return Row(arm=name, search=search, before=report.plain_residual, after=report.residual,
               growth=found.cost / plans['plain'].cost - 1, trials=len(report.trials) - 1,
               arms=len(report.errors), plain=min(spent['plain'][1:]),
               forgiving=min(spent['robust'][1:]))


def table(rows: Sequence[Row]) -> str:
    """Return the rows as a table."""
    return '\n'.join([
        '| arm | search | residual bending [mm] | asked to forgive [mm] | more J | plans more '
        '| arms | plain, CPU [s] | forgiving [s] | ratio |',
        '|---|---|---|---|---|---|---|---|---|---|',
        *(f'| `{one.arm}` | {one.search} | {1e3 * one.before:.3g} | {1e3 * one.after:.3g} '
          f'| {100 * one.growth:.2g} % | {one.trials} | {one.arms} | {one.plain:.3f} '
          f'| {one.forgiving:.3f} | {one.forgiving / one.plain:.1f} |' for one in rows)])


def measure(rounds: int = ROUNDS) -> list[dict[str, object]]:
    """Return the rows of all cases and search efforts."""
    return [asdict(measure_case(name, rounds, search))
            for search in ('normal', 'fast') for name in CASES]


if __name__ == '__main__':
    measured = measure(int(sys.argv[1]) if len(sys.argv) > 1 else ROUNDS)
    print(table([Row(**row) for row in measured]))  # type: ignore[arg-type]
