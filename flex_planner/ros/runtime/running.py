"""Start and end of every node of this package."""

from __future__ import annotations

from collections.abc import Callable
import faulthandler
import logging
import os
import signal
import sys
import threading
import time

from flex_planner.base.errors import FlexPlannerError
from flex_planner.ros.runtime.logs import forward_logs
from flex_planner.ros.runtime.namesakes import NamesakeWatch
import rclpy
from rclpy.exceptions import ParameterException
from rclpy.executors import ExternalShutdownException, SingleThreadedExecutor
import rclpy.logging
from rclpy.node import Node

_LONGEST_WAIT = 0.2  # [s]
_LAST_RESORT = 3.0  # [s] after a signal
_AFTER_ERROR = 0.01  # [s]; an error that comes again and again must not fill disk and processor


class CannotGoOnError(FlexPlannerError):
    """Raised by a callback that ends its node: what it is for can no longer be done."""


def run_node(create: Callable[[], Node], name: str, args: list[str] | None) -> None:
    """
    Run a node until SIGINT or SIGTERM, then exit with code 0.

    The code is 1 if it cannot start, or a callback raises CannotGoOnError; the reason is logged.
    Any other exception of a callback is logged, and the node goes on.

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
        # should anything below hang, say where, and end
        faulthandler.dump_traceback_later(_LAST_RESORT, exit=True)
        # once it spins, rclpy ends it between two callbacks; before, nobody would for seconds
        if not started:
            sys.exit(0)

    for number in (signal.SIGINT, signal.SIGTERM):
        signal.signal(number, on_signal)
    rclpy.init(args=args)  # calls the handlers above from its own
    forward_logs(logging.getLogger('flex_planner'))
    try:
        node = create()
        NamesakeWatch(node)
        started = True
        executor = SingleThreadedExecutor()
        executor.add_node(node)
        # spin() would wait without end: where the signal that ends rclpy comes between two waits,
        # its wake-up is lost now and then
        while rclpy.ok():
            _spin_once(executor, name)
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


def _spin_once(executor: SingleThreadedExecutor, name: str) -> None:
    """
    Let the executor do one thing.

    Requests that rclpy itself cannot digest, such as a parameter of an unknown type, raise here:
    they get no answer, but all others do.

    """
    try:
        executor.spin_once(timeout_sec=_LONGEST_WAIT)
    except (ExternalShutdownException, CannotGoOnError):
        raise
    except Exception as error:
        if not rclpy.ok():
            raise
        rclpy.logging.get_logger(name).error(
            f'a callback failed: {type(error).__name__}: {error}')
        time.sleep(_AFTER_ERROR)


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
