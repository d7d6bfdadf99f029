"""The status of the planner node on /diagnostics."""

from __future__ import annotations

from dataclasses import dataclass, field
import os
from pathlib import Path
import time

from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus, KeyValue
from flex_planner.planning.warnings import WarningKind
from flex_planner.ros.planner.controller import Controller
from flex_planner.ros.planner.request_queue import RequestQueue
from flex_planner.ros.planner.streamer import Streamer
from flex_planner_interfaces.msg import PlanReport
from rclpy.callback_groups import ReentrantCallbackGroup
from rclpy.clock import Clock, ClockType
from rclpy.node import Node
from rclpy.publisher import Publisher

SUBSCRIBERS = 'trajectory subscribers'
_PERIOD = 1.0  # [s]
_MEGABYTE = 2**20
_BROKEN = (PlanReport.RECORDING_FAILED, PlanReport.UNKNOWN)


@dataclass(slots=True)
class Record:
    """
    Counts of the requests so far by their ends.

    Attributes
    ----------
    solved, failed, canceled : int
        How many.
    error_code, error_msg
        Of the last that was not canceled; 0 and empty if it was solved.
    not_recorded : str
        Why the last has no recording; empty if it has, or needs none.

    """

    solved: int = 0
    failed: int = 0
    canceled: int = 0
    error_code: int = 0
    error_msg: str = ''
    not_recorded: str = ''
    started: float = field(default_factory=time.monotonic)

    def add(self, report: PlanReport) -> None:
        """Count a request."""
        told = dict(zip(report.warning_kinds, report.warnings, strict=False))
        self.not_recorded = told.get(WarningKind.NOT_RECORDED.name, '')
        if report.error_code == PlanReport.CANCELED:
            self.canceled += 1
            return
        self.error_code, self.error_msg = int(report.error_code), report.error_msg
        if report.error_code == PlanReport.NONE:
            self.solved += 1
        else:
            self.failed += 1


class Diagnostics:
    """
    Publishes the status of the planner and of its stream once a second.

    planner: OK; WARN if the last request failed or could not be recorded; ERROR if it failed for
    a reason inside the node, which are RECORDING_FAILED and UNKNOWN. reference states: ERROR while
    the process that streams them is gone, else OK.

    Parameters
    ----------
    node : Node
        The planner.
    queue : RequestQueue
        Its requests.
    record : Record
        How they ended.
    streamer : Streamer
        Streams the reference states.
    trajectories : Publisher
        Of the trajectories, whose subscribers are counted.
    arm : str
        Name of the arm.
    controller : Controller or None
        Carries out plans.

    """

    def __init__(self, node: Node, queue: RequestQueue, record: Record, streamer: Streamer,
                 trajectories: Publisher, arm: str, controller: Controller | None = None
                 ) -> None:
        self._node, self._queue, self._record, self._arm = node, queue, record, arm
        self._streamer, self._trajectories = streamer, trajectories
        self._controller = controller
        self._publisher = node.create_publisher(DiagnosticArray, '/diagnostics', 1)
        # whatever clock the node has: that of a simulation may stand still
        node.create_timer(_PERIOD, self._publish, callback_group=ReentrantCallbackGroup(),
                          clock=Clock(clock_type=ClockType.STEADY_TIME))

    def _publish(self) -> None:
        message = DiagnosticArray(status=[self._of_planner(), self._of_stream()])
        message.header.stamp = self._node.get_clock().now().to_msg()
        self._publisher.publish(message)

    def _of_planner(self) -> DiagnosticStatus:
        return DiagnosticStatus(
            level=self._level(), name=f'{self._node.get_name()}: planner', message=self._message(),
            hardware_id=self._arm,
            values=[KeyValue(key=key, value=str(value)) for key, value in self._values().items()])

    def _of_stream(self) -> DiagnosticStatus:
        failure = self._streamer.failure
        return DiagnosticStatus(
            level=DiagnosticStatus.ERROR if failure else DiagnosticStatus.OK,
            name=f'{self._node.get_name()}: reference states', message=failure or 'ready',
            hardware_id=self._arm)

    def _level(self) -> bytes:
        code, warned = self._record.error_code, self._record.not_recorded
        level: bytes = (DiagnosticStatus.ERROR if code in _BROKEN
                        else DiagnosticStatus.WARN if code or warned else DiagnosticStatus.OK)
        return level

    def _message(self) -> str:
        state, record = self._state(), self._record
        if record.error_code:
            return f'{state}; the last request failed: {record.error_msg}'
        return f'{state}; {record.not_recorded}' if record.not_recorded else state

    def _state(self) -> str:
        active = self._queue.active
        if active:
            return f'planning: {active.progress.phase}'
        return 'carrying out a plan' if self._controller and self._controller.busy else 'idle'

    def _values(self) -> dict[str, object]:
        active, record = self._queue.active, self._record
        return {
            'state': self._state(), 'requests waiting': self._queue.waiting,
            'requests solved': record.solved, 'requests failed': record.failed,
            'requests canceled': record.canceled, 'last error code': record.error_code,
            'iteration': active.progress.iteration if active else 0,
            'residual': active.progress.residual if active else 0.0,
            SUBSCRIBERS: self._trajectories.get_subscription_count(),
            'uptime [s]': round(time.monotonic() - record.started, 1),
            'memory [MB]': round(memory() / _MEGABYTE, 1)}


def memory() -> int:
    """Return the resident memory of this process [bytes]; 0 where there is no /proc."""
    try:
        pages = int(Path('/proc/self/statm').read_text().split()[1])
    except OSError:
        return 0
    return pages * os.sysconf('SC_PAGE_SIZE')
