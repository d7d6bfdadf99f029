"""
Arms and tasks that must be solved without any help.

The paper's arm with clamped shapes and two modes per link takes 10 to 80 s and is not run here;
it converges to J = 0.648966 (EI = 50) and 0.70984 (EI = 5).

"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

from flex_planner.arms.arm import Arm
from flex_planner.arms.arm_files import load_arm
from flex_planner.base.progress import Monitor
from flex_planner.optimal_control.arm_model import ArmModel
from flex_planner.optimal_control.task import Task
from flex_planner.planning.plan import Plan
from flex_planner.planning.plan_path import plan_path
import numpy as np
import pytest

TaskFactory = Callable[..., Task]


def solved(task: Task) -> Plan:
    plan = plan_path(task, model=ArmModel(task.arm), monitor=Monitor(time_limit=120))
    assert plan.solved, plan.message
    assert plan.certificate.tip_error <= 1e-6  # [m]; 1e-5 is the limit
    assert max(plan.certificate.state_error, plan.certificate.costate_error) <= 1e-6
    assert plan.certificate.hamiltonian_drift <= 1e-5
    return plan


def paper_arm(rigidity: float, modes: int, family: str = 'pinned_pinned') -> Arm:
    """Return the arm of Tables III to V with other links."""
    arm = load_arm('korayem_ei50')
    shape = {'shape_mass': 1.0} if family == 'clamped_mass' else {}
    link = replace(arm.links[0], flexural_rigidity=rigidity, modes=modes, mode_family=family,
                   **shape)
    return replace(arm, links=(link, link))


@pytest.mark.parametrize('payload_mass', [1.0, 3.0, 5.5])
@pytest.mark.parametrize('modes', [1, 2, 3])
@pytest.mark.parametrize('rigidity', [50.0, 5.0])
def test_paper_arm(paper_task: TaskFactory, rigidity: float, modes: int,
                   payload_mass: float) -> None:
    solved(paper_task(paper_arm(rigidity, modes), payload_mass))


@pytest.mark.parametrize('payload_mass', [1.0, 5.5])
@pytest.mark.parametrize('w_2', [1.0, 10.0, 200.0, 700.0, 1400.0])
@pytest.mark.parametrize('name', ['korayem_rigid', 'korayem_ei50', 'korayem_ei5'])
def test_paper_arm_with_weights(paper_task: TaskFactory, name: str, w_2: float,
                                payload_mass: float) -> None:
    solved(paper_task(load_arm(name), payload_mass, w_2))


@pytest.mark.parametrize(('name', 'payload_mass'), [
    # 5.855, 5.850 and 5.742 kg are the most
    ('korayem_rigid', 5.8), ('korayem_ei50', 5.8), ('korayem_ei5', 5.7)])
def test_paper_arm_near_its_largest_payload(paper_task: TaskFactory, name: str,
                                            payload_mass: float) -> None:
    plan = solved(paper_task(load_arm(name), payload_mass))
    # on their limits most of the time
    assert plan.saturation[0] > 0.8
    assert plan.switching_times.size >= 4


@pytest.mark.parametrize('family', ['clamped_free', 'clamped_mass'])
@pytest.mark.parametrize(('rigidity', 'cost'), [(50.0, 0.65), (5.0, 0.71)])
def test_clamped_links(paper_task: TaskFactory, family: str, rigidity: float,
                       cost: float) -> None:
    plan = solved(paper_task(paper_arm(rigidity, 1, family)))
    assert plan.cost == pytest.approx(cost, rel=0.02)


@pytest.mark.parametrize(('name', 'start', 'goal', 'duration', 'payload_mass'), [
    # Table VI
    ('korayem_table6', [0.0, np.pi], [np.pi, 0.0], 2.0, 0.0),
    # the vertical plane
    ('korayem_hanging', [-np.pi / 2, 0.0], [-0.8, -0.3], 1.5, 0.0),
    ('three_links', [0.0, 0.5, 0.5], [1.0, 1.0, -0.5], 1.5, 1.0),
    ('de_luca_siciliano', [0.0, 0.3], [0.8, 0.9], 1.0, 0.0)])
def test_presets(name: str, start: list[float], goal: list[float], duration: float,
                 payload_mass: float) -> None:
    solved(Task(arm=load_arm(name), start_positions=start,  # type: ignore[arg-type]
                goal_positions=goal, duration=duration,  # type: ignore[arg-type]
                payload_mass=payload_mass, allow_large_bending=name == 'de_luca_siciliano'))


def test_single_link_with_four_modes() -> None:
    arm = load_arm('single_link')
    arm = replace(arm, links=(replace(arm.links[0], modes=4),))
    solved(Task(arm=arm, start_positions=[0.0], goal_positions=[1.0],  # type: ignore[arg-type]
                duration=1.0, payload_mass=0.1))
