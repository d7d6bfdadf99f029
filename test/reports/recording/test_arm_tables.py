"""What a report says of an arm: all that its file says, and no empty columns."""

from __future__ import annotations

from flex_planner.arms.arm_files import load_arm, read_arm_template
from flex_planner.reports.recording.arm_tables import arm_tables
import pytest


def cells(name: str, title: str) -> dict[str, list[str]]:
    """Return the columns of a table of an arm."""
    (table,) = [one for one in arm_tables(load_arm(name)) if one.title.startswith(title)]
    return {column: [row[i] for row in table.rows] for i, column in enumerate(table.columns)}


@pytest.fixture
def template(tmp_path_factory: pytest.TempPathFactory) -> str:
    path = tmp_path_factory.mktemp('arm') / 'arm.yaml'
    path.write_text(read_arm_template(), encoding='utf-8')
    return str(path)


def test_joints_say_what_data_sheets_say(template: str) -> None:
    joints = cells(template, 'Joints')
    assert joints['largest torque [N m]'] == ['30', '15']  # 0.4 and 0.2 N m, 100 times 0.75
    assert joints['rotor inertia at the joint [kg m²]'] == ['0.15', '0.06']
    assert joints['gear ratio'] == ['100', '100']
    assert joints['Coulomb friction [N m]'] == ['0.4 above 0.1 rad/s', '0.2 above 0.1 rad/s']
    assert joints['joint stiffness, damping [N m/rad, N m s/rad]'] == ['6000, 2', '–']


def test_masses_are_those_of_all_nodes_and_housings(template: str) -> None:
    arm = load_arm(template)
    (table,) = [one for one in arm_tables(arm) if one.title.startswith('Masses')]
    named = {row[0]: row[1:] for row in table.rows}
    assert named == {
        'joint 1': ('0 kg', '0.002 kg m²'), 'joint 2': ('0.15 kg', '0.0005 kg m²'),
        'tip': ('0.25 kg', '0.0003 kg m²'), 'housing of joint 2': ('0.7 kg', '0.0004 kg m²'),
        'centre of the payload': ('(0.03, 0) m', 'from the tip')}


def test_links_say_their_sections(template: str) -> None:
    assert cells(template, 'Arm')['sections'][0] == (
        '0.03 m rigid without mass; 0.55 m EI x 1; 0.02 m rigid')


def test_what_no_joint_has_takes_no_column() -> None:
    assert list(cells('korayem_ei50', 'Joints')) == [
        'joint', 'stall torque [N m]', 'no-load speed [rad/s]', 'largest torque [N m]',
        'largest speed [rad/s]', 'joint limits [deg]', 'viscous friction [N m s/rad]']
    assert cells('korayem_ei50', 'Joints')['largest torque [N m]'] == ['by its line alone'] * 2
    assert len(arm_tables(load_arm('korayem_rigid'))) == 2
