"""Compiled functions are found again only while nothing that enters them has changed."""

from __future__ import annotations

import dataclasses
from pathlib import Path
import shutil

from flex_planner.arms.arm import Arm, Joint, Link, Motor, Node
from flex_planner.dynamics import cache_key as module
from flex_planner.dynamics.cache_key import cache_key
import pytest
from spatial_arms import yaw_pitch


def test_key_of_an_arm_holds_all_that_is_compiled_and_no_more(workshop_arm: Arm) -> None:
    link, joint = workshop_arm.links[0], workshop_arm.joints[0]
    links = [dataclasses.replace(link, **change) for change in (
        {}, {'flexural_rigidity': 99.0}, {'length': 0.7}, {'linear_density': 5.0},
        {'modes': 2}, {'mode_family': 'clamped_free'}, {'shape_mass': 1.0},
        {'shape_inertia': 1.0}, {'damping_ratio': 0.1})]
    arms = [dataclasses.replace(workshop_arm, links=(changed, workshop_arm.links[1]))
            for changed in links]
    stiffer = dataclasses.replace(joint, viscous_friction=0.4)
    limited = dataclasses.replace(joint, motor=Motor(max_speed=2.0), upper_limit=1.0)
    arms += [dataclasses.replace(workshop_arm, **change) for change in (
        {'name': 'other'}, {'gravity': [0.0, 0.0]}, {'nodes': (Node(),) * 3},
        {'joints': (stiffer, workshop_arm.joints[1])},
        {'joints': (limited, workshop_arm.joints[1])})]
    keys = [cache_key(arm, 'dynamics') for arm in arms]
    # the rigidity, the name and limits are not compiled in
    assert [keys.index(key) for key in keys] == [0, 0, 2, 3, 4, 5, 6, 7, 8, 0, 10, 11, 12, 0]


@dataclasses.dataclass(frozen=True, kw_only=True)
class GearedJoint(Joint):
    """A joint with a field that nobody thought of."""

    rotor_inertia: float = 0.0


def test_new_field_of_an_arm_enters_its_key_by_itself(workshop_arm: Arm) -> None:
    def geared(inertia: float) -> Arm:
        joints = tuple(GearedJoint(viscous_friction=joint.viscous_friction,
                                   rotor_inertia=inertia) for joint in workshop_arm.joints)
        return dataclasses.replace(workshop_arm, joints=joints)

    keys = {cache_key(arm, 'dynamics') for arm in (workshop_arm, geared(0.0), geared(0.1))}
    assert len(keys) == 3
    assert cache_key(geared(0.1), 'dynamics') in keys


def test_field_of_another_class_is_not_free_for_having_the_name_of_a_free_one() -> None:
    @dataclasses.dataclass(frozen=True, kw_only=True)
    class NamedLink(Link):
        name: str = ''

    joints = (Joint(),)
    arms = [Arm(name='one', links=(NamedLink(length=1.0, linear_density=1.0, name=name),),
                joints=joints) for name in 'ab']
    assert len({cache_key(arm, 'dynamics') for arm in arms}) == 2


@pytest.mark.parametrize('changed', ['arms/new_file.py', 'dynamics/chain.py',
                                     'dynamics/deeper/another.py'])
def test_any_source_of_a_package_changes_the_key(
        workshop_arm: Arm, tmp_path: Path, monkeypatch: pytest.MonkeyPatch,
        changed: str) -> None:
    for package in ('arms', 'dynamics', 'optimal_control'):
        shutil.copytree(module._PACKAGES / package, tmp_path / package)
    monkeypatch.setattr(module, '_PACKAGES', tmp_path)
    keys = []
    for text in ('', '# more', '# more and more'):
        path = tmp_path / changed
        path.parent.mkdir(exist_ok=True)
        if text:
            path.write_text(text)
        module._sources.cache_clear()
        keys.append(cache_key(workshop_arm, 'dynamics'))
    module._sources.cache_clear()
    assert len(set(keys)) == 3


def test_optimality_conditions_have_a_library_of_their_own(workshop_arm: Arm) -> None:
    assert cache_key(workshop_arm, 'dynamics') != cache_key(workshop_arm, 'dynamics',
                                                            'optimal_control')


def test_names_notes_and_limits_of_spatial_arms_are_not_compiled_in() -> None:
    arm = yaw_pitch()
    first, second = arm.joints
    arms = [arm, dataclasses.replace(arm, name='other', source='elsewhere', notes=('note',),
                                     payload_inertia=0.1, joint_names=('yaw', 'pitch')),
            dataclasses.replace(arm, joints=(dataclasses.replace(first, upper_limit=1.0), second)),
            dataclasses.replace(arm, joints=(dataclasses.replace(first, slides=True), second)),
            dataclasses.replace(arm, tip_rotation=(0.1, 0.0, 0.0))]
    keys = [cache_key(one, 'dynamics') for one in arms]
    assert [keys.index(key) for key in keys] == [0, 0, 0, 3, 4]
