"""
A published plan as a stream of reference states, in a process of its own.

In real time, or in that of ``/clock`` where the planner is to use simulated time.


The solver's libraries keep Python's other threads from running for tens of milliseconds: a thread
of the planner could not keep the times. Run as a program, this module reads plans from its
standard input and publishes them; it ends with that input, and so with the planner. It imports
nothing of the solver.

"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import suppress
from dataclasses import dataclass
import faulthandler
from functools import partial
import logging
import os
import pickle
import signal
import sys
import threading
import time

from flex_planner.base.validation import Array
from flex_planner.control.joint_reference import JointReference
from flex_planner.ros.runtime.clock_listener import ClockListener
from flex_planner.ros.runtime.elapsed import ElapsedTime
import numpy as np
from numpy.typing import NDArray
import rclpy
from rclpy.signals import SignalHandlerOptions
from sensor_msgs.msg import JointState

# by which stamps might run backwards from one plan to another: two clocks are read in turn
_APART_NS = 20_000_000
_BLOCK = 100  # states are interpolated that many at a time
_DEPTH = 10
_AFTER_YOU, _LAST_RESORT = 0.3, 1.5  # [s], for the planner to leave first; to leave by force
_LOG = logging.getLogger(__name__)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class StreamedPlan:
    """
    Samples of a plan, and how to stream them.

    Attributes
    ----------
    names : list of str
        Of the joints, then of the modal coordinates.
    rate : float
        States per second, above 0 [Hz].
    stamp_ns, began_ns : int
        When the motion starts, by the clock of the planner and by the monotonic clock [ns].
    by_clock : bool
        Whether the clock of the planner is ``/clock``, which the states follow then.
    times_ns : numpy.ndarray of int64, shape (k,)
        Of the samples, from 0, or later where the arm is held before [ns].
    coordinates, rates, accelerations : numpy.ndarray, shape (k, n_t)
        Joints [rad], then modes [m].
    torques : numpy.ndarray, shape (k, n)
        [N m].

    """

    names: list[str]
    rate: float
    stamp_ns: int
    began_ns: int
    by_clock: bool = False
    times_ns: NDArray[np.int64]
    coordinates: Array
    rates: Array
    accelerations: Array
    torques: Array


class ReferenceStates:
    """
    A plan at a constant rate, and at its end.

    Between the samples, coordinates follow quintic polynomials and torques are linear, as they do
    for a joint_trajectory_controller.

    Parameters
    ----------
    plan : StreamedPlan
        Its samples.

    """

    def __init__(self, plan: StreamedPlan) -> None:
        self.plan, times = plan, np.multiply(plan.times_ns, 1e-9, dtype=np.float64)
        self._reference = JointReference(
            times=times, positions=plan.coordinates, velocities=plan.rates,
            accelerations=plan.accelerations, torques=plan.torques,
        ).after(plan.coordinates[0], plan.rates[0], plan.torques[0])
        # the last period may be up to half a period longer or shorter than the others
        count = max(int(np.floor(times[-1] * plan.rate + 0.5)), 1)
        grid = np.round(np.arange(count) / plan.rate * 1e9).astype(np.int64)
        self.times_ns = np.append(grid, plan.times_ns[-1])

    def messages(self) -> Iterator[JointState]:
        """Yield the states."""
        for first in range(0, len(self.times_ns), _BLOCK):
            chosen = self.times_ns[first:first + _BLOCK]
            for time_ns, *values in zip(chosen, *self._values(chosen * 1e-9), strict=True):
                yield self._message(self.plan.stamp_ns + int(time_ns), *values)

    def _values(self, times: Array) -> tuple[Array, Array, Array]:
        """Return coordinates, rates, and torques with zeros for the modes."""
        modes = np.zeros((len(times), len(self.plan.names) - self.plan.torques.shape[1]))
        positions, velocities = self._reference.motion(times)
        return positions, velocities, np.hstack([self._reference.torque(times), modes])

    def _message(self, stamp_ns: int, position: Array, velocity: Array,
                 effort: Array) -> JointState:
        message = JointState(name=self.plan.names, position=position.tolist(),
                             velocity=velocity.tolist(), effort=effort.tolist())
        _set_stamp(message, stamp_ns)
        return message


class Stream:
    """
    Publishes reference states when they are due, in its own thread.

    Parameters
    ----------
    publish : callable
        Takes a message; called from the thread.

    """

    def __init__(self, publish: Callable[[JointState], None]) -> None:
        self._publish = publish
        self._changed = threading.Condition()
        self._next: StreamedPlan | None = None
        self._closed = False
        # when the last state was due, by the monotonic clock, and its stamp
        self._last_ns = self._last_stamp_ns = 0
        self._passed, self._clock_ns = ElapsedTime(), 0  # of /clock
        self._thread = threading.Thread(target=self._run, name='reference states', daemon=True)
        self._thread.start()

    def start(self, plan: StreamedPlan) -> None:
        """Stream a plan, in place of one that is being streamed."""
        with self._changed:
            self._next = plan
            self._changed.notify()

    def tick(self, now_ns: int) -> None:
        """Take note of the time of ``/clock`` [ns]."""
        with self._changed:
            self._passed.look(now_ns)
            self._clock_ns = now_ns
            self._changed.notify()

    def close(self, timeout: float) -> None:
        """End the stream and its thread [s]."""
        with self._changed:
            self._closed = True
            self._changed.notify()
        self._thread.join(timeout)

    def _is_interrupted(self) -> bool:
        return self._closed or self._next is not None

    def _run(self) -> None:
        _hurry()
        while True:
            with self._changed:
                self._changed.wait_for(self._is_interrupted)
                if self._closed or self._next is None:
                    return
                plan, self._next = self._next, None
            try:
                (self._play_by_clock if plan.by_clock else self._play)(ReferenceStates(plan))
            except Exception:
                _LOG.exception('streaming the reference states failed')

    def _play(self, states: ReferenceStates) -> None:
        """
        Publish states at their times until the last, or another plan.

        A plan takes a moment to get here, in which the one before may go on: what was due by then
        is left out, so that time never runs backwards.

        """
        for time_ns, message in zip(states.times_ns, states.messages(), strict=True):
            due_ns = states.plan.began_ns + int(time_ns)
            stamp_ns = states.plan.stamp_ns + int(time_ns)
            if due_ns <= self._last_ns or 0 <= self._last_stamp_ns - stamp_ns < _APART_NS:
                continue
            if self._wait(due_ns):
                return
            self._publish(message)
            self._last_ns, self._last_stamp_ns = due_ns, stamp_ns

    def _play_by_clock(self, states: ReferenceStates) -> None:
        """Publish states at their times of ``/clock``; where that jumps, the motion goes on."""
        stamp_ns = states.plan.stamp_ns
        with self._changed:
            self._passed, self._clock_ns = ElapsedTime(), stamp_ns
            self._passed.look(stamp_ns)
        for time_ns, message in zip(states.times_ns, states.messages(), strict=True):
            due_ns = int(time_ns)
            with self._changed:
                self._changed.wait_for(partial(self._is_due, due_ns))
                if self._is_interrupted():
                    return
                start_ns = self._clock_ns - self._passed.nanoseconds
            _set_stamp(message, start_ns + due_ns)
            self._publish(message)

    def _is_due(self, due_ns: int) -> bool:
        """Return whether so much of the time of the clock has passed [ns], or there is no plan."""
        begun = self._clock_ns > 0
        return self._is_interrupted() or (begun and self._passed.nanoseconds >= due_ns)

    def _wait(self, due_ns: int) -> bool:
        """Wait until a time of the monotonic clock [ns]; return whether to stop instead."""
        with self._changed:
            while not self._is_interrupted():
                left = due_ns - time.monotonic_ns()
                if left <= 0:
                    return False
                self._changed.wait(left * 1e-9)
        return True


def _set_stamp(message: JointState, stamp_ns: int) -> None:
    """Set the time of a message, none before 0 [ns]."""
    stamp = message.header.stamp
    stamp.sec, stamp.nanosec = divmod(max(stamp_ns, 0), 10**9)


def _hurry() -> None:
    """Let this thread run before others as soon as it is due, where the system allows that."""
    with suppress(OSError):
        os.sched_setscheduler(0, os.SCHED_RR | os.SCHED_RESET_ON_FORK, os.sched_param(1))


def main() -> None:
    """
    Publish plans from the standard input on a topic.

    Arguments: name, namespace, topic, and ``by_clock`` where plans are to follow ``/clock``.

    """
    name, namespace, topic, *by_clock = sys.argv[1:]
    for number in (signal.SIGINT, signal.SIGTERM):
        signal.signal(number, signal.SIG_IGN)  # the planner decides when it ends
    rclpy.init(args=[], signal_handler_options=SignalHandlerOptions.NO)
    node = rclpy.create_node(name, namespace=namespace, enable_rosout=False,
                             start_parameter_services=False)
    stream = Stream(node.create_publisher(JointState, topic, _DEPTH).publish)
    clock = ClockListener(node, stream.tick)
    if by_clock:
        clock.start()
    try:
        print('ready', flush=True)
    except BrokenPipeError:  # the planner ended while this one started
        os._exit(0)
    try:
        while True:
            plan = pickle.load(sys.stdin.buffer)
            if plan.by_clock:
                clock.start()
            stream.start(plan)
    except EOFError:
        stream.close(1.0)
        clock.close()
    # Fast DDS may spin without end where it leaves while another one does (its issue 6513)
    time.sleep(_AFTER_YOU)
    nowhere = os.open(os.devnull, os.O_WRONLY)  # open to the end
    faulthandler.dump_traceback_later(_LAST_RESORT, exit=True, file=nowhere)
    node.destroy_node()
    rclpy.try_shutdown()


if __name__ == '__main__':
    main()
