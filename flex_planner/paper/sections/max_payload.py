"""Section 5.3, Tables III to V, figs. 9 to 14: the largest payload."""

from __future__ import annotations

import math

from flex_planner.base.validation import Array
from flex_planner.capacity.max_payload import find_max_payload
from flex_planner.capacity.results import MaxPayload, PayloadMethod
from flex_planner.optimal_control.arm_model import ArmModel
from flex_planner.paper.cases import (
    ACCURACY,
    EPSILON,
    find_largest,
    LIMITS,
    NoPlanError,
    paper_arm,
    PAYLOADS,
    plan_certified,
    point_to_point,
    STIFFNESS_LIMITS,
)
from flex_planner.paper.checks import format_value, maximize_payload
from flex_planner.paper.diagrams import joint_panels, POINTS, tip_panel
from flex_planner.paper.evidence import Claim, judge, Section, Table, Verdict
from flex_planner.planning.plan import peaks, Plan, Samples
from flex_planner.plotting.diagrams import Picture
import numpy as np

_PRICE = 1e3  # of the payload against effort, for IPOPT [1/kg]
_RIGID = math.inf
_NEARLY_ALL = 0.95  # of the time


def study(*, reduced: bool = False) -> Section:
    """Return the evidence on section 5.3."""
    found = {_RIGID: find_largest(point_to_point(paper_arm(_RIGID), 1.0))}
    if not reduced:
        found |= {rigidity: find_largest(point_to_point(paper_arm(rigidity), 1.0))
                  for rigidity in STIFFNESS_LIMITS if not math.isinf(rigidity)}
    rigid = _plan_of(found[_RIGID])
    light = {payload: plan_certified(point_to_point(rigid.arm, payload)) for payload in PAYLOADS}
    weighted = _plan_with_weights(rigid, (0.0, 1000.0) if reduced else tuple(LIMITS))
    checks = {rigidity: maximize_payload(one.task, _plan_of(one), _PRICE)
              for rigidity, one in found.items()}
    values = {f'limit_{rigidity:g}': one.payload for rigidity, one in found.items()}
    values |= {f'limit_w2_{w_2:g}': plan.task.payload_mass for w_2, plan in weighted.items()}
    raised = _raise_payload(rigid)
    values |= {'limit_fig_2': raised.payload}
    independent = {rigidity: format_value(check, check.payload, 5)
                   for rigidity, check in checks.items()}
    samples = {f'{payload:g} kg': plan.uniform_samples(POINTS) for payload, plan in light.items()}
    by_weight = {f'w2 = {w_2:g}': plan.uniform_samples(POINTS) for w_2, plan in weighted.items()}
    as_printed = {
        f'w2 = {w_2:g}, {LIMITS[w_2]:g} kg': plan_certified(
            point_to_point(rigid.arm, LIMITS[w_2], w_2)).uniform_samples(POINTS)
        for w_2 in weighted}
    by_stiffness = {_link_name(rigidity): _plan_of(one).uniform_samples(POINTS)
                    for rigidity, one in found.items()}
    claims = (*_limit_claims(found[_RIGID], raised), *_weight_claims(weighted, by_weight))
    if not reduced:
        claims += _stiffness_claims(found, by_stiffness)
    return Section(
        key='5.3', title='Maximum payload',
        text='The same motion in 1 s, R = 1/8. The payload is an unknown of the boundary-value '
        'problem at a rising price; the bracket has a certified motion at its lower end. The '
        'independent check maximises the payload by IPOPT, less its effort at a fixed price, '
        'which leaves it a little below the limit. Links that bend have two modes each.',
        tables=(_payload_table(light), _weight_table(weighted),
                _stiffness_table(found, independent)), claims=claims,
        pictures=_pictures(samples, as_printed, by_weight, by_stiffness), values=values)


def _link_name(rigidity: float) -> str:
    return 'rigid' if math.isinf(rigidity) else f'EI = {rigidity:g} N m^2'


def _plan_of(found: MaxPayload) -> Plan:
    if found.plan is None:
        raise NoPlanError(found.message)
    return found.plan


