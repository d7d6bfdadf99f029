"""
Which logs began while the arm still moved: slow swings of a millimetre spoil a fit.

What the state at the start of a log explains is compared with what noise would have in common
with it: a score test, or that of Wald where the state was free already.

"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from flex_planner.base.progress import Monitor
from flex_planner.base.validation import Array
from flex_planner.identification.experiments import Experiment
from flex_planner.identification.fit import Fit, MOST_RMS
from flex_planner.identification.log_errors import LogErrors
from flex_planner.identification.loop_model import LoopModel
import numpy as np

# how often a log that began at rest is taken for one that did not
_RARE = 1e-4
# of the errors of a log, that the state at its start explains
_MOSTLY = 0.5
# of directions, as a share of the largest, that are more than rounding
_SPANNED = 1e-7


def find_moving_starts(model: LoopModel, experiments: Sequence[Experiment], fit: Fit,
                       monitor: Monitor | None = None) -> tuple[int, ...]:
    """
    Return which logs of a fit began while the arm still moved.

    That is so where the state at the start explains more of the errors than noise does once in ten
    thousand logs; what parameters, or the starts of other logs that are known to move, explain as
    well does not count. A model that is not the plant fits better with almost anything that is
    free: then it must be half of the errors of the log.

    Parameters
    ----------
    model : LoopModel
        Of the fit.
    experiments : sequence of Experiment
        Its logs.
    fit : Fit
        To them.
    monitor : Monitor, optional
        May stop it.

    Raises
    ------
    StoppedError
        If the monitor stopped it.

    """
    moving = [replace(one, moves=True) for one in experiments]
    problem = LogErrors(model, moving, fit.values, fit.free, monitor)
    errors, jacobian = problem.evaluate(problem.join(fit.found))
    places = [problem.columns_away(i) for i in range(len(moving))]
    found = []
    for i, place in enumerate(places):
        unused = [at for j, at in enumerate(places) if j == i or j not in fit.moving]
        basis = _basis(np.delete(jacobian, np.r_[tuple(unused)], axis=1))
        before = errors - jacobian[:, place] @ fit.found.swings[i]  # as if it had been at rest
        if _is_explained(_beside(basis, before), _basis(_beside(basis, jacobian[:, place])),
                         problem.rows(i), noise_known=not problem.is_input):
            found.append(i)
    return tuple(found)


def _is_explained(errors: Array, basis: Array, rows: slice, *, noise_known: bool) -> bool:
    """Return whether directions explain the errors of some rows, noise of which has size 1."""
    from scipy.stats import chi2

    explained, total = float(np.sum((basis.T @ errors)**2)), float(np.sum(errors[rows]**2))
    left = max(total - explained, 0.0) / errors[rows].size
    noise = max(left, 1.0) if noise_known else left
    is_plant = noise_known and left <= MOST_RMS**2
    return explained > noise * chi2.isf(_RARE, basis.shape[1]) and (
        is_plant or explained > _MOSTLY * total)


def _beside(basis: Array, columns: Array) -> Array:
    """Return what of some columns an orthonormal basis does not span."""
    beside: Array = columns - basis @ (basis.T @ columns)
    return beside


def _basis(columns: Array) -> Array:
    """Return an orthonormal basis of what columns of any size span, but for rounding."""
    scale = np.linalg.norm(columns, axis=0)
    left, sizes, _ = np.linalg.svd(columns / np.where(scale > 0, scale, 1.0), full_matrices=False)
    basis: Array = left[:, sizes > _SPANNED * sizes.max(initial=0.0)]
    return basis
