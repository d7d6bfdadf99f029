"""
The optimal control problem as a nonlinear programme: discretised first, optimised then.

Every collocation point has the unknowns y = (q, q', q'', w) with w = u + K_2 q', so that eq. (15)
is -K_1 <= w <= K_1 and eq. (3) one nonlinear row a coordinate. The rows that tie the points
together are linear; their multipliers give the costates. CasADi is imported only to derive it.

"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from flex_planner.arms.arm import Arm
from flex_planner.base.progress import Monitor, StopReason
from flex_planner.base.validation import Array
import numpy as np
from numpy.polynomial import legendre
from numpy.typing import NDArray

SCHEMES = ('gauss', 'radau', 'hermite_simpson')
Indices = NDArray[np.intp]


@dataclass(frozen=True, slots=True, eq=False)
class Mesh:
    """
    A collocation method on N intervals of a unit of time.

    The values are x at K points, then at those nodes that are no points. They satisfy
    ``P x = Q x'``, r rows an interval, of which the last leads to its right node; two more rows of
    P pick the first and the last node.

    Attributes
    ----------
    breaks : numpy.ndarray, shape (N + 1,)
        Ends of the intervals.
    points, weights : numpy.ndarray, shape (K,)
        Collocation times and the quadrature's weights.
    nodes : numpy.ndarray, shape (N + 1,)
        Which values they are.
    P, Q : scipy.sparse.csr_matrix
        Shapes (N r + 2, values) and (N r + 2, K).

    """

    breaks: Array
    points: Array
    weights: Array
    nodes: Indices
    P: Any
    Q: Any

    @classmethod
    def of(cls, scheme: str, degree: int, intervals: int, breaks: Array | None = None) -> Mesh:
        """
        Return one of `SCHEMES`; the degree counts the points an interval of the first two.

        On equal intervals, unless their ends from 0 to 1 are given.

        """
        if breaks is None:
            breaks = np.linspace(0, 1, intervals + 1, dtype=np.float64)
        c, steps = _collocation_points(scheme, degree), np.diff(breaks)
        index = np.arange(intervals)[:, None] * (c.size - (c[0] == 0)) + np.arange(c.size)
        targets, values, nodes = _values(index, c)
        integrals = _integrals(c, targets) * steps[:, None, None]
        weights = np.bincount(index.ravel(), integrals[:, -1].ravel()).astype(float)
        points = np.empty_like(weights)
        points[index] = breaks[:-1, None] + steps[:, None] * c
        rows = np.arange(values.size).reshape(values.shape)
        height, width = values.size + 2, max(points.size, int(nodes.max()) + 1)
        P = (_sparse((height, width), 1.0, rows, values)
             + _sparse((height, width), -1.0, rows, nodes[:-1, None])
             + _sparse((height, width), 1.0, values.size + np.arange(2), nodes[[0, -1]]))
        Q = _sparse((height, points.size), integrals, rows[:, :, None], index[:, None, :])
        return cls(breaks, points, weights, nodes, P, Q)

    def costates(self, multipliers: Array) -> tuple[Array, Array]:
        """Return psi at nodes and at points from multipliers of all rows (N r + 2, 2 n_t)."""
        of_intervals = multipliers[:-2].reshape(self.nodes.size - 1, -1, multipliers.shape[1])
        inner = -of_intervals[1:].sum(axis=1)
        if self.nodes[0] == 0:
            # the nodes are points of both their intervals: the mean of what both sides say, in
            # which the parts of f cancel but for O(h^4)
            inner = (inner - of_intervals[:-1, -1]) / 2
        at_nodes = np.vstack([-multipliers[-2], inner, multipliers[-1]])
        return at_nodes, -(self.Q.T @ multipliers) / self.weights[:, None]


def _collocation_points(scheme: str, degree: int) -> Array:
    """Return the points of an interval, from 0 to 1."""
    if scheme == 'hermite_simpson':
        return np.array([0.0, 0.5, 1.0])
    if scheme == 'gauss':
        gauss: Array = (legendre.leggauss(degree)[0] + 1) / 2
        return gauss
    inner = legendre.legroots([0.0] * (degree - 1) + [-1.0, 1.0])[:-1]
    return np.append((inner + 1) / 2, 1.0)


def _values(index: Indices, c: Array) -> tuple[Array, Indices, Indices]:
    """Return where an interval's rows lead, to which values (N, r), and the nodes (N + 1,)."""
    N, K = len(index), int(index[-1, -1]) + 1
    shared = int(c[0] == 0)
    first = 0 if shared else K
    if c[-1] == 1:
        return c[shared:], index[:, shared:], np.append(first, index[:, -1])
    nodes = K + np.arange(N + 1)
    return np.append(c, 1.0), np.hstack([index, nodes[1:, None]]), nodes


