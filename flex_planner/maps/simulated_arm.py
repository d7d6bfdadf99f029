"""The arm that carries out the plans of a map of residual vibrations."""

from __future__ import annotations

from dataclasses import dataclass, field
import math

from flex_planner.arms.arm import Arm
from flex_planner.base.validation import number, vector
from flex_planner.control.joint_controller import Gains
from flex_planner.optimal_control.task import MAX_PAYLOAD
from flex_planner.simulation.mismatch import Mismatch
from flex_planner.simulation.settling import MAX_SETTLING, MIN_SETTLING


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class SimulatedArm:
    """
    The simulated arm of a study, its payload and its controller.

    Parameters
    ----------
    mismatch : Mismatch
        Its differences from the planned arm.
    payload_mass : float
        Its payload, >= 0 [kg]; NaN for the planned one.
    gains : Gains or None
        Of its joint controller; None for the planned torques alone.
    settling : float
        Time to watch it after its arrival, 0.001 to 1000 [s].

    """

    mismatch: Mismatch = field(default_factory=Mismatch)
    payload_mass: float = math.nan
    gains: Gains | None = None
    settling: float = 1.0

    @property
    def has_payload(self) -> bool:
        """Return whether it has a payload of its own."""
        return not math.isnan(self.payload_mass)

    def check(self, arm: Arm) -> None:
        """
        Refuse values that are out of bounds, or do not fit an arm.

        Raises
        ------
        InvalidValueError
            Naming the field as in a study file.

        """
        number('settling', self.settling, at_least=MIN_SETTLING, at_most=MAX_SETTLING, unit='s')
        self.mismatch.apply(arm)
        if self.has_payload:
            number('mismatch.payload_mass', self.payload_mass, at_least=0, at_most=MAX_PAYLOAD,
                   unit='kg')
        if self.gains is not None:
            for name in ('stiffness', 'damping'):
                vector(f'gains.{name}', getattr(self.gains, name), arm.n_joints)
