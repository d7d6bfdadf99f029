"""Random arms that could be built, motions for them, and joint controllers."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

from bench.independent.equations import Equations
from bench.independent.shapes import Array
from flex_planner.arms.arm import Arm, Joint, Link, Motor, Node
from flex_planner.control.default_gains import default_gains
from flex_planner.control.joint_controller import EffortHold, Gains, JointController
from flex_planner.dynamics.arm_dynamics import ArmDynamics
from flex_planner.optimal_control.task import Task
from flex_planner.planning.sampling import SamplingSettings
import numpy as np

_GRAVITY = 9.81
_FAMILIES = ('rigid', 'pinned_pinned', 'clamped_free', 'clamped_mass')
_SHARES = (0.25, 0.2, 0.35, 0.2)
# of a clamped link with what it carries [rad/s]
_FREQUENCIES = (15.0, 60.0)
# accelerations that motors allow [rad/s^2], their torques by the weight they hold
_ACCELERATIONS, _RESERVES = (3.0, 15.0), (1.3, 2.2)


def random_arm(draw: np.random.Generator) -> Arm:
    """Return an arm of 1 to 3 links, rigid or flexible, with or without gravity and limits."""
    n, family = int(draw.choice([1, 2, 3], p=[0.3, 0.5, 0.2])), draw.choice(_FAMILIES, p=_SHARES)
    lengths, densities = draw.uniform(0.3, 0.7, n), draw.uniform(1.0, 5.0, n)
    gravity = _GRAVITY * np.array([0.0, -1.0]) * (draw.random() < 0.4)
    nodes = _nodes(draw, n) if family.startswith('clamped') or draw.random() < 0.5 else ()
    links = [Link(length=float(length), linear_density=float(density))
             for length, density in zip(lengths, densities, strict=True)]
    plain = Arm(name='random', links=tuple(links), joints=(Joint(),) * n, nodes=nodes,
                gravity=gravity)
    if family != 'rigid':
        links = [_flexible(draw, plain, k, str(family)) for k in range(n)]
    return replace(plain, links=tuple(links), joints=_joints(draw, plain))


def random_motion(draw: np.random.Generator, arm: Arm) -> dict[str, Any]:
    """Return fields of a task between joint angles, with a payload."""
    n, plain = arm.n_joints, arm.rigid()
    stroke = np.deg2rad(80.0 if arm.n_modes else 140.0)
    start = draw.uniform(-1.5, 1.5, n) - np.pi / 2 * bool(arm.gravity.any())
    change = draw.uniform(0.3, 1.0, n) * stroke * draw.choice([-1, 1], n)
    payload = float(draw.choice([0.0, draw.uniform(0.05, 0.6)]))
    mass, weight = _stretched(plain)
    stall = np.array([joint.motor.stall_torque for joint in arm.joints])
    free = np.minimum(stall - weight / 2, 20 * mass)
    speeds = np.array([joint.motor.no_load_speed for joint in arm.joints])
    quickest = np.maximum(2 * np.sqrt(np.abs(change) * mass / free),
                          1.6 * np.abs(change) / speeds).max()
    return {'start_positions': start, 'goal_positions': start + change, 'payload_mass': payload,
            'payload_inertia': payload * float(draw.uniform(0.0, 0.02)),
            'duration': float(quickest * draw.uniform(1.3, 2.2))}


def random_controller(draw: np.random.Generator, arm: Arm) -> SamplingSettings:
    """Return a controller of 250 to 2000 Hz, and what its trajectory is shifted for."""
    rate = float(np.exp(draw.uniform(np.log(250), np.log(2000))))
    gains, factor = default_gains(ArmDynamics.of(arm), rate), float(draw.uniform(0.3, 1.0))
    controller = JointController(
        gains=Gains(stiffness=gains.stiffness * factor, damping=gains.damping * factor),
        rate=rate, hold=EffortHold(draw.choice([hold.value for hold in EffortHold])))
    return SamplingSettings(controller=controller,
                            controller_period=0.0 if draw.random() < 0.15 else None)


def between_points(draw: np.random.Generator, arm: Arm, motion: dict[str, Any]) -> Task:
    """Return the motion between the points at which the unbent arm would have its tip."""
    plain = Equations.of(arm.rigid(), 0.0, 0.0)
    start, goal = (plain.tip(motion.pop(f'{end}_positions')) for end in ('start', 'goal'))
    return Task.between_points(arm, start, goal, elbow=int(draw.choice([-1, 1])), **motion)


def _nodes(draw: np.random.Generator, n: int) -> tuple[Node, ...]:
    """Return hubs that turn with their links, and a tip."""
    hubs = [Node(mass=float(draw.uniform(0.2, 1.0)), inertia=float(draw.uniform(0.02, 0.15)))
            for _ in range(n)]
    return (*hubs, Node(mass=float(draw.uniform(0.0, 0.2)), inertia=1e-3))


def _flexible(draw: np.random.Generator, plain: Arm, index: int, family: str) -> Link:
    """Return a link that swings with one of the frequencies, with what it carries."""
    link = plain.links[index]
    carried = (sum(other.mass for other in plain.links[index + 1:])
               + sum(node.mass for node in plain.nodes[index + 1:]))
    frequency = draw.uniform(*_FREQUENCIES) * (0.4 if family == 'pinned_pinned' else 1.0)
    rigidity = frequency**2 * (carried * link.length**3 / 3
                               + link.mass * link.length**3 / 12.4)
    return replace(link, flexural_rigidity=float(rigidity), mode_family=family,
                   modes=int(draw.choice([1, 2])),
                   shape_mass=carried if family == 'clamped_mass' else 0.0,
                   damping_ratio=float(draw.choice([0.0, draw.uniform(0.005, 0.03)])))


def _joints(draw: np.random.Generator, plain: Arm) -> tuple[Joint, ...]:
    """Return joints with friction and motors, of which some have no limits."""
    mass, weight = _stretched(plain)
    stall = mass * draw.uniform(*_ACCELERATIONS, mass.size)
    stall += weight * draw.uniform(*_RESERVES, mass.size)
    speeds = draw.uniform(2.5, 8.0, mass.size) if draw.random() < 0.6 else [np.inf] * mass.size
    if draw.random() < 0.15:
        motors = [Motor()] * mass.size
    else:
        motors = [Motor(stall_torque=float(torque), no_load_speed=float(speed),
                        max_torque=np.inf)
                  for torque, speed in zip(stall, speeds, strict=True)]
    friction = draw.uniform(0.0, 0.3, mass.size) * (draw.random() < 0.5)
    return tuple(Joint(motor=motor, viscous_friction=float(value))
                 for motor, value in zip(motors, friction, strict=True))


def _stretched(plain: Arm) -> tuple[Array, Array]:
    """Return what each joint turns and holds with a half-laden arm stretched out."""
    laden, n = Equations.of(plain, 0.3, 0.0), plain.n_joints
    flat = np.zeros(n)
    mass, force = laden.mass_and_force(flat, flat)
    return np.diag(mass).copy(), np.abs(force)
