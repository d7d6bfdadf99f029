"""Spatial arms that several tests use: with flexible links, with elastic joints, with slides."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace
import math

from flex_planner.arms.joint import Elasticity, Motor
from flex_planner.arms.spatial_arm import SpatialArm
from flex_planner.arms.spatial_beam import SpatialBeam
from flex_planner.arms.spatial_body import as_matrix, as_point, SpatialBody, turn_rpy
from flex_planner.arms.spatial_joint import SpatialJoint
from flex_planner.arms.spatial_link import SpatialLink
import numpy as np

HALF = math.pi / 2


def tube(outer: float, inner: float, modulus: float = 70e9,
         density: float = 2700.0, poisson: float = 0.33) -> dict[str, float]:
    """Return density per length, E I, G J_t and polar inertia per length of a tube's radii."""
    area, second = math.pi * (outer**2 - inner**2), math.pi / 4 * (outer**4 - inner**4)
    return {'rho': density * area, 'EI': modulus * second,
            'GJ': modulus / (1 + poisson) * second, 'polar': 2 * density * second}


def motor(stall: float, no_load: float, rotor: float) -> Motor:
    return Motor(stall_torque=stall, no_load_speed=no_load, max_torque=math.inf,
                 rotor_inertia=rotor)


def flexible_3r(modes: int = 1, twist: int = 0, *, foreshortening: bool = False) -> SpatialArm:
    """Return a yaw-pitch-pitch arm with two tubes of aluminium, 0.8 m long each."""
    one = tube(0.015, 0.0135)

    def beam(carried: float) -> SpatialBeam:
        return SpatialBeam(
            linear_density=one['rho'], flexural_rigidity=(one['EI'], one['EI']),
            torsional_rigidity=one['GJ'], polar_inertia=one['polar'], modes=(modes, modes),
            twist_modes=twist, mode_family='clamped_mass', shape_mass=carried,
            shape_twist_inertia=20 * one['polar'] * 0.8, foreshortening=foreshortening)

    def joint(axis: tuple[float, float, float], stall: float, rotor: float) -> SpatialJoint:
        return SpatialJoint(axis=axis, viscous_friction=0.1, motor=motor(stall, 6.0, rotor))

    return SpatialArm(
        name='3R', payload_com=[0.05, 0, 0],
        joints=(joint((0, 0, 1), 40, 0.05), joint((0, 1, 0), 60, 0.05),
                joint((0, 1, 0), 30, 0.03)),
        links=(
            SpatialLink(end=(0, 0, 0.3), body=SpatialBody(
                mass=3.0, center_of_mass=(0, 0, 0.15), inertia=(0.03, 0.03, 0.01))),
            SpatialLink(end=(0.8, 0, 0), beam=beam(2.0),
                        body=SpatialBody(mass=0.5, inertia=(0.001,) * 3),
                        tip_body=SpatialBody(mass=1.2, inertia=(0.002,) * 3)),
            SpatialLink(end=(0.8, 0, 0), beam=beam(1.0), tip_body=SpatialBody(
                mass=0.3, center_of_mass=(0.03, 0, 0), inertia=(0.0005,) * 3))))


