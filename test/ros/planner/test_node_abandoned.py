"""Requests that nobody waits for, and nodes that cannot be told apart, with the real node."""

from __future__ import annotations

from collections.abc import Iterator
import signal
import subprocess
import sys

from flex_planner.ros.runtime.processes import NodeProcess
from flex_planner_interfaces.msg import PlanReport
import pytest
from ros_support import Planner

# A program that asks twice for a plan that takes a minute, and leaves as it is told to.
IMPATIENT_CLIENT = """
import sys
import rclpy
from flex_planner_interfaces.action import PlanPath
from flex_planner_interfaces.msg import MotionTask
from flex_planner_interfaces.srv import PlanPath as PlanService
from rclpy.action import ActionClient
rclpy.init()
node = rclpy.create_node('impatient')
task = MotionTask(start_positions=[1.0, -2.0], goal_positions=[1.5, -1.5], duration=100.0,
                  start_modal_displacements=[0.02, 0.0, 0.02, 0.0], effort_weights=[0.1, 0.1],
                  allowed_planning_time=600.0)
client = ActionClient(node, PlanPath, '/abandoned/plan_path')
service = node.create_client(PlanService, '/abandoned/plan_path')
assert client.wait_for_server(60) and service.wait_for_service(60)
accepted = client.send_goal_async(PlanPath.Goal(task=task))
rclpy.spin_until_future_complete(node, accepted)
result = accepted.result().get_result_async()
service.call_async(PlanService.Request(task=task))
for _ in range(10):
    rclpy.spin_once(node, timeout_sec=0.1)
print('sent', flush=True)
sys.stdin.readline()
rclpy.shutdown()
"""


@pytest.fixture(scope='module')
def planner(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Planner]:
    # no other test has clients of a planner of this name in this process
    with Planner(tmp_path_factory.mktemp('abandoned'), 'korayem_ei50', 'abandoned',
                 max_waiting_time=1000.0, queue_length=3) as planner:
        yield planner
        assert planner.process.process.poll() is None
        assert 'Traceback' not in planner.log()


def test_requests_whose_sender_is_gone_make_room(planner: Planner) -> None:
    """One is at work, one waits; both are of a program that leaves, what comes after is not."""
    planner.search(duration=-1.0)  # of another kind: nobody else waits for plans
    with subprocess.Popen([sys.executable, '-c', IMPATIENT_CLIENT], stdin=subprocess.PIPE,
                          stdout=subprocess.PIPE) as client:
        assert client.stdout is not None
        assert client.stdin is not None
        assert client.stdout.readline() == b'sent\n'
        busy = planner.search(allowed_planning_time=900.0).report
        assert busy.error_code == PlanReport.BUSY
        assert 'together more than max_waiting_time = 1000 s: there is room in about' in (
            busy.error_msg)
        mine = planner.send_search(payload_mass=5.5, payload_accuracy=2.0)
        client.stdin.write(b'\n')
        client.stdin.flush()
        client.wait(60)
    planner.wait('the answer', mine.done)
    report = mine.result().report
    assert report.error_code == PlanReport.NONE
    assert report.waiting_time.sec >= 1
    assert report.planning_time.sec >= report.waiting_time.sec
    assert planner.log().count('given up: whoever sent the request has left the network') == 2
    took = planner.log().rpartition('planned in ')[2].partition(' s')[0]
    assert float(took) < 1 + report.planning_time.sec - report.waiting_time.sec


def test_second_node_of_a_name_is_warned_of(planner: Planner) -> None:
    planner.spin(1.5)
    assert 'another node is named' not in planner.log()
    log = planner.recordings.parent / 'second.log'
    with NodeProcess('flex_planner.ros.arm_simulator', {'arm': 'korayem_rigid'},
                     {'__node': 'abandoned'}, log) as second:
        said = 'another node is named /abandoned'
        planner.wait('both warnings', lambda: said in planner.log() and said in log.read_text())
        assert second.process.poll() is None
        assert second.stop(signal.SIGINT) == 0
    assert planner.log().count('another node is named') == 1
