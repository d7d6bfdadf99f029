"""The slips of the paper, each with its evidence."""

from __future__ import annotations

from dataclasses import replace
import math

from flex_planner.arms.inverse_kinematics import inverse_kinematics
from flex_planner.arms.kinematics import tip_position
from flex_planner.base.validation import Array
from flex_planner.collocation import CollocationSolution, solve, SolverSettings
from flex_planner.dynamics.statics import natural_modes
from flex_planner.optimal_control.arm_model import ArmModel
from flex_planner.optimal_control.motion_problem import MotionProblem, task_parameters
from flex_planner.optimal_control.parameters import Parameters
from flex_planner.paper.cases import (
    find_largest,
    NoPlanError,
    paper_arm,
    plan_certified,
    point_to_point,
)
from flex_planner.paper.evidence import Section, Table
from flex_planner.planning.certificate import hamiltonian_drift
import numpy as np

_HEAVY, _STEP = 5.5, 0.01  # [kg]
_NUDGE = 1e-6


class PrintedProblem(MotionProblem):
    """The costate equation as eq. (12) prints it: without the term of the moving bounds."""

    def rate(self, t: Array, z: Array) -> Array:
        """Return z' without that term."""
        return self.model.optimality(z, self.p) - self._term(z)

    def rate_jacobian(self, t: Array, z: Array) -> tuple[Array, Array]:
        """Return z' and its Jacobian, that of the term by differences."""
        rate, jacobian = self.model.optimality_jacobian(z, self.p)
        for k in range(self.size):
            step = np.zeros(self.size)
            step[k] = _NUDGE * max(self.scale[k], _NUDGE)
            jacobian[:, :, k] -= (self._term(z + step) - self._term(z - step)) / (2 * step[k])
        return rate - self._term(z), jacobian

    def _term(self, z: Array) -> Array:
        """Return -(dU/dx)^T dH/du, which is not zero where a motor is on its limit."""
        n, n_t = self.model.arm.n_joints, self.model.arm.n_coordinates
        control, term = self.model.controls(z, self.p), np.zeros_like(z)
        multiplier = self.parameters.effort_weights * (control.torque - control.free_torque)
        term[:, 3 * n_t:3 * n_t + n] = self.parameters.torque_slope * multiplier
        return term


def study(*, reduced: bool = False) -> Section:
    """Return the slips of the paper with their evidence."""
    rows: list[tuple[str, str, str]] = []
    values: dict[str, float] = {}
    for part in (_angle, _costates, _appendix):
        more, numbers = part()
        rows += more
        values |= numbers
    rows += _readings()
    return Section(
        key='7', title='Slips of the paper', text='Each with what settles it.',
        tables=(Table(title='What is printed, what must be meant, and why',
                      header=('printed', 'taken', 'evidence'), rows=tuple(rows)),),
        values=values)


Rows = tuple[list[tuple[str, str, str]], dict[str, float]]


def _angle() -> Rows:
    """Return the evidence on eq. (28)."""
    arm = paper_arm(math.inf)
    tips = [tip_position(arm, np.radians([[60.0, angle]]))[0] for angle in (-60.0, -120.0)]
    right = point_to_point(arm, 1.0)
    wrong = find_largest(replace(right, start_positions=np.radians([60.0, -60.0])))
    solved = np.degrees(inverse_kinematics(arm, np.array([0.5, 0.0]), elbow=-1))
    return [('(28): theta_2(0) = -60 deg', '-120 deg',
             f'With theta_1 = 60 deg the tip is at ({tips[0][0]:.3f}, {tips[0][1]:.3f}) m for -60 '
             f"deg and at ({tips[1][0]:.3f}, {abs(tips[1][1]):.3f}) m, the paper's p_0, for -120 "
             f'deg; inverse kinematics gives ({solved[0]:.0f}, {solved[1]:.0f}) deg. From -60 deg '
             f'the arm would carry {wrong.payload:.2f} kg, not 5.85 kg.')], {
                 'limit_printed_angle': wrong.payload}


