"""Section 5.5, figs. 17 to 20: the same turn with little vibration."""

from __future__ import annotations

from flex_planner.base.colours import ASIDE, COORDINATES
from flex_planner.base.validation import Array
from flex_planner.dynamics.statics import natural_modes
from flex_planner.optimal_control.arm_model import ArmModel
from flex_planner.optimal_control.parameters import Parameters
from flex_planner.paper.cases import plan_certified, turn, turning_arm, VIBRATION_WEIGHT
from flex_planner.paper.checks import format_value, solve_by_ipopt
from flex_planner.paper.diagrams import joint_panels, modal_panels, tip_panel
from flex_planner.paper.evidence import Claim, judge, Section, Table
from flex_planner.planning.plan import peaks, Plan, Samples
from flex_planner.plotting.diagrams import Curve, Panel, Picture
import numpy as np
from scipy.signal import butter, sosfiltfilt

_FFT = 500  # points
_ENDS = 1 / 8  # of the time
_HIGHEST = 60.0  # [Hz]
_MODES = ('link 1', 'link 2')
_HEAVY = 5e4
_CONSIDERABLE = 0.25
_RINGING = 10.0  # [Hz] and above: the slowest bending mode has 15


def study(*, reduced: bool = False) -> Section:
    """Return the evidence on section 5.5."""
    arm = turning_arm(limited=False)
    weights = (0.0, VIBRATION_WEIGHT) if reduced else (0.0, VIBRATION_WEIGHT, _HEAVY)
    plans = {weight: plan_certified(turn(arm, weight)) for weight in weights}
    samples = {weight: plan.uniform_samples(_FFT + 1) for weight, plan in plans.items()}
    checks = {weight: solve_by_ipopt(plans[weight], 80) for weight in weights[:2]}
    shaken = {weight: _rms(one) for weight, one in samples.items()}
    values = {f'vibration_cost_{weight:g}': plan.cost for weight, plan in plans.items()}
    values |= {f'vibration_rms_{weight:g}_link_{j + 1}': float(shaken[weight][j])
               for weight in weights for j in range(2)}
    independent = {weight: format_value(check, check.cost) for weight, check in checks.items()}
    named = {'minimum effort': samples[0.0],
             f'minimum vibration, w = {VIBRATION_WEIGHT:g}': samples[VIBRATION_WEIGHT]}
    return Section(
        key='5.5', title='Minimum vibration',
        text='The turn of section 5.4 (first reading of the inertias) with unlimited motors: '
        'R = 1, then W_2 = diag(0, 0, 500, 500) as well, which puts a price on the rates of the '
        'two modes. The spectra are those of 500 points, as in the paper.',
        tables=(_table(plans, samples, shaken, independent),),
        claims=_claims(plans, samples, shaken), pictures=_pictures(named, plans[0.0]),
        values=values)


def _rms(samples: Samples) -> Array:
    """Return the root mean square of the modal rates [m/s]."""
    rms: Array = np.sqrt((samples.rates[:, 2:]**2).mean(axis=0))
    return rms


def _pair(values: Array, digits: str = '.3g') -> str:
    return ', '.join(format(float(value), digits) for value in values)


def _largest_bending(samples: Samples) -> Array:
    """Return the largest modal displacements [mm]."""
    most: Array = np.abs(samples.coordinates[:, 2:]).max(axis=0) * 1e3
    return most


def _table(plans: dict[float, Plan], samples: dict[float, Samples], shaken: dict[float, Array],
           independent: dict[float, str]) -> Table:
    rows = tuple(
        (f'{weight:g}', f'{plan.cost:.6g}', independent.get(weight, ''), f'{plan.effort:.6g}',
         _pair(peaks(plan, samples[weight]).torques), _pair(_largest_bending(samples[weight])),
         _pair(shaken[weight] * 1e3)) for weight, plan in plans.items())
    return Table(title='Effort against vibration', rows=rows, header=(
        'weight of the modal rates', 'J', 'J, IPOPT', 'effort [N^2 m^2 s]',
        'peak torques 1, 2 [N m]', 'largest bending of links 1, 2 [mm]',
        'rms of the modal rates [mm/s]'))


def _claims(plans: dict[float, Plan], samples: dict[float, Samples],
            shaken: dict[float, Array]) -> tuple[Claim, ...]:
    least, calm = samples[0.0], samples[VIBRATION_WEIGHT]
    fall = 1 - shaken[VIBRATION_WEIGHT] / shaken[0.0]
    bent = 1 - _largest_bending(calm) / _largest_bending(least)
    power = 1 - _ringing_power(calm) / _ringing_power(least)
    effort = plans[VIBRATION_WEIGHT].effort / plans[0.0].effort - 1
    torque = (peaks(plans[VIBRATION_WEIGHT], calm).torques
              / peaks(plans[0.0], least).torques - 1)
    fast = [_fast_acceleration(one) for one in (least, calm)]
    place = np.linspace(0, 1, len(fast[0]))
    inner = (place > _ENDS) & (place < 1 - _ENDS)
    return (
        Claim(said='With a price on the modal rates the oscillation is considerably smaller.',
              found=f'The rms of the modal rates falls by {_pair(fall, ".0%")} (links 1, 2), the '
              f'power of the ringing above 10 Hz by {_pair(power, ".0%")}.',
              verdict=judge(fall.min() > _CONSIDERABLE)),
        Claim(said='The amplitudes of the modes are much smaller.',
              found=f'The largest bending falls by {_pair(bent, ".0%")} only: it is that of '
              'accelerating the arm, which every motion of 2 s needs. It is what rings on top of '
              'it that becomes small.', verdict=judge(bent.min() > _CONSIDERABLE)),
        Claim(said='The torques are larger: a smoother motion takes more effort.',
              found=f'The integral of the squared torques grows by {effort:.2%}; peak torques '
              f'change by {_pair(torque, "+.1%")}. It takes more effort, but hardly any.',
              verdict=judge(effort > 0 and torque.max() > 0)),
        Claim(said='The path of the tip is smoother.',
              found="The rms of the tip's acceleration above 10 Hz falls from "
              f'{_rms_of(fast[0]):.3g} to {_rms_of(fast[1]):.3g} m/s^2: in the middle three '
              f'quarters of the time from {_rms_of(fast[0][inner]):.3g} to '
              f'{_rms_of(fast[1][inner]):.3g}, at the ends from {_rms_of(fast[0][~inner]):.3g} to '
              f'{_rms_of(fast[1][~inner]):.3g}.',
              verdict=judge(_rms_of(fast[1]) < _rms_of(fast[0]))))


