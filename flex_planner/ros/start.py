"""Starts of the nodes, which say in one sentence where ROS 2 is missing."""

from __future__ import annotations

from importlib import import_module
import sys

from flex_planner.base.errors import FlexPlannerError


def planner() -> None:
    """Run the planner node."""
    _start('planner', 'flex_planner.ros.planner.node')


def arm_simulator() -> None:
    """Run the simulator of the arm."""
    _start('arm_simulator', 'flex_planner.ros.arm_simulator')


def replay() -> None:
    """Run the node that publishes a recording again."""
    _start('replay', 'flex_planner.ros.replay')


def _start(name: str, module: str) -> None:
    """Run the main function of a module."""
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
