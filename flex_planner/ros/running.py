"""How every node of this package starts and ends."""

from __future__ import annotations

from collections.abc import Callable
import logging
import os
import signal
import sys
import threading

from flex_planner.errors import FlexPlannerError
from flex_planner.ros.logs import forward_logs
import rclpy
from rclpy.exceptions import ParameterException
from rclpy.executors import ExternalShutdownException, SingleThreadedExecutor
import rclpy.logging
from rclpy.node import Node

_LONGEST_WAIT = 0.2  # [s]


def run_node(create: Callable[[], Node], name: str, args: list[str] | None) -> None:
    """
    Run a node until SIGINT or SIGTERM, then exit with code 0; code 1 if it cannot start.

    Parameters
    ----------
    create : callable
        Returns the node; a FlexPlannerError, and a parameter of a wrong type or out of its
        range, is logged as the reason not to start.
    name : str
        Of the logger until the node has its own.
    args : list of str or None
        Command line.

    """
    node, code, started = None, 0, False

    def on_signal(number: int, frame: object) -> None:
        # once it spins, rclpy ends it between two callbacks; before, nobody would for seconds
        if not started:
            sys.exit(0)

    for number in (signal.SIGINT, signal.SIGTERM):
        signal.signal(number, on_signal)
    rclpy.init(args=args)  # calls the handlers above from its own
    forward_logs(logging.getLogger('flex_planner'))
    try:
        node = create()
        started = True
        executor = SingleThreadedExecutor()
        executor.add_node(node)
        # spin() would wait without end: where the signal that ends rclpy comes between two waits,
        # its wake-up is lost now and then
        while rclpy.ok():
            executor.spin_once(timeout_sec=_LONGEST_WAIT)
    except ExternalShutdownException:
        pass
    except (FlexPlannerError, ParameterException) as error:
        rclpy.logging.get_logger(name).fatal(str(error))
        code = 1
    except Exception:
        if rclpy.ok():
            raise  # else it comes of a signal that shut rclpy down
    finally:
        if node is not None:
            node.destroy_node()
        rclpy.try_shutdown()
    _leave(code)


def _leave(code: int) -> None:
    """
    End the process.

    A solve that did not give up in time still runs in its thread. The libraries' clean-up at
    exit would wait for it, and has nothing left to do: ROS is shut down, files are closed.

    """
    if any(thread is not threading.main_thread() for thread in threading.enumerate()):
        sys.stdout.flush()
        sys.stderr.flush()
        os._exit(code)
    sys.exit(code)
