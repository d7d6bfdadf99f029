"""Arms with everything that a data sheet may say of joints, links and payload."""

from __future__ import annotations

from typing import Any

from flex_planner.arms.arm import Arm, BeamSection, Elasticity, Joint, Link, Motor, Node
import numpy as np

HUB = (BeamSection(share=0.1, density=0.0, rigidity=np.inf),
       BeamSection(share=0.4, density=1.5, rigidity=6.0), BeamSection(share=0.3, density=0.5),
       BeamSection(share=0.2, density=1.25, rigidity=np.inf))


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
    """Return a rigid body with its centre off its axis, or a beam with hub and rigid tip."""
    modes = index % 3
    values: dict[str, Any] = {
        'length': float(rng.uniform(0.3, 0.7)), 'linear_density': float(rng.uniform(0.5, 3)),
        'flexural_rigidity': float(rng.uniform(30, 100)), 'modes': modes}
    if not modes:
        return Link(center_of_mass=(0.2, 0.03), inertia=0.02, **values)
    return Link(mode_family='clamped_free', sections=HUB,
                damping_ratio=tuple(0.02 * (j + 1) for j in range(modes)), **values)


def stepped_arm() -> Arm:
    """Return links of all families in sections, bent and rigid, and a rigid body."""
    tapered = (BeamSection(share=0.5, density=1.2, rigidity=3.0),
               BeamSection(share=0.5, density=0.8))
    links = (Link(length=0.6, linear_density=4.0, flexural_rigidity=60.0, modes=2, sections=HUB,
                  mode_family='clamped_mass', shape_mass=4.0, damping_ratio=(0.07, 0.03)),
             Link(length=0.5, linear_density=2.0, center_of_mass=(0.3, -0.08), inertia=0.05),
             Link(length=0.3, linear_density=3.0, sections=tapered),
             Link(length=0.4, linear_density=2.0, flexural_rigidity=6.0, modes=2,
                  sections=tapered),
             Link(length=0.4, linear_density=1.0, flexural_rigidity=6.0, modes=3, sections=HUB,
                  mode_family='clamped_free'))
    return Arm(name='stepped', links=links, joints=(Joint(),) * 5, gravity=[1.3, -9.81],
               nodes=tuple(Node(mass=0.3 * i, inertia=0.02) for i in range(6)))
