"""The benefit of planning with flexible links, as a table of text."""

from __future__ import annotations

from flex_planner.arms.link import Link
from flex_planner.arms.spatial_link import SpatialLink
from flex_planner.base.sentences import say_reason
from flex_planner.planning.plan import Plan
from flex_planner.reports.motion import columns, planning_row, Row, warning_rows
from flex_planner.simulation.comparison import Comparison
from flex_planner.simulation.execution import ExecutionResult

_MILLI = 1e3


def comparison_rows(comparison: Comparison) -> list[Row]:
    """Return both plans, the warnings of the flexible one, the simulated arm and the goal."""
    simulated = comparison.arm
    rigidity = ', '.join(_say_rigidity(link) for link in simulated.links)
    goal = ', '.join(f'{value:.6g}' for value in comparison.goal)
    return [
        ('planned flexible', _planning(comparison.flexible)),
        *warning_rows(comparison.flexible.warnings),
        ('planned rigid', _planning(comparison.rigid)),
        ('simulated arm', f'E I = {rigidity} N m^2, {simulated.n_modes} modes, '
                          f'{comparison.payload_mass:g} kg'),
        ('goal of the tip', f'({goal}) m'),
        ('watched after arrival', f'{comparison.settling:g} s')]


def _say_rigidity(link: Link | SpatialLink) -> str:
    """Return E I; of finite elements there is none."""
    elements = isinstance(link, SpatialLink) and link.elements is not None
    return '(finite elements)' if elements else f'{link.flexural_rigidity:g}'


def comparison_table(comparison: Comparison) -> str:
    """
    Return one line per mode of execution, as text; empty if no plan was solved.

    Errors are distances of the tip from the goal, on arrival and when it has settled. The tip's
    motion after the arrival is peak to peak; bending is the largest deflection of the links if
    the joints were locked on arrival. Tracking is the largest error of a joint before it.

    """
    if not comparison.results:
        return ''
    return columns(
        ['', 'error on arrival [mm]', 'settled [mm]', 'tip motion after [mm]',
         'bending left [mm]', 'tracking [mrad]'],
        [_cells(result) for result in comparison.results])


def _planning(plan: Plan) -> str:
    """Return time and strategy of planning, or the reason of its failure."""
    if plan.solved:
        return planning_row(plan.planning_time, plan.strategy,
                            f'{plan.iterations} iterations')[1]
    return say_reason(plan.status.value, plan.message)


def _cells(result: ExecutionResult) -> list[str]:
    values = (result.arrival_error, result.final_error, result.residual.tip, result.bending,
              result.tracking_error)
    return [result.mode.value, *(f'{value * _MILLI:.3g}' for value in values)]
