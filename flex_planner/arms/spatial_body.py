"""Rigid bodies in space as data sheets and URDF files describe them."""

from __future__ import annotations

from dataclasses import dataclass

from flex_planner.arms.mechanism import RigidBody
from flex_planner.arms.quantities import check_quantity
from flex_planner.base.errors import InvalidValueError
from flex_planner.base.validation import Array, vector
import numpy as np
from numpy.typing import ArrayLike

__all__ = ['SpatialBody']

Point = tuple[float, float, float]
Matrix = tuple[Point, Point, Point]

IDENTITY: Matrix = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))
NO_INERTIA: Matrix = ((0.0, 0.0, 0.0),) * 3
# of the largest principal moment
_ROUNDING = 1e-9
# of entries of a rotation
_ORTHONORMAL = 1e-6


@dataclass(frozen=True, slots=True, kw_only=True)
class SpatialBody:
    """
    A rigid body.

    Parameters
    ----------
    mass : float
        >= 0 [kg].
    center_of_mass : array_like, shape (3,)
        In the frame that carries it [m].
    inertia : array_like, shape (3,) or (3, 3)
        About the centre of mass: principal moments along the axes of that frame, or a symmetric
        matrix without negative eigenvalues [kg m^2].

    Raises
    ------
    InvalidValueError
        If a value breaks its bound.

    """

    mass: float = 0.0
    center_of_mass: Point = (0.0, 0.0, 0.0)
    inertia: Matrix = NO_INERTIA

    def __post_init__(self) -> None:
        check_quantity('mass', self.mass, 'mass', at_least=0)
        object.__setattr__(self, 'center_of_mass',
                           point('center_of_mass', self.center_of_mass))
        object.__setattr__(self, 'inertia', inertia_matrix('inertia', self.inertia))

    @property
    def is_nothing(self) -> bool:
        """Return whether it has neither mass nor inertia."""
        return not self.mass and not np.any(self.inertia)

    @property
    def is_possible(self) -> bool:
        """Return whether a body can have it: no principal moment is above the others' sum."""
        moments = np.linalg.eigvalsh(np.array(self.inertia))
        return bool(moments[2] <= (1 + 1e-6) * (moments[0] + moments[1]))

    def about(self, origin: Array, axes: Array) -> RigidBody:
        """
        Return the same body by its moments about the origin of another frame.

        Parameters
        ----------
        origin : numpy.ndarray, shape (3,)
            Where the origin of the body's frame is in the other one [m].
        axes : numpy.ndarray, shape (3, 3)
            Columns are axes of the body's frame in the other one.

        """
        place = origin + axes @ np.array(self.center_of_mass)
        own = clean(axes @ np.array(self.inertia) @ axes.T)
        return RigidBody(mass=self.mass, first_moment=self.mass * place,
                         inertia=own + self.mass * spread(place))


def spread(place: Array) -> Array:
    """Return the inertia of a mass of 1 kg at a place about the origin, shape (3, 3)."""
    matrix: Array = place @ place * np.eye(3) - np.outer(place, place)
    return matrix


def join_bodies(*bodies: SpatialBody) -> SpatialBody:
    """Return what bodies that are fixed to the same frame are together."""
    mass, given = sum(body.mass for body in bodies), [one for one in bodies if not one.is_nothing]
    if len(given) < 2 or not mass:
        return given[0] if given else SpatialBody()
    wholes = [body.about(np.zeros(3), np.eye(3)) for body in given]
    center: Array = np.sum([body.first_moment for body in wholes], axis=0) / mass
    inertia = np.sum([body.inertia for body in wholes], axis=0) - mass * spread(center)
    return SpatialBody(mass=mass, center_of_mass=as_point(center),
                       inertia=as_matrix((inertia + inertia.T) / 2))


def place_body(body: SpatialBody, origin: Array, axes: Array) -> SpatialBody:
    """Return a body in another frame, see `SpatialBody.about`."""
    inertia = axes @ np.array(body.inertia) @ axes.T
    place = origin + axes @ np.array(body.center_of_mass)
    return SpatialBody(mass=body.mass, center_of_mass=as_point(place),
                       inertia=as_matrix((inertia + inertia.T) / 2))


def point(field: str, values: ArrayLike) -> Point:
    """Return three checked lengths [m]."""
    x, y, z = (check_quantity(f'{field}[{i}]', entry, 'length')
               for i, entry in enumerate(vector(field, values, 3, unit='m')))
    return x, y, z


def as_point(values: ArrayLike) -> Point:
    """Return three numbers as a tuple."""
    x, y, z = (float(entry) for entry in np.asarray(values))
    return x, y, z


def as_matrix(values: ArrayLike) -> Matrix:
    """Return a matrix of three rows as tuples."""
    x, y, z = (as_point(row) for row in np.asarray(values))
    return x, y, z


def square(field: str, values: ArrayLike) -> Array:
    """Return a checked matrix (3, 3)."""
    if not isinstance(values, (list, tuple, np.ndarray)) or len(values) != 3:
        raise InvalidValueError(field, values, 'three rows of three numbers')
    return np.array([vector(f'{field}[{i}]', row, 3) for i, row in enumerate(values)])


def rotation(field: str, values: ArrayLike) -> Matrix:
    """Return a checked rotation, given by its matrix or by roll, pitch and yaw [rad]."""
    if np.ndim(values) == 1:
        return as_matrix(turn_rpy(*vector(field, values, 3, unit='rad')))
    matrix = square(field, values)
    if (np.abs(matrix @ matrix.T - np.eye(3)).max() > _ORTHONORMAL
            or np.linalg.det(matrix) < 0):
        raise InvalidValueError(field, matrix.tolist(), 'a rotation: roll, pitch and yaw in rad, '
                                'or a matrix with orthonormal rows and determinant 1')
    return as_matrix(matrix)


def turn_rpy(roll: float, pitch: float, yaw: float) -> Array:
    """Return the rotation by roll, pitch and yaw about fixed axes, as in URDF, (3, 3) [rad]."""
    matrix = np.eye(3)
    for axis, angle in enumerate((roll, pitch, yaw)):
        c, s = np.cos(angle), np.sin(angle)
        turn, (i, k) = np.eye(3), ((axis + 1) % 3, (axis + 2) % 3)
        turn[i, i] = turn[k, k] = c
        turn[k, i], turn[i, k] = s, -s
        matrix = turn @ matrix
    return clean(matrix)


def clean(matrix: Array) -> Array:
    """Return a matrix whose entries that are only rounding are exactly what they should be."""
    size = np.abs(matrix).max(initial=0.0)
    near = np.round(matrix)
    cleaned: Array = np.where(np.abs(matrix) < 1e-14 * size, 0.0, matrix)
    return np.where(np.abs(matrix - near) < 1e-14, near, cleaned) + 0.0


def inertia_matrix(field: str, values: ArrayLike) -> Matrix:
    """Return a checked inertia of three principal moments, or a symmetric matrix [kg m^2]."""
    if np.ndim(values) == 1:
        moments = vector(field, values, 3, at_least=0, unit='kg m^2')
        matrix = np.diag(moments)
    else:
        matrix = square(field, values)
    size = np.abs(matrix).max()
    if np.abs(matrix - matrix.T).max() > _ROUNDING * size:
        raise InvalidValueError(field, matrix.tolist(), 'symmetric')
    if np.linalg.eigvalsh(matrix)[0] < -_ROUNDING * size:
        raise InvalidValueError(field, matrix.tolist(), 'without negative principal moments')
    for entry in matrix.ravel():
        check_quantity(field, abs(float(entry)), 'inertia', at_least=0)
    return as_matrix(matrix)