def tudor(modes: int = 1) -> SpatialArm:
    """Return an arm like TUDOR of TU Dortmund: two slender links of spring steel; estimates."""
    b, h, modulus, density = 0.015, 0.004, 206e9, 7850.0

    def beam(carried: float) -> SpatialBeam:
        return SpatialBeam(
            linear_density=density * b * h, modes=(1, modes), mode_family='clamped_mass',
            flexural_rigidity=(modulus * h * b**3 / 12, modulus * b * h**3 / 12),
            torsional_rigidity=80e9 * b * h**3 / 3, shape_mass=carried,
            polar_inertia=density * b * h * (b * b + h * h) / 12)

    def joint(axis: tuple[float, float, float], stall: float, rotor: float,
              friction: float) -> SpatialJoint:
        return SpatialJoint(axis=axis, viscous_friction=friction, motor=motor(stall, 5.0, rotor))

    return SpatialArm(
        name='TUDOR-like',
        joints=(joint((0, 0, 1), 15, 0.06, 0.2), joint((0, 1, 0), 20, 0.06, 0.2),
                joint((0, 1, 0), 8, 0.02, 0.1)),
        links=(
            SpatialLink(end=(0, 0, 0.1), body=SpatialBody(
                mass=2.0, center_of_mass=(0, 0, 0.05), inertia=(0.005,) * 3)),
            SpatialLink(end=(0.44, 0, 0), beam=beam(1.3),
                        tip_body=SpatialBody(mass=0.9, inertia=(0.0008,) * 3)),
            SpatialLink(end=(0.41, 0, 0), beam=beam(0.3),
                        tip_body=SpatialBody(mass=0.05, inertia=(1e-5,) * 3))))


def ur5(elastic: Iterable[int] = (), damping: float = 0.0) -> SpatialArm:
    """Return a UR5 with a gripper; rotors, stiffnesses and wrists' inertias are estimates."""
    at = ((0, 0, 0.089159), (0, 0.13585, 0), (0, -0.1197, 0.425), (0, 0, 0.39225), (0, 0.093, 0),
          (0, 0, 0.09465), (0, 0.0823, 0))
    turns = ((0, 0, 0), (0, HALF, 0), (0, 0, 0), (0, HALF, 0), (0, 0, 0), (0, 0, 0))
    axes = ((0, 0, 1), (0, 1, 0), (0, 1, 0), (0, 1, 0), (0, 0, 1), (0, 1, 0))
    wrist = (1.219, (0, 0, 0), (0.0025599, 0.0025599, 0.0021942))
    bodies = ((3.7, (0, 0, 0), (0.010267495893, 0.010267495893, 0.00666)),
              (8.393, (0, 0, 0.28), (0.22689067591, 0.22689067591, 0.0151074)),
              (2.275, (0, 0, 0.25), (0.049443313556, 0.049443313556, 0.004095)), wrist, wrist,
              (1.1879, (0, 0.05, 0), (0.0025, 0.0015, 0.0025)))
    stiffness = (20000.0, 20000.0, 12000.0, 4000.0, 4000.0, 4000.0)
    soft = set(elastic)
    return SpatialArm(
        name='UR5', base=at[0], payload_com=[0, 0.05, 0],
        joints=tuple(SpatialJoint(
            axis=axes[i], rotation=turns[i], viscous_friction=5.0 if i < 3 else 1.0,
            motor=motor(150 if i < 3 else 28, 4.5, 1.5 if i < 3 else 0.2),
            elasticity=Elasticity(stiffness=stiffness[i], damping=damping * stiffness[i])
            if i in soft else None) for i in range(6)),
        links=tuple(SpatialLink(end=at[i + 1], body=SpatialBody(
            mass=mass, center_of_mass=center, inertia=inertia))
            for i, (mass, center, inertia) in enumerate(bodies)))


