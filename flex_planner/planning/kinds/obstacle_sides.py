"""
The sides on which a tip passes obstacles, and motions that pass them on the other side.

On which side an obstacle is passed is a choice that Newton's method does not revise: each side has
an extremal of its own, and only trying both tells which is cheaper.

"""

from __future__ import annotations

from collections.abc import Iterator
from itertools import product

from flex_planner.arms.kinematics import tip_jacobian, tip_position, tip_velocity
from flex_planner.base.validation import Array
from flex_planner.collocation import CollocationSolution
from flex_planner.optimal_control.motion_problem import MotionProblem
from flex_planner.optimal_control.path_constraints import KeepOut, PathSlacks
from flex_planner.optimal_control.path_constraints.regions import Pill
import numpy as np

# how far beyond the edge of an obstacle a start passes it, in units of its radius
_BEYOND = 1.3
# of the Jacobian: near a singularity the joints need not turn for ever
_DAMPING = 1e-2
# starts, at most: obstacles beyond are passed as the motion does
_MOST_OBSTACLES = 2
_INTERVALS = 60


def find_obstacles(slacks: PathSlacks, values: Array) -> list[KeepOut]:
    """
    Return the obstacles whose slacks are negative somewhere, the deepest first.

    Parameters
    ----------
    slacks : PathSlacks
        n_c of them.
    values : numpy.ndarray, shape (k, n_c)
        Along a motion.

    """
    least: dict[int, float] = {}
    for owner, slack in zip(slacks.owners(), values.min(axis=0).tolist(), strict=True):
        least[owner] = min(slack, least.get(owner, 0.0))
    passed = sorted((slack, owner) for owner, slack in least.items() if slack < 0)
    # motors, which are no obstacles, count on after the constraints
    count = len(slacks.constraints)
    every = (slacks.constraints[owner] for _, owner in passed if owner < count)
    return [one for one in every if isinstance(one, KeepOut) and one.is_obstacle]


def find_side(problem: MotionProblem, solution: CollocationSolution, obstacle: KeepOut) -> str:
    """
    Return on which side a motion has an obstacle where it is nearest: left or right.

    In space it is the axis of the base nearest to the direction in which it is passed, as ``+z``.

    """
    _, _, tip, velocity, middle = _nearest(problem, solution, obstacle)
    away = middle - tip
    if away.size == 2:
        return 'left' if velocity[0] * away[1] - velocity[1] * away[0] > 0 else 'right'
    across = _across(away, velocity)
    axis = int(np.abs(across).argmax())
    return f'{"+" if across[axis] > 0 else "-"}{"xyz"[axis]}'


def say_sides(problem: MotionProblem, solution: CollocationSolution,
              obstacles: list[KeepOut]) -> str:
    """Return on which sides a motion has obstacles."""
    side = 'side' if problem.model.arm.dimension == 3 else ''
    return ', '.join(
        f'{one.name or "the keep-out"} on its {find_side(problem, solution, one)} {side}'.strip()
        for one in obstacles)


def pass_otherwise(problem: MotionProblem, solution: CollocationSolution,
                   obstacles: list[KeepOut]) -> Iterator[CollocationSolution]:
    """
    Yield starts that pass one or more of the obstacles on the side that a motion does not.

    Parameters
    ----------
    problem : MotionProblem
        n joints.
    solution : CollocationSolution
        The motion.
    obstacles : list of KeepOut
        That it passes through; more than two are not all turned.

    """
    for turned in product((False, True), repeat=min(len(obstacles), _MOST_OBSTACLES)):
        if not any(turned):
            continue
        moved = solution
        for one, other in zip(obstacles, turned, strict=False):
            if other:
                moved = _move_across(problem, moved, one)
        yield moved


