"""The plots of a report, as data for plots.js."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from flex_planner.arms.joint_units import label_joints, position_scales
from flex_planner.base.colours import (
    ASIDE,
    CARRIED,
    CARRIED_OUT,
    coordinate_colour,
    FLEXIBLE,
    hides_another,
    PLANNED,
    REFUSED,
)
from flex_planner.base.validation import Array
from flex_planner.optimal_control.torque_limits import TorqueLimits
from flex_planner.reports.recording.contents import RecordedMotion, RecordedRequest
from flex_planner.reports.recording.findings import MotionCheck
from flex_planner.reports.recording.frequencies import NaturalFrequencies
from flex_planner.reports.recording.limit_plots import add_limits
from flex_planner.reports.recording.plot_data import Bands, Plot, Series
from flex_planner.reports.recording.spectra import spectrum
import numpy as np
from numpy.typing import NDArray

_TIME = 'time [s]'
_MILLI, _TINY = 1e3, 1e-300
# of a path in space: what it is seen from, and the coordinates that are seen
TIP_SIDES = (('from above', 0, 1), ('from the front', 0, 2), ('from the right', 1, 2))


def plots(request: RecordedRequest, check: MotionCheck | None = None,
          frequencies: NaturalFrequencies | None = None) -> list[Plot]:
    """Return the plots of a report; those of the motion only where there is one."""
    found = [] if request.motion is None else add_limits(request, request.motion, _motion_plots(
        request, request.motion, check, _bands(frequencies)))
    return [*found, *([] if request.search is None else _search_plots(request.search))]


def _motion_plots(request: RecordedRequest, motion: RecordedMotion, check: MotionCheck | None,
                  bands: Bands | None) -> list[Plot]:
    arm, n = request.arm, request.arm.n_joints
    joints, modes, t = request.joint_names, arm.passive_names, motion.times
    found = [
        _torques(request, motion),
        _over_time('positions', 'Joint angles', label_joints(arm, 'angle [deg]', 'way [mm]'), t,
                   position_scales(arm) * motion.coordinates[:, :n], joints, least=0.1),
        _over_time('speeds', 'Joint speeds', label_joints(arm, 'speed [rad/s]', '[m/s]'), t,
                   motion.rates[:, :n], joints, least=1e-3),
        *_tips(motion, check)]
    if arm.n_passive:
        moving = motion.moving
        bends, rates = motion.coordinates[:, n:] * _MILLI, motion.rates[:, n:] * _MILLI
        twists, milli, rate = (' and twists', ', mrad', ', mrad/s') if arm.elastic_joints else (
            '', '', '')
        found += [
            _over_time('modes', f'Modal displacements{twists}', f'displacement [mm{milli}]', t,
                       bends, modes, first=n, least=1e-2),
            _over_time('modal_rates', f'Modal rates{twists}', f'rate [mm/s{rate}]', t, rates,
                       modes, first=n, least=1e-1),
            _spectrum('modes_spectrum', 'Spectrum of the modal displacements',
                      f'amplitude [mm{milli}]', t[moving], bends[moving], modes, bands, first=n),
            _spectrum('modal_rates_spectrum', 'Spectrum of the modal rates',
                      f'amplitude [mm/s{rate}]', t[moving], rates[moving], modes, bands,
                      first=n)]
    names = [*joints, *modes]
    return [
        *found,
        _over_time('position_costates', 'Costates ψ₁ of the positions',
                   'N²m²s/rad, N²m s', t, motion.position_costates, names),
        _over_time('velocity_costates', 'Costates ψ₂ of the rates',
                   'N²m²s²/rad, N²m s²', t, motion.velocity_costates, names)]


def _torques(request: RecordedRequest, motion: RecordedMotion) -> Plot:
    """Return the torques between their bounds, eq. (15)."""
    n = request.arm.n_joints
    plot = _over_time('torques', 'Torques between their bounds',
                      label_joints(request.arm, 'torque [N m]', 'force [N]'), motion.times,
                      motion.torques, request.joint_names, least=1e-3)
    for name, values in zip(('lowest', 'highest'),
                            TorqueLimits.of(request.arm).bounds(motion.rates[:, :n]), strict=True):
        plot.series.extend(
            Series(name=f'{joint} {name}', x=motion.times, y=values[:, i], dashed=True, bound=True,
                   colour=coordinate_colour(i))
            for i, joint in enumerate(request.joint_names) if np.isfinite(values[:, i]).any())
    return plot


def _over_time(key: str, title: str, unit: str, times: Array, values: Array,
               names: Sequence[str], *, first: int = 0, least: float = 0.0) -> Plot:
    """Return columns over time, of coordinates from the first one on."""
    return Plot(key=key, title=title, x_label=_TIME, y_label=unit, group='time', least=least,
                series=_columns(times, values, names, first))


def _columns(x: Array, values: Array, names: Sequence[str], first: int, *,
             log: bool = False) -> list[Series]:
    """Return columns as lines, dashed where one lies upon another, each in its colour."""
    heights = np.log10(np.maximum(values, _TINY)) if log else values
    return [Series(name=name, x=x, y=values[:, i], colour=coordinate_colour(first + i),
                   dashed=hides_another(heights, i)) for i, name in enumerate(names)]


def _bands(frequencies: NaturalFrequencies | None) -> Bands | None:
    """Return the frequencies at which spectra peak: under given torques the joints are free."""
    if frequencies is None:
        return None
    ranges = frequencies.free.tolist()
    return Bands(name='natural frequencies, joints free, over the postures of the motion',
                 labels=[f'f{k}' for k in range(1, len(ranges) + 1)], ranges=ranges)


def _spectrum(key: str, title: str, unit: str, times: Array, values: Array,
              names: Sequence[str], bands: Bands | None, *, first: int) -> Plot:
    """Return the spectra of columns."""
    frequencies, amplitudes = spectrum(times, values)
    return Plot(key=key, title=title, x_label='frequency [Hz]', y_label=unit, log=True,
                group='frequency', bands=bands,
                series=_columns(frequencies, amplitudes, names, first, log=True))


def _tips(motion: RecordedMotion, check: MotionCheck | None) -> list[Plot]:
    """Return the path of the tip as planned and as re-simulated, in space from three sides."""
    if motion.tip.shape[1] == 2:
        return [_tip('tip', 'Path of the tip', motion, check, (0, 1))]
    return [_tip(f'tip_{"xyz"[i]}{"xyz"[j]}', f'Path of the tip, {side}', motion, check, (i, j))
            for side, i, j in TIP_SIDES]


def _tip(key: str, title: str, motion: RecordedMotion, check: MotionCheck | None,
         sides: tuple[int, int]) -> Plot:
    """Return the path of the tip in two of its coordinates."""
    x, y = motion.tip[:, sides].T
    series = [Series(name='planned', x=x, y=y, colour=PLANNED)]
    if check is not None:
        done = check.tip[:, sides].T
        series.append(Series(name='re-simulated', x=done[0], y=done[1], colour=CARRIED_OUT,
                             dashed=True))
    series += [Series(name=name, x=x[k:k + 1], y=y[k:k + 1], colour=colour, dots=True)
               for name, k, colour in (('start', 0, ASIDE), ('goal', len(x) - 1, CARRIED))]
    first, second = ('xyz'[i] for i in sides)
    return Plot(key=key, title=title, x_label=f'{first} [m]', y_label=f'{second} [m]', equal=True,
                series=series)


def _search_plots(search: Any) -> list[Plot]:
    """Return the front of a direct search, or the trials of an incremental one."""
    found = []
    if len(search.front_payloads):
        payloads = np.asarray(search.front_payloads)
        for key, title, unit, values in (
                ('front', 'Least effort for each payload', 'J [N²m²s]', search.front_efforts),
                ('prices', 'Price of a payload', 'dJ/dm [N²m²s/kg]', search.front_prices)):
            line = Series(name=unit, x=payloads, y=np.asarray(values), colour=FLEXIBLE)
            dots = Series(name='solved', x=payloads, y=np.asarray(values), colour=FLEXIBLE,
                          dots=True)
            found.append(Plot(key=key, title=title, x_label='payload [kg]', y_label=unit,
                              series=[line, dots], group='payload'))
    if len(search.tried_payloads):
        found.append(_trials(np.asarray(search.tried_payloads, dtype=float),
                             np.asarray(search.tried_solved, dtype=bool)))
    return found


def _trials(payloads: Array, carried: NDArray[np.bool_]) -> Plot:
    """Return the payloads in the order they were tried."""
    numbers: Array = np.arange(1, payloads.size + 1).astype(np.float64)
    return Plot(key='trials', title='Payloads tried', x_label='trial', y_label='payload [kg]',
                series=[Series(name='tried', x=numbers, y=payloads, colour=ASIDE,
                        dashed=True)] + [
                    Series(name=name, x=numbers[chosen], y=payloads[chosen], colour=colour,
                           dots=True)
                    for name, chosen, colour in (
                        ('carried', carried, CARRIED),
                        ('not carried', ~carried, REFUSED)) if chosen.any()])
