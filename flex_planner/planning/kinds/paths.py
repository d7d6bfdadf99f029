"""Joint paths that an exploration starts from: straight to the goal, and with detours."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

from flex_planner.base.validation import Array
from flex_planner.collocation import CollocationSolution
import numpy as np

# amplitude of detours [rad]; of the first joint, where gravity can help to swing
_DETOUR, _SWING = 1.2, 3.0
# angles of the last joints at half time: stretched, and folded to either side [rad]
_STRETCHED, _FOLDED = 0.0, 2.5
# standard deviations of random detours, in turn [rad], their sine terms, and the seed
_RANDOM, _TERMS, _SEED = (0.7, 1.5, 2.5, 3.5), 3, 4242


@dataclass(frozen=True, slots=True, eq=False)
class JointPath:
    """
    A quintic from rest to rest with sine detours that are zero at both ends.

    Attributes
    ----------
    start, goal : numpy.ndarray, shape (n,)
        [rad].
    detours : numpy.ndarray, shape (k, n)
        Amplitudes of sin(j pi t / T), j = 1 to k [rad].

    """

    start: Array
    goal: Array
    detours: Array

    def __call__(self, share: Array, duration: float) -> tuple[Array, Array, Array]:
        """Return angles, speeds and accelerations, (k, n) each, at shares (k,) of a duration."""
        s, stroke = share[:, None], self.goal - self.start
        q = self.start + (10 * s**3 - 15 * s**4 + 6 * s**5) * stroke
        v = (30 * s**2 - 60 * s**3 + 30 * s**4) * stroke
        a = (60 * s - 180 * s**2 + 120 * s**3) * stroke
        for j, amplitude in enumerate(self.detours, 1):
            w = j * np.pi
            q = q + np.sin(w * s) * amplitude
            v = v + w * np.cos(w * s) * amplitude
            a = a - w**2 * np.sin(w * s) * amplitude
        return q, v / duration, a / duration**2


@dataclass(frozen=True, slots=True, eq=False)
class DetourFrom:
    """
    A motion that is known, with sine detours that are zero at both ends.

    Attributes
    ----------
    motion : CollocationSolution
        z = (q, q', ...).
    detours : numpy.ndarray, shape (k, n)
        As those of a `JointPath`.

    """

    motion: CollocationSolution
    detours: Array

    def __call__(self, share: Array, duration: float) -> tuple[Array, Array, Array]:
        """Return angles, speeds and accelerations, (k, n) each, at shares (k,) of a duration."""
        n, own = self.detours.shape[1], self.motion.mesh[-1]
        z, rate = self.motion(share * own), self.motion.rate(share * own)
        rest = np.zeros(n)
        q, v, a = JointPath(rest, rest, self.detours)(share, duration)
        faster = own / duration
        return (z[:, :n] + q, z[:, n:2 * n] * faster + v,
                rate[:, n:2 * n] * faster**2 + a)


AnyPath = JointPath | DetourFrom


def fixed_paths(start: Array, goal: Array, *, gravity: bool) -> Iterator[JointPath]:
    """
    Yield the paths that most often lead to the best motion, the best first.

    Parameters
    ----------
    start, goal : numpy.ndarray, shape (n,)
        [rad].
    gravity : bool
        Whether gravity acts: swinging the first joint far may then help.

    """
    ahead = np.where(goal >= start, 1.0, -1.0)
    middle = (start + goal) / 2

    def bow(*amplitudes: float) -> Array:
        shaped: Array = np.array([amplitudes]) * ahead
        return shaped

    def wave(*amplitudes: float) -> Array:
        return np.vstack([np.zeros(start.size), np.array(amplitudes) * ahead])

    def via(*angles: float) -> Array:
        return np.append(0.0, np.array(angles) - middle[1:])[None]

    detours = _MANY if start.size > 3 else (_ONE, _TWO, _THREE)[start.size - 1]
    kinds = {'bow': bow, 'wave': wave, 'via': via}
    yield JointPath(start, goal, np.zeros((0, start.size)))
    for name, amplitudes in detours:
        full = (*amplitudes, *(0.0,) * (start.size - len(amplitudes))) if name != 'via' else (
            *amplitudes, *(0.0,) * (start.size - 1 - len(amplitudes)))
        yield JointPath(start, goal, kinds[name](*full))
    if gravity:
        rest = (0.0,) * (start.size - 1)
        if rest:  # a single joint has swung so far already
            yield JointPath(start, goal, bow(_SWING, *rest))
        yield JointPath(start, goal, wave(-_SWING, *rest))


def random_paths(start: Array, goal: Array, seed: int = _SEED) -> Iterator[JointPath]:
    """Yield straight paths with random detours without end, the same for each task."""
    return (JointPath(start, goal, detours) for detours in random_detours(start.size, seed))


def random_detours(n: int, seed: int = _SEED) -> Iterator[Array]:
    """Yield random detours (k, n) without end."""
    generator = np.random.default_rng(seed)
    falling = 1 / np.arange(1, _TERMS + 1)[:, None]
    while True:
        for deviation in _RANDOM:
            yield deviation * falling * generator.normal(size=(_TERMS, n))


# in units of the joint's own stroke: + beyond it, - back; see `fixed_paths`
_D, _F, _S = _DETOUR, _FOLDED, _STRETCHED
_ONE = (('bow', (_SWING,)), ('bow', (-_SWING,)))
_TWO = (('bow', (0, _D)), ('via', (_S,)), ('via', (_F,)), ('via', (-_F,)), ('wave', (-_D, _D)),
        ('bow', (-_D, 0)), ('bow', (-_D, _D)))
_THREE = (('bow', (0, -_D, 0)), ('via', (_F, 0)), ('bow', (-_D, -_D, _D)), ('via', (-_F, 0)),
          ('bow', (_D, _D, -_D)), ('bow', (0, 0, _D)), ('wave', (0, _D, 0)))
_MANY = (('bow', (0, _D)), ('bow', (0, -_D)), ('via', (_F, -_F)), ('via', (-_F, _F)),
         ('bow', (_D, 0)), ('bow', (-_D, 0)), ('wave', (0, _D)))
