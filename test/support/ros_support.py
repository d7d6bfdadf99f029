"""
ROS 2 for the tests: a domain of their own, nodes in processes, and no wait without a limit.

Importing this module sets the environment of the tests and of every node that they start.

"""

from __future__ import annotations

from collections.abc import Callable, Mapping
import importlib
import itertools
import os
from pathlib import Path
import signal
import socket
import time
from types import TracebackType
from typing import Any, TypeVar
import warnings

from bench.leftovers import shared_memory
from flex_planner.ros.runtime.processes import NodeProcess
from flex_planner_interfaces import action
from flex_planner_interfaces.msg import MotionTask, PlanReport
from flex_planner_interfaces.srv import FindMaxPayload, PlanPath
from geometry_msgs.msg import Point
from rcl_interfaces.msg import SetParametersResult
from rcl_interfaces.srv import GetParameters, SetParameters
import rclpy
from rclpy.action import ActionClient
from rclpy.action.client import ClientGoalHandle
from rclpy.context import Context
from rclpy.executors import SingleThreadedExecutor
from rclpy.parameter import Parameter, parameter_value_to_python
from rclpy.qos import DurabilityPolicy, QoSProfile
from rclpy.task import Future
from rclpy.time import Time

LATCHED = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)
MANY = QoSProfile(depth=1000)  # requests on their way; beyond 10, others would be lost
STARTING = 60.0  # [s], a node on a machine that is busy
PATIENCE = 60.0  # [s], for anything else that comes by itself
LEAVING = 20.0  # [s], less than the plan takes that a node is at work on meanwhile
SUPPORT = Path(__file__).parent
PARAMETER_FILE = Path(__file__).parents[2] / 'config' / 'planner.yaml'
# keeps the solver of the flexible arm at work until a limit: its links ring at the start, and
# nothing damps the hundreds of swings that the motion has to follow
LONG: dict[str, Any] = {
    'space': MotionTask.JOINT, 'start_positions': [1.0, -2.0], 'goal_positions': [1.5, -1.5],
    'start_modal_displacements': [0.02, 0.0, 0.02, 0.0], 'duration': 100.0}
SomeClient = TypeVar('SomeClient', bound='Client')
_NUMBERS = itertools.count(1)
_CLAIMS: list[socket.socket] = []  # held until this process ends
_RUNNING: set[str] = set()  # full names of the planners that this process has started


def free_domain() -> int:
    """Return a domain that no other node on this machine is in, as far as one can see."""
    for number in range(os.getpid(), os.getpid() + 101):
        domain = 1 + number % 101
        claim = socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM)
        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
            try:
                # other tests that begin now have no node yet; a name of Linux, and no file
                claim.bind(f'\0flex_planner test domain {domain}')
                probe.bind(('', 7410 + 250 * domain))  # of its first node, by the DDSI standard
            except OSError:
                claim.close()
                continue
        _CLAIMS.append(claim)
        return domain
    raise RuntimeError('every ROS domain from 1 to 101 is in use')


with warnings.catch_warnings():
    # rclpy imports this with the first node, and it imports lark, which uses a deprecated module
    warnings.simplefilter('ignore', DeprecationWarning)
    importlib.import_module('rosidl_generator_py')
DOMAIN = free_domain()
os.environ.update(
    ROS_DOMAIN_ID=str(DOMAIN), ROS_AUTOMATIC_DISCOVERY_RANGE='LOCALHOST',
    ROS_PYTHON_CHECK_FIELDS='1')


class Goal:
    """
    An accepted goal of an action.

    Attributes
    ----------
    feedback : list
        What has come so far, each with the time it came [s].
    answer : Future
        Of the result.

    """

    def __init__(self, client: Client, handle: ClientGoalHandle,
                 feedback: list[tuple[float, Any]]) -> None:
        self._client, self._handle, self.feedback = client, handle, feedback
        self.answer = handle.get_result_async()

    def end(self, limit: float = PATIENCE) -> tuple[int, Any]:
        """Return the end state, of GoalStatus, and the result."""
        self._client.wait('result', self.answer.done, limit)
        return self.answer.result().status, self.answer.result().result

    def cancel(self) -> bool:
        """Cancel the goal and return whether the server accepts that."""
        answer = self._handle.cancel_goal_async()
        self._client.wait('answer to the cancellation', answer.done)
        return bool(answer.result().goals_canceling)


