"""
Recordings of plans of the presets and of published arms pass their check untouched.

The arms of ``test/data/published_arms`` have the sources of their numbers in their comments.
Durations: *mod* is slow, *fast* near the shortest of the rigid arm, *long* a long stroke, *load*
with a payload. Of these the shortest with two modes a link, and the long strokes and those with a
payload with one, are what leaves the least room; ``FLEX_PLANNER_ALL_ARMS=1`` runs the others, too.

"""

from __future__ import annotations

from dataclasses import replace
import os
from pathlib import Path
from typing import Any

from flex_planner.arms.arm_files import load_arm
from flex_planner.cli.recorder import RequestRecorder
from flex_planner.cli.request import Request
from flex_planner.control.default_gains import default_gains
from flex_planner.control.joint_controller import EffortHold, JointController
from flex_planner.dynamics.arm_dynamics import ArmDynamics
from flex_planner.optimal_control.task import Task
from flex_planner.planning.plan_path import plan_path
from flex_planner.planning.robustness import assess_robustness
from flex_planner.planning.sampling import judge_execution, sample_plan, SamplingSettings
from flex_planner.reports.recording import check_motion, RecordedRequest
import numpy as np
from presets import PLANAR_PRESETS
import pytest

ARMS = Path(__file__).parents[2] / 'data' / 'published_arms'

# start and goal [deg], duration [s], payload [kg]
PRESETS = {
    'korayem_ei5': ([60, -120], [75, -30], 1.0, 1.0),
    'korayem_ei50': ([60, -120], [75, -30], 1.0, 1.0),
    'korayem_rigid': ([60, -120], [75, -30], 1.0, 1.0),
    'korayem_table6': ([60, -120], [75, -30], 3.0, 1.0),
    'korayem_hanging': ([-100, 30], [-60, 50], 1.0, 0.3),
    'clamped_motors': ([60, -120], [75, -30], 1.0, 1.0),
    'de_luca_siciliano': ([0, 0], [60, 30], 1.5, 0.0),
    'single_link': ([0], [60], 2.5, 0.0),
    'three_links': ([-90, 30, 30], [-60, 40, 10], 1.5, 0.1),
    'asen_single': ([0], [45], 0.844, 0.0),
    'space_beam': ([0], [30], 50.013, 0.0),
    'rome_flexarm': ([0, 30], [45, 60], 3.25, 0.0),
    'muroran_vertical': ([0, 45], [40, 80], 1.023, 0.0),
    'mamedov_horizontal': ([0, 45], [40, 80], 1.137, 0.0),
    'desk_arm': ([-90, 30], [0, 60], 1.0, 0.3),
}
MOTIONS = {
    'asen_single': (([0], [45]), ([-75], [75])),
    'rome_forearm': (([0, 30], [45, 60]), ([-90, -45], [60, 45])),
    'muroran_vertical': (([0, 45], [40, 80]), ([-70, 30], [70, 90])),
    'mamedov_horizontal': (([0, 45], [40, 80]), ([-70, 30], [70, 90])),
    'mamedov_horizontal_rotors': (([0, 45], [40, 80]), ([-70, 30], [70, 90])),
    'ralf_vertical_rotors': (([20, -40], [50, -70]), ([-30, 20], [80, -60])),
    'space_beam': (([0], [30]), ([-60], [60])),
}
# arm, kind of motion, modes of each flexible link, duration [s], payload [kg]
CASES = [
    *(('asen_single', kind, modes, duration, 0.05 if kind == 'load' else 0.0)
      for kind, duration in (('mod', 0.816), ('fast', 0.592), ('long', 1.651), ('load', 1.573))
      for modes in (1, 2)),
    *(('rome_forearm', kind, modes, duration, 0.3 if kind == 'load' else 0.0)
      for kind, duration in (('mod', 3.224), ('fast', 1.754), ('long', 4.742), ('load', 4.33))
      for modes in (1, 2)),
    *(('mamedov_horizontal_rotors', kind, modes, duration, 0.25 if kind == 'load' else 0.0)
      for kind, duration in (('mod', 1.156), ('fast', 0.809), ('long', 2.359), ('load', 1.99))
      for modes in (1, 2)),
    ('muroran_vertical', 'mod', 1, 1.064, 0.0), ('muroran_vertical', 'mod', 2, 1.064, 0.0),
    ('muroran_vertical', 'fast', 1, 0.517, 0.0), ('muroran_vertical', 'fast', 2, 0.517, 0.0),
    ('muroran_vertical', 'long', 1, 2.058, 0.0), ('muroran_vertical', 'load', 1, 1.346, 0.5),
    ('muroran_vertical', 'load', 2, 1.346, 0.5), ('mamedov_horizontal', 'fast', 1, 0.594, 0.0),
    ('mamedov_horizontal', 'mod', 1, 0.873, 0.0), ('mamedov_horizontal', 'long', 1, 1.968, 0.0),
    ('mamedov_horizontal', 'load', 1, 1.654, 0.25),
    ('ralf_vertical_rotors', 'mod', 1, 6.0, 0.0), ('ralf_vertical_rotors', 'fast', 1, 2.543, 0.0),
    ('ralf_vertical_rotors', 'fast', 2, 2.543, 0.0),
    ('ralf_vertical_rotors', 'long', 1, 2.463, 0.0),
    ('ralf_vertical_rotors', 'long', 2, 2.463, 0.0), ('space_beam', 'mod', 1, 50.013, 0.0),
    ('space_beam', 'mod', 2, 50.013, 0.0), ('space_beam', 'fast', 1, 28.04, 0.0),
    ('space_beam', 'fast', 2, 28.04, 0.0), ('space_beam', 'load', 1, 72.457, 30.0),
    ('space_beam', 'load', 2, 72.457, 30.0),
]
# kinds of motion with modes, about 1 min of the 3 min of all
KEPT = {('fast', 2), ('long', 1), ('load', 1)}
ALL = bool(os.environ.get('FLEX_PLANNER_ALL_ARMS'))
# start and goal [deg], duration [s], payload [kg], as given
OTHERS = {
    'desk_arm_rotor': ([-90, 0], [-60, 30], 2.0, 0.3),
    'payload_17x': ([-3, -13], [-63, 184], 2.19, 1.5),
    's12': ([93, -43], [26, -112], 1.65, 1.0),
    's17': ([-98, -10], [-235, -79], 1.76, 1.0),
    'g12': ([-129.854423528, 52.594753245], [-4.854423528, 63.633872544], 1.06541771768534,
            0.803605215668333),
}


