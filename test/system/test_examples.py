"""The scripts of the gallery that talk to a planner run, and say what they should."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

from example_scripts import check, run, WITH_ROS
from flex_planner.ros.runtime.processes import NodeProcess
from flex_planner_interfaces.srv import PlanPath
import pytest
from ros_support import Planner

UNKNOWN = '_NODE_NAME_UNKNOWN_'  # of a node that has just come, or goes


@pytest.fixture(scope='module')
def planner(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Planner]:
    folder = tmp_path_factory.mktemp('examples')
    with Planner(folder, 'korayem_ei50', effort_weights=[0.125, 0.125]) as planner:
        yield planner
        assert 'Traceback' not in planner.log()


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
