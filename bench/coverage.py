"""
How often the intervals of an identification hold the truth: ``python -m bench.coverage``.

Logs of simulated arms, by another integrator, with another noise of the encoders each time.

"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, replace
import sys

from bench.recorded_motions import LSB, record_motion
from flex_planner.arms.arm import Arm
from flex_planner.arms.arm_files import load_arm
from flex_planner.base.validation import Array
from flex_planner.control.joint_controller import Gains
from flex_planner.control.joint_reference import JointReference
from flex_planner.identification.drive import Drive
from flex_planner.identification.identification import Identification
from flex_planner.identification.identify import identify
from flex_planner.identification.plant_parameters import arm_with, list_parameters
from flex_planner.optimal_control.task import Task
from flex_planner.planning.plan_path import plan_path
from flex_planner.planning.sampling import sample_plan, SamplingSettings
from flex_planner.reports.motion import columns
import numpy as np

SEEDS = 20
_NORMAL_95 = 1.96


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Case:
    """
    An arm whose numbers are known, its motions, and how they are recorded.

    Attributes
    ----------
    arm : Arm
        As it is assumed.
    truth : numpy.ndarray, shape (2 + 6 n,)
        As `list_parameters` has them.
    drive : Drive
        That follows the motions.
    motions : tuple of JointReference
        One for each log.
    every : int
        Which periods of the drive are recorded.
    away : numpy.ndarray, shape (2 n_t - n,), optional
        How the arm differs from rest when it is recorded first.

    """

    arm: Arm
    truth: Array
    drive: Drive
    motions: tuple[JointReference, ...]
    every: int = 10
    away: Array | None = None

    def identify(self, seed: int) -> Identification:
        """Return what logs with a noise of their own lead to."""
        n = self.arm.n_joints
        logs = [record_motion(
            arm_with(self.arm, self.truth), float(self.truth[0]), self.drive, motion,
            float(motion.times[-1]) + 1.0, offset=self.truth[-1 - n:-1],
            delay=float(self.truth[-1]), every=self.every, away=self.away,
            seed=len(self.motions) * seed + i) for i, motion in enumerate(self.motions)]
        return identify(self.arm, logs, payload_mass=float(self.truth[0]),
                        drive=replace(self.drive, resolution=LSB), more_modes=0)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Coverage:
    """
    Errors beside the intervals that were stated, of every seed and parameter.

    Attributes
    ----------
    names : tuple of str
        Of the parameters that were found.
    errors, half_widths : numpy.ndarray, shape (seeds, len(names))
        Values less the truth, and half of the intervals of 95 %; NaN where one was withheld.

    """

    names: tuple[str, ...]
    errors: Array
    half_widths: Array

    @property
    def share(self) -> float:
        """Return which share of all intervals holds the truth; one that is withheld does not."""
        return float(np.mean(np.abs(self.errors) <= np.nan_to_num(self.half_widths)))

    @property
    def shares(self) -> Array:
        """Return the same of each parameter, shape (len(names),)."""
        held: Array = (np.abs(self.errors) <= np.nan_to_num(self.half_widths)).mean(axis=0)
        return held

    @property
    def deviations(self) -> Array:
        """Return the errors over the deviations that intervals claim, root mean square."""
        found: Array = np.sqrt(np.nanmean((_NORMAL_95 * self.errors / self.half_widths)**2,
                                          axis=0))
        return found


def find_coverage(case: Case, seeds: Iterable[int]) -> Coverage:
    """Return errors and intervals of a case."""
    truth = dict(zip((one.name for one in list_parameters(case.arm.n_joints)), case.truth,
                     strict=True))
    found = [[one for one in case.identify(seed).estimates if one.verdict.value != 'fixed']
             for seed in seeds]
    return Coverage(
        names=tuple(one.parameter.name for one in found[0]),
        errors=np.array([[one.value - truth[one.parameter.name] for one in row] for row in found]),
        half_widths=np.array([[one.half_width for one in row] for row in found]))


def single_link(every: int, away: Sequence[float] = ()) -> Case:
    """Return a light link with one mode, whose joint swings there and back."""
    arm = load_arm('single_link')
    arm = replace(arm, links=tuple(link.with_modes(1) for link in arm.links))
    return Case(arm=arm, truth=np.array([0.11, 0.9, 0.01, 0.02, 0.01, 0.012, 0.0, 1.4e-3]),
                drive=Drive(gains=Gains.of(1, 4.0, 0.3), speed_filter=50.0),
                motions=(_swing(1.2), _swing(-0.8)), every=every,
                away=np.array(away) if away else None)


def _swing(size: float, seconds: float = 0.5) -> JointReference:
    """Return a motion of a polynomial of fifth order, with the torque of a stiff arm."""
    times: Array = np.linspace(0, seconds, 101, dtype=np.float64)
    s = times / seconds
    angle = np.polynomial.Polynomial([0, 0, 0, 10, -15, 6])
    position, speed, acceleration = (np.asarray(
        size / seconds**k * angle.deriv(k)(s)[:, None], dtype=np.float64) for k in range(3))
    return JointReference(times=times, positions=position, velocities=speed,
                          accelerations=acceleration, torques=0.14 * acceleration)


def two_links(every: int) -> Case:
    """Return the arm of docs/identification.md with its two plans."""
    arm, motions = load_arm('clamped_motors'), []
    for start, goal in (((0.5, 0), (0.5, 0.5)), ((0.5, 0.5), (0.5, 0))):
        task = Task.between_points(arm, start, goal, elbow=-1, duration=1.0, payload_mass=1.0,
                                   effort_weights=[0.125, 0.125])
        motions.append(sample_plan(plan_path(task), SamplingSettings()).reference)
    truth = [1.1, 45, 54, 0.01, 0.015, 0.3, 0.2, 0.08, 0.05, 0.03, 0.02, 0, 0.012, 1.4e-3]
    return Case(arm=arm, truth=np.array(truth),
                drive=Drive(gains=Gains.of(2, 40.0, 4.0), speed_filter=50.0),
                motions=tuple(motions), every=every)


CASES: dict[str, Callable[[], Case]] = {
    'one link, 100 Hz': lambda: single_link(10),
    'one link, 1 kHz': lambda: single_link(1),
    'one link, 100 Hz, swinging at the start': lambda: single_link(10, (5e-4, 0.05, 0.0)),
    'two links, 100 Hz': lambda: two_links(10),
    'two links, 1 kHz': lambda: two_links(1)}


def main() -> None:
    """Print the coverage of cases, all or those whose names begin with an argument."""
    wanted = tuple(sys.argv[1:]) or ('',)
    for name, make in CASES.items():
        if not name.startswith(wanted):
            continue
        found = find_coverage(make(), range(SEEDS))
        rows = [[one, f'{100 * share:.0f} %', f'{deviation:.2f}'] for one, share, deviation in zip(
            found.names, found.shares, found.deviations, strict=True)]
        header = (name, 'held', 'errors over their stated deviation')
        print(columns(header, [*rows, ['all', f'{100 * found.share:.1f} %', '']]), flush=True)


if __name__ == '__main__':
    main()