def _move_across(problem: MotionProblem, solution: CollocationSolution,
                 obstacle: KeepOut) -> CollocationSolution:
    """Return a motion whose tip passes an obstacle on the other side."""
    arm, duration = problem.model.arm, float(solution.mesh[-1])
    time, q, tip, velocity, middle = _nearest(problem, solution, obstacle)
    across = _across(middle - tip, velocity)
    reach = _BEYOND * (obstacle.region.scale + obstacle.tip_radius)
    if isinstance(obstacle.region, Pill):
        ends = np.array([obstacle.region.start, obstacle.region.end])
        reach += float(np.max((ends - middle) @ across))
    slopes = tip_jacobian(arm, q)[:, :arm.n_joints]
    target = middle + reach * across - tip
    turn = slopes.T @ np.linalg.solve(
        slopes @ slopes.T + (_DAMPING * arm.reach)**2 * np.eye(target.size), target)
    return _add_bump(solution, turn, time, duration, arm.n_coordinates)


def _across(away: Array, velocity: Array) -> Array:
    """
    Return the direction across a path in which an obstacle lies, a unit vector.

    Parameters
    ----------
    away : numpy.ndarray, shape (2,) or (3,)
        From the path to the middle of the obstacle [m].
    velocity : numpy.ndarray, shape (2,) or (3,)
        Along the path.

    """
    along = velocity / max(float(np.linalg.norm(velocity)), 1e-300)
    if away.size == 2:
        left = np.array([-along[1], along[0]])
        return left if left @ away > 0 else -left
    across = away - (away @ along) * along
    if np.linalg.norm(across) < 1e-9:  # right through the middle: upwards, or anywhere
        upwards = np.eye(3)[2 if abs(along[2]) < 0.9 else 0]
        across = upwards - (upwards @ along) * along
    direction: Array = across / np.linalg.norm(across)
    return direction


def _add_bump(solution: CollocationSolution, turn: Array, time: float, duration: float,
              n_t: int) -> CollocationSolution:
    """Return a motion whose joints turn by so much more at a time, and not at both ends."""
    mesh = np.linspace(0, duration, _INTERVALS + 1, dtype=np.float64)
    moved, n = solution.on_mesh(mesh), turn.size
    node, stage = _bump(mesh, time, duration), _bump(moved.stage_times(), time, duration)
    nodes, stages = moved.nodes.copy(), moved.stages.copy()
    nodes[:, :n] += node[0][:, None] * turn
    nodes[:, n_t:n_t + n] += node[1][:, None] * turn
    stages[..., :n] += stage[1][..., None] * turn
    stages[..., n_t:n_t + n] += stage[2][..., None] * turn
    return CollocationSolution(mesh, nodes, stages, moved.rule)


def _bump(times: Array, peak: float, duration: float) -> tuple[Array, Array, Array]:
    """Return a function that is 1 at its peak and 0 at both ends, and two derivatives."""
    before = times < peak
    length = np.where(before, max(peak, 1e-3 * duration),
                      max(duration - peak, 1e-3 * duration))
    angle = np.pi * np.where(before, times, duration - times) / length
    sign = np.where(before, 1.0, -1.0)
    rate = np.pi / length
    return ((1 - np.cos(angle)) / 2, sign * rate * np.sin(angle) / 2,
            rate**2 * np.cos(angle) / 2)


def _nearest(problem: MotionProblem, solution: CollocationSolution, obstacle: KeepOut,
             ) -> tuple[float, Array, Array, Array, Array]:
    """Return time, q, tip, its velocity and the obstacle's middle where they are nearest."""
    arm, n_t = problem.model.arm, problem.model.arm.n_coordinates
    times = np.linspace(0, solution.mesh[-1], 20 * _INTERVALS + 1, dtype=np.float64)
    states = solution(times)
    tips = tip_position(arm, states[:, :n_t])
    middle = np.array(obstacle.region.middle)
    k = int(((tips - middle)**2).sum(axis=1).argmin())
    velocity = tip_velocity(arm, states[k:k + 1, :n_t], states[k:k + 1, n_t:2 * n_t])[0]
    return float(times[k]), states[k, :n_t], tips[k], velocity, middle
