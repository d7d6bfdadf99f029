"""
A second derivation of the dynamics, from positions alone, by automatic differentiation.

Points of the links at Gauss stations are differentiated by autograd: velocities, energies, then
the Euler-Lagrange equations. No link frame moves, no integral is taken by hand and CasADi is not
used, so that little but the mode shapes is in common with
:mod:`flex_planner.dynamics.build_chain`.

"""

from __future__ import annotations

from collections.abc import Callable

import autograd
from autograd.differential_operators import make_jvp
import autograd.numpy as anp
from data_sheet_arms import stepped_arm
from flex_planner.arms.arm import Arm, BeamSection, Joint, Link, Node
from flex_planner.base.validation import Array
from flex_planner.optimal_control.parameters import Parameters
from light_model import LightModel
import numpy as np
import pytest

NODES, WEIGHTS = np.polynomial.legendre.leggauss(30)  # exact to rounding for modes 1 to 4
PAYLOAD, INERTIA = 1.3, 0.07


def quadrature(link: Link) -> tuple[Array, Array, Array, Array]:
    """Return points of a link, along and across it, with their masses and rigidities."""
    if link.center_of_mass is not None and link.inertia is not None:
        # two points with the mass, centre and inertia of a rigid body
        x, y = link.center_of_mass
        apart = np.sqrt(link.inertia / link.mass) * np.array([-1.0, 1.0])
        return x + apart, np.full(2, y), np.full(2, link.mass / 2), np.zeros(2)
    sections = link.sections or (BeamSection(share=1.0),)
    ends = link.length * np.cumsum([0.0, *(one.share for one in sections)])
    stations, rule = (np.concatenate(part) for part in zip(*(
        (low + (high - low) * (NODES + 1) / 2, WEIGHTS * (high - low) / 2)
        for low, high in zip(ends[:-1], ends[1:], strict=True)), strict=True))
    density, rigidity = np.repeat([[one.density, one.rigidity] for one in sections],
                                  NODES.size, axis=0).T
    bends = np.isfinite(rigidity) & bool(link.modes)  # rigid pieces have no curvature
    stiff = link.flexural_rigidity * np.where(bends, rigidity, 0.0) if link.modes else 0 * rule
    return stations, 0 * stations, link.linear_density * density * rule, stiff * rule