class Client:
    """A ROS node in this process that calls, listens and waits; for a with block."""

    def __init__(self) -> None:
        self._context = Context()
        rclpy.init(context=self._context, domain_id=DOMAIN)
        self.node = rclpy.create_node(f'test_client_{next(_NUMBERS)}', context=self._context)
        self._executor = SingleThreadedExecutor(context=self._context)
        self._executor.add_node(self.node)
        self._services: dict[str, Any] = {}
        self._actions: dict[str, ActionClient] = {}

    def wait(self, what: str, done: Callable[[], bool], limit: float = PATIENCE) -> None:
        """Spin until something is the case; fail after a time [s]."""
        end = time.monotonic() + limit
        while not done():
            assert time.monotonic() < end, (
                f'waited for {what}: not within {limit:g} s{self.last_words()}')
            self._executor.spin_once(timeout_sec=0.02)

    def next_of(self, messages: list[Any]) -> Any:
        """Return what a topic says of a moment from now on; older words may be on their way."""
        now = self.node.get_clock().now()
        self.wait('what is said from now on', lambda: bool(
            messages and Time.from_msg(messages[-1].header.stamp) >= now))
        return messages[-1]

    def last_words(self) -> str:
        """Return what helps to understand why something did not come in time."""
        return ''

    def spin(self, seconds: float) -> None:
        """Receive what comes for a while [s]."""
        end = time.monotonic() + seconds
        while time.monotonic() < end:
            self._executor.spin_once(timeout_sec=0.02)

    def send(self, kind: Any, name: str, request: Any) -> Future:
        """Call a service without waiting for its answer."""
        if name not in self._services:
            self._services[name] = self.node.create_client(kind, name, qos_profile=MANY)
            self.wait(f'service {name}', self._services[name].service_is_ready, STARTING)
        return self._services[name].call_async(request)

    def call(self, kind: Any, name: str, request: Any, limit: float = PATIENCE) -> Any:
        """Call a service and return its answer."""
        future = self.send(kind, name, request)
        self.wait(f'answer of {name}', future.done, limit)
        return future.result()

    def send_goal(self, kind: Any, name: str, goal: Any) -> Goal:
        """Send a goal to an action and return once it is accepted."""
        if name not in self._actions:
            self._actions[name] = ActionClient(
                self.node, kind, name, goal_service_qos_profile=MANY,
                result_service_qos_profile=MANY)
            self.wait(f'action {name}', self._actions[name].server_is_ready, STARTING)
        feedback: list[tuple[float, Any]] = []
        answer = self._actions[name].send_goal_async(
            goal, lambda message: feedback.append((time.monotonic(), message.feedback)))
        self.wait(f'goal of {name}', answer.done)
        assert answer.result().accepted
        return Goal(self, answer.result(), feedback)

    def listen(self, kind: Any, topic: str, qos: QoSProfile | int = LATCHED) -> list[Any]:
        """Return a list that the messages of a topic will be added to."""
        messages: list[Any] = []
        self.node.create_subscription(kind, topic, messages.append, qos)
        return messages

    def latched(self, kind: Any, topic: str) -> Any:
        """Return what a subscriber gets that comes late."""
        messages: list[Any] = []
        subscription = self.node.create_subscription(kind, topic, messages.append, LATCHED)
        self.wait(f'latched message of {topic}', lambda: bool(messages))
        self.node.destroy_subscription(subscription)
        return messages[0]

    def __enter__(self: SomeClient) -> SomeClient:
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None,
                 trace: TracebackType | None) -> None:
        self._executor.shutdown()
        self.node.destroy_node()
        rclpy.shutdown(context=self._context)


