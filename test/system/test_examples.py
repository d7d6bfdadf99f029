"""Every script of the gallery runs, says what it should, and stays short."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from pathlib import Path
import re
import subprocess
import sys
import time

from flex_planner.ros.runtime.processes import NodeProcess
from flex_planner_interfaces.srv import PlanPath
import pytest
from ros_support import Planner

FOLDER = Path(__file__).resolve().parents[2] / 'examples'
SCRIPTS = {path.name: path for path in sorted(FOLDER.glob('*.py'))}
WITH_ROS = {name for name, path in SCRIPTS.items() if 'import rclpy' in path.read_text()}
LIMIT = 180.0  # [s], of a script on a machine that is busy
LONGEST = 80  # lines
UNKNOWN = '_NODE_NAME_UNKNOWN_'  # of a node that has just come, or goes

# what must be among the lines of a script; a new one needs no entry
EXPECTED = {
    'allowable_stress.py': ('factor 3: J = 1.175', 'factor 5: J = 1.246', 'factor 2: 4.36 kg'),
    'call_the_node.py': ('service: J = 0.6', 'action: canceled'),
    'controller.py': ('followed: at most 0.',),
    'find_the_payload.py': ('between 5.85', 'dJ/dm_p'),
    'forgiving_plans.py': ('least effort: 3.1', 'forgiving:    1.6'),
    'keep_a_speed.py': ('w_2 = 4.2', 'an objective cannot be met'),
    'map_the_payload.py': ('49 solved', '5.85    6.18', 'from the map: '),
    'minimum_time.py': ('shortest time with 1 kg: 0.642', 'in 1.00 s: 5.85'),
    'minimum_vibration.py': ('minimum vibration: ',),
    'pass_via_points.py': ('passed at 0.5 s: J = 1.3222', 'passed when it is best: J = 0.9358'),
    'plan_again.py': ('the tip rests at (0.7000, -0.4000) m', 'from the first plan'),
    'plan_a_path.py': ('solved and certified by a cold start', 'J = 0.647'),
    'post_in_the_way.py': ('post J = 0.8185', '0.45 N m J = 0.651', 'round the post: 5.60'),
    'replay_and_report.py': ('/flex_planner/motion_task', 'the check of the recording passed'),
    'urdf_over_ros.py': ('joints: yaw, shoulder, elbow', 'the tip is at (0.500, 1.200, 0.900) m'),
    'your_own_urdf.py': ('link forearm was merged with gripper', 'solved and certified'),
    'your_own_arm.py': ('dampingratio', 'joints locked: 2.803', 'solved and certified'),
}


@pytest.fixture(scope='module')
def planner(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Planner]:
    folder = tmp_path_factory.mktemp('examples')
    with Planner(folder, 'korayem_ei50', effort_weights=[0.125, 0.125]) as planner:
        yield planner
        assert 'Traceback' not in planner.log()


def run(name: str, folder: Path, meanwhile: Callable[[], None]) -> str:
    """Run a script in a folder, doing something else again and again; return what it says."""
    output, end = folder / 'said.txt', time.monotonic() + LIMIT
    # rclpy imports what uses a deprecated module
    strict = [] if name in WITH_ROS else ['-W', 'error']
    command = [sys.executable, *strict, SCRIPTS[name]]
    with output.open('w') as file, subprocess.Popen(command, cwd=folder, stdout=file,
                                                    stderr=subprocess.STDOUT) as script:
        while script.poll() is None:
            meanwhile()
            if time.monotonic() > end:
                script.kill()
    assert script.returncode == 0, (
        f'{name} ended with {script.returncode}, killed after {LIMIT:g} s at the latest: '
        f'{output.read_text()}')
    return output.read_text()


def check(name: str, output: str) -> None:
    assert output.strip()
    assert [text for text in EXPECTED.get(name, ()) if text not in output] == [], output


def test_gallery_is_complete() -> None:
    assert EXPECTED.keys() <= SCRIPTS.keys()
    table = (FOLDER / 'README.md').read_text()
    assert [name for name in SCRIPTS if f'[{name}]({name})' not in table] == []


@pytest.mark.parametrize('name', SCRIPTS)
def test_example_is_short_and_says_how_to_run_it(name: str) -> None:
    text = SCRIPTS[name].read_text()
    assert len(text.splitlines()) <= LONGEST
    assert f'\n    tools/run python examples/{name}\n' in text


@pytest.mark.parametrize('name', sorted(SCRIPTS.keys() - WITH_ROS))
def test_example_runs(name: str, tmp_path: Path) -> None:
    check(name, run(name, tmp_path, lambda: time.sleep(0.05)))
    written = {path.name for path in tmp_path.glob('output/*') if path.stat().st_size > 10_000}
    assert set(re.findall(r'\w+\.(?:png|html)', SCRIPTS[name].read_text())) <= written


def listening(planner: Planner, topic: str) -> set[str]:
    """Return the names of the nodes that subscribe to a topic."""
    return {info.node_name for info in planner.node.get_subscriptions_info_by_topic(topic)}


@pytest.mark.parametrize('name', sorted(WITH_ROS))
def test_example_with_a_planner_runs(name: str, planner: Planner, tmp_path: Path) -> None:
    trajectories, published = '/flex_planner/joint_trajectory', list[PlanPath.Response]()
    simulator = NodeProcess(
        'flex_planner.ros.arm_simulator',
        {'arm': 'korayem_ei50', 'payload_mass': 1.0, 'initial_positions': [1.0472, -2.0944]},
        {'joint_trajectory': trajectories}, tmp_path / 'simulator.log')

    def publish() -> None:
        """Give a script that listens, as the simulator does, something to listen to."""
        planner.spin(0.1)
        listeners = listening(planner, trajectories)
        # nodes of the test before may be on their way out, and those of this one half known
        if published or len(listeners) != 2 or UNKNOWN in listeners:
            return
        streamed = listening(planner, '/flex_planner/reference_states')
        if 'controller' in listeners - streamed:
            return
        # nothing is published before the planner hears from this simulator: it knows another
        answer = planner.plan(publish=True)
        published.extend([] if answer.report.error_code else [answer])

    with simulator:
        check(name, run(name, tmp_path, publish))