def _costates() -> Rows:
    """Return the evidence on eq. (12)."""
    arm = paper_arm(math.inf)
    drifts, slopes = [], []
    for kind in (PrintedProblem, MotionProblem):
        costs, solution, problem = [], None, None
        for payload in (_HEAVY - _STEP, _HEAVY + _STEP, _HEAVY):
            plan = plan_certified(point_to_point(arm, payload))
            problem = kind(plan.model, plan.task, task_parameters(plan.task))
            solution = _solve(problem, plan.solution)
            costs.append(_cost(problem, solution))
        assert problem is not None and solution is not None
        drifts.append(hamiltonian_drift(problem, solution))
        by_difference = (costs[1] - costs[0]) / (2 * _STEP)
        slopes.append(abs(_price(problem, solution) / by_difference - 1))
    return [('(12): no term for bounds that move with the speed',
             'minus (dU/dx)^T dH/du where a motor is on its limit, as in docs/theory.md',
             f'Rigid arm, {_HEAVY:g} kg, both forms solved: H drifts by {drifts[0]:.1%} of its '
             f'terms as printed, by {drifts[1]:.0e} with the term. dJ/dm_p by differences and as '
             f'the integral of dH/dm_p depart by {slopes[0]:.1%} and {slopes[1]:.0e}.')], {
                 'printed_drift': drifts[0], 'right_drift': drifts[1],
                 'printed_slope_error': slopes[0], 'right_slope_error': slopes[1]}


def _solve(problem: MotionProblem, guess: CollocationSolution | None) -> CollocationSolution:
    if guess is None:
        raise NoPlanError('a plan without a solution')
    result = solve(problem, guess, SolverSettings())
    if not result.converged:
        raise NoPlanError(f'the printed costate equation: {result.message}')
    return result.solution


def _integral(problem: MotionProblem, solution: CollocationSolution, name: str) -> float:
    points, weights = np.polynomial.legendre.leggauss(10)
    times = solution.mesh[:-1, None] + np.diff(solution.mesh)[:, None] * (points + 1) / 2
    values = getattr(problem.model.controls(solution(times.ravel()), problem.p), name)
    return float((values.reshape(times.shape) @ weights) @ np.diff(solution.mesh) / 2)


def _cost(problem: MotionProblem, solution: CollocationSolution) -> float:
    return _integral(problem, solution, 'cost_rate')


def _price(problem: MotionProblem, solution: CollocationSolution) -> float:
    return _integral(problem, solution, 'payload_share')


def _appendix() -> Rows:
    """Compare the printed entries of the mass matrix with ours at some postures."""
    rng, model = np.random.default_rng(1), ArmModel(paper_arm(50.0, 2))
    worst: dict[str, float] = {}
    for _ in range(20):
        q = np.concatenate([rng.uniform(-3, 3, 2), rng.uniform(-0.05, 0.05, 4)])
        payload = float(rng.uniform(0, 6))
        parameters = Parameters.of(model.arm, payload_mass=payload).physical
        mass = model.mass_and_energy(np.concatenate([q, np.zeros(6)])[None], parameters)[0][0]
        for name, (row, column, value) in _printed_entries(q, payload).items():
            error = float(abs(value - mass[row, column]) / max(abs(mass[row, column]), 1e-9))
            worst[name] = max(worst.get(name, 0.0), error)
    return [
        ('appendix: J_r12, brackets', 'L_2 times all of it, rho times all of the first bracket',
         'Largest distance from the derived matrix at 20 random postures: '
         f'{worst["J_r12"]:.0%} as printed, {worst["J_r12, mended"]:.0e} mended; J_r11 and '
         f'J_r22 agree to {max(worst["J_r11"], worst["J_r22"]):.0e}.'),
        ('appendix: J_rf112 divided by rho / pi', 'times rho / pi',
         f'{worst["J_rf112"]:.0%} as printed, {worst["J_rf112, mended"]:.0e} mended.'),
    ], {'appendix_j_r11': worst['J_r11'], 'appendix_j_r12': worst['J_r12'],
        'appendix_j_r12_mended': worst['J_r12, mended'],
        'appendix_j_rf112_mended': worst['J_rf112, mended']}


