"""A plan carried out on a simulated flexible arm in one of several modes, and the result."""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum

from flex_planner.arms.kinematics import tip_position
from flex_planner.base.progress import Monitor
from flex_planner.base.validation import Array
from flex_planner.control.controlled_motion import locked_bending
from flex_planner.control.joint_controller import Gains
from flex_planner.dynamics.arm_dynamics import ArmDynamics
from flex_planner.planning.plan import Plan
from flex_planner.planning.sampling import SampledPlan
from flex_planner.simulation.plant import Control, Plant
from flex_planner.simulation.settling import ResidualVibration
import numpy as np

_SETTLED = 0.1  # of the time after arrival


class ExecutionMode(Enum):
    """Modes of planning and carrying out a task; the value is shown to people."""

    FLEXIBLE_OPEN = 'flexible plan, torque only'
    RIGID_OPEN = 'rigid plan, torque only'
    FLEXIBLE = 'flexible plan, torque and PD'
    RIGID = 'rigid plan, torque and PD'
    PD_ONLY = 'flexible plan, PD only'

    @property
    def rigid(self) -> bool:
        """Return whether the plan takes the links as rigid."""
        return self in (ExecutionMode.RIGID_OPEN, ExecutionMode.RIGID)

    @property
    def feedback(self) -> bool:
        """Return whether the joints are under PD."""
        return self not in (ExecutionMode.FLEXIBLE_OPEN, ExecutionMode.RIGID_OPEN)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class SimulatedMotion:
    """
    The motion of the arm, at every period of the controller from 0.

    Attributes
    ----------
    times : numpy.ndarray, shape (k,)
        Since the motion began [s].
    coordinates : numpy.ndarray, shape (k, n_t)
        Of the simulated arm.
    torques : numpy.ndarray, shape (k, n)
        Of the motors, over the period that ends there [N m].
    tip : numpy.ndarray, shape (k, 2), or (k, 3) of a spatial arm
        [m].

    """

    times: Array
    coordinates: Array
    torques: Array
    tip: Array


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class ExecutionResult:
    """
    The result of carrying out a plan.

    Attributes
    ----------
    mode : ExecutionMode
        Of execution.
    arrival : float
        Planned duration [s].
    arrival_error : float
        Distance of the tip from the goal at that time [m].
    final_error : float
        The same after settling: the largest over the last tenth of the time [m].
    bending : float
        Largest deflection of the links if the joints were locked on arrival [m].
    residual : ResidualVibration
        Peak-to-peak motion from the arrival to the end; under torque alone nothing stops the
        joints, and this is mostly how far the arm drifts.
    tracking_error : float
        Largest distance of a joint from its own reference up to the arrival [rad].
    execution : SimulatedMotion
        All of it.

    """

    mode: ExecutionMode
    arrival: float
    arrival_error: float
    final_error: float
    bending: float
    residual: ResidualVibration
    tracking_error: float
    execution: SimulatedMotion


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Setting:
    """
    The conditions that all modes share.

    Attributes
    ----------
    model : ArmDynamics
        Of the simulated arm.
    gains : Gains
        Of the PD.
    rate : float
        Of the controller [Hz].
    payload_mass : float
        That the arm carries [kg].
    goal : numpy.ndarray, shape (2,), or (3,) of a spatial arm
        Of the tip [m].
    settling : float
        How long to watch the arm after its arrival [s].
    monitor : Monitor
        May stop it.

    """

    model: ArmDynamics
    gains: Gains
    rate: float
    payload_mass: float
    goal: Array
    settling: float
    monitor: Monitor


def execute_plan(mode: ExecutionMode, plan: Plan, sampled: SampledPlan,
                 setting: Setting) -> ExecutionResult:
    """
    Carry out a sampled plan in one mode.

    Raises
    ------
    RunawayError
        If the simulated arm gets out of hand.
    StoppedError
        If the monitor stopped it.

    """
    reference, n = sampled.reference, plan.arm.n_joints
    gains = setting.gains if mode.feedback else Gains.of(n, 0.0, 0.0)
    plant = Plant(
        setting.model, Control(gains=gains, rate=setting.rate,
                               feedforward=mode is not ExecutionMode.PD_ONLY),
        payload_mass=setting.payload_mass, payload_inertia=plan.task.payload_inertia,
        positions=plan.problem.start[:n])
    if not plan.task.starts_at_rest:
        plant.state = _moving_start(plan, plant.state)
    plant.follow(reference)
    arrival = sampled.start_hold + plan.task.duration
    execution, bending = _watch(plant, arrival, setting)
    error = np.linalg.norm(execution.tip - setting.goal, axis=1)
    after = int(np.ceil(arrival * setting.rate - 1e-6))
    end = execution.times[-1] - _SETTLED * setting.settling
    demanded = np.array([reference.motion(time)[0] for time in execution.times[:after + 1]])
    tracking = np.abs(execution.coordinates[:after + 1, :n] - demanded).max()
    return ExecutionResult(
        mode=mode, arrival=arrival, arrival_error=float(error[after]),
        final_error=float(error[execution.times >= end].max()), bending=bending,
        residual=ResidualVibration.of(plant.model.arm, execution.coordinates[after:]),
        tracking_error=float(tracking), execution=execution)


def _moving_start(plan: Plan, rest: Array) -> Array:
    """Return the state at the start of a plan, of the joints alone where it has no modes."""
    state, start, n = rest.copy(), plan.problem.start, plan.arm.n_joints
    if start.size == rest.size:
        return start.copy()
    state[rest.size // 2:rest.size // 2 + n] = start[n:]
    return state


def _watch(plant: Plant, arrival: float, setting: Setting) -> tuple[SimulatedMotion, float]:
    """Run a motion; return it, and the bending with the joints locked on arrival."""
    n_t = plant.model.arm.n_coordinates
    times, states, torques = [0.0], [plant.state], [plant.torque]

    def note(moved: Plant) -> None:
        setting.monitor.check()
        times.append(moved.elapsed)
        states.append(moved.state)
        torques.append(moved.torque)

    plant.advance(np.ceil(arrival * setting.rate - 1e-6) / setting.rate, note)
    bending = locked_bending(plant.model, plant.state, plant.parameters)
    plant.advance(arrival + setting.settling, note)
    coordinates = np.array(states)[:, :n_t]
    torques[0] = torques[1]
    return SimulatedMotion(times=np.array(times), coordinates=coordinates,
                           torques=np.array(torques),
                           tip=tip_position(plant.model.arm, coordinates)), bending
