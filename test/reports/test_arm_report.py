"""What `flex-planner arm` says of an arm before anything is planned."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
import re

from flex_planner.arms.arm import Arm
from flex_planner.arms.arm_files import arm_from_mapping, load_arm, read_arm_template
from flex_planner.base.yaml_text import parse_yaml
from flex_planner.cli import main
from flex_planner.dynamics.physical_parameters import PhysicalParameters
from flex_planner.optimal_control.arm_model import ArmModel
from flex_planner.optimal_control.task import Task
from flex_planner.planning.plan_path import plan_path
from flex_planner.planning.warnings import find_arm_warnings, WarningKind
from flex_planner.reports.arm import describe_arm, standard_postures
from flex_planner.reports.mode_relevance import DURATIONS, find_bending
from light_model import LightModel
import numpy as np
import pytest


@pytest.fixture(scope='module')
def template() -> Arm:
    """Return the arm of the template."""
    return arm_from_mapping(parse_yaml(read_arm_template()))


def report(arm: Arm, payload: float = 0.0) -> str:
    """Return what is said of an arm at the usual postures."""
    return describe_arm(ArmModel.of(arm), standard_postures(arm), payload)


def test_template_has_all_that_data_sheets_say(template: Arm) -> None:
    first, second = template.joints
    motor = first.motor
    # at the motor 0.6 and 0.4 N m, 420 and 450 rad/s, behind a gear of 100 that lets 75 % through
    assert (motor.stall_torque, motor.max_torque) == pytest.approx((45.0, 30.0))
    assert (motor.no_load_speed, motor.max_speed) == pytest.approx((4.2, 4.5))
    assert motor.reflected_inertia == pytest.approx(0.15)
    assert first.is_elastic and first.coulomb_friction and second.housing.mass
    assert template.payload_com.tolist() == [0.03, 0.0] and template.payload_inertia
    assert all(link.is_clamped and link.sections for link in template.links)
    assert not find_arm_warnings(template)


def test_report_tells_what_the_data_sheets_say(template: Arm) -> None:
    text = report(template)
    for part in ('housings 0.7 kg', '1 twist, 2 modal', '0.03 m rigid without mass',
                 '+-45 N m at standstill, no-load speed 4.2 rad/s, at most 30 N m',
                 'rotor 1.5e-05 kg m^2 behind a gear of 100: 0.15 kg m^2 at the joint',
                 'elastic, 6000 N m/rad', 'Coulomb friction 0.4 N m above 0.1 rad/s',
                 'payload 0 kg at (0.03, 0) m from the tip'):
        assert part in text


def test_payload_that_is_held_is_what_a_lever_says(template: Arm) -> None:
    rigid = template.rigid()
    (line,) = [line for line in report(rigid).splitlines() if 'hold up to' in line][:1]
    limit = float(line.split('up to')[1].split('kg')[0])
    # stretched out level joint 1 has 30 N m; each kilogram of payload takes 9.81 N at 1.13 m
    bare = 9.81 * (0.7 * 0.6 + 0.15 * 0.6 + 0.25 * 1.1
                   + template.links[0].first_moment[0]
                   + template.links[1].mass * 0.6 + template.links[1].first_moment[0])
    assert limit == pytest.approx((30.0 - bare) / (9.81 * 1.13), rel=1e-3)
    assert 'then joint 1 is too weak' in line


def test_joint_that_gravity_overloads_is_named(template: Arm) -> None:
    text = report(template, payload=5.0)
    assert 'joint 1 cannot hold this: gravity takes' in text


def test_bending_is_that_of_a_spring_under_the_acceleration_of_the_motion() -> None:
    arm = load_arm('asen_single')
    arm = replace(arm, links=(replace(arm.links[0], modes=6),))
    p = PhysicalParameters.of_arm(arm)
    frequencies, bending = find_bending(LightModel(arm), np.zeros(1), p)  # type: ignore[arg-type]
    assert bending.shape == (6, len(DURATIONS))
    link, tip = arm.links[0], arm.nodes[-1].mass
    # a cantilever whose mass and tip resist an acceleration of 6 rad in T^2
    load = 6.0 / DURATIONS[1]**2
    deflection = load * (11 * link.linear_density * link.length**5 / 120
                         + tip * link.length**4 / 3) / link.flexural_rigidity
    assert bending[:, 1].sum() == pytest.approx(deflection, rel=0.01)
    assert bending[:, 0] == pytest.approx(4 * bending[:, 1])
    assert frequencies[0] / (2 * np.pi) == pytest.approx(1.8, rel=1e-3)  # of the laboratory


def test_mode_slower_than_the_motion_stays_behind_but_no_further() -> None:
    arm = load_arm('space_beam')
    frequencies, bending = find_bending(
        LightModel(arm), np.zeros(1), PhysicalParameters.of_arm(arm))  # type: ignore[arg-type]
    assert frequencies[0] / (2 * np.pi) < 0.1
    # a radian of the whole length, where in half a second the arm turns and the tip does not
    assert bending[0, :4] == pytest.approx(arm.reach, rel=0.02)
    assert bending[0, 4] < bending[0, 3]
    text = report(arm)
    assert re.search(r'Hz( +[\d.]+ mm){5}\n', text)


def test_payload_that_is_held_is_told_where_the_given_one_is_not(template: Arm) -> None:
    held = [[line for line in report(template, payload).splitlines() if 'hold up to' in line]
            for payload in (0.0, 5.0)]
    assert held[0] == held[1] != []


def test_template_plans_the_motion_that_it_names(template: Arm) -> None:
    named = re.search(r'--from-angles=(\S+) --to-angles=(\S+) --duration (\S+)',
                      read_arm_template())
    assert named is not None
    start, goal = (np.radians([float(angle) for angle in text.split(',')])
                   for text in named.groups()[:2])
    plan = plan_path(Task(arm=template, start_positions=start, goal_positions=goal,
                          duration=float(named[3])))
    assert plan.solved, plan.message


def test_family_that_nobody_gave_is_told() -> None:
    text = parse_yaml(read_arm_template())
    assert isinstance(text, dict)
    del text['links'][1]['mode_family']
    arm = arm_from_mapping(text)
    assert arm.links[1].mode_family == 'pinned_pinned'
    (told,) = find_arm_warnings(arm)
    assert told.kind is WarningKind.MODE_FAMILY_ASSUMED
    assert told.sentence.startswith('link 2 has no mode_family')
    assert 'warning: link 2 has no mode_family' in report(arm)


def test_families_that_nobody_gave_are_told_in_one_sentence() -> None:
    text = parse_yaml(read_arm_template())
    assert isinstance(text, dict)
    for link in text['links']:
        del link['mode_family']
    (told,) = find_arm_warnings(arm_from_mapping(text))
    assert told.sentence.startswith(
        'links 1 and 2 have no mode_family and bend between their ends like beams on two supports')


@pytest.mark.parametrize('name', ['korayem_ei50', 'single_link'])
def test_family_of_a_preset_is_given(name: str) -> None:
    assert not any(one.kind is WarningKind.MODE_FAMILY_ASSUMED
                   for one in find_arm_warnings(load_arm(name)))


def test_template_is_written_but_never_over_another_file(
        tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = tmp_path / 'mine.yaml'
    assert main(['arm', '--template', str(path)]) == 0
    assert load_arm(path).name == 'My arm'
    assert main(['arm', '--template', str(path)]) != 0
    assert 'File exists' in capsys.readouterr().err
    assert main(['arm', '--template']) == 0
    assert capsys.readouterr().out == read_arm_template() == path.read_text()
