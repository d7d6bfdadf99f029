"""
The optimal control problem as a nonlinear programme: discretised first, optimised then.

Every collocation point has the unknowns y = (q, q', q'', w) with w = u + K_2 q', so that eq. (15)
is -K_1 <= w <= K_1 and eq. (3) one nonlinear row per coordinate. A cap of the torque is a linear
row, where a motor has one. Where torques have rates w is a state, and w' another unknown; the
rate of a torque is w' - K_2 q'', a linear row. The rows that tie the points together are linear;
their multipliers give the costates. CasADi is imported only to derive it.

"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from flex_planner.arms.arm import Arm
from flex_planner.base.progress import Monitor, StopReason
from flex_planner.optimal_control.direct.mesh import Columns, Transcription
from flex_planner.optimal_control.direct.point_layout import PointLayout
from flex_planner.optimal_control.parameters import (
    ParameterSymbols,
    payload_index,
    torque_slope_slice,
)
from flex_planner.optimal_control.torque_limits import TorqueLimits


@dataclass(frozen=True, slots=True, eq=False)
class _Point:
    """
    CasADi functions of one point with unknowns y and parameters p.

    ``cost`` (y, p) -> L, dL/dy; ``force`` (y, p) -> M a + h - B u, its Jacobian; ``hessian``
    (y, p, s, mu) -> upper triangle of the Hessian of s L + mu^T (M a + h - B u); ``share``
    (y, p) -> d(M a + h)/dm_p, in which the force is linear; ``bend`` (y, p, mu) -> the gradient
    of mu^T times that.

    """

    cost: Any
    force: Any
    hessian: Any
    share: Any
    bend: Any

    @classmethod
    def of(cls, arm: Arm, layout: PointLayout) -> _Point:
        """Derive them; where torques have rates S follows the other parameters."""
        import casadi as ca
        from flex_planner.dynamics.build_chain import build_chain
        from flex_planner.optimal_control.running_cost import running_cost

        chain, n, n_t = build_chain(arm), arm.n_joints, arm.n_coordinates
        a, w, s, mu = (ca.SX.sym(*each) for each in (('a', n_t), ('w', n), ('s',), ('mu', n_t)))
        turning, weights = (ca.SX.sym(name, n * layout.with_rates) for name in ('dw', 'S'))
        q, v, symbols = chain.coordinates, chain.rates, ParameterSymbols.of(chain)
        y = (ca.vertcat(q, v, w, a, turning) if layout.with_rates else ca.vertcat(q, v, a, w))
        p, slope = ca.vertcat(*symbols.stack(), weights), symbols['torque_slope']
        u = w - slope * v[:n]
        L = running_cost(symbols, q, v, u)
        if layout.with_rates:
            L += ca.dot(weights, (turning - slope * a[:n])**2) / 2
        force = chain.inverse_dynamics(a) - ca.vertcat(u, ca.SX(n_t - n, 1))
        hessian = ca.triu(ca.hessian(s * L + ca.dot(mu, force), y)[0])
        share = ca.densify(ca.jacobian(force, chain.payload_mass))
        bend = ca.densify(ca.gradient(ca.dot(mu, share), y))
        return cls(ca.Function('cost', [y, p], [L, ca.densify(ca.gradient(L, y))]),
                   ca.Function('force', [y, p], [force, ca.jacobian(force, y)]),
                   ca.Function('hessian', [y, p, s, mu], [hessian]),
                   ca.Function('share', [y, p], [share]),
                   ca.Function('bend', [y, p, mu], [bend]))


@dataclass(frozen=True, slots=True, eq=False)
class Programme:
    """
    A nonlinear programme and its derivatives, as CasADi's ``nlpsol`` takes them.

    Unknowns are y at the points, then x at the nodes that are no points, then the payload m_p and
    the duration t_f, which bounds fix or free. Parameters are p, in which the payload does not
    count, x at both ends, and three prices: the cost is ``prices[0] J - prices[1] m_p +
    prices[2] t_f``. Rows are equations, those of the mesh, then eq. (3); then come the torques of
    motors that have a cap, and the rates of torques, where they have any.

    """

    expressions: dict[str, Any]
    derivatives: dict[str, Any]

    @classmethod
    def of(cls, arm: Arm, mesh: Transcription, *, with_rates: bool = False) -> Programme:
        """Derive it."""
        import casadi as ca

        layout = PointLayout(arm.n_coordinates, arm.n_joints, with_rates)
        point, K, n_x = _Point.of(arm, layout), mesh.weights.size, layout.states
        size, outer = point.cost.numel_in(0), (mesh.P.shape[1] - K) * n_x
        X, p = ca.MX.sym('X', K * size + outer + 2), ca.MX.sym('p', point.cost.numel_in(1))
        ends, prices = ca.MX.sym('ends', 2 * n_x), ca.MX.sym('prices', 3)
        motion, duration, at = X[:-2], X[-1], payload_index()
        used = ca.vertcat(p[:at], X[-2], p[at + 1:])
        points = ca.reshape(X[:K * size], size, K), ca.repmat(used, 1, K)
        weights, (constant, growing) = ca.DM(mesh.weights).T, _linear_rows(mesh, layout)
        given = ca.vertcat(ca.MX(constant.size1() - 2 * n_x, 1), ends)
        moved = growing @ motion
        L, L_slope = point.cost.map(K)(*points)
        force, force_slope = point.force.map(K)(*points)
        share, mean = point.share.map(K)(*points), ca.dot(weights, L)
        f = prices[0] * duration * mean - prices[1] * X[-2] + prices[2] * duration
        torques = _limited_rows(arm, layout, used)
        g = ca.vertcat(constant @ motion - duration * moved - given, ca.vec(force),
                       ca.vec(torques @ points[0]))
        s, multipliers = ca.MX.sym('s'), ca.MX.sym('lambda', g.numel())
        in_mesh, of_force, _ = ca.vertsplit(multipliers, [
            0, constant.size1(), constant.size1() + force.numel(), g.numel()])
        mu = ca.reshape(of_force, -1, K)
        along = ca.vertcat(ca.vec(L_slope * ca.repmat(weights, size, 1)), ca.DM.zeros(outer))
        f_slope = ca.vertcat(prices[0] * duration * along, -prices[1],
                             prices[0] * mean + prices[2])
        rows = ca.blockcat([
            [constant - duration * growing, ca.MX(moved.numel(), 1), -moved],
            [ca.horzcat(_diagonal(force_slope, K), ca.MX(force.numel(), outer)), ca.vec(share),
             ca.MX(force.numel(), 1)],
            [ca.horzcat(ca.kron(ca.DM.eye(K), torques), ca.MX(K * torques.size1(), outer)),
             ca.MX(K * torques.size1(), 1), ca.MX(K * torques.size1(), 1)]])
        bend = ca.vertcat(ca.vec(point.bend.map(K)(*points, mu)), ca.MX(outer, 1))
        hessian = ca.blockcat([
            [ca.diagcat(_diagonal(point.hessian.map(K)(
                *points, s * prices[0] * duration * weights, mu), K), ca.MX(outer, outer)),
             bend, s * prices[0] * along - growing.T @ in_mesh],
            [ca.MX(2, K * size + outer), ca.MX(2, 1), ca.MX(2, 1)]])
        inputs = [X, ca.vertcat(p, ends, prices)]
        return cls({'x': X, 'p': inputs[1], 'f': f, 'g': g}, {
            'grad_f': ca.Function('grad_f', inputs, [f, f_slope]),
            'jac_g': ca.Function('jac_g', inputs, [g, rows]),
            'hess_lag': ca.Function('hess_lag', [*inputs, s, multipliers], [hessian])})

    def ipopt(self, options: dict[str, Any], watch: Any) -> Any:
        """Return its solver, a CasADi function."""
        import casadi as ca

        every: dict[str, Any] = {
            **self.derivatives, 'ipopt': options, 'iteration_callback': watch, 'print_time': False,
            'show_eval_warnings': False, 'calc_lam_p': False}
        return ca.nlpsol('direct', 'ipopt', self.expressions, every)

    def watch(self) -> Any:
        """Return a callback that asks the monitor it follows after every iteration."""
        import casadi as ca

        sizes = {name: self.expressions[name].numel() for name in ('x', 'p', 'f', 'g')}

        class Watch(ca.Callback):
            def __init__(self) -> None:
                ca.Callback.__init__(self)
                self.follow(Monitor(), 0, [])
                self.construct('watch', {})

            def follow(self, monitor: Monitor, intervals: int,
                       raised: list[BaseException]) -> None:
                self.monitor, self.intervals, self.raised = monitor, intervals, raised
                self.stopped: StopReason | None = None
                self.error: BaseException | None = None

            def get_n_in(self) -> int:
                return int(ca.nlpsol_n_out())

            def get_sparsity_in(self, i: int) -> Any:
                return ca.Sparsity.dense(sizes[ca.nlpsol_out(i).removeprefix('lam_')], 1)

            def eval(self, arg: Any) -> list[int]:  # noqa: A003,RUF100
                try:
                    self.monitor.step(float(ca.norm_inf(arg[2])), self.intervals)
                    self.stopped = self.monitor.stop_reason()
                except BaseException as error:  # CasADi would print and drop it
                    self.error = error
                return [int(bool(self.stopped or self.error or self.raised
                                 or self.monitor.exhausted))]

        return Watch()


def _limited_rows(arm: Arm, layout: PointLayout, parameters: Any) -> Any:
    """Return rows that make of y torques w - K_2 q' with a cap, and all rates w' - K_2 q''."""
    import casadi as ca

    capped = [i for i, has in enumerate(TorqueLimits.of(arm).capped) if has]
    rows = [(i, layout.drives.start, layout.coordinates) for i in capped]
    if layout.with_rates:
        rows += [(i, layout.drive_rates.start, layout.accelerations.start)
                 for i in range(layout.joints)]
    driven, turning = ca.DM(len(rows), layout.size), ca.DM(len(rows), layout.size)
    for row, (i, drives, speeds) in enumerate(rows):
        driven[row, drives + i] = turning[row, speeds + i] = 1
    slopes = parameters[torque_slope_slice(layout.joints)][[i for i, _, _ in rows]]
    return driven - ca.diag(slopes) @ turning


def _linear_rows(mesh: Transcription, layout: PointLayout) -> tuple[Any, Any]:
    """Return A and B of the mesh's rows (A - t_f B) (y, nodes)."""
    import casadi as ca

    P, Q, n_x = _sparse(mesh.P), _sparse(mesh.Q), layout.states
    value, K = ca.DM.eye(n_x), Q.size2()
    in_point = ca.horzcat(value, ca.DM(n_x, layout.size - n_x))
    rate = ca.DM(n_x, layout.size)
    for row, column in enumerate(layout.derivatives.tolist()):
        rate[row, column] = 1
    constant = ca.horzcat(ca.kron(P[:, :K], in_point), ca.kron(P[:, K:], value))
    growing = ca.kron(Q, rate)
    others = constant.size2() - growing.size2()
    return constant, ca.horzcat(growing, ca.DM(growing.size1(), others))


def _sparse(matrix: Columns) -> Any:
    """Return CasADi's form of a sparse matrix."""
    import casadi as ca

    pattern = ca.Sparsity(*matrix.shape, matrix.starts.tolist(), matrix.rows.tolist())
    return ca.DM(pattern, matrix.values)


def _diagonal(blocks: Any, count: int) -> Any:
    """Return equal sparse blocks that stand side by side as a block-diagonal matrix."""
    import casadi as ca

    pattern = ca.horzsplit(blocks.sparsity(), blocks.size2() // count)
    return ca.sparsity_cast(blocks, ca.diagcat(*pattern))
