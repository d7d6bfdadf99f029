"""The scripts of the gallery: what they should say, and how they are run."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
import subprocess
import sys
import time

FOLDER = Path(__file__).resolve().parents[2] / 'examples'
SCRIPTS = {path.name: path for path in sorted(FOLDER.glob('*.py'))}
WITH_ROS = {name for name, path in SCRIPTS.items() if 'import rclpy' in path.read_text()}
LIMIT = 180.0  # [s], of a script on a machine that is busy
LONGEST = 80  # lines

# what must be among the lines of a script; a new one needs no entry
EXPECTED = {
    'allowable_stress.py': ('factor 3: J = 1.175', 'factor 5: J = 1.246', 'factor 2: 4.37 kg'),
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
    'torques_without_jumps.py': ('the torque jumps by 5.55 N m', 'a price: rates up to 303, 236',
                                 'bounds: rates up to 150, 150', 'speeds up to 1.00, 1.0'),
    'urdf_over_ros.py': ('joints: yaw, shoulder, elbow', 'the tip is at (0.500, 1.200, 0.900) m'),
    'your_own_urdf.py': ('link forearm was merged with gripper', 'solved and certified'),
    'your_own_arm.py': ('dampingratio', 'joints locked: 2.803', 'solved and certified'),
}


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