def check(task: Task, folder: Path, **sampling: Any) -> None:
    """Plan, sample, record and read a motion; its check must pass."""
    task = replace(task, allow_large_bending=True)
    plan = plan_path(task)
    assert plan.solved, plan.message
    request = Request(task=task, elbow=-1, time_limit=60.0,
                      sampled=SamplingSettings(**sampling))
    sampled = sample_plan(plan, request.sampling)
    assert judge_execution(plan, sampled) is plan
    sampled = replace(sampled, robustness=assess_robustness(plan, sampled))
    path = RequestRecorder(request, folder).record_plan(plan, sampled)
    found = check_motion(RecordedRequest.read(path), plan.model)
    assert found.passed, [str(finding) for finding in found.findings if not finding.passed]


def task_of(name: str, start: list[float], goal: list[float], duration: float, payload: float,
            modes: int = 0) -> Task:
    """Return a motion of an arm, whose flexible links have a number of modes, unless it is 0."""
    arm = load_arm(name)
    if modes:
        arm = replace(arm, links=tuple(
            replace(link, modes=modes) if link.modes else link for link in arm.links))
    return Task(arm=arm, start_positions=np.radians(start), goal_positions=np.radians(goal),
                duration=duration, payload_mass=payload)


def test_every_preset_is_among_them() -> None:
    assert set(PRESETS) == set(PLANAR_PRESETS)


def test_every_arm_and_motion_is_among_those_kept() -> None:
    kept = [case for case in CASES if case[1:3] in KEPT]
    assert {case[0] for case in kept} == set(MOTIONS)
    assert len(kept) < len(CASES) / 2


@pytest.mark.parametrize('name', PRESETS)
def test_recordings_of_presets_pass(name: str, tmp_path: Path) -> None:
    check(task_of(name, *PRESETS[name]), tmp_path)


@pytest.mark.parametrize('hold', EffortHold)
def test_recordings_of_motions_after_a_hold_pass(hold: EffortHold, tmp_path: Path) -> None:
    task = task_of('korayem_hanging', *PRESETS['korayem_hanging'])
    controller = JointController(gains=default_gains(ArmDynamics.of(task.arm), 300.0), rate=300.0,
                                 hold=hold)
    check(task, tmp_path, controller=controller, start_hold=0.3777)


@pytest.mark.parametrize(('name', 'kind', 'modes', 'duration', 'payload'), [
    case for case in CASES if ALL or case[1:3] in KEPT])
def test_recordings_of_published_arms_pass(name: str, kind: str, modes: int, duration: float,
                                           payload: float, tmp_path: Path) -> None:
    start, goal = MOTIONS[name][kind == 'long']
    check(task_of(str(ARMS / f'{name}.yaml'), start, goal, duration, payload, modes), tmp_path)


@pytest.mark.parametrize('name', OTHERS)
def test_recordings_of_counter_examples_pass(name: str, tmp_path: Path) -> None:
    check(task_of(str(ARMS / f'{name}.yaml'), *OTHERS[name]), tmp_path)