def _plan_with_weights(rigid: Plan, weights: tuple[float, ...]) -> dict[float, Plan]:
    """Return the motions with the rigid arm's largest payload at weights of the velocities."""
    plans, plan = {}, rigid
    for w_2 in weights:
        task = point_to_point(rigid.arm, rigid.task.payload_mass, w_2)
        plan = plans[w_2] = plan_certified(task, start_from=plan)
    return plans


def _raise_payload(rigid: Plan) -> MaxPayload:
    """Return the result of the algorithm of fig. 2 with the paper's accuracies."""
    return find_max_payload(point_to_point(rigid.arm, 1.0), model=ArmModel(rigid.arm),
                            method=PayloadMethod.INCREMENTAL, accuracy=ACCURACY)


def _payload_table(plans: dict[float, Plan]) -> Table:
    rows = tuple((f'{payload:g}', f'{plan.cost:.6g}',
                  ', '.join(f'{share:.1%}' for share in plan.saturation),
                  f'{plan.certificate.tip_error:.0e}') for payload, plan in plans.items())
    return Table(title='Table III: rigid arm', rows=rows, header=(
        'payload [kg]', 'J', 'motors 1, 2 on their limit', 'tip error of the re-simulation [m]'))


def _weight_table(weighted: dict[float, Plan]) -> Table:
    rows = tuple((f'{w_2:g}', f'{LIMITS[w_2]:g}', f'{plan.task.payload_mass:.4f}',
                  f'{plan.certificate.tip_error:.0e}',
                  ', '.join(f'{share:.1%}' for share in plan.saturation))
                 for w_2, plan in weighted.items())
    return Table(title='Table IV: the same payload, carried with every weight', rows=rows,
                 header=('w_2', 'paper [kg]', 'ours, certified [kg]',
                         'tip error of the re-simulation [m]', 'motors 1, 2 on their limit'))


def _stiffness_table(found: dict[float, MaxPayload], independent: dict[float, str]) -> Table:
    rows = tuple((_link_name(rigidity), f'{STIFFNESS_LIMITS[rigidity]:g}', f'{one.payload:.5f}',
                  f'{one.local_upper:.5f}', independent[rigidity])
                 for rigidity, one in found.items())
    return Table(title='Table V: the largest payload', rows=rows,
                 header=('links', 'paper [kg]', 'ours, carried [kg]', 'too much [kg]',
                         'IPOPT [kg]'))


def _limit_claims(found: MaxPayload, raised: MaxPayload) -> tuple[Claim, ...]:
    plan = _plan_of(found)
    missed = [trial for trial in raised.trials if trial.payload > found.local_upper]
    close = [trial for trial in missed if trial.boundary_error <= EPSILON]
    error = min((trial.boundary_error for trial in missed), default=math.inf)
    return (
        Claim(said='The rigid arm carries 5.85 kg.',
              found=f'{found.payload:.5f} kg is carried by a certified motion, '
              f'{found.local_upper:.5f} kg is too much; the algorithm of fig. 2 ends at '
              f'{raised.payload:.3f} kg, to its accuracy of {ACCURACY:g} kg.',
              verdict=judge(abs(found.payload - LIMITS[0.0]) <= ACCURACY)),
        Claim(said='At the largest payload both torques lie on their limits completely.',
              found='On the limit for ' + ' and '.join(
                  f'{share:.1%}' for share in plan.saturation) + ' of the time; the rest are the '
              f'{plan.switching_times.size // 2} changes from one limit to the other.',
              verdict=judge(plan.saturation.min() > _NEARLY_ALL)),
        Claim(said='Above it the error of eq. (17) grows suddenly beyond eps = 1e-3, which shows '
              'that the payload is too large.',
              found=f'The smallest error of a payload that is too large was {error:.1e} here'
              + (f', at {close[0].payload:.3f} kg: eps would have let it pass. It is the failure '
                 "of Newton's method, not the error, that tells." if close else '.'),
              verdict=judge(not close)))


