"""
The motions behind the numbers of a map, kept as starts for others like them.

The signature of a motion is a vector of all that it solves; two motions are as near as the entry
that differs most.

"""

from __future__ import annotations

from dataclasses import dataclass, fields

from flex_planner.base.validation import Array
from flex_planner.collocation import CollocationSolution, GaussRule
from flex_planner.optimal_control.motion_problem import MotionProblem, task_parameters
from flex_planner.optimal_control.parameters import Parameters
from flex_planner.optimal_control.task import Task
from flex_planner.planning.strategies.extremals import SearchStart
import numpy as np
from numpy.typing import NDArray

# how far apart the entries of a signature may be: at all, and as a share of the larger one
_REACH = {
    'start_positions': (0.2, 0.0), 'goal_positions': (0.2, 0.0), 'duration': (0.0, 0.1),
    'payload_mass': (0.1, 0.1), 'payload_inertia': (1e-3, 0.1), 'rigidity': (0.0, 0.5),
    'stall_torque': (0.0, 0.1), 'torque_slope': (0.0, 0.1), 'max_torque': (0.0, 0.1),
    'effort_weights': (0.0, 0.5),
    'position_weights': (0.1, 0.5), 'velocity_weights': (0.1, 0.5)}
# of a quantity that nobody has given a reach
_SAME = (1e-6, 1e-6)  # single precision
# what the largest payload is, or does not depend on
_NOT_SEARCHED = ('payload_mass', 'position_weights', 'velocity_weights')
_HEAD = 3  # payload, price, number of nodes
_TYPE = '<f4'


def signature_fields(task: Task) -> list[str]:
    """Return the quantity that each entry of a task's signature belongs to."""
    n = task.arm.n_joints
    parameters = task_parameters(task)
    sizes = {field.name: np.size(getattr(parameters, field.name)) for field in fields(Parameters)}
    counts = {'start_positions': n, 'goal_positions': n, 'duration': 1, **sizes}
    return [name for name, count in counts.items() for _ in range(count)]


def signature(task: Task, parameters: Parameters | None = None) -> Array:
    """Return the signature of a motion from rest to rest, shape (k,); see `signature_fields`."""
    parameters = parameters or task_parameters(task)
    return np.concatenate([task.start_positions, task.goal_positions, [task.duration],
                           parameters.stack()])


def distances(signatures: NDArray[np.floating], own: Array, names: list[str],
              *, searched: bool) -> Array:
    """
    Return the distances of motions (j, k) from one (k,), shape (j,); up to 1 is near.

    Parameters
    ----------
    signatures, own : numpy.ndarray
        Of the motions, and of the one.
    names : list of str
        See `signature_fields`.
    searched : bool
        Whether a largest payload is searched, which does not depend on weights.

    """
    counted = [k for k, name in enumerate(names) if not (searched and name in _NOT_SEARCHED)]
    there, here = signatures[:, counted].astype(np.float64), own[counted]
    least, share = np.array([_REACH.get(names[k], _SAME) for k in counted]).T
    with np.errstate(invalid='ignore', divide='ignore'):
        reach = least + share * np.maximum(np.abs(there), np.abs(here))
        apart = np.where(there == here, 0.0, np.abs(there - here) / reach)
    worst: Array = np.nan_to_num(apart, nan=np.inf).max(axis=1)
    return worst


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class KeptMotion:
    """
    A motion as a map keeps it: its unknowns at the nodes of its mesh.

    Attributes
    ----------
    signature : numpy.ndarray, shape (k,)
        What it solves.
    payload : float
        m_p [kg].
    price : float
        dJ/dm_p if a search for the largest payload solved it; 0 otherwise [1/kg].
    mesh : numpy.ndarray, shape (N + 1,)
        From 0 to the duration [s].
    nodes : numpy.ndarray, shape (N + 1, 4 n_t)
        z = (q, q', psi_1, psi_2).

    """

    signature: Array
    payload: float
    price: float
    mesh: Array
    nodes: Array

    @classmethod
    def of(cls, problem: MotionProblem, solution: CollocationSolution,
           price: float = 0.0) -> KeptMotion:
        """Return the solution of a problem as it is kept."""
        return cls(signature=signature(problem.task, problem.parameters), price=price,
                   payload=problem.parameters.payload_mass, mesh=solution.mesh,
                   nodes=solution.nodes)

    def pack(self) -> bytes:
        """Return payload, price, mesh and nodes; single precision is plenty for a start."""
        mesh, kept = np.unique(self.mesh.astype(np.float32), return_index=True)
        return np.concatenate([[self.payload, self.price, mesh.size], mesh,
                               self.nodes[kept].ravel()], dtype=np.float32).astype(_TYPE).tobytes()

    @classmethod
    def unpack(cls, own: Array, packed: bytes) -> KeptMotion:
        """Return the motion of a signature and what `pack` made of it."""
        numbers = np.frombuffer(packed, _TYPE)
        head, values = numbers[:_HEAD].tolist(), numbers[_HEAD:].astype(np.float64)
        payload, price, count = head[0], head[1], int(head[2])
        return cls(signature=own, payload=payload, price=price, mesh=values[:count],
                   nodes=values[count:].reshape(count, -1))

    def start(self) -> SearchStart:
        """Return it as the start of a search for the largest payload."""
        return SearchStart(value=self.payload, price=self.price, solution=self.solution())

    def solution(self) -> CollocationSolution:
        """Return it as a guess, linear between the nodes."""
        return CollocationSolution.from_values(self.mesh, self.nodes, GaussRule.of(2))
