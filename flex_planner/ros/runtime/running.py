"""Start and end of every node of this package."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from contextlib import suppress
import faulthandler
import logging
import os
import signal
import sys
import tempfile
import threading
import time

from flex_planner.base.errors import FlexPlannerError
from flex_planner.base.text import printable
from flex_planner.ros.runtime.arguments import readable_arguments, unused_files
from flex_planner.ros.runtime.logs import forward_logs
from flex_planner.ros.runtime.namesakes import NamesakeWatch
import rclpy
from rclpy.exceptions import ParameterException
from rclpy.executors import ExternalShutdownException, SingleThreadedExecutor
import rclpy.logging
from rclpy.node import Node

_LONGEST_WAIT = 0.2  # [s]
# [s] after a signal, on machines that have much else to do
_LAST_RESORT, _BY_FORCE = 4.0, 8.0
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
        # once it spins, rclpy ends it between two callbacks; before, nobody would for seconds
        if not started:
            os._exit(0)
        _end_soon()

    for number in (signal.SIGINT, signal.SIGTERM):
        signal.signal(number, on_signal)
    _have_log_folder()
    _initialize(sys.argv if args is None else args, name)  # calls these handlers from its own
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
    except (FlexPlannerError, ParameterException, OSError) as error:
        rclpy.logging.get_logger(name).fatal(printable(str(error)))
        code = 1
    except Exception:
        if rclpy.ok():
            raise  # else it comes of a signal that shut rclpy down
    finally:
        _clean_up(node)
    _leave(code)


def _clean_up(node: Node | None) -> None:
    """End the node and ROS; where a signal has ended ROS before, parts of them are gone."""
    try:
        if node is not None:
            node.destroy_node()
        rclpy.try_shutdown()
    except Exception:
        if rclpy.ok():
            raise


def _end_soon() -> None:
    """End the process in a while, should it hang: quietly, for it was told to end."""
    watch = threading.Timer(_LAST_RESORT, os._exit, [0])
    watch.daemon = True
    watch.start()
    # where a library keeps Python's threads from running; the file stays open until the end
    nowhere = os.open(os.devnull, os.O_WRONLY)
    faulthandler.dump_traceback_later(_BY_FORCE, exit=True, file=nowhere)


def _have_log_folder() -> None:
    """Let ROS log into a temporary folder where it cannot into its own, which is an error."""
    home = os.environ.get('ROS_HOME') or os.path.expanduser('~/.ros')
    folder = os.environ.get('ROS_LOG_DIR') or os.path.join(home, 'log')
    try:
        os.makedirs(folder, exist_ok=True)
        with tempfile.TemporaryFile(dir=folder):
            return
    except OSError:
        os.environ['ROS_LOG_DIR'] = tempfile.mkdtemp(prefix='flex_planner-log-')


def _initialize(arguments: Sequence[str], name: str) -> None:
    """Start rclpy with a command line; end with code 1 and a sentence if it is none."""
    readable = arguments
    try:
        with readable_arguments(arguments) as readable:
            rclpy.init(args=readable)
    except Exception as error:
        sentence = ' '.join(str(error).partition(', at ')[0].split())  # then places in its source
        for given, changed in zip(arguments, readable, strict=True):
            sentence = sentence.replace(changed, given)
        print(printable(f'{name}: ROS cannot start: {sentence}'), file=sys.stderr)
        _leave(1)
    for sentence in unused_files(arguments, name):
        rclpy.logging.get_logger(name).warning(sentence)


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
            printable(f'a callback failed: {type(error).__name__}: {error}'))
        time.sleep(_AFTER_ERROR)


def _leave(code: int) -> None:
    """
    End the process.

    A solve that did not give up in time still runs in its thread. The libraries' clean-up at
    exit would wait for it or stumble over it, and has nothing left to do: ROS is shut down, files
    are closed.

    """
    for stream in (sys.stdout, sys.stderr):
        with suppress(OSError, ValueError, AttributeError):
            stream.flush()
    os._exit(code)