def _weight_claims(weighted: dict[float, Plan],
                   samples: dict[str, Samples]) -> tuple[Claim, ...]:
    heaviest = max(weighted)
    first, last = list(samples.values())[0], list(samples.values())[-1]
    apart = np.linalg.norm(first.tip - last.tip, axis=1).max() * 1e3
    speeds = {w_2: peaks(plan, one).speeds.max()
              for (w_2, plan), one in zip(weighted.items(), samples.values(), strict=True)}
    return (
        Claim(said='Other weights lead to other, smaller largest payloads: 4.6 kg with '
              'w_2 = 1000.',
              found=f'{weighted[heaviest].task.payload_mass:.4f} kg is carried with '
              f'w_2 = {heaviest:g} as well, certified. Weights choose among the motions that the '
              'motors can make, they do not change which can be made; the table shows where the '
              "paper's solver stopped converging.",
              verdict=Verdict.CORRECTED),
        Claim(said='The motions of the largest payload differ with the weights, and are slower '
              'with larger ones.',
              found='At the true limit hardly any freedom is left: the paths of the tip are '
              f'{apart:.2g} mm apart at most, peak velocities {speeds[min(weighted)]:.4f} and '
              f'{speeds[heaviest]:.4f} rad/s. At the smaller payloads of the paper they do '
              'differ.', verdict=Verdict.CORRECTED))


def _stiffness_claims(found: dict[float, MaxPayload],
                      samples: dict[str, Samples]) -> tuple[Claim, ...]:
    limits = [one.payload for one in found.values()]
    rough = np.array([_roughness(one) for one in samples.values()])
    return (
        Claim(said="The largest payload of flexible arms is close to the rigid one's, and falls "
              'with the stiffness: 5.85, 5.8, 5.75 kg.',
              found=', '.join(f'{limit:.4f}' for limit in limits) + ' kg, within the '
              f'{ACCURACY:g} kg to which the paper searches; from rigid links to 50 N m^2 it '
              f'falls by {limits[0] - limits[1]:.4f} kg only, not by 0.05. It is close because '
              'pinned-pinned shapes do not move the tip; with clamped ones it is not, see '
              'section 6.2.', verdict=judge(
                  limits == sorted(limits, reverse=True) and all(
                      abs(limit - printed) <= ACCURACY + 1e-3 for limit, printed in zip(
                          limits, STIFFNESS_LIMITS.values(), strict=True)))),
        Claim(said='The torques oscillate more the softer the links are.',
              found='Up and down of the torques of motors 1; 2 in all: ' + '; '.join(
                  ', '.join(f'{value:.1f}' for value in rough[:, joint]) for joint in range(2))
              + ' N m (rigid, 50, 5 N m^2), with '
              + ', '.join(str(_plan_of(one).switching_times.size) for one in found.values())
              + ' switching times.',
              verdict=judge(bool((np.diff(rough.sum(axis=1)) > 0).all()))))


def _roughness(samples: Samples) -> Array:
    """Return the total variation of each torque, shape (n,) [N m]."""
    change: Array = np.abs(np.diff(samples.torques, axis=0)).sum(axis=0)
    return change


def _pictures(payloads: dict[str, Samples], printed: dict[str, Samples],
              weights: dict[str, Samples], stiffness: dict[str, Samples]) -> tuple[Picture, ...]:
    return (
        Picture(name='fig09', panels=joint_panels(payloads, 'torques'),
                caption='As fig. 9: torques of the payloads of Table III'),
        Picture(name='fig10', panels=(
            tip_panel(printed, 'path of the tip, payloads of Table IV'),
            tip_panel(weights, 'path of the tip, 5.855 kg with every weight')),
                caption='As fig. 10: paths of the tip with the payloads that the paper takes for '
                'the largest, and with the one that is'),
        Picture(name='fig11', panels=joint_panels(printed, 'speeds'),
                caption='As fig. 11: angular velocities with the payloads of Table IV'),
        Picture(name='fig12', panels=joint_panels(printed, 'torques'),
                caption='As fig. 12: torques with the payloads of Table IV'),
        Picture(name='fig13', panels=(tip_panel(stiffness),),
                caption='As fig. 13: paths of the tip for other stiffness'),
        Picture(name='fig14', panels=joint_panels(stiffness, 'torques'),
                caption='As fig. 14: torques for other stiffness'))