def _integrals(points: Array, targets: Array) -> Array:
    """Return the integrals of the Lagrange polynomials of points from 0 to each target."""
    lagrange = np.linalg.inv(legendre.legvander(2 * points - 1, points.size - 1))
    antiderivatives = legendre.legint(lagrange, lbnd=-1) / 2
    integrals: Array = legendre.legvander(2 * targets - 1, points.size) @ antiderivatives
    return integrals


def _sparse(shape: tuple[int, int], *triplets: Any) -> Any:
    """Return a sparse matrix from entries, rows and columns that are broadcast."""
    from scipy.sparse import csr_matrix

    entries, rows, columns = (part.ravel() for part in np.broadcast_arrays(*triplets))
    return csr_matrix((entries, (rows, columns)), shape)


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
    def of(cls, arm: Arm) -> _Point:
        """Derive them."""
        import casadi as ca
        from flex_planner.dynamics.planar_chain import build_chain

        chain, n, n_t = build_chain(arm), arm.n_joints, arm.n_coordinates
        a, w, s, mu = (ca.SX.sym(*each) for each in (('a', n_t), ('w', n), ('s',), ('mu', n_t)))
        stall, slope, R = (ca.SX.sym(name, n) for name in ('K_1', 'K_2', 'R'))
        W_1, W_2 = ca.SX.sym('W_1', n_t), ca.SX.sym('W_2', n_t)
        q, v = chain.coordinates, chain.rates
        y, p = ca.vertcat(q, v, a, w), ca.vertcat(chain.payload_mass, chain.payload_inertia,
                                                  chain.rigidity, stall, slope, R, W_1, W_2)
        u = w - slope * v[:n]
        L = (ca.dot(W_1 * q, q) + ca.dot(W_2 * v, v) + ca.dot(R * u, u)) / 2
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

    Unknowns are y at the points, then x at the nodes that are no points, then the payload if it
    is free; parameters are p, x at both ends, the duration, and the price of a free payload. All
    rows are equations: those of the mesh, then eq. (3).

    """

    expressions: dict[str, Any]
    derivatives: dict[str, Any]

    @classmethod
    def of(cls, arm: Arm, mesh: Mesh, free_payload: bool = False) -> Programme:
        """Derive it."""
        import casadi as ca

        point, K, n_x, free = _Point.of(arm), mesh.points.size, 2 * arm.n_coordinates, free_payload
        size, outer = point.cost.numel_in(0), (mesh.P.shape[1] - K) * n_x
        X = ca.MX.sym('X', K * size + outer + free)
        p, price = ca.MX.sym('p', point.cost.numel_in(1)), ca.MX.sym('sigma', int(free))
        ends, duration = ca.MX.sym('ends', 2 * n_x), ca.MX.sym('t_f')
        used = ca.vertcat(X[-1], p[1:]) if free else p
        points = ca.reshape(X[:K * size], size, K), ca.repmat(used, 1, K)
        weights, linear = duration * ca.DM(mesh.weights).T, _linear_rows(mesh, n_x, size, duration)
        linear = ca.horzcat(linear, ca.MX(linear.size1(), int(free)))
        given = ca.vertcat(ca.MX(linear.size1() - 2 * n_x, 1), ends)
        L, L_slope = point.cost.map(K)(*points)
        force, force_slope = point.force.map(K)(*points)
        f, g = ca.dot(weights, L), ca.vertcat(linear @ X - given, ca.vec(force))
        s, multipliers = ca.MX.sym('s'), ca.MX.sym('lambda', g.numel())
        mu = ca.reshape(multipliers[linear.size1():], -1, K)
        hessian = ca.diagcat(_diagonal(point.hessian.map(K)(*points, s * weights, mu), K),
                             ca.MX(outer, outer))
        f_slope = ca.vertcat(ca.vec(L_slope * ca.repmat(weights, size, 1)), ca.DM.zeros(outer))
        force_rows = ca.horzcat(_diagonal(force_slope, K), ca.MX(force.numel(), outer))
        if free:
            share, bend = point.share.map(K)(*points), point.bend.map(K)(*points, mu)
            f, f_slope = f - price * X[-1], ca.vertcat(f_slope, -price)
            force_rows = ca.horzcat(force_rows, ca.vec(share))
            column = ca.vertcat(ca.vec(bend), ca.MX(outer, 1))
            hessian = ca.blockcat(hessian, column, ca.MX(1, K * size + outer), ca.MX(1, 1))
        inputs = [X, ca.vertcat(p, ends, duration, price)]
        return cls({'x': X, 'p': inputs[1], 'f': f, 'g': g}, {
            'grad_f': ca.Function('grad_f', inputs, [f, f_slope]),
            'jac_g': ca.Function('jac_g', inputs, [g, ca.vertcat(linear, force_rows)]),
            'hess_lag': ca.Function('hess_lag', [*inputs, s, multipliers], [hessian])})

    def ipopt(self, options: dict[str, Any], watch: Any) -> Any:
        """Return its solver, a CasADi function."""
        import casadi as ca

        every: dict[str, Any] = {
            **self.derivatives, 'ipopt': options, 'iteration_callback': watch, 'print_time': False,
            'show_eval_warnings': False, 'calc_lam_p': False}
        return ca.nlpsol('direct', 'ipopt', self.expressions, every)

    def watch(self, intervals: int) -> Any:
        """Return a callback that asks the monitor it follows after every iteration."""
        import casadi as ca

        sizes = {name: self.expressions[name].numel() for name in ('x', 'p', 'f', 'g')}

        class Watch(ca.Callback):
            def __init__(self) -> None:
                ca.Callback.__init__(self)
                self.follow(Monitor())
                self.construct('watch', {})

            def follow(self, monitor: Monitor) -> None:
                self.monitor = monitor
                self.stopped: StopReason | None = None
                self.error: BaseException | None = None

            def get_n_in(self) -> int:
                return int(ca.nlpsol_n_out())

            def get_sparsity_in(self, i: int) -> Any:
                return ca.Sparsity.dense(sizes[ca.nlpsol_out(i).removeprefix('lam_')], 1)

            def eval(self, arg: Any) -> list[int]:  # noqa: A003,RUF100
                try:
                    self.monitor.step(float(ca.norm_inf(arg[2])), intervals)
                    self.stopped = self.monitor.stop_reason()
                except BaseException as error:  # CasADi would print and drop it
                    self.error = error
                return [int(self.stopped is not None or self.error is not None)]

        return Watch()


def _linear_rows(mesh: Mesh, n_x: int, size: int, duration: Any) -> Any:
    """Return the matrix of the mesh's rows for all unknowns; x' = (q', q'') follows x in y."""
    import casadi as ca

    P, Q = ca.DM(mesh.P.tocsc()), ca.DM(mesh.Q.tocsc())
    value, K = ca.DM.eye(n_x), Q.size2()
    in_point = ca.horzcat(value, ca.DM(n_x, size - n_x))
    rate = ca.horzcat(ca.DM(n_x, n_x // 2), value, ca.DM(n_x, size - n_x - n_x // 2))
    at_points = ca.kron(P[:, :K], in_point) - duration * ca.kron(Q, rate)
    return ca.horzcat(at_points, ca.kron(P[:, K:], value))


def _diagonal(blocks: Any, count: int) -> Any:
    """Return equal sparse blocks that stand side by side as a block-diagonal matrix."""
    import casadi as ca

    pattern = ca.horzsplit(blocks.sparsity(), blocks.size2() // count)
    return ca.sparsity_cast(blocks, ca.diagcat(*pattern))
