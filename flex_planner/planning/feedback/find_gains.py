"""
The search of gains for a plan: laws are made of its model, and tried on arms that differ from it.

What is handed out was carried through the plan in simulation, with quantised encoders at the
controller's rate, on the corners of a box of errors and with two more modes per link.

"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

from flex_planner.base.errors import InvalidTaskError, NoEquilibriumError
from flex_planner.base.progress import Monitor
from flex_planner.base.validation import Array, number
from flex_planner.control.default_gains import default_gains
from flex_planner.control.joint_controller import Gains, JointController
from flex_planner.control.linear_feedback import (
    joint_feedback,
    LinearFeedback,
    pd_feedback,
    SPEED_CUTOFF,
)
from flex_planner.control.state_feedback import LinearArm, NoFeedbackError, StateFeedback
from flex_planner.planning.execution import (
    describe_controller,
    UNSTABLE_GROWTH,
)
from flex_planner.planning.feedback.carried_motion import CarriedMotion
from flex_planner.planning.feedback.differing_arm import (
    DifferingArm,
    list_differences,
    Response,
    without_friction,
)
from flex_planner.planning.feedback.gains import FeedbackGains, Record
from flex_planner.planning.plan import Plan
import numpy as np

# encoders of 16 bits
RESOLUTION = 2 * np.pi / 2**16
MAX_ERROR = 0.5
# prices of torque, and errors of the motors that observers are made for [N m]
_PRICES, _ERRORS = (10.0, 1.0, 1e-1, 1e-2, 1e-3, 1e-4), (0.003, 0.03, 0.3, 3.0)
# by how much a torque beside the motors wanders within a second [N m/sqrt(s)]
_WANDERS = 3.0, 30.0


@dataclass(frozen=True, slots=True, kw_only=True)
class GainSettings:
    """
    What gains are made for.

    Parameters
    ----------
    controller : JointController or None
        Its rate, how it holds efforts, and gains that are tried, too; None for 1 kHz and
        `default_gains`.
    encoder_resolution : float
        Of the encoders, 1e-9 to 1 [rad].
    stiffness_error, payload_error : float
        By which shares E I of all links, and mass and inertia of the payload, may differ from the
        model, up and down, 0 to 0.5.

    Raises
    ------
    InvalidValueError
        If a value breaks its bound.

    """

    controller: JointController | None = None
    encoder_resolution: float = RESOLUTION
    stiffness_error: float = 0.1
    payload_error: float = 0.1

    def __post_init__(self) -> None:
        number('encoder_resolution', self.encoder_resolution, at_least=1e-9, at_most=1, unit='rad')
        for name in ('stiffness_error', 'payload_error'):
            number(name, getattr(self, name), at_least=0, at_most=MAX_ERROR)


def find_feedback_gains(plan: Plan, settings: GainSettings | None = None,
                        monitor: Monitor | None = None) -> FeedbackGains:
    """
    Find gains of feedback for a plan.

    Parameters
    ----------
    plan : Plan
        Solved, ending at rest.
    settings : GainSettings, optional
        Of the controller and the errors of the model.
    monitor : Monitor, optional
        May stop it.

    Returns
    -------
    FeedbackGains
        Check `found`.

    Raises
    ------
    InvalidTaskError
        If the plan is not solved, or does not end at rest.
    StoppedError
        If the monitor stopped it.

    """
    if not plan.solved:
        raise InvalidTaskError(f'gains are found for plans that are solved: {plan.message}')
    if not plan.task.ends_at_rest:
        raise InvalidTaskError('gains are found for motions that end at rest')
    given = settings or GainSettings()
    controller = given.controller or JointController(gains=default_gains(plan.model))
    return _Search(CarriedMotion.of(plan, controller), given, monitor or Monitor()).run()


def find_motion_gains(motion: CarriedMotion, settings: GainSettings | None = None,
                      monitor: Monitor | None = None) -> FeedbackGains:
    """
    Find gains of feedback for a trajectory, such as a recorded one.

    Parameters
    ----------
    motion : CarriedMotion
        The trajectory under its controller.
    settings : GainSettings, optional
        Of the errors of the model; its controller is not looked at.
    monitor : Monitor, optional
        May stop it.

    Returns
    -------
    FeedbackGains
        Check `found`.

    Raises
    ------
    StoppedError
        If the monitor stopped it.

    """
    return _Search(motion, settings or GainSettings(), monitor or Monitor()).run()


class _Search:
    """A search: arms that differ, and the laws that are tried on them."""

    def __init__(self, motion: CarriedMotion, settings: GainSettings, monitor: Monitor) -> None:
        self._motion, self._settings, self._controller = motion, settings, motion.controller
        self._monitor, self._rate = monitor, motion.controller.rate
        self._differences = list_differences(motion, settings.stiffness_error,
                                             settings.payload_error)
        # of roundings, and of a noise of half a step
        self._noise = settings.encoder_resolution * float(np.sqrt(1 / 12 + 1 / 4))
        self._model = LinearArm.of(motion.execution.dynamics, motion.goal,
                                   without_friction(motion.execution.parameters), self._rate)

    def run(self) -> FeedbackGains:
        """Return what was found."""
        found = FeedbackGains(rate=self._rate, cutoff=SPEED_CUTOFF, differences=self._differences,
                              resolution=self._settings.encoder_resolution)
        try:
            self._arms = self._make_arms()
        except NoEquilibriumError as error:
            return replace(found, message=f'an arm of the box buckles: {error}')
        found = self._add_joints(self._add_state(found))
        return replace(found, message=self._say(found))

    def _make_arms(self) -> list[DifferingArm]:
        """Return the arms that are looked at."""
        course, resolution = self._motion.course, self._settings.encoder_resolution
        return [DifferingArm.of(self._motion, course, difference, resolution)
                for difference in self._differences]

    def _add_state(self, found: FeedbackGains) -> FeedbackGains:
        """Look for a regulator with its observer, and one that estimates a torque, too."""
        gains = self._regulators
        try:
            observers = [self._model.observe(self._noise, error) for error in _ERRORS]
            wandering = [self._model.observe(self._noise, error, wander)
                         for error in _ERRORS[2:] for wander in _WANDERS]
        except NoFeedbackError:
            return found
        plain = self._best([[self._combine(gain, one) for gain in gains] for one in observers])
        if plain is None:
            return found
        found = replace(found, state=plain[0], records={**found.records, 'state': plain[1]})
        more = self._best([[self._combine(plain[0].state_gain, one)] for one in wandering])
        if more is None or more[1].worst >= plain[1].worst:
            return found
        return replace(found, disturbance=more[0],
                       records={**found.records, 'disturbance': more[1]})

    def _combine(self, gain: Array, observer: tuple[Array, Array]) -> StateFeedback:
        """Return a regulator with an observer."""
        correction, disturbance = observer
        return StateFeedback(transition=self._model.free, inputs=self._model.forced,
                             state_gain=gain, observer_gain=correction, rate=self._rate,
                             disturbance_gain=disturbance)

    def _best(self, groups: Sequence[Sequence[StateFeedback]],
              ) -> tuple[StateFeedback, Record] | None:
        """Return what leaves least of the firmest of each group that shake no arm."""
        calm = [one for group in groups for one in self._calmest(group)]
        residuals = [self._yardstick.predict_residual(one.law(), self._monitor) for one in calm]
        for i in np.argsort(residuals):
            record = self._try(calm[i].law())
            if record.stable:
                return calm[i], record
        return None

    def _calmest(self, group: Sequence[StateFeedback]) -> list[StateFeedback]:
        """Return the first of a group that shakes no arm, if there is one."""
        return next(([one] for one in group if self._is_calm(one.law())), [])

    @property
    def _yardstick(self) -> DifferingArm:
        """Return the arm by which laws are ranked: the corner that is softest and heaviest."""
        return [arm for arm, difference in zip(self._arms, self._differences, strict=True)
                if not difference.more_modes][-1]

    def _is_calm(self, law: LinearFeedback) -> bool:
        """Return whether a law shakes none of the arms at the goal; the worst are last."""
        return all(arm.growth(law) <= UNSTABLE_GROWTH for arm in reversed(self._arms))

    def _try(self, law: LinearFeedback) -> Record:
        """Return what a law makes of the plan on every arm."""
        return Record(responses=tuple(self._respond(arm, law) for arm in self._arms))

    def _respond(self, arm: DifferingArm, law: LinearFeedback) -> Response:
        """Return what a law makes of the plan on an arm; nothing more where it is unstable."""
        growth = arm.growth(law)
        if growth > UNSTABLE_GROWTH:
            return Response(growth=growth)
        return arm.respond(law, self._monitor, growth=growth)

    def _add_joints(self, found: FeedbackGains) -> FeedbackGains:
        """Look for gains on the joints alone: those next to regulators, and those given."""
        coupled = [self._model.project(gain, _ERRORS[2]) for gain in self._regulators]
        best = self._firmest([joint_feedback(gain, self._rate) for gain in coupled])
        if best is not None:
            found = replace(found, coupled_joints=coupled[best[0]],
                            records={**found.records, 'coupled_joints': best[1]})
        choices = [*map(_own_gains, coupled), self._controller.gains]
        laws = [pd_feedback(gains, self._rate) for gains in choices]
        given = self._try(laws[-1])
        found = replace(found, given=given)
        tried = [self._firmest(laws[:-1]), (len(laws) - 1, given)]
        which, record = min(filter(None, tried), key=lambda one: one[1].worst)
        if not record.stable:
            return found
        return replace(found, joints=choices[which],
                       records={**found.records, 'joints': record})

    @cached_property
    def _regulators(self) -> list[Array]:
        """Return gains on the state, the firmest first; none where there are none."""
        try:
            return [self._model.regulate(price) for price in reversed(_PRICES)]
        except NoFeedbackError:
            return []

    def _firmest(self, laws: Sequence[LinearFeedback]) -> tuple[int, Record] | None:
        """Return the number of the first law that is stable on all arms, and its record."""
        for number_, law in enumerate(laws):
            record = self._try(law) if self._is_calm(law) else None
            if record is not None and record.stable:
                return number_, record
        return None

    def _say(self, found: FeedbackGains) -> str:
        """Return what was found in words."""
        looked = f'{len(self._differences)} arms'
        if found.found:
            return f'stable on {looked} at {self._rate:g} Hz'
        return (f'no gains are stable on {looked} at {self._rate:g} Hz, nor is the PD of '
                f'{describe_controller(self._controller)}: try a faster controller, give the '
                'motors their rotor_inertia, or smaller errors of the model')


def _own_gains(coupled: Array) -> Gains:
    """Return the gains of each joint on itself, (n,) each of (n, 2 n)."""
    stiffness, damping = (np.maximum(np.diag(part), 0.0) for part in np.hsplit(coupled, 2))
    return Gains(stiffness=stiffness, damping=damping)
