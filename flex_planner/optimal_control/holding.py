"""The payload that the motors hold at the goal, and whether none above it can be held."""

from __future__ import annotations

from dataclasses import replace

from flex_planner.arms.arm import Arm
from flex_planner.arms.kinematics import frame_angles
from flex_planner.arms.spatial_arm import SpatialArm
from flex_planner.base.errors import NoEquilibriumError, SingularError, UnreachableError
from flex_planner.base.validation import Array
from flex_planner.dynamics.statics import equilibrium
from flex_planner.optimal_control.arm_model import ArmModel
from flex_planner.optimal_control.boundary_conditions import rest_at_end
from flex_planner.optimal_control.parameters import Parameters
from flex_planner.optimal_control.task import MAX_PAYLOAD, Task
import numpy as np

# share of its stall torque by which a motor is said to be too weak for a buckled arm
_OVERLOADED = 1e3
# just below the payload that is held, motors are loaded by nearly all of their torque: as shares
_BELOW, _NEARLY = 1e-9, 1e-5
# of the stall torque: squares of the payload that matter less are taken for rounding
_NEGLIGIBLE = 1e-3


def holding_limit(model: ArmModel, task: Task, parameters: Parameters) -> tuple[float, int]:
    """
    Return the payload [kg] that the motors just hold at the goal, and the joint that is first.

    It is the next one above that of the task. Links that bend further may need less torque again,
    see `holding_bound`. It is infinite where gravity does not load the joints, where motors have
    no limits, and where the links give way before the motors do.

    """
    from scipy.optimize import brentq  # a tenth of a second, and few tasks need it

    def load(payload: float) -> Array:
        """Return the share of the stall torque that each motor needs."""
        try:
            torque = _holding_torque(model, task, parameters, payload)
        except (NoEquilibriumError, SingularError, UnreachableError):
            return np.full(model.arm.n_joints, _OVERLOADED)
        share: Array = np.abs(torque) / parameters.torque_limits.standstill
        return share

    # that of the task can be held, though none may be too much where it is a counterweight
    light = parameters.payload_mass
    heavy = light + 1.0
    while load(heavy).max() < 1:
        heavy = light + 2 * (heavy - light)
        if heavy > MAX_PAYLOAD:
            return np.inf, 0
    limit = float(brentq(lambda payload: load(payload).max() - 1, light, heavy, xtol=1e-12))
    below = load(limit * (1 - _BELOW))
    return (limit, int(below.argmax())) if abs(below.max() - 1) < _NEARLY else (np.inf, 0)


def holding_bound(model: ArmModel, task: Task, parameters: Parameters) -> tuple[float, int]:
    """
    Return a payload [kg] above which none is held at the goal, and the joint that cannot.

    It is infinite where that is not known, see `knows_holding`, and where `holding_limit` is.
    Of arms that do not bend back under their payload it is that limit.

    """
    turned = task.must_reach_point and model.arm.bends_at_rest  # the posture follows the payload
    if turned or not (model.arm.gravity.any() and knows_holding(model.arm)):
        return np.inf, 0
    bend, scale = _square(model, task, parameters), 1.0
    limits: Array = np.zeros(0)
    for _ in range(3):  # b is most exact near the limit
        bare, loaded = (_holding_torque(model, task, parameters, payload)
                        for payload in (0.0, scale))
        slopes = (loaded - bare - bend * scale**2) / scale
        limits = np.array([_last_within(a, b, bend, float(stall)) for a, b, stall in zip(
            bare, slopes, parameters.torque_limits.standstill, strict=True)])
        scale = float(limits.min())
        if not 0 < scale <= MAX_PAYLOAD:
            break
    return (scale, int(limits.argmin())) if scale <= MAX_PAYLOAD else (np.inf, 0)


def knows_holding(arm: Arm) -> bool:
    """
    Return whether the torque that holds an arm is known for every payload: a polynomial.

    It is if only the last link moves the payload by its own bending: the load of a link with
    pinned modes does not bend it, and the links before a clamped one do not feel its slope. It is
    not where a payload off the tip turns with that slope, nor where joints give way; of spatial
    arms nothing of the kind is known.

    """
    if isinstance(arm, SpatialArm):
        return False
    turned = arm.payload_com.any() and arm.links[-1].mode_shapes().tip_slope.any()
    return not (turned or arm.elastic_joints
                or any(_carries(arm, i) for i in range(arm.n_joints - 1)))


def _carries(arm: Arm, index: int) -> bool:
    """Return whether the bending of a link moves what it carries."""
    modes = arm.links[index].mode_shapes()
    return bool(modes.tip_deflection.any() or modes.tip_slope.any())


def _square(model: ArmModel, task: Task, parameters: Parameters) -> float:
    """
    Return c, the torque of the square of the payload, the same for each joint [N m/kg^2].

    The payload m bends the last link across by ``m g_n phi^T (E I K)^-1 phi``, and its weight
    along the link pulls there with the lever of this deflection.

    """
    arm = model.arm
    link, phi = arm.links[-1], arm.links[-1].mode_shapes().tip_deflection
    if not phi.any():
        return 0.0
    coordinates = equilibrium(model, task.goal_positions,
                              replace(parameters, payload_mass=0.0))[0]
    angle = float(frame_angles(arm, coordinates)[-1])
    along = float(arm.gravity @ [np.cos(angle), np.sin(angle)])
    across = float(arm.gravity @ [-np.sin(angle), np.cos(angle)])
    compliance = phi @ np.linalg.solve(link.mode_shapes().stiffness, phi)
    return float(along * across * compliance / parameters.rigidity[-1])


def _last_within(a: float, b: float, c: float, stall: float) -> float:
    """Return the largest m with |a + b m + c m^2| <= stall; 0 for none, inf for no end."""
    if not np.isfinite(stall):
        return np.inf
    if abs(c) * MAX_PAYLOAD**2 <= _NEGLIGIBLE * stall:
        wider = stall + abs(c) * MAX_PAYLOAD**2
        return max((wider - a) / b, (-wider - a) / b, 0.0) if b else np.inf
    roots = np.concatenate([np.roots([c, b, a - side]) for side in (stall, -stall)])
    real = roots[np.isreal(roots)].real
    return float(np.max(real, initial=0.0))


def _holding_torque(model: ArmModel, task: Task, parameters: Parameters, payload: float) -> Array:
    """Return the torque that holds the arm at the goal with a payload, shape (n,) [N m]."""
    loaded = replace(parameters, payload_mass=payload)
    return rest_at_end(model, task, 'goal', loaded)[1]
