"""Section 5.4, Table VI, fig. 16: the turn of half a revolution with least effort."""

from __future__ import annotations

from flex_planner.paper.cases import plan_certified, turn, turning_arm
from flex_planner.paper.checks import format_value, solve_by_ipopt
from flex_planner.paper.diagrams import joint_panels, POINTS, runs_on_limit
from flex_planner.paper.evidence import Claim, Section, Table, Verdict
from flex_planner.planning.plan import peaks, Plan, Samples
from flex_planner.plotting.diagrams import Picture

# what J_1, J_2, J_3 = 1 kg m^2 may turn with: inertias at the nodes of the arm, each of which
# turns with the link that starts there, the last with the tip
READINGS = {
    'each with the link that starts at its node, the last with the tip': (1.0, 1.0, 1.0),
    'the first two with link 1, the third with link 2': (2.0, 0.0, 1.0),
    'the hub alone': (1.0, 0.0, 0.0),
    'a tenth of the printed value': (0.1, 0.1, 0.1),
    'none': (0.0, 0.0, 0.0),
}
TAKEN = next(iter(READINGS))


def study(*, reduced: bool = False) -> Section:
    """Return the evidence on section 5.4."""
    names = list(READINGS)[:1] if reduced else list(READINGS)
    plans = {name: plan_certified(turn(turning_arm(READINGS[name]))) for name in names}
    samples = {name: plan.uniform_samples(POINTS) for name, plan in plans.items()}
    checks = {name: solve_by_ipopt(plan, 80) for name, plan in plans.items()
              if name in (TAKEN, names[-1])}
    values = {f'turn_cost_{k}': plan.cost for k, plan in enumerate(plans.values())}
    values |= {f'turn_peak_joint_{j + 1}': float(peaks(plans[TAKEN], samples[TAKEN]).speeds[j])
               for j in range(2)}
    independent = {name: format_value(check, check.cost) for name, check in checks.items()}
    return Section(
        key='5.4', title='Minimum effort',
        text='The arm of Table VI, one pinned-pinned mode per link, turns from (0, 180) deg to '
        '(180, 0) deg in 2 s; R = 1, motors of 13.5 and 4 N m at any speed. The paper does not '
        'say what J_1 to J_3 turn with; its readings are compared, and the first is taken below. '
        'The independent check is IPOPT from a straight line.',
        tables=(_table(plans, samples, independent),),
        claims=(_saturation_claim(plans, samples), _comparison_claim(plans[TAKEN])),
        pictures=(_picture(samples),), values=values)


def _ends(samples: Samples, joint: int) -> str:
    """Return the ends of the motion at which a motor is on its limit, in words."""
    runs, last = runs_on_limit(samples, joint), samples.times[-1]
    first = bool(runs) and runs[0][0] == 0
    final = bool(runs) and runs[-1][1] == last
    return {(True, True): 'both ends', (True, False): 'start', (False, True): 'end'}.get(
        (first, final), 'in between' if runs else 'never')


def _table(plans: dict[str, Plan], samples: dict[str, Samples],
           independent: dict[str, str]) -> Table:
    rows = []
    for k, (name, plan) in enumerate(plans.items(), 1):
        most = peaks(plan, samples[name])
        rows.append((f'{k}: {name}', f'{plan.cost:.6g}', independent.get(name, ''),
                     ', '.join(f'{speed:.2f}' for speed in most.speeds),
                     ', '.join(f'{torque:.2f}' for torque in most.torques),
                     ', '.join(_ends(samples[name], joint) for joint in range(2))))
    return Table(title='Readings of J_1 to J_3', rows=tuple(rows), header=(
        'turn with', 'J', 'J, IPOPT', 'peak velocities [rad/s]', 'peak torques [N m]',
        'motors 1, 2 on their limit'))


def _saturation_claim(plans: dict[str, Plan], samples: dict[str, Samples]) -> Claim:
    both = [name for name, one in samples.items()
            if all(_ends(one, joint) == 'both ends' for joint in range(2))]
    taken = ', '.join(f'motor {joint + 1}: {_ends(samples[TAKEN], joint)}' for joint in range(2))
    return Claim(
        said='Each motor is on its limit at the beginning and at the end.',
        found=(f'With the first reading, {taken}. '
               + ('; '.join(f'Both are if J_1 to J_3 turn thus: {name}; motor 1 is then on its '
                            f'limit for {plans[name].saturation[0]:.0%} of the time'
                            for name in both)
                  or f'None of the {len(plans)} readings has both there at both ends')
               + '. The paper does not say which reading is its own.'),
        verdict=Verdict.CONFIRMED if both else Verdict.NOT_REPRODUCIBLE)


def _comparison_claim(plan: Plan) -> Claim:
    return Claim(
        said='Velocities and torques agree reasonably with those of an earlier study by dynamic '
        'programming.',
        found='That study gives curves, not numbers, and the inertias are not certain, so the '
        f'agreement cannot be judged. Our motion is certified (tip error '
        f'{plan.certificate.tip_error:.0e} m, Hamiltonian constant to '
        f'{plan.certificate.hamiltonian_drift:.0e}) and IPOPT finds the same cost.',
        verdict=Verdict.NOT_REPRODUCIBLE)


def _picture(samples: dict[str, Samples]) -> Picture:
    cases = {f'reading {k}': one for k, (name, one) in enumerate(samples.items(), 1)
             if READINGS[name][2] in (0.0, 1.0)}
    return Picture(name='fig16', panels=(*joint_panels(cases, 'angles'),
                                         *joint_panels(cases, 'speeds'),
                                         *joint_panels(cases, 'torques')),
                   caption='As fig. 16: positions, velocities and torques of minimum effort, for '
                   'some of the readings of the table')
