"""
A link of finite elements: its nodes, matrices and modes, and the integrals that are made of them.

What is of first order in the modes follows from the mass matrix M and rigid motions of the nodes;
what is of second order, and products of modes with places, from sums over nodes, each of which has
the mass that M gives it in a uniform acceleration.

"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

from flex_planner.arms.element_modes import ElementModes
from flex_planner.arms.link import MAX_MODES
from flex_planner.arms.mechanism import FlexibleBody
from flex_planner.arms.spatial_body import Point
from flex_planner.base.errors import InvalidSizeError, InvalidValueError, NotFiniteError
from flex_planner.base.validation import Array, integer
import numpy as np
from numpy.typing import ArrayLike

MAX_UNKNOWNS = 3000
# of the largest entry
_ASYMMETRY, _ROUNDING, _HELD = 1e-8, 1e-12, 1e-6
# of scaled matrices: what a negative eigenvalue may be by rounding
_NEGATIVE = 1e-9
# of the mass: by how much it may differ between directions
_DIRECTIONS = 1e-6
# of the length: where the line of a link may begin and end
_NEAR = 1e-6


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class ElementModel:
    """
    A link of finite elements with modes that are clamped at its joint.

    Parameters
    ----------
    nodes : array_like, shape (k, 3)
        Where nodes are in the frame of the link, unbent [m].
    mass, stiffness : array_like, shape (d k, d k)
        M and K, symmetric, without negative eigenvalues. The d = 3 or 6 unknowns of a node are its
        displacement along x, y, z and, of 6, its turns about them, node after node [m, rad].
    modes : array_like, shape (d k, m)
        Displacements of all nodes by each mode, 1 to 8 of them.
    root_nodes : sequence of int
        Nodes that are fixed to the joint, counted from 0; no mode moves them.
    tip_nodes : sequence of int
        Nodes that carry the end of the link: one with 6 unknowns, or more, of which the motion as
        a rigid body is taken.
    line_nodes : sequence of int
        Nodes whose displacements are those of the line from the joint to the end, in the order of
        their places along it, as it is drawn and kept out of regions; by default `tip_nodes`
        alone, so that it stays straight.

    Raises
    ------
    InvalidValueError
        If a value breaks its bound; errors of shapes are `InvalidSizeError`.

    """

    nodes: Array
    mass: Array
    stiffness: Array
    modes: Array
    root_nodes: Sequence[int]
    tip_nodes: Sequence[int]
    line_nodes: Sequence[int] = ()

    if TYPE_CHECKING:
        # arrays are made of anything like one; type checkers would insist on arrays
        def __init__(self, *, nodes: ArrayLike, mass: ArrayLike, stiffness: ArrayLike,
                     modes: ArrayLike, root_nodes: Sequence[int], tip_nodes: Sequence[int],
                     line_nodes: Sequence[int] = ...) -> None:
            """Accept a list where an array is kept."""

    def __post_init__(self) -> None:
        for name in ('nodes', 'mass', 'stiffness', 'modes'):
            object.__setattr__(self, name, _finite(name, getattr(self, name)))
        if self.nodes.ndim != 2 or self.nodes.shape[1] != 3 or not len(self.nodes):
            raise InvalidSizeError('nodes', f'shape {self.nodes.shape}', 'shape (k, 3)')
        self._check_sizes()
        for name in ('root_nodes', 'tip_nodes', 'line_nodes'):
            object.__setattr__(self, name, tuple(
                integer(f'{name}[{i}]', one, at_least=0, at_most=len(self.nodes) - 1)
                for i, one in enumerate(np.ravel(getattr(self, name)).tolist())))
        for name in ('root_nodes', 'tip_nodes'):
            if not getattr(self, name):
                raise InvalidSizeError(name, 'no node', 'one at least')
        for name in ('mass', 'stiffness'):
            object.__setattr__(self, name, _semidefinite(name, getattr(self, name)))
        held = np.abs(self._by_node()[list(self.root_nodes)]).max()
        if held > _HELD * np.abs(self.modes).max():
            raise InvalidValueError('modes', f'moving root_nodes by up to {held:g}',
                                    '0 at root_nodes: modes are those of the clamped link')

    def _check_sizes(self) -> None:
        """Refuse matrices that do not fit the nodes, or one another."""
        k, size = len(self.nodes), len(self.mass)
        if self.mass.shape not in ((3 * k, 3 * k), (6 * k, 6 * k)):
            raise InvalidSizeError('mass', f'shape {self.mass.shape}',
                                   f'shape {(3 * k, 3 * k)} or {(6 * k, 6 * k)}: 3 or 6 unknowns '
                                   'per node')
        if size > MAX_UNKNOWNS:
            raise InvalidSizeError('mass', f'{size} unknowns', f'{MAX_UNKNOWNS} at most')
        if self.stiffness.shape != self.mass.shape:
            raise InvalidSizeError('stiffness', f'shape {self.stiffness.shape}',
                                   f'shape {self.mass.shape}, that of mass')
        if self.modes.ndim != 2 or len(self.modes) != size or not (
                1 <= self.modes.shape[1] <= MAX_MODES):
            raise InvalidSizeError('modes', f'shape {self.modes.shape}',
                                   f'shape ({size}, m) with m from 1 to {MAX_MODES}')

    def reduce(self, end: Point, damping_ratio: float = 0.0) -> ElementModes:
        """
        Return the modes of a link with the integrals over it.

        Parameters
        ----------
        end : tuple of float, shape (3,)
            Where the next joint or the tip is, in the frame of the link [m].
        damping_ratio : float
            Of each mode by itself.

        Raises
        ------
        InvalidValueError
            If the matrices are none of a body that bends, or `tip_nodes` do not say how the end
            turns.

        """
        body = self._body(np.array(end))
        shares, line = self._line(np.array(end), body.tip_displacement)
        return ElementModes(body=body, shares=shares, line=line, damping_ratio=damping_ratio)

    @property
    def _per_node(self) -> int:
        return len(self.mass) // len(self.nodes)

    def _by_node(self) -> Array:
        """Return the modes by nodes, shape (k, d, m)."""
        return self.modes.reshape(len(self.nodes), self._per_node, -1)

    def _rigid_motions(self) -> Array:
        """Return displacements along and about the axes of the link, shape (d k, 6)."""
        moved = np.zeros((len(self.nodes), self._per_node, 6))
        moved[:, :3, :3] = np.eye(3)
        for axis in range(3):
            moved[:, :3, 3 + axis] = np.cross(np.eye(3)[axis], self.nodes)
        if self._per_node == 6:
            moved[:, 3:, 3:] = np.eye(3)
        return moved.reshape(-1, 6)

    def _body(self, end: Array) -> FlexibleBody:
        """Return the integrals."""
        rigid, phi = self._rigid_motions(), self._by_node()[:, :3]
        loads = self.mass @ rigid
        inertia, coupling = rigid.T @ loads, loads.T @ self.modes
        # of nodes: their share of the mass in a uniform acceleration
        shares = np.einsum('iaa->i', loads.reshape(len(self.nodes), -1, 6)[:, :3, :3]) / 3
        places = np.einsum('i,iaj,ib->jab', shares, phi, self.nodes)
        pairs = np.einsum('i,iaj,ibk->jkab', shares, phi, phi)
        about = np.einsum('i,iaj->aj', shares, np.cross(self.nodes[:, :, None], phi, axis=1))
        by_mode = phi.swapaxes(1, 2)
        crossed = np.cross(by_mode[:, :, None], by_mode[:, None])
        moved, turned = self._tip(end)
        none = np.zeros((3, *pairs.shape[:2]))
        return FlexibleBody(
            mass=_checked_mass(inertia[:3, :3]),
            first_moment=_clean(-inertia[[4, 5, 3], [2, 0, 1]]), inertia=_clean(inertia[3:, 3:]),
            displacement=_clean(coupling[:3]), inertia_slope=_clean(_spread(places)),
            inertia_bend=_clean(_spread(pairs)), moment=_clean(coupling[3:]),
            cross_moment=_clean(np.einsum('i,ikja->kja', shares, crossed)),
            gram=_modal('mass', self.mass, self.modes),
            stiffness=_modal('stiffness', self.stiffness, self.modes),
            damping=np.zeros(self.modes.shape[1]), tip=end, tip_displacement=_clean(moved),
            tip_turn=_clean(turned),
            # with what sums over nodes miss of the moment
            spin=_clean(coupling[3:] - about), shortening=none, tip_shortening=none)

    def _tip(self, end: Array) -> tuple[Array, Array]:
        """Return how modes displace and turn the end, fixed to the nodes of the tip, (3, m)."""
        chosen = list(self.tip_nodes)
        motions = self._rigid_motions().reshape(len(self.nodes), -1, 6)[chosen].reshape(-1, 6)
        moved = self._by_node()[chosen].reshape(-1, self.modes.shape[1])
        # about the end
        motions[:, 3:] -= motions[:, :3] @ _crossing(end)
        solution, _, rank, _ = np.linalg.lstsq(motions, moved, rcond=_ROUNDING)
        found = np.asarray(solution, dtype=np.float64)
        if rank < 6:
            raise InvalidValueError('tip_nodes', chosen, 'one node with turns, or three that are '
                                    'not in a line: they must say how the end turns')
        return found[:3], found[3:]

    def _line(self, end: Array, moved: Array) -> tuple[Array, Array]:
        """Return stations of the line to the end, and what modes displace them by."""
        size = float(end @ end)
        if not size:
            raise InvalidValueError('end', end.tolist(), 'apart from the joint where the link is '
                                    'one of finite elements')
        chosen = list(self.line_nodes)
        shares = self.nodes[chosen] @ end / size
        inside = (shares > _NEAR) & (shares < 1 - _NEAR)
        if not (np.diff(shares) > 0).all():
            raise InvalidValueError('line_nodes', chosen,
                                    'in the order of their places from the joint to the end')
        phi = self._by_node()[chosen, :3][inside]
        stations: Array = np.concatenate([[0.0], shares[inside], [1.0]])
        line: Array = np.concatenate([np.zeros((1, *moved.shape)), phi, moved[None]])
        return stations, line


def _finite(name: str, given: ArrayLike) -> Array:
    """Return a read-only copy of an array of finite numbers."""
    try:
        array = np.array(given, dtype=float)
    except (TypeError, ValueError):
        raise InvalidValueError(name, given, 'an array of numbers') from None
    if not np.isfinite(array).all():
        raise NotFiniteError(name, 'with entries that are infinite or NaN', 'finite')
    array.setflags(write=False)
    return array


def _semidefinite(name: str, matrix: Array) -> Array:
    """Return a symmetric matrix, refused if it has negative eigenvalues."""
    away = np.abs(matrix - matrix.T).max()
    if away > _ASYMMETRY * np.abs(matrix).max():
        raise InvalidValueError(name, f'unsymmetric by up to {away:g}', 'symmetric')
    symmetric: Array = (matrix + matrix.T) / 2
    own = np.diag(symmetric)
    scale = 1 / np.sqrt(np.where(own > 0, own, 1.0))
    try:
        np.linalg.cholesky(scale[:, None] * symmetric * scale + _NEGATIVE * np.eye(len(own)))
    except np.linalg.LinAlgError:
        raise InvalidValueError(name, 'with a negative eigenvalue',
                                'positive semidefinite') from None
    symmetric.setflags(write=False)
    return symmetric


def _modal(name: str, matrix: Array, modes: Array) -> Array:
    """Return a matrix of the modes, which must be definite."""
    own = modes.T @ matrix @ modes
    own = (own + own.T) / 2
    scale = np.sqrt(np.maximum(np.diag(own), np.finfo(float).tiny))
    if np.linalg.eigvalsh(own / np.outer(scale, scale))[0] < _NEGATIVE:
        raise InvalidValueError('modes', f'dependent, or without {name}',
                                f'modes each of which has {name}, independent of the others')
    return _clean(own)


def _checked_mass(matrix: Array) -> float:
    """Return the mass, which must be the same in all directions."""
    mass = float(np.trace(matrix)) / 3
    away = np.abs(matrix - mass * np.eye(3)).max()
    if not mass > 0 or away > _DIRECTIONS * mass:
        masses = ', '.join(f'{entry:g}' for entry in np.diag(matrix))
        raise InvalidValueError('mass', f'{masses} kg along x, y, z', '> 0 and the same in all '
                                'directions: displacements x, y, z, then turns, node after node')
    return mass


def _crossing(vector: Array) -> Array:
    """Return the matrix whose columns are the axes crossed with a vector, (3, 3)."""
    crossed: Array = np.asarray(np.cross(np.eye(3), vector).T, dtype=np.float64)
    return crossed


def _spread(products: Array) -> Array:
    """Return ``trace(N) 1 - N`` for N (..., 3, 3)."""
    spread: Array = np.einsum('...aa,bc->...bc', products, np.eye(3)) - products
    return spread


def _clean(values: Array) -> Array:
    """Return an array in which entries that are only rounding are 0."""
    size = np.abs(values).max(initial=0.0)
    cleaned: Array = np.where(np.abs(values) < _ROUNDING * size, 0.0, values)
    return cleaned
