"""Section 5.2, Table II, figs. 5 to 8: from minimum effort to low speeds."""

from __future__ import annotations

import math

from flex_planner.base.validation import Array
from flex_planner.paper.cases import paper_arm, plan_certified, point_to_point, W_2
from flex_planner.paper.checks import format_value, solve_by_ipopt, swing_of
from flex_planner.paper.diagrams import joint_panels, POINTS, runs_on_limit, tip_panel
from flex_planner.paper.evidence import Claim, judge, Section, Table, Verdict
from flex_planner.planning.objectives import Objectives
from flex_planner.planning.plan import peaks, Plan, Samples
from flex_planner.planning.plan_path import plan_path
from flex_planner.plotting.diagrams import Picture
import numpy as np

_PAYLOAD, _WISHED = 1.0, 0.8  # [kg], [rad/s]
_ROUNDING = 0.05  # of velocities printed with one decimal [rad/s]
_NEXT = 9.0  # a smallest weight above this would be the paper's 10
_BEYOND = 1e5  # a weight far beyond the paper's largest


def study(*, reduced: bool = False) -> Section:
    """Return the evidence on section 5.2."""
    rigid = _plans(math.inf, W_2)
    flexible = _plans(50.0, W_2[:1] if reduced else W_2)
    shown_plans = rigid if reduced else flexible
    samples = {f'w2 = {w_2:g}': plan.uniform_samples(POINTS) for w_2, plan in shown_plans.items()}
    speeds = {w_2: peaks(plan, plan.uniform_samples(POINTS)).speeds for w_2, plan in rigid.items()}
    checks = {w_2: solve_by_ipopt(rigid[w_2]) for w_2 in (W_2[:1] if reduced else W_2)}
    values = {f'rigid_cost_{w_2:g}': plan.cost for w_2, plan in rigid.items()}
    values |= {f'rigid_peak_{w_2:g}_joint_{j + 1}': float(speeds[w_2][j])
               for w_2 in speeds for j in range(2)}
    values |= {f'ei50_cost_{w_2:g}': plan.cost for w_2, plan in flexible.items()}
    independent = {w_2: format_value(check, check.cost) for w_2, check in checks.items()}
    links = 'rigid' if reduced else 'EI = 50 N m^2'
    claims = _claims(links, speeds, list(samples.values()), shown_plans)
    if not reduced:
        weight, slowest = _smallest_weight(), _slowest(rigid[W_2[-1]])
        values |= {'smallest_weight': weight, 'slowest_peak': slowest}
        claims += _further_claims(weight, slowest)
    return Section(
        key='5.2', title='Minimum effort and speed',
        text='The tip goes from (0.5, 0) m to (0.5, 0.5) m in 1 s with 1 kg; R = 1/8, W_2 = w_2 '
        'at the joints. Rigid links, and the arm of Table I with two modes per link (EI = 50 '
        'N m^2); the independent check is IPOPT on the rigid arm, from a straight line.',
        tables=(_table(speeds, rigid, flexible, independent),), claims=claims,
        pictures=_pictures(samples, links), values=values)


def _plans(rigidity: float, weights: tuple[float, ...]) -> dict[float, Plan]:
    arm = paper_arm(rigidity)
    return {w_2: plan_certified(point_to_point(arm, _PAYLOAD, w_2)) for w_2 in weights}


def _table(speeds: dict[float, Array], rigid: dict[float, Plan], flexible: dict[float, Plan],
           independent: dict[float, str]) -> Table:
    paper = dict(zip(W_2, ('up to 1.2', '', 'first within 0.8', '0.6'), strict=True))
    rows = tuple(
        (f'{w_2:g}', paper[w_2], ', '.join(f'{speed:.3f}' for speed in speeds[w_2]),
         f'{plan.cost:.6g}', independent.get(w_2, ''),
         f'{flexible[w_2].cost:.6g}' if w_2 in flexible else '',
         f'{plan.certificate.tip_error:.0e}') for w_2, plan in rigid.items())
    return Table(title='Table II: peak velocities and costs', rows=rows, header=(
        'w_2', 'paper, peak [rad/s]', 'ours, joints 1, 2 [rad/s]', 'J, rigid', 'J, IPOPT',
        'J, EI 50', 'tip error of the re-simulation [m]'))


