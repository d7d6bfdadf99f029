"""
The first steps of a node's process, before it loads the libraries that take long.

Where ROS 2 is missing, they are the last ones, and say so.

Run as a program, this module runs another one: ``python -m flex_planner.ros.runtime.start MODULE
--ros-args ...``.

"""

from __future__ import annotations

from importlib import import_module
import os
import runpy
import signal
import sys

from flex_planner.base.errors import FlexPlannerError
from flex_planner.base.streams import open_descriptors


def prepare_process() -> None:
    """Open the standard descriptors, and let a signal end the process at once until it runs."""
    open_descriptors()
    for number in (signal.SIGINT, signal.SIGTERM):
        signal.signal(number, _leave)


_HELP = """\
usage: {name} [--ros-args [-p PARAMETER:=VALUE]... [--params-file FILE]... [-r FROM:=TO]...]

{summary}

example:     {name} --ros-args -p {example}
parameters:  {parameters}
names:       {names}
"""
_HELPS = {
    'planner': (
        'Plan motions of a flexible arm on request, and publish them.', 'arm:=desk_arm',
        'config/planner.yaml lists them', 'docs/ros_node.md lists services, actions and topics'),
    'arm_simulator': (
        'Simulate a flexible arm in real time, which follows the topic joint_trajectory.',
        'arm:=desk_arm -r joint_trajectory:=/flex_planner/joint_trajectory',
        'config/planner.yaml lists them', 'docs/simulator.md lists topics'),
    'replay': (
        'Publish a recording again, with its topics and times.', 'recording:=PATH',
        'rate, start, delay and loop, as flex-planner replay --help has them',
        'those that were recorded'),
}


def planner() -> None:
    """Run the planner node."""
    _run('planner', 'flex_planner.ros.planner.node')


def arm_simulator() -> None:
    """Run the simulated arm."""
    _run('arm_simulator', 'flex_planner.ros.arm_simulator')


def replay() -> None:
    """Run the node that publishes a recording again."""
    _run('replay', 'flex_planner.ros.replay')


def _run(name: str, module: str) -> None:
    """Run the main function of a module, or say how the node is started."""
    prepare_process()
    if sys.argv[1:] in (['-h'], ['--help']):
        summary, example, parameters, names = _HELPS[name]
        print(_HELP.format(name=name, summary=summary, example=example, parameters=parameters,
                           names=names), end='')
        return
    try:
        main = import_module(module).main
    except ImportError as error:
        print(f'{name}: this node needs ROS 2 with the messages of flex_planner_interfaces: '
              f'{error}', file=sys.stderr)
        sys.exit(1)
    except FlexPlannerError as error:  # no message definitions
        print(f'{name}: {error}', file=sys.stderr)
        sys.exit(1)
    main()


def _leave(number: int, frame: object) -> None:
    """End: nothing is begun yet that would have to be ended."""
    os._exit(0)


if __name__ == '__main__':
    prepare_process()
    del sys.argv[0]
    runpy.run_module(sys.argv[0], run_name='__main__', alter_sys=True)
