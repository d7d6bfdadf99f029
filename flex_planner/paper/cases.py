"""The arms and motions of the paper's section 5."""

from __future__ import annotations

from dataclasses import replace
import math

from flex_planner.arms.arm import Arm, Joint, Link, Motor, Node
from flex_planner.arms.arm_files import load_arm
from flex_planner.base.errors import FlexPlannerError
from flex_planner.capacity.max_payload import find_max_payload
from flex_planner.capacity.results import MaxPayload
from flex_planner.optimal_control.task import postures_from_points, Task
from flex_planner.planning.plan import Plan
from flex_planner.planning.plan_path import plan_path
import numpy as np

# sections 5.1 to 5.3
START, GOAL, DURATION, ELBOW = (0.5, 0.0), (0.5, 0.5), 1.0, -1
EFFORT = (1 / 8, 1 / 8)
# eps of eq. (17) and e of fig. 2
EPSILON, ACCURACY = 1e-3, 0.05
# table II, III and IV
W_2 = (0.0, 1.0, 10.0, 1400.0)
PAYLOADS = (1.0, 4.0, 5.5, 5.85)
LIMITS = {0.0: 5.85, 200.0: 5.5, 700.0: 5.1, 1000.0: 4.6}
# table V: E I [N m^2] to m_pmax [kg]
STIFFNESS_LIMITS = {math.inf: 5.85, 50.0: 5.8, 5.0: 5.75}
# sections 5.4 and 5.5
TURN = ((0.0, math.pi), (math.pi, 0.0), 2.0)
VIBRATION_WEIGHT = 500.0


class NoPlanError(FlexPlannerError):
    """A motion that the report is about could not be planned."""


def paper_arm(rigidity: float = 50.0, modes: int = 2, family: str = 'pinned_pinned') -> Arm:
    """Return the arm of Table I with links of a flexural rigidity [N m^2], inf for rigid."""
    joints = load_arm('korayem_rigid').joints
    if math.isinf(rigidity):
        link, name = Link(length=0.5, linear_density=6.0), 'rigid'
    else:
        link = Link(length=0.5, linear_density=6.0, flexural_rigidity=rigidity, modes=modes,
                    mode_family=family)
        name = f'EI = {rigidity:g}, {modes} modes, {family}'
    return Arm(name=f'Korayem 2009, {name}', links=(link, link), joints=joints)


def point_to_point(arm: Arm, payload: float, w_2: float = 0.0, elbow: int = ELBOW) -> Task:
    """Return the motion of sections 5.2 and 5.3."""
    start, goal = postures_from_points(arm, START, GOAL, elbow=elbow)
    return Task(arm=arm, start_positions=start, goal_positions=goal, duration=DURATION,
                payload_mass=payload, effort_weights=np.array(EFFORT),
                velocity_weights=np.full(2, w_2) if w_2 else np.zeros(0), tolerance=EPSILON)


def turning_arm(inertias: tuple[float, float, float] = (1.0, 1.0, 1.0), *,
                limited: bool = True) -> Arm:
    """Return the arm of Table VI with rotary inertias [kg m^2] at its nodes."""
    arm = load_arm('korayem_table6')
    nodes = tuple(Node(mass=node.mass, inertia=inertia)
                  for node, inertia in zip(arm.nodes, inertias, strict=True))
    joints = arm.joints if limited else tuple(
        Joint(motor=Motor(), viscous_friction=joint.viscous_friction) for joint in arm.joints)
    return replace(arm, nodes=nodes, joints=joints)


def turn(arm: Arm, modal_weight: float = 0.0) -> Task:
    """Return the motion of sections 5.4 and 5.5, with a weight of the modal rates."""
    start, goal, duration = TURN
    weights = np.array([0.0, 0.0, modal_weight, modal_weight]) if modal_weight else np.zeros(0)
    return Task(arm=arm, start_positions=np.array(start), goal_positions=np.array(goal),
                duration=duration, velocity_weights=weights, tolerance=EPSILON)


def find_largest(task: Task) -> MaxPayload:
    """
    Return the largest payload of a task.

    Raises
    ------
    NoPlanError
        If it is not found.

    """
    return require_solved(find_max_payload(task))


def require_solved(found: MaxPayload) -> MaxPayload:
    """Return a search that succeeded; raise NoPlanError for others."""
    if not found.solved:
        raise NoPlanError(f'{found.task.arm.name}, {found.task.duration:g} s: {found.message}')
    return found


def plan_certified(task: Task, start_from: Plan | None = None) -> Plan:
    """
    Return the plan of a task.

    Raises
    ------
    NoPlanError
        If there is none that passes its certificate.

    """
    plan = plan_path(task, start_from=start_from)
    if not plan.solved:
        raise NoPlanError(f'{task.arm.name}, {task.payload_mass:g} kg: {plan.message}')
    return plan
