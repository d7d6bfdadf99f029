"""What it costs to forgive errors of the model."""

from __future__ import annotations

from flex_planner.base.colours import ASIDE, CARRIED, FLEXIBLE
from flex_planner.planning.robust.effort_front import EffortFront
from flex_planner.plotting.figures import finish, Picture
from matplotlib.axes import Axes


def draw_effort_front(front: EffortFront, limit: float | None = None, title: str = '') -> Picture:
    """
    Draw the worst residual vibration against the growth of the cost.

    Parameters
    ----------
    front : EffortFront
        Of motions with the energy of differing arms weighed more and more.
    limit : float, optional
        Residual that is asked for [m].
    title : str
        Above the diagram.

    Returns
    -------
    Picture
        A Matplotlib figure.

    """
    figure = Picture(7.0, 4.75)
    axes = figure.subplots()
    draw_front(axes, front)
    if limit is not None:
        axes.axhline(1e3 * limit, color=CARRIED, linestyle='--', label='asked for')
    finish(axes, title or 'Forgiving motions', 'residual bending [mm]',
           'more cost than the motion of least cost [%]')
    return figure


def draw_front(axes: Axes, front: EffortFront) -> None:
    """Draw the curves of `draw_effort_front` in axes, without labels."""
    growth = 100 * front.growth
    axes.plot(growth, 1e3 * front.residuals, color=FLEXIBLE, marker='o', linewidth=1.5,
              label='worst of the arms that differ')
    axes.plot(growth, 1e3 * front.nominal, color=ASIDE, marker='.', linewidth=1.0,
              label='the arm of the model')
    axes.set_ylim(bottom=0)
    for i, weight in enumerate(front.weights):
        axes.annotate(f'{weight:.2g}', (growth[i], 1e3 * front.residuals[i]), fontsize='x-small',
                      xytext=(4, 5), textcoords='offset points', color=ASIDE)
