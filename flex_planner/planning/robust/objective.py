"""What a plan must forgive, and what was found."""

from __future__ import annotations

from dataclasses import dataclass

from flex_planner.base.errors import InvalidTaskError, InvalidValueError
from flex_planner.base.validation import Array, number
from flex_planner.control.joint_controller import JointController
from flex_planner.optimal_control.task import Task

# larger errors than half of a value are no errors of a model any more
MAX_ERROR = 0.5
LEAST_RESIDUAL, MOST_RESIDUAL = 1e-9, 1e3
# how long links are watched after the arrival [s]
WATCHED = 1.0


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Robustness:
    """
    Residual vibration that a motion may leave on arms that differ from their model.

    Parameters
    ----------
    max_residual : float
        Largest peak-to-peak deflection of any link in the second after the arrival, under the
        joint controller, 1e-9 to 1000 [m]. What elastic joints move the stretched arm's tip by
        counts, too, and of an arm in space what all of it moves the tip by.
    stiffness_error : float
        By which share E I of all links, and what else of them is stiff, may differ from the
        model, up and down, 0 to 0.5. Springs of joints do not.
    payload_error : float
        The same of mass and inertia of the payload; one of the two must be > 0.
    controller : JointController or None
        That carries the motion out; None for 1 kHz and `default_gains`.

    Raises
    ------
    InvalidValueError
        If a value breaks its bound.

    """

    max_residual: float
    stiffness_error: float = 0.1
    payload_error: float = 0.1
    controller: JointController | None = None

    def __post_init__(self) -> None:
        number('max_residual', self.max_residual, at_least=LEAST_RESIDUAL,
               at_most=MOST_RESIDUAL, unit='m')
        for name in ('stiffness_error', 'payload_error'):
            number(name, getattr(self, name), at_least=0, at_most=MAX_ERROR)
        if not self.stiffness_error and not self.payload_error:
            raise InvalidValueError('stiffness_error', self.stiffness_error,
                                    f'> 0 and <= {MAX_ERROR:g} where payload_error is 0')

    def check(self, task: Task) -> None:
        """
        Check that it goes with a task.

        Raises
        ------
        InvalidTaskError
            If nothing of the arm bends, nothing is there of which an error is given, the motion
            does not end at rest, it has via points, or rates of torques have a price or a bound.

        """
        if not task.arm.n_passive:
            raise InvalidTaskError('max_residual is given, but the links of the arm are rigid: '
                                   'there is no vibration')
        if not task.ends_at_rest:
            raise InvalidTaskError('max_residual is given, but the motion does not end at rest')
        if task.via_points:
            raise InvalidTaskError('max_residual is given, but the motion has via points: motions '
                                   'that forgive errors of the model are not found through them')
        for name in ('torque_rate_weight', 'max_torque_rate'):
            if getattr(task, name).size:
                raise InvalidTaskError(f'{name} is given, but must be left out of motions that '
                                       'forgive errors of the model (max_residual)')
        if not task.arm.n_modes and self.stiffness_error:
            raise InvalidTaskError('stiffness_error is given, but the links of the arm are rigid, '
                                   'and springs of joints are taken as known: give payload_error '
                                   'alone')
        if not self.stiffness_error and not (task.payload_mass or task.payload_inertia):
            raise InvalidTaskError('payload_error is given, but there is no payload: give '
                                   'stiffness_error')


@dataclass(frozen=True, slots=True, kw_only=True)
class RobustTrial:
    """
    A motion on the way to one that forgives enough.

    Attributes
    ----------
    weight : float
        Of the energy with which differing arms arrive [1/J]; 0 for the plan without.
    cost : float
        J of eq. (6), without what the weight adds; ``inf`` if not solved.
    residual : float
        Largest residual bending of the arms that the weight is for [m].

    """

    weight: float
    cost: float
    residual: float


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class RobustSearch:
    """
    How a motion forgives errors of the model, and what that costs.

    Attributes
    ----------
    robustness : Robustness
        What was asked.
    met : bool
        Whether `residual` is at most what was asked.
    weight : float
        Of the motion; 0 where the plain one forgives enough [1/J].
    plain_cost, plain_residual : float
        J of eq. (6) of the motion with weight 0, and the largest residual of the arms that are
        weighed, see `weighed_errors` [m].
    errors : numpy.ndarray, shape (k, 2)
        Errors of stiffness and payload of the arms that were simulated, as shares.
    residuals : numpy.ndarray, shape (k,)
        Their residual bending: peak to peak, where it is largest, in the second after the arrival;
        ``inf`` if they run away [m].
    reason : str
        Why it is not met; empty if it is.
    trials : tuple of RobustTrial
        In this order.

    """

    robustness: Robustness
    met: bool
    weight: float
    plain_cost: float
    plain_residual: float
    errors: Array
    residuals: Array
    reason: str = ''
    trials: tuple[RobustTrial, ...] = ()

    @property
    def residual(self) -> float:
        """Return the largest of `residuals` [m]."""
        return float(self.residuals.max())