def _claims(links: str, speeds: dict[float, Array], samples: list[Samples],
            plans: dict[float, Plan]) -> tuple[Claim, ...]:
    top = {w_2: float(one.max()) for w_2, one in speeds.items()}
    bent = [max(float(swing_of(one, joint).max()) for joint in range(2))
            for one in (samples[0], samples[-1])]
    runs = [runs_on_limit(samples[-1], joint) for joint in range(2)]
    ends = all(run and run[0][0] == 0 and run[-1][1] == samples[-1].times[-1] for run in runs)
    within = [w_2 for w_2, peak in top.items() if peak <= _WISHED]
    least, most = (plans[w_2] for w_2 in (W_2[0], W_2[-1]))
    return (
        Claim(said='Larger w_2 brings the peak velocity from 1.2 down to 0.6 rad/s, greatly up '
              'to the third case and little in the fourth.',
              found=_falls(speeds),
              verdict=judge(abs(top[0.0] - 1.2) < _ROUNDING > abs(top[1400.0] - 0.6)
                            and all(_levels_off(speeds, joint) for joint in range(2)))),
        Claim(said='w_2 = 10 is the first case within +-0.8 rad/s.',
              found=f'The first of the four is w_2 = {within[0]:g} (rigid).',
              verdict=judge(within[0] == W_2[2])),
        Claim(said='With larger w_2 the joints move more and more along a straight line in time.',
              found='The largest distance of a joint from it falls from '
              f'{bent[0]:.1%} to {bent[1]:.1%} of its travel ({links}).',
              verdict=judge(bent[1] < bent[0] / 2)),
        Claim(said='In the last case the torques reach their bounds at both ends of the motion.',
              found=f'On the bound ({links}): ' + '; '.join(
                  f'motor {joint + 1} ' + _spans(run) for joint, run in enumerate(runs)) + '.',
              verdict=judge(ends)),
        Claim(said='Least effort comes with the highest velocity and the other way round.',
              found=f'Integral of the squared torques: {least.effort:.3g} N^2 m^2 s at w_2 = 0, '
              f'{most.effort:.3g} at 1400 ({links}).',
              verdict=judge(least.effort < most.effort)))


def _levels_off(speeds: dict[float, Array], joint: int) -> bool:
    """Return whether a peak falls by less than half as much at last as in the step before."""
    peaks = [float(one[joint]) for one in speeds.values()]
    return peaks[2] - peaks[3] < (peaks[1] - peaks[2]) / 2


def _falls(speeds: dict[float, Array]) -> str:
    """Return the peaks of both joints, and for which of them the statement holds."""
    rows = '; '.join(f'joint {joint + 1}: ' + ', '.join(f'{one[joint]:.3f}'
                                                        for one in speeds.values())
                     for joint in range(2))
    held = [str(joint + 1) for joint in range(2) if _levels_off(speeds, joint)]
    return (f'{rows} rad/s (rigid). The range is right; that little happens in the last step '
            f'holds for joint {" and ".join(held) or "none"} only.' if len(held) < 2
            else f'{rows} rad/s (rigid).')


def _spans(runs: list[tuple[float, float]]) -> str:
    return ' and '.join(f'{a:.3f}-{b:.3f} s' for a, b in runs) or 'never'


def _smallest_weight() -> float:
    """Return the smallest w_2 with which the rigid arm keeps the wished velocity."""
    task = point_to_point(paper_arm(math.inf), _PAYLOAD)
    plan = plan_path(task, objectives=Objectives(max_joint_speeds=np.full(2, _WISHED)))
    return float(plan.task.velocity_weights.max())


def _slowest(start: Plan) -> float:
    """Return the peak velocity of the rigid arm at a weight far beyond the paper's."""
    weight, plan = W_2[-1], start
    while weight < _BEYOND:
        weight = min(4 * weight, _BEYOND)
        plan = plan_certified(point_to_point(start.arm, _PAYLOAD, weight), start_from=plan)
    return float(peaks(plan, plan.uniform_samples(POINTS)).speeds.max())


def _further_claims(weight: float, slowest: float) -> tuple[Claim, ...]:
    return (
        Claim(said='w_2 = 10 is the weight to choose for 0.8 rad/s.',
              found=f'It does keep the limit, but so does every weight from w_2 = {weight:.2f} '
              'on, with less effort; `Objectives(max_joint_speeds=...)` finds it.',
              verdict=judge(weight > _NEXT)),
        Claim(said='Less than 0.6 rad/s is impossible, because with w_2 > 1400 the solution does '
              'not converge.',
              found=f'It converges: at w_2 = {_BEYOND:g} the certified motion peaks at '
              f'{slowest:.4f} rad/s. The limit is real, but it is the motors that set it.',
              verdict=Verdict.CORRECTED))


def _pictures(samples: dict[str, Samples], links: str) -> tuple[Picture, ...]:
    of = f' ({links})'
    return (
        Picture(name='fig05', panels=(tip_panel(samples),),
                caption=f'As fig. 5: paths of the tip{of}'),
        Picture(name='fig06', panels=joint_panels(samples, 'angles'),
                caption=f'As fig. 6: angular positions{of}'),
        Picture(name='fig07', panels=joint_panels(samples, 'speeds'),
                caption=f'As fig. 7: angular velocities{of}'),
        Picture(name='fig08', panels=joint_panels(samples, 'torques'),
                caption=f'As fig. 8: torques and their bounds{of}'))
