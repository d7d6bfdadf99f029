"""How every node of this package starts and ends."""

from __future__ import annotations

from collections.abc import Callable
import logging
import sys

from flex_planner.errors import FlexPlannerError
from flex_planner.ros.logs import forward_logs
import rclpy
from rclpy.executors import ExternalShutdownException, SingleThreadedExecutor
import rclpy.logging
from rclpy.node import Node


def run_node(create: Callable[[], Node], name: str, args: list[str] | None) -> None:
    """
    Run a node until SIGINT or SIGTERM, then exit with code 0; code 1 if it cannot start.

    Parameters
    ----------
    create : callable
        Returns the node; a FlexPlannerError is logged as the reason not to start.
    name : str
        Of the logger until the node has its own.
    args : list of str or None
        Command line.

    """
    rclpy.init(args=args)
    forward_logs(logging.getLogger('flex_planner'))
    node, code = None, 0
    try:
        node = create()
        executor = SingleThreadedExecutor()
        executor.add_node(node)
        executor.spin()
    except (KeyboardInterrupt, ExternalShutdownException):
        pass
    except FlexPlannerError as error:
        rclpy.logging.get_logger(name).fatal(str(error))
        code = 1
    finally:
        if node is not None:
            node.destroy_node()
        rclpy.try_shutdown()
    sys.exit(code)