class SecondDerivation:
    """Energies and Euler-Lagrange equations of an arm."""

    def __init__(self, arm: Arm) -> None:
        self.arm, ends = arm, [np.array([link.length]) for link in arm.links]
        shapes = [link.mode_shapes() for link in arm.links]
        rules = [quadrature(link) for link in arm.links]
        self._stations, self._aside, density, self._rigidity = zip(*rules, strict=True)
        self._shapes = [modes.shape(x) for modes, x in zip(shapes, self._stations, strict=True)]
        self._bends = [modes.curvature(x) for modes, x in zip(shapes, self._stations, strict=True)]
        self._tips = [modes.shape(end)[0] for modes, end in zip(shapes, ends, strict=True)]
        # the slope by a complex step; the frame of a pinned link is its chord, which has none
        self._slopes = [0 * modes.tip_slope if link.mode_family == 'pinned_pinned'
                        else modes.shape(end + 1e-20j)[0].imag / 1e-20
                        for link, modes, end in zip(arm.links, shapes, ends, strict=True)]
        masses = [node.mass for node in arm.nodes[1:]]
        masses[-1] += PAYLOAD
        self._masses = np.concatenate([*density, masses])
        self._inertias = np.array([node.inertia for node in arm.nodes])
        self._inertias[-1] += INERTIA

    def places(self, q: Array) -> tuple[Array, Array]:
        """Return all points with mass (k, 2) and the angles of all nodes (n + 1,)."""
        angle, base, points, nodes, angles = 0.0, anp.zeros(2), [], [], []
        for i, part in enumerate(self.arm.modal_slices):
            angle, bend = angle + q[i], q[part]
            angles.append(angle)
            e, normal = (anp.array([anp.cos(angle), anp.sin(angle)]),
                         anp.array([-anp.sin(angle), anp.cos(angle)]))
            deflection = anp.dot(self._shapes[i], bend) + self._aside[i]
            points.append(base + anp.outer(self._stations[i], e) + anp.outer(deflection, normal))
            base = base + self.arm.links[i].length * e + anp.dot(self._tips[i], bend) * normal
            angle = angle + anp.dot(self._slopes[i], bend)
            nodes.append(base)
        return anp.concatenate([*points, anp.array(nodes)]), anp.array([*angles, angle])

    def kinetic(self, q: Array, rates: Array) -> Array:
        velocities = make_jvp(lambda c: self.places(c)[0])(q)(rates)[1]
        turning = make_jvp(lambda c: self.places(c)[1])(q)(rates)[1]
        return (anp.dot(self._masses, anp.sum(velocities**2, axis=1))
                + anp.dot(self._inertias, turning**2)) / 2

    def potential(self, q: Array) -> Array:
        total = -anp.dot(self._masses, anp.dot(self.places(q)[0], self.arm.gravity))
        for link, rigidity, bends, part in zip(self.arm.links, self._rigidity, self._bends,
                                               self.arm.modal_slices, strict=True):
            if link.modes:
                curvature = anp.dot(bends, q[part])
                total += anp.dot(rigidity, curvature**2) / 2
        return total

    def damping(self) -> Array:
        coefficients = [joint.viscous_friction for joint in self.arm.joints]
        for i, link in enumerate(self.arm.links):
            if link.modes:
                product = (quadrature(link)[2] @ self._shapes[i]**2
                           * (self._rigidity[i] @ self._bends[i]**2))
                coefficients += [*2 * np.array(link.damping_ratio) * np.sqrt(product)]
        return np.array(coefficients)

    def inverse_dynamics(self, q: Array, rates: Array, a: Array) -> Array:
        """Return d/dt dT/dq' - dT/dq + dV/dq + damping."""
        momentum: Callable[[Array, Array], Array] = autograd.grad(self.kinetic, 1)
        change = (autograd.jacobian(momentum, 1)(q, rates) @ a
                  + autograd.jacobian(momentum, 0)(q, rates) @ rates)
        force: Array = (change - autograd.grad(self.kinetic, 0)(q, rates)
                        + autograd.grad(self.potential)(q) + self.damping() * rates)
        return force


def three_links() -> Arm:
    """Return links of all families, one of them rigid, with everything at every node."""
    links = (Link(length=0.6, linear_density=4.0, flexural_rigidity=60.0, modes=2,
                  mode_family='clamped_mass', shape_mass=4.0, shape_inertia=0.4),
             Link(length=0.5, linear_density=2.0),
             Link(length=0.4, linear_density=1.0, flexural_rigidity=6.0, modes=3,
                  mode_family='clamped_free', damping_ratio=0.03))
    nodes = tuple(Node(mass=0.3 * i, inertia=0.02 + 0.01 * i) for i in range(4))
    return Arm(name='three', links=links, joints=(Joint(viscous_friction=0.2),) * 3, nodes=nodes,
               gravity=[1.3, -9.81])


def pinned_in_the_middle() -> Arm:
    """Return four links with the frames of clamped and pinned ones in turn."""
    clamped = Link(length=0.5, linear_density=2.0, flexural_rigidity=9.0, modes=1,
                   mode_family='clamped_mass', shape_mass=1.0, shape_inertia=0.1)
    pinned = Link(length=0.4, linear_density=3.0, flexural_rigidity=7.0, modes=2)
    return Arm(name='mixed', links=(pinned, clamped, pinned, clamped), joints=(Joint(),) * 4,
               gravity=[0.0, -9.81])