def _power(samples: Samples, values: Array) -> tuple[Array, Array]:
    """Return frequencies [Hz] and the power spectrum of 500 points."""
    step = samples.times[1] - samples.times[0]
    kept = values[:_FFT] - values[:_FFT].mean(axis=0)
    power: Array = np.abs(np.fft.rfft(kept, _FFT, axis=0))**2 / _FFT
    return np.fft.rfftfreq(_FFT, step).astype(np.float64), power


def _ringing_power(samples: Samples) -> Array:
    """Return the power of the modal rates above 10 Hz."""
    frequencies, power = _power(samples, samples.rates[:, 2:])
    total: Array = power[frequencies > _RINGING].sum(axis=0)
    return total


def _acceleration(samples: Samples) -> Array:
    """Return the tip's acceleration [m/s^2]."""
    step = samples.times[1] - samples.times[0]
    acceleration: Array = np.gradient(np.gradient(samples.tip, step, axis=0), step, axis=0)
    return acceleration


def _acceleration_panel(cases: dict[str, Samples]) -> Panel:
    curves = [Curve(x=samples.times[2:-2], label=label, color=COORDINATES[k],
                    y=np.linalg.norm(_fast_acceleration(samples), axis=1))
              for k, (label, samples) in enumerate(cases.items())]
    return Panel(title='acceleration of the tip above 10 Hz', x_label='time [s]',
                 y_label='acceleration [m/s^2]', curves=tuple(curves))


def _fast_acceleration(samples: Samples) -> Array:
    """Return the tip's acceleration above 10 Hz, without two points at either end [m/s^2]."""
    # in time: a window that hides what does not fit together at the ends would hide their ringing
    rate = 1 / (samples.times[1] - samples.times[0])
    fast = butter(4, _RINGING, 'highpass', fs=rate, output='sos')
    ringing: Array = sosfiltfilt(fast, _acceleration(samples)[2:-2], axis=0)
    return ringing


def _rms_of(vectors: Array) -> float:
    """Return the root mean square length of vectors (k, 2)."""
    return float(np.sqrt((vectors**2).sum(axis=1).mean()))


def _pictures(cases: dict[str, Samples], plan: Plan) -> tuple[Picture, ...]:
    return (
        Picture(name='fig17', panels=(*joint_panels(cases, 'speeds'),
                                      *joint_panels(cases, 'torques')),
                caption='As fig. 17: velocities and torques; the motors have no limits here'),
        Picture(name='fig18', panels=modal_panels(cases, _MODES),
                caption='As fig. 18: modal displacements and their rates'),
        Picture(name='fig19', panels=_spectra(cases, plan),
                caption='As fig. 19: power spectra of the modal displacements and their rates; '
                'grey: natural frequencies of the arm with free joints, half way'),
        Picture(name='fig20', panels=(tip_panel(cases), _acceleration_panel(cases)),
                caption='As fig. 20: path of the tip; and its acceleration above 10 Hz, which '
                'shows the difference'))


def _spectra(cases: dict[str, Samples], plan: Plan) -> tuple[Panel, ...]:
    lines = _frequencies(plan)
    panels = []
    for kind in ('displacement', 'rate'):
        for j, name in enumerate(_MODES):
            curves, low, high = [], np.inf, 0.0
            for k, (label, samples) in enumerate(cases.items()):
                values = samples.coordinates if kind == 'displacement' else samples.rates
                frequencies, power = _power(samples, values[:, 2:] * 1e3)
                seen = (frequencies > 0) & (frequencies <= _HIGHEST)
                shown_power = power[seen, j]
                low, high = min(low, shown_power.min()), max(high, shown_power.max())
                curves.append(Curve(x=frequencies[seen], y=shown_power, label=label,
                                    color=COORDINATES[k]))
            curves += [Curve(x=np.full(2, line), y=np.array([low, high]), color=ASIDE, style=':',
                             label='' if k else 'natural frequencies')
                       for k, line in enumerate(lines)]
            unit = 'mm^2' if kind == 'displacement' else '(mm/s)^2'
            panels.append(Panel(title=f'{kind} of the mode of {name}', x_label='frequency [Hz]',
                                y_label=f'|FFT|^2 / {_FFT} [{unit}]', curves=tuple(curves),
                                log=True))
    return tuple(panels)


def _frequencies(plan: Plan) -> Array:
    """Return the natural frequencies half way, joints free [Hz]."""
    model = ArmModel(plan.arm)
    rest = np.zeros(model.arm.n_coordinates)
    rest[:2] = (plan.task.start_positions + plan.task.goal_positions) / 2
    found, _ = natural_modes(model, rest, Parameters.of(model.arm), locked=False)
    frequencies: Array = found[found > 0] / (2 * np.pi)
    return frequencies
