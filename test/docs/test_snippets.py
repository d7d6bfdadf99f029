"""Code, commands and files that pages show are such that they run, are understood and are read."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import fields
from pathlib import Path
import re
import shlex
import textwrap
from types import SimpleNamespace
from typing import Any

from documents import Block, DOCS, Follower, PAGES, read_blocks
from flex_planner.cli.parser import parse
from flex_planner.logs.drive_file import load_drive
from flex_planner.ros.runtime.parameters import ARM_PARAMETERS
from flex_planner.ros.settings.planner import PlannerSettings
from flex_planner.ros.settings.simulator import SimulatorSettings
from flex_planner_interfaces.msg import MotionTask
from flex_planner_interfaces.srv import PlanPath
from geometry_msgs.msg import Point
import pytest
from rclpy.clock import Clock
from rclpy.duration import Duration

SETTINGS = {'planner': PlannerSettings, 'arm_simulator': SimulatorSettings}


def code_of(page: str, *, ros: bool) -> list[Block]:
    """Return blocks of Python of a page, those that ask a node or the others."""
    return [block for block in read_blocks(DOCS / page)
            if block.language == 'python' and ('client.' in block.text) == ros]


@pytest.mark.parametrize('page', ['feedback.md', 'replanning.md'])
def test_code_runs(page: str, tmp_path: Path) -> None:
    blocks = code_of(page, ros=False)
    assert blocks
    with Follower(tmp_path) as follower:
        assert all(follower.follow(block) for block in blocks)


def test_request_for_another_plan_is_one() -> None:
    (block,), asked = code_of('replanning.md', ros=True), list[MotionTask]()

    def call(request: PlanPath.Request) -> SimpleNamespace:
        asked.append(request.task)
        return SimpleNamespace(report=SimpleNamespace(plan_id='next'))

    names: dict[str, Any] = {
        'MotionTask': MotionTask, 'PlanPath': PlanPath, 'Point': Point, 'Duration': Duration,
        'client': SimpleNamespace(call=call), 'report': SimpleNamespace(plan_id='running'),
        'node': SimpleNamespace(get_clock=Clock)}
    exec(compile(block.text, 'replanning.md', 'exec'), names)
    assert asked[0].replaces == 'running' and names['report'].plan_id == 'next'
    assert asked[0].publish and asked[0].start_time.sec > 0


def commands(page: Path, name: str) -> Iterator[list[str]]:
    """Return the arguments of a command wherever a page shows it on lines of its own."""
    text = page.read_text(encoding='utf-8').replace('\\\n', ' ')
    for line in re.findall(rf'^(?: {{4}})?(?:\$ )?{name} (.*)$', text,
                           re.MULTILINE):
        yield shlex.split(line, comments=True)


@pytest.mark.parametrize('page', PAGES, ids=lambda page: page.stem)
def test_commands_are_understood(page: Path) -> None:
    for arguments in commands(page, '(?:tools/run )?flex-planner'):
        assert callable(parse(arguments).run), arguments


@pytest.mark.parametrize('page', PAGES, ids=lambda page: page.stem)
def test_parameters_of_nodes_are_known(page: Path) -> None:
    for name, settings in SETTINGS.items():
        known = {*ARM_PARAMETERS, *(one.name for one in fields(settings)), 'use_sim_time'}
        for arguments in commands(page, f'tools/run {name}'):
            given = {one.partition(':=')[0] for option, one in zip(
                arguments, arguments[1:], strict=False) if option == '-p'}
            assert given <= known, arguments


@pytest.mark.parametrize('page', ['identification.md', 'tutorials/quieter_arm.md'])
def test_files_of_drives_are_read(page: str, tmp_path: Path) -> None:
    text = (DOCS / page).read_text(encoding='utf-8')
    (block,) = re.findall(r'(?:^ {4}(?:#|\w+:) .*\n)*^ {4}rate: .*\n(?:^ {4}.*\n)+', text,
                          re.MULTILINE)
    path = tmp_path / 'drive.yaml'
    path.write_text(textwrap.dedent(block), encoding='utf-8')
    drive = load_drive(path, 2)
    assert (drive.rate, drive.speed_filter) == (1000, 50)
    assert drive.gains.stiffness.tolist() == [40, 40] and drive.resolution > 0