def states(arm: Arm, count: int, seed: int) -> tuple[Array, Array, Array]:
    """Return coordinates, rates and accelerations."""
    n, f = arm.n_joints, arm.n_modes
    random = np.random.default_rng(seed)
    q, rates, a = (random.uniform(-1, 1, (count, n + f)) * np.repeat(sizes, [n, f])
                   for sizes in ([np.pi, 0.03], [4.0, 1.0], [20.0, 50.0]))
    return q, rates, a


@pytest.fixture(scope='module', params=['workshop', 'crane', 'three', 'mixed', 'stepped'])
def arm(request: pytest.FixtureRequest) -> Arm:
    made = {'three': three_links, 'mixed': pinned_in_the_middle, 'stepped': stepped_arm}
    found: Arm = (made[request.param]() if request.param in made
                  else request.getfixturevalue(f'{request.param}_arm'))
    return found


def test_energies_and_mass_matrix_agree_with_the_second_derivation(arm: Arm) -> None:
    second, (q, rates, _) = SecondDerivation(arm), states(arm, 4, 1)
    p = Parameters.of(arm, payload_mass=PAYLOAD, payload_inertia=INERTIA).physical
    mass, kinetic, potential = LightModel(arm).mass_and_energy(np.hstack([q, rates]), p)
    for k in range(4):
        M = autograd.jacobian(autograd.grad(second.kinetic, 1), 1)(q[k], rates[k])
        # rounding, relative to the largest entry
        np.testing.assert_allclose(mass[k], M, rtol=0, atol=1e-12 * np.abs(M).max())
        assert kinetic[k] == pytest.approx(second.kinetic(q[k], rates[k]), rel=1e-12)
        assert potential[k] == pytest.approx(second.potential(q[k]), rel=1e-11, abs=1e-10)


def test_inverse_dynamics_agrees_with_the_second_derivation(arm: Arm) -> None:
    second, (q, rates, a) = SecondDerivation(arm), states(arm, 4, 2)
    p = Parameters.of(arm, payload_mass=PAYLOAD, payload_inertia=INERTIA).physical
    found = LightModel(arm).inverse_dynamics(np.hstack([q, rates]), a, p)
    for k in range(4):
        expected = second.inverse_dynamics(q[k], rates[k], a[k])
        # rounding, relative to the largest force
        np.testing.assert_allclose(found[k], expected, rtol=0,
                                   atol=1e-11 * np.abs(expected).max())


def test_static_forces_agree_with_the_second_derivation(arm: Arm) -> None:
    second, (q, _, _) = SecondDerivation(arm), states(arm, 4, 3)
    p = Parameters.of(arm, payload_mass=PAYLOAD, payload_inertia=INERTIA).physical
    force, stiffness = LightModel(arm).static_forces(q, p)
    for k in range(4):
        gradient = autograd.grad(second.potential)(q[k])
        hessian = autograd.jacobian(autograd.grad(second.potential))(q[k])
        np.testing.assert_allclose(force[k], gradient, rtol=0,
                                   atol=1e-12 * np.abs(gradient).max())  # rounding
        np.testing.assert_allclose(stiffness[k], hessian, rtol=0,
                                   atol=1e-12 * np.abs(hessian).max())


def test_compiled_inverse_dynamics_agree_with_the_second_derivation(
        crane_arm: Arm, crane_model: object) -> None:
    second, (q, rates, a) = SecondDerivation(crane_arm), states(crane_arm, 4, 4)
    p = Parameters.of(crane_arm, payload_mass=PAYLOAD, payload_inertia=INERTIA).physical
    found = crane_model.inverse_dynamics(np.hstack([q, rates]), a, p)  # type: ignore
    for k in range(4):
        expected = second.inverse_dynamics(q[k], rates[k], a[k])
        np.testing.assert_allclose(found[k], expected, rtol=0,
                                   atol=1e-11 * np.abs(expected).max())  # rounding
