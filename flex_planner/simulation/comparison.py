"""
The benefit of planning with flexible links: one task, planned and carried out in several modes.

Every plan is followed by the same flexible arm, which may differ from the planned one. The
controller samples and holds, as one with hardware would.

"""

from __future__ import annotations

from dataclasses import dataclass

from flex_planner.arms.arm import Arm
from flex_planner.arms.kinematics import tip_position
from flex_planner.base.progress import Monitor
from flex_planner.base.validation import Array, number
from flex_planner.control.default_gains import default_gains
from flex_planner.control.joint_controller import Gains, JointController
from flex_planner.dynamics.arm_dynamics import ArmDynamics
from flex_planner.optimal_control.arm_model import ArmModel
from flex_planner.optimal_control.task import MAX_PAYLOAD, Task
from flex_planner.planning.plan import Plan
from flex_planner.planning.plan_path import plan_path
from flex_planner.planning.point_times import MAX_SAMPLES
from flex_planner.planning.sampling import sample_plan, SampledPlan, SamplingSettings
from flex_planner.planning.strategies.initial_guesses import rigid_problem
from flex_planner.simulation.execution import execute_plan, ExecutionMode, ExecutionResult, Setting
from flex_planner.simulation.mismatch import Mismatch
from flex_planner.simulation.plant import Control
from flex_planner.simulation.settling import MAX_SETTLING, MIN_SETTLING

_STIFFNESS, _DAMPING = 100.0, 10.0
# closer than a controller needs it, so that what is compared is the plans
_STEP, _TORQUE_TOLERANCE = 2.5e-4, 1e-5


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Comparison:
    """
    A task carried out in several modes.

    Attributes
    ----------
    flexible, rigid : Plan
        Of the task, and of the same arm made rigid.
    arm : Arm
        As simulated.
    payload_mass : float
        As simulated [kg].
    goal : numpy.ndarray, shape (2,), or (3,) of a spatial arm
        Goal of the tip [m].
    settling : float
        How long the arm is watched after its arrival [s].
    results : tuple of ExecutionResult
        In the order of `ExecutionMode`; without those of a plan that failed.

    """

    flexible: Plan
    rigid: Plan
    arm: Arm
    payload_mass: float
    goal: Array
    settling: float
    results: tuple[ExecutionResult, ...]

    @property
    def solved(self) -> bool:
        """Return whether there is a plan for every mode."""
        return self.flexible.solved and self.rigid.solved

    def of(self, mode: ExecutionMode) -> ExecutionResult:
        """Return the result of a mode; KeyError if its plan failed."""
        return {result.mode: result for result in self.results}[mode]


def compare(task: Task, *, model: ArmModel | None = None, mismatch: Mismatch | None = None,
            payload_mass: float | None = None, gains: Gains | None = None, rate: float = 1000.0,
            settling: float = 1.0, monitor: Monitor | None = None) -> Comparison:
    """
    Plan a task with flexible and with rigid links, and carry out each plan on a flexible arm.

    Parameters
    ----------
    task : Task
        Ends at rest.
    model : ArmModel, optional
        Of the task's arm.
    mismatch : Mismatch, optional
        What is different about the simulated arm; default: nothing.
    payload_mass : float, optional
        That it carries, >= 0 [kg]; default: that of the task.
    gains : Gains, optional
        Of the PD; default: 100 N m/rad and 10 N m s/rad.
    rate : float
        Of the controller, 10 to 100000 [Hz].
    settling : float
        For how long to watch the arm after its arrival, 0.001 to 1000 [s].
    monitor : Monitor, optional
        Receives progress, and may stop it.

    Returns
    -------
    Comparison
        Check `Comparison.solved`.

    Raises
    ------
    InvalidValueError, InvalidTaskError
        Naming what is wrong.
    RunawayError
        If the simulated arm gets out of hand.
    StoppedError
        If the monitor stopped a simulation.

    """
    watch = monitor or Monitor()
    simulated = (mismatch or Mismatch()).apply(task.arm)
    chosen = gains or Gains.of(task.arm.n_joints, _STIFFNESS, _DAMPING)
    Control(gains=chosen, rate=rate).check(task.arm.n_joints)
    number('settling', settling, at_least=MIN_SETTLING, at_most=MAX_SETTLING, unit='s')
    carried = number('payload_mass', task.payload_mass if payload_mass is None else payload_mass,
                     at_least=0, at_most=MAX_PAYLOAD, unit='kg')
    flexible = plan_path(task, model=model, monitor=watch)
    again = Monitor(time_limit=watch.time_limit - watch.elapsed, canceled=watch.canceled,
                    report=watch.report)
    rigid = plan_path(rigid_problem(flexible.problem).task, monitor=again)
    goal = tip_position(task.arm, flexible.problem.goal[:task.arm.n_coordinates])
    setting = Setting(model=ArmDynamics(simulated), gains=chosen, rate=rate, settling=settling,
                      payload_mass=carried, goal=goal, monitor=watch)
    return Comparison(flexible=flexible, rigid=rigid, arm=simulated, payload_mass=carried,
                      goal=goal, settling=settling,
                      results=_execute_all(flexible, rigid, setting))


def _execute_all(flexible: Plan, rigid: Plan, setting: Setting) -> tuple[ExecutionResult, ...]:
    """Carry out every mode whose plan is solved."""
    references = {plan is rigid: sample_finely(plan, setting.rate, setting.monitor)
                  for plan in (flexible, rigid) if plan.solved}
    plans = {False: flexible, True: rigid}
    found = []
    for mode in ExecutionMode:
        if mode.rigid in references:
            setting.monitor.phase = mode.value
            found.append(execute_plan(mode, plans[mode.rigid], references[mode.rigid], setting))
    return tuple(found)


def sample_finely(plan: Plan, rate: float, monitor: Monitor) -> SampledPlan:
    """Return samples as close as the sampling allows, for a controller of a rate [Hz]."""
    step = max(_STEP, plan.task.duration / (MAX_SAMPLES - 1))
    controller = JointController(gains=default_gains(plan.model, rate), rate=rate)
    settings = SamplingSettings(longest_step=step, torque_tolerance=_TORQUE_TOLERANCE,
                                controller=controller)
    return sample_plan(plan, settings, monitor)