def _printed_entries(q: Array, payload: float) -> dict[str, tuple[int, int, float]]:
    """
    Return entries of the appendix: row, column, value.

    Our coordinates are theta_1, theta_2, q11, q12 of link 1, q21, q22 of link 2; in the paper's
    appendix and eq. (25) their modes are ordered q11, q21, q12, q22.

    """
    rho, L_1, L_2, m_p = 6.0, 0.5, 0.5, payload
    sine, cosine = math.sin(q[1]), math.cos(q[1])
    first, second = q[2]**2 + q[3]**2, q[4]**2 + q[5]**2
    coupling = -12 * L_1 * q[4] * sine / math.pi
    inner = coupling + 3 * second + 3 * L_2 * L_1 * cosine + 2 * L_2**2
    outer = m_p * L_1 * cosine + m_p * L_2
    across = L_2**2 + 2 * L_2 * L_1 * cosine
    return {
        'J_r11': (0, 0, rho / 6 * (
            3 * L_1 * first + 3 * L_2 * second + 2 * L_1**3 + 2 * L_2**3 + 2 * L_2 * coupling
            + 6 * L_2 * L_1**2 + 6 * L_2**2 * L_1 * cosine)
            + m_p * (L_1**2 + L_2**2 + 2 * L_1 * L_2 * cosine)),
        'J_r12': (0, 1, L_2 * (rho * coupling + (inner - coupling)) / 6 + outer),
        'J_r12, mended': (0, 1, L_2 * (rho * inner / 6 + outer)),
        'J_r22': (1, 1, rho * L_2 * (3 * second + 2 * L_2**2) / 6 + m_p * L_2**2),
        'J_rf112': (0, 4, across / (rho / math.pi)),
        'J_rf112, mended': (0, 4, across * rho / math.pi),
    }


def _readings() -> list[tuple[str, str, str]]:
    """Return the slips that a line of argument settles."""
    arm = paper_arm(50.0)
    rest = np.zeros(6)
    found, _ = natural_modes(ArmModel(arm), rest, Parameters.of(arm), locked=True)
    return [
        ('Table I: E without its mantissa', 'EI = 50 N m^2, so E = 2e10 N/m^2',
         'With I = 2.5e-9 m^4 it is the stiffness of Table V; rho = 3 kg / 0.5 m = 6 kg/m. The '
         f'first bending modes, joints locked, are then at {found[0] / 2 / math.pi:.1f} and '
         f'{found[1] / 2 / math.pi:.1f} Hz.'),
        ('(23): the curvature is not squared', 'its square',
         'The integral of the curvature alone is linear in the modal displacements: a constant '
         'force, no stiffness.'),
        ('(25) and appendix: modes ordered q11, q21, q12, q22, in (3) q11, q12, q21, q22',
         'that of (3)', 'J_rf112 belongs to the first mode of link 2 (above), J_rf113 to the '
         'second of link 1.'),
        ('Table VI: density per m, modulus 6.9e-10', 'kg/m^3 and 6.9e10 N/m^2',
         '2700 kg/m^3 and 69 GPa are aluminium, of which such arms are made.'),
        ('Table VI: J_1 to J_3 without a place', 'see section 5.4', 'The readings are compared '
         'there.'),
        ('(7): W_1, W_2 of size n x n', 'n_t x n_t', 'X_1 and X_2 have n_t entries; section 5.5 '
         'itself weighs the modal rates.'),
        ('section 5.1: boundary conditions "in (26)"', '(28)', '(26) defines the state.'),
    ]
