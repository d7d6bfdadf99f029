"""Arms with everything that a data sheet may say of joints, links and payload."""

from __future__ import annotations

from flex_planner.arms.arm import Arm, Elasticity, Joint, Link, Motor, Node
import numpy as np


def data_sheet_arm(seed: int) -> Arm:
    """Return a random arm of two or three links."""
    rng = np.random.default_rng(seed)
    n = 2 + seed % 2
    return Arm(name=f'data sheet {seed}', links=tuple(_link(rng, i) for i in range(n)),
               joints=tuple(_joint(rng, (i + seed) % 2 == 0) for i in range(n)),
               nodes=tuple(Node(mass=float(rng.uniform(0, 0.5)), inertia=float(
                   rng.uniform(0, 0.02))) for _ in range(n + 1)),
               gravity=rng.uniform(-9, 9, 2), payload_com=rng.uniform(-0.1, 0.1, 2),
               payload_inertia=0.01)


def _joint(rng: np.random.Generator, elastic: bool) -> Joint:
    motor = Motor(stall_torque=float(rng.uniform(5, 20)), no_load_speed=float(rng.uniform(3, 6)),
                  gear_ratio=float(rng.choice([50, 100])),
                  rotor_inertia=float(rng.uniform(5e-6, 3e-5)))
    spring = Elasticity(stiffness=float(rng.uniform(300, 3000)), damping=0.3) if elastic else None
    return Joint(motor=motor, viscous_friction=0.1, coulomb_friction=float(rng.uniform(0.1, 0.5)),
                 coulomb_speed=0.2, elasticity=spring,
                 housing=Node(mass=float(rng.uniform(0.2, 0.8)), inertia=1e-3))


def _link(rng: np.random.Generator, index: int) -> Link:
    modes = index % 3
    return Link(length=float(rng.uniform(0.3, 0.7)), linear_density=float(rng.uniform(0.5, 3)),
                flexural_rigidity=float(rng.uniform(30, 100)), modes=modes,
                mode_family='clamped_free' if modes else 'pinned_pinned',
                damping_ratio=tuple(0.02 * (j + 1) for j in range(modes)) if modes else 0.0)
