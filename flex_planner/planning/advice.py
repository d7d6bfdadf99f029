"""What may help where no motion was found."""

from __future__ import annotations

from flex_planner.arms.arm import Arm
from flex_planner.base.errors import FlexPlannerError
from flex_planner.base.sentences import join_words
from flex_planner.collocation import Solver
from flex_planner.dynamics.statics import natural_modes
from flex_planner.optimal_control.motion_problem import MotionProblem
from flex_planner.planning.strategies.friction_homotopy import find_easier_speed
from flex_planner.planning.warnings import find_arm_warnings, WarningKind
import numpy as np

# a motion of fewer periods of the lowest vibration is short
_SHORT = 2.0


def suggest_changes(problem: MotionProblem, solver: Solver | None = None) -> str:
    """
    Return a sentence about what makes a motion easier to find.

    Parameters
    ----------
    problem : MotionProblem
        Of the motion that was not found.
    solver : Solver, optional
        Tries, if it is given, whether softer friction leads to a motion; its monitor may stop it.

    """
    easier = None if solver is None else find_easier_speed(problem, solver)
    friction = [] if easier is None else [
        f'a larger coulomb_speed (with {easier:.2g} times as much there is a motion)']
    return f'what may help: {join_words([*friction, *_changes(problem)], "or")}'


def _changes(problem: MotionProblem) -> list[str]:
    """Return the changes, those that help most first."""
    arm, task = problem.task.arm, problem.task
    found = []
    if any(one.kind is WarningKind.JOINT_WITHOUT_INERTIA for one in find_arm_warnings(arm)):
        found.append('rotor_inertia and gear_ratio of the motors')
    most = max((link.modes for link in arm.links), default=0)
    if most > 1:
        found.append(f'fewer modes per link than {most}')
    found.append(f'a longer duration than {task.duration:g} s{_periods(problem)}')
    if task.max_torque_rate.size:
        found.append('a larger max_torque_rate')
    if arm.n_modes and not any(_is_damped(arm)):
        found.append('damping of the links')
    if task.payload_mass:
        found.append('less payload')
    if arm.n_passive and not task.velocity_weights.any():
        found.append('velocity_weights, a price on fast bending')
    return found


def _is_damped(arm: Arm) -> list[bool]:
    return [bool(np.any(link.damping_ratios)) for link in arm.links]


def _periods(problem: MotionProblem) -> str:
    """Say how short the duration is for the lowest vibration, if it is."""
    if not problem.task.arm.n_passive:
        return ''
    try:
        rates, _ = natural_modes(problem.model, problem.start[:problem.layout.coordinates],
                                 problem.parameters, locked=True)
    except FlexPlannerError:
        return ''
    lowest = float(np.nanmin(rates)) if np.isfinite(rates).any() else np.inf
    count = problem.task.duration * lowest / (2 * np.pi)
    return f' ({count:.2g} periods of the lowest vibration)' if count < _SHORT else ''
