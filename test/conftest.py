"""
Arms, models and tasks that several test files share.

Compiling an arm costs seconds and reading it back milliseconds: models live for the session, and
the compiled functions stay in the user's cache folder.

"""

from __future__ import annotations

from collections.abc import Callable, Iterator
import math
import os
from pathlib import Path
from typing import Any

from applied_torques import Case, crane_plan
from factories import PlanFactory, TaskFactory
from flex_planner.arms.arm import Arm, Joint, Link, Motor, Node
from flex_planner.arms.arm_files import load_arm
from flex_planner.base.compiled_library import load_once
from flex_planner.collocation import core
from flex_planner.optimal_control.arm_model import ArmModel
from flex_planner.optimal_control.task import postures_from_points, Task
from flex_planner.planning.plan import Plan
from flex_planner.planning.plan_path import plan_path
from hypothesis import settings
import pytest

FOLDER = Path(__file__).parent
# read when a message class is imported: assignments of a wrong type fail at once
os.environ['ROS_PYTHON_CHECK_FIELDS'] = '1'

# the machine may be busy, and the same examples every time keep a failure repeatable
settings.register_profile('repository', deadline=None, derandomize=True)
settings.load_profile('repository')


# tests in these folders start other processes, so that no more than two files run at a time
ALONE = {'ros', 'system'}
# the ids of files, tests and cases that `make test` leaves out
THOROUGH = FOLDER / 'thorough.txt'


def pytest_collection_modifyitems(config: pytest.Config, items: list[pytest.Item]) -> None:
    """Mark the tests that do not run beside others, and those that take long."""
    listed = {line for line in THOROUGH.read_text().splitlines() if line and line[0] != '#'}
    found = set()
    for item in items:
        if item.path.relative_to(FOLDER).parts[0] in ALONE:
            item.add_marker(pytest.mark.alone)
        matches = {item.nodeid, *_wholes(item.nodeid)} & listed
        if matches:
            item.add_marker(pytest.mark.thorough)
            found |= matches
    if config.args_source is pytest.Config.ArgsSource.TESTPATHS and found != listed:
        raise pytest.UsageError(f'{THOROUGH.name} names no test: {", ".join(listed - found)}')


def _wholes(identifier: str) -> tuple[str, str]:
    """Return the ids of the test that a case is of, and of its file."""
    return identifier.partition('[')[0], identifier.partition('::')[0]


@pytest.fixture(autouse=True)
def failed_compilations_are_forgotten() -> Iterator[None]:
    """Let what one test could not compile be compiled by the next; what is there is read again."""
    yield
    core.LOADED.clear()
    load_once.cache_clear()


@pytest.fixture(scope='session')
def rigid_arm() -> Arm:
    return load_arm('korayem_rigid')


@pytest.fixture(scope='session')
def ei50_arm() -> Arm:
    return load_arm('korayem_ei50')


@pytest.fixture(scope='session')
def ei5_arm() -> Arm:
    return load_arm('korayem_ei5')


@pytest.fixture(scope='session')
def single_mode_arm(ei50_arm: Arm) -> Arm:
    """Return the arm of the paper with one mode per link."""
    link = Link(length=0.5, linear_density=6.0, flexural_rigidity=50.0, modes=1)
    return Arm(name='single mode', links=(link, link), joints=ei50_arm.joints)


@pytest.fixture(scope='session')
def uneven_arm() -> Arm:
    """Return the arm of the appendix, with links that cannot be mistaken for one another."""
    first = Link(length=0.6, linear_density=6.0, flexural_rigidity=50.0, modes=2)
    second = Link(length=0.35, linear_density=6.0, flexural_rigidity=20.0, modes=2)
    return Arm(name='uneven', links=(first, second), joints=(Joint(), Joint()))


@pytest.fixture(scope='session')
def workshop_arm() -> Arm:
    """Return an arm that has everything: gravity, friction, nodes, motors, unlike links."""
    links = (Link(length=0.6, linear_density=4.0, flexural_rigidity=30.0, modes=1),
             Link(length=0.4, linear_density=2.5, flexural_rigidity=12.0, modes=2))
    joints = (Joint(motor=Motor(stall_torque=9.0, no_load_speed=4.0), viscous_friction=0.3),
              Joint(motor=Motor(stall_torque=5.0, no_load_speed=6.0), viscous_friction=0.1))
    nodes = (Node(mass=2.0, inertia=0.05), Node(mass=1.5, inertia=0.02),
             Node(mass=0.4, inertia=0.01))
    return Arm(name='workshop', links=links, joints=joints, nodes=nodes, gravity=[1.3, -9.81])