def panda(elastic: Iterable[int] = (), damping: float = 0.0) -> SpatialArm:
    """Return a Franka Panda by the inertias of Gaz et al. 2019; rotors and springs: estimates."""
    at = ((0, 0, 0.333), (0, 0, 0), (0, -0.316, 0), (0.0825, 0, 0), (-0.0825, 0.384, 0), (0, 0, 0),
          (0.088, 0, 0), (0, 0, 0.107))
    rolls = (0, -HALF, HALF, HALF, -HALF, HALF, HALF)
    bodies = (
        (4.97, (.0039, .0021, -.0476), (.7034, -.0001, .0068, .7066, .0192, .0091)),
        (.6469, (-.0031, -.0287, .0035), (.0080, -.0039, .0103, .0281, .0007, .0259)),
        (3.2286, (.0275, .0392, -.0665), (.0372, -.0048, -.0114, .0362, -.0128, .0108)),
        (3.5879, (-.0532, .1044, .0275), (.0259, .0078, -.0013, .0196, .0086, .0283)),
        (1.2259, (-.0120, .0411, -.0384), (.0355, -.0021, -.0041, .0295, .0003, .0086)),
        (1.6666, (.0601, -.0141, -.0105), (.0020, .0001, -.0012, .0043, .0003, .0054)),
        (.7355, (.0105, -.0043, .0616), (.0125, -.0004, -.0012, .0100, -.0007, .0048)))
    soft = set(elastic)
    stiffness = [15000.0] * 4 + [8000.0] * 3
    return SpatialArm(
        name='Panda', base=at[0], payload_com=[0, 0, 0.05],
        joints=tuple(SpatialJoint(
            rotation=(rolls[i], 0, 0), viscous_friction=1.0,
            motor=motor(87 if i < 4 else 12, 3.5, 0.6 if i < 4 else 0.2),
            elasticity=Elasticity(stiffness=stiffness[i], damping=damping * stiffness[i])
            if i in soft else None) for i in range(7)),
        links=tuple(SpatialLink(end=at[i + 1], body=SpatialBody(
            mass=mass, center_of_mass=center,
            inertia=((xx, xy, xz), (xy, yy, yz), (xz, yz, zz))))
            for i, (mass, center, (xx, xy, xz, yy, yz, zz)) in enumerate(bodies)))


def oblique(seed: int = 3, joints: int = 6) -> SpatialArm:
    """Return a rigid arm with oblique axes, of which every other one but the first slides."""
    rng = np.random.default_rng(seed)
    links, made = [], []
    for i in range(joints):
        root = rng.normal(size=(3, 3))
        points = root @ root.T * 0.01
        links.append(SpatialLink(end=as_point(rng.normal(size=3) * 0.3), body=SpatialBody(
            mass=rng.uniform(0.5, 3), center_of_mass=as_point(rng.normal(size=3) * 0.1),
            inertia=as_matrix(np.trace(points) * np.eye(3) - points))))
        made.append(SpatialJoint(axis=as_point(rng.normal(size=3)), slides=i in (2, 4),
                                 rotation=as_matrix(turn_rpy(*rng.uniform(-3, 3, 3)))))
    return SpatialArm(name='oblique', base=rng.normal(size=3) * 0.3, joints=tuple(made),
                      links=tuple(links), payload_com=[0.01, 0.02, 0.03])


def without_friction(arm: SpatialArm) -> SpatialArm:
    return replace(arm, joints=tuple(replace(joint, viscous_friction=0.0)
                                     for joint in arm.joints))


def yaw_pitch(*, foreshortening: bool = False) -> SpatialArm:
    """Return a light arm of two joints whose second link bends in two planes."""
    beam = SpatialBeam(linear_density=0.6, flexural_rigidity=(60.0, 90.0), modes=(1, 1),
                       mode_family='clamped_mass', shape_mass=0.5, damping_ratio=0.0,
                       foreshortening=foreshortening)
    return SpatialArm(
        name='yaw and pitch', payload_com=[0, 0, 0],
        joints=(SpatialJoint(viscous_friction=0.1, motor=motor(20, 6.0, 0.03)),
                SpatialJoint(axis=(0, 1, 0), viscous_friction=0.1, motor=motor(25, 6.0, 0.03))),
        links=(SpatialLink(end=(0.05, 0, 0.3), body=SpatialBody(
                   mass=2.0, center_of_mass=(0, 0, 0.15), inertia=(0.02, 0.02, 0.005))),
               SpatialLink(end=(0.7, 0, 0), beam=beam, body=SpatialBody(inertia=(0.001,) * 3),
                           tip_body=SpatialBody(mass=0.3, center_of_mass=(0.02, 0, 0),
                                                inertia=(0.0004,) * 3))))