class Planner(Client):
    """
    A planner node in a process of its own, and a client of it.

    Attributes
    ----------
    name : str
        Full name of the node.
    recordings : Path
        Where it records.

    """

    module = 'flex_planner.ros.planner.node'

    def __init__(self, folder: Path, arm: str, name: str = 'flex_planner', *,
                 space: str = '', parameter_file: Path | None = None,
                 remappings: Mapping[str, str] | None = None, **parameters: object) -> None:
        super().__init__()
        self.name, self._log = f'{space}/{name}', folder / f'{name}.log'
        assert self.name not in _RUNNING, f'either of two planners {self.name} may answer'
        _RUNNING.add(self.name)
        self._log.parent.mkdir(parents=True, exist_ok=True)
        self.recordings = folder / 'recordings'
        given = {'arm': arm, 'recording_folder': self.recordings, **parameters}
        self.process = NodeProcess(self.module, given,
                                   {'__node': name, '__ns': space or '/', **(remappings or {})},
                                   self._log, parameter_file)

    def log(self) -> str:
        """Return what the node has said."""
        return self._log.read_text()

    def last_words(self) -> str:
        """Return whether the node runs, and the end of what it has said."""
        code = self.process.process.poll()
        state = 'runs' if code is None else f'has ended with {code}'
        return f'; {self.name} {state}, and said last:\n{self.log()[-2000:]}'

    def send_plan(self, **fields: Any) -> Future:
        """Ask for the motion of the paper with some fields changed; do not wait."""
        return self.send(PlanPath, f'{self.name}/plan_path', PlanPath.Request(task=task(**fields)))

    def plan(self, **fields: Any) -> PlanPath.Response:
        """Ask for the motion of the paper with some fields changed."""
        future = self.send_plan(**fields)
        self.wait('plan', future.done)
        return future.result()

    def report(self, **fields: Any) -> PlanReport:
        """Ask for the motion of the paper with some fields changed; return the report."""
        return self.plan(**fields).report

    def send_search(self, **fields: Any) -> Future:
        """Ask for the maximum payload of the motion of the paper; do not wait."""
        return self.send(FindMaxPayload, f'{self.name}/find_max_payload',
                         search_request(**fields))

    def search(self, **fields: Any) -> FindMaxPayload.Response:
        """Ask for the maximum payload of the motion of the paper, some fields changed."""
        future = self.send_search(**fields)
        self.wait('search', future.done)
        return future.result()

    def plan_goal(self, **fields: Any) -> Goal:
        """Send the motion of the paper with some fields changed to the action."""
        goal = action.PlanPath.Goal(task=task(**fields))
        return self.send_goal(action.PlanPath, f'{self.name}/plan_path', goal)

    def search_goal(self, **fields: Any) -> Goal:
        """Send the search for the maximum payload of that motion to the action."""
        request = search_request(**fields)
        goal = action.FindMaxPayload.Goal(**{
            name: getattr(request, name) for name in request.get_fields_and_field_types()})
        return self.send_goal(action.FindMaxPayload, f'{self.name}/find_max_payload', goal)

    def set_parameter(self, name: str, value: object) -> SetParametersResult:
        """Set a parameter as ``ros2 param set`` does."""
        change = Parameter(name, value=value).to_parameter_msg()
        request = SetParameters.Request(parameters=[change])
        return self.call(SetParameters, f'{self.name}/set_parameters', request).results[0]

    def parameter(self, name: str) -> Any:
        """Return the value of a parameter."""
        request = GetParameters.Request(names=[name])
        answer = self.call(GetParameters, f'{self.name}/get_parameters', request)
        return parameter_value_to_python(answer.values[0])

    def shared_memory(self) -> list[Path]:
        """Return the segments of shared memory that its middleware has made."""
        return shared_memory([Path('/proc', str(self.process.process.pid))])

    def stop(self, number: signal.Signals = signal.SIGINT) -> int:
        """End the node by a signal and return its exit code; fail if it stays."""
        process = self.process.process
        process.send_signal(number)
        self.wait(f'the end of {self.name} by {number.name}',
                  lambda: process.poll() is not None, LEAVING)
        return process.wait()

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None,
                 trace: TracebackType | None) -> None:
        self.process.stop()
        _RUNNING.remove(self.name)
        super().__exit__(kind, error, trace)


def task(**fields: Any) -> MotionTask:
    """Return the motion of the paper, section 5.2, with some fields changed."""
    paper = {'space': MotionTask.CARTESIAN, 'start_point': Point(x=0.5, y=0.0),
             'goal_point': Point(x=0.5, y=0.5), 'elbow': -1, 'duration': 1.0,
             'payload_mass': 1.0, 'effort_weights': [1 / 8, 1 / 8]}
    return MotionTask(**{**paper, **fields})


def search_request(**fields: Any) -> FindMaxPayload.Request:
    """Return a request for the maximum payload, from 0 kg, some fields or the task's changed."""
    own = FindMaxPayload.Request.get_fields_and_field_types().keys() - {'task'}
    options = {name: fields.pop(name) for name in own & fields.keys()}
    return FindMaxPayload.Request(task=task(**{'payload_mass': 0.0, **fields}), **options)