@pytest.fixture(scope='session')
def crane_arm() -> Arm:
    """Return an arm with clamped links that has everything the workshop arm has, and damping."""
    links = (Link(length=0.6, linear_density=4.0, flexural_rigidity=60.0, modes=2,
                  mode_family='clamped_mass', shape_mass=4.0, shape_inertia=0.4,
                  damping_ratio=0.02),
             Link(length=0.4, linear_density=2.5, flexural_rigidity=20.0, modes=1,
                  mode_family='clamped_free', damping_ratio=0.05))
    motors = (Motor(stall_torque=9.0, no_load_speed=4.0, max_torque=math.inf),
              Motor(stall_torque=5.0, no_load_speed=6.0, max_torque=math.inf))
    joints = tuple(Joint(motor=motor, viscous_friction=friction)
                   for motor, friction in zip(motors, (0.3, 0.1), strict=True))
    nodes = (Node(mass=2.0, inertia=0.05), Node(mass=1.5, inertia=0.02),
             Node(mass=0.4, inertia=0.01))
    return Arm(name='crane', links=links, joints=joints, nodes=nodes, gravity=[1.3, -9.81])


@pytest.fixture(scope='session')
def rigid_model(rigid_arm: Arm) -> ArmModel:
    return ArmModel(rigid_arm)


@pytest.fixture(scope='session')
def ei50_model(ei50_arm: Arm) -> ArmModel:
    return ArmModel(ei50_arm)


@pytest.fixture(scope='session')
def ei5_model(ei5_arm: Arm) -> ArmModel:
    return ArmModel(ei5_arm)


@pytest.fixture(scope='session')
def single_mode_model(single_mode_arm: Arm) -> ArmModel:
    return ArmModel(single_mode_arm)


@pytest.fixture(scope='session')
def uneven_model(uneven_arm: Arm) -> ArmModel:
    return ArmModel(uneven_arm)


@pytest.fixture(scope='session')
def workshop_model(workshop_arm: Arm) -> ArmModel:
    return ArmModel(workshop_arm)


@pytest.fixture(scope='session')
def crane_model(crane_arm: Arm) -> ArmModel:
    return ArmModel(crane_arm)


@pytest.fixture(scope='session')
def paper_task() -> TaskFactory:
    """Build the motion of sections 5.2 and 5.3 for an arm; w_2 weighs the joint speeds."""

    def build(arm: Arm, payload_mass: float = 1.0, w_2: float = 0.0, **changes: Any) -> Task:
        start, goal = postures_from_points(arm, (0.5, 0.0), (0.5, 0.5), elbow=-1)
        values: dict[str, Any] = {
            'start_positions': start, 'goal_positions': goal, 'duration': 1.0,
            'payload_mass': payload_mass, 'effort_weights': [1 / 8, 1 / 8],
            'velocity_weights': [w_2, w_2]}
        return Task(arm=arm, **{**values, **changes})

    return build


@pytest.fixture(scope='session')
def plan_of(request: pytest.FixtureRequest, paper_task: TaskFactory) -> PlanFactory:
    """Plan the paper's motion, once for each arm, payload and weight."""
    known: dict[tuple[str, float, float], Plan] = {}

    def plan(arm: str, payload_mass: float = 1.0, w_2: float = 0.0) -> Plan:
        key = arm, payload_mass, w_2
        if key not in known:
            model = request.getfixturevalue(f'{arm}_model')
            known[key] = plan_path(paper_task(model.arm, payload_mass, w_2), model=model)
        return known[key]

    return plan


@pytest.fixture(scope='session')
def any_plan(plan_of: PlanFactory, crane_model: ArmModel) -> Callable[[Case], Plan]:
    """Return plans of the paper's arms, and one under gravity; motors saturate in most."""
    return lambda case: crane_plan(crane_model) if isinstance(case, str) else plan_of(*case)
