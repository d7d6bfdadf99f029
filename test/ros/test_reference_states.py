"""Reference states along a published plan: their values, and when they come."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
import io
import os
from pathlib import Path
import pickle
import signal
import subprocess
import sys
import time
from typing import NamedTuple

from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus
from factories import PlanFactory
from flex_planner.planning.sampling import sample_plan, SampledPlan, SamplingSettings
from flex_planner.ros.planner.running_plan import Track
from flex_planner.ros.planner.streamer import Streamer
from flex_planner.ros.reference_states import ReferenceStates, Stream, StreamedPlan
from flex_planner.ros.settings.planner import PlannerSettings
import numpy as np
import pytest
from rclpy.clock import ROSClock
from ros_support import LONG, PATIENCE, Planner
from sensor_msgs.msg import JointState

NAMES = ['joint1', 'joint2', 'link1_mode1', 'link1_mode2', 'link2_mode1', 'link2_mode2']


class Heard(NamedTuple):
    """A state, and when it was published [ns since 1970]."""

    published: int
    message: JointState

    @property
    def stamp(self) -> int:
        return int(self.message.header.stamp.sec * 10**9 + self.message.header.stamp.nanosec)


def check_that_the_stream_ends(planner: Planner, number: signal.Signals, code: int) -> None:
    """Require that a planner ended by a signal takes the process with it, while it streams."""
    assert planner.report(publish=True, duration=6.0).error_code == 0
    (streamer,) = children(planner.process.process.pid)
    assert planner.stop(number) == code
    planner.wait('the end of the process that streams', lambda: gone(streamer))


@pytest.fixture(scope='module')
def planner(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Planner]:
    folder = tmp_path_factory.mktemp('stream')
    with Planner(folder, 'korayem_ei50', record=False) as planner:
        yield planner
        assert planner.process.process.poll() is None
        check_that_the_stream_ends(planner, signal.SIGINT, 0)
        assert 'Traceback' not in planner.log()


@pytest.fixture(scope='module')
def heard(planner: Planner) -> list[Heard]:
    states: list[Heard] = []

    def note(message: JointState, info: dict[str, int]) -> None:
        states.append(Heard(info['source_timestamp'], message))

    planner.node.create_subscription(JointState, f'{planner.name}/reference_states', note, 1000)
    planner.wait('publisher', lambda: planner.node.count_publishers(
        f'{planner.name}/reference_states') == 1)
    for _ in range(5):  # that the publisher knows of this subscriber shows in what comes
        planner.report(publish=True)
        planner.spin(1.3)
        if states:
            break
    return states


def streamed(reference: SampledPlan, rate: float) -> StreamedPlan:
    samples = reference.samples
    return StreamedPlan(
        names=NAMES, rate=rate, stamp_ns=10**18, began_ns=0, times_ns=reference.times_ns,
        coordinates=samples.coordinates, rates=samples.rates,
        accelerations=samples.accelerations, torques=samples.torques)


def wait_for(heard: list[JointState], count: int) -> None:
    end = time.monotonic() + PATIENCE
    while len(heard) < count:
        assert time.monotonic() < end, f'waited for {count} states, and {len(heard)} came'
        time.sleep(0.001)


def children(pid: int) -> list[int]:
    return [int(word) for word in Path(f'/proc/{pid}/task/{pid}/children').read_text().split()]


def stream_status(statuses: list[DiagnosticArray]) -> tuple[bytes, str]:
    """Return level and message of what the node said last of its stream."""
    _, stream = statuses[-1].status
    return stream.level, stream.message


class BrokenPipe(io.BytesIO):
    """The input of a process that is gone."""

    def flush(self) -> None:
        raise BrokenPipeError('Broken pipe')


class FakeProcess:
    """A process with an input and an exit code, None while it runs."""

    def __init__(self, stdin: io.BytesIO, code: int | None = None) -> None:
        self.stdin, self.stdout, self._code = stdin, io.BytesIO(), code

    def poll(self) -> int | None:
        return self._code


class FakeNode:
    """What the streamer needs of a node, and what it logged."""

    def __init__(self) -> None:
        self.said: list[str] = []
        self.warning = self.error = self.said.append

    def get_name(self) -> str:
        return 'fake'

    def get_namespace(self) -> str:
        return '/'

    def resolve_topic_name(self, name: str) -> str:
        return name

    def get_logger(self) -> FakeNode:
        return self

    def get_clock(self) -> ROSClock:
        return ROSClock()


def gone(pid: int) -> bool:
    try:
        state = Path(f'/proc/{pid}/stat').read_text().rpartition(')')[2].split()[0]
    except FileNotFoundError:
        return True
    return state == 'Z'


@pytest.mark.parametrize('rate', [30.0, 250.0])
def test_states_between_the_samples_are_those_of_the_plan(plan_of: PlanFactory,
                                                          rate: float) -> None:
    plan = plan_of('ei50')
    states = ReferenceStates(streamed(sample_plan(plan, SamplingSettings()), rate))
    messages = list(states.messages())
    exact = plan.sample(states.times_ns[:-1] * 1e-9)
    assert len(messages) == rate + 1
    for k, message in enumerate(messages[:-1]):
        assert message.position == pytest.approx(exact.coordinates[k], abs=1e-5)
        assert message.velocity == pytest.approx(exact.rates[k], abs=1e-2)
        assert message.effort[:2] == pytest.approx(exact.torques[k], abs=0.03)
        assert list(message.effort[2:]) == [0.0] * 4


def test_last_state_is_the_last_sample(plan_of: PlanFactory) -> None:
    reference = sample_plan(plan_of('ei50'), SamplingSettings())
    for rate in (1.0, 7.0, 100.0, 1000.0):
        states = ReferenceStates(streamed(reference, rate))
        *_, last = states.messages()
        assert list(last.position) == reference.samples.coordinates[-1].tolist()
        assert list(last.effort) == [*reference.samples.torques[-1], 0, 0, 0, 0]
        assert last.header.stamp.nanosec == reference.times_ns[-1] % 10**9
        periods = np.diff(states.times_ns) * rate * 1e-9
        assert periods[:-1] == pytest.approx(1, abs=1e-5)
        assert 0.5 - 1e-5 < periods[-1] < 1.5 + 1e-5


def test_published_plan_is_streamed_to_its_end(planner: Planner, heard: list[Heard]) -> None:
    heard.clear()
    answer = planner.plan(publish=True)
    points = answer.trajectory.joint_trajectory.points
    planner.wait('all states', lambda: len(heard) == 101)
    planner.spin(0.1)
    assert len(heard) == 101
    first, last = heard[0], heard[-1]
    assert list(first.message.name) == NAMES
    assert first.message.position[:2] == points[0].positions
    assert last.message.position[:2] == points[-1].positions
    assert last.message.effort[:2] == points[-1].effort
    assert last.stamp - first.stamp == 10**9 + 10**6
    assert np.diff([state.stamp for state in heard[:-1]]) == pytest.approx(10**7)


def test_plan_that_is_not_published_is_not_streamed(planner: Planner, heard: list[Heard]) -> None:
    heard.clear()
    planner.report()
    planner.report(publish=True, duration=-1.0)
    planner.spin(0.1)
    assert heard == []


def test_rate_is_that_of_the_parameter(planner: Planner, heard: list[Heard]) -> None:
    assert planner.set_parameter('reference_rate', 20.0).successful
    heard.clear()
    planner.report(publish=True)
    planner.wait('all states', lambda: len(heard) == 21)
    assert planner.set_parameter('reference_rate', 100.0).successful
    assert np.diff([state.stamp for state in heard[:-1]]) == pytest.approx(5e7)


def test_new_plan_takes_the_place_of_the_one_before(planner: Planner, heard: list[Heard]) -> None:
    heard.clear()
    planner.report(publish=True, duration=5.0)
    planner.wait('states', lambda: len(heard) > 20)
    end = planner.plan(publish=True, payload_mass=1.3).trajectory.joint_trajectory.points[-1]
    planner.wait('the end of the new plan', lambda: (
        heard[-1].message.position[:2], heard[-1].message.effort[:2]) == (
            end.positions, end.effort))
    planner.spin(0.1)
    stamps = [state.stamp for state in heard]
    (change,) = np.flatnonzero(np.abs(np.diff(stamps[:-1]) - 10**7) > 1e4)
    assert stamps == sorted(stamps)
    assert change < 499
    # all of the new plan, but for states that were due before the last one of the plan before: it
    # begins when it is published, and is streamed by a process that hears of it a moment later
    count = len(stamps) - (change + 1)
    assert count <= 101
    assert 0 < stamps[change + 1] - stamps[change] <= 10**7 + 1e4  # and no other
    assert stamps[-1] - stamps[change + 1] == (count - 1) * 10**7 + 10**6  # without a hole


# Leaves as the streaming process does, but rclpy spins and holds the interpreter's lock.
SPINNING = """
import ctypes
from flex_planner.ros import reference_states

reference_states.rclpy.try_shutdown = lambda: ctypes.PyDLL(None).sleep(600)
reference_states.main()
"""


def test_process_that_spins_while_it_leaves_is_ended_by_force() -> None:
    hung = subprocess.run([sys.executable, '-c', SPINNING, 'hung_states', '/', '/hung'],
                          stdin=subprocess.DEVNULL, capture_output=True, check=False, text=True,
                          timeout=60)
    assert (hung.returncode, hung.stderr) == (1, '')


def test_states_that_were_due_before_a_plan_came_are_left_out(plan_of: PlanFactory) -> None:
    plan = streamed(sample_plan(plan_of('ei50'), SamplingSettings()), 100.0)
    heard: list[JointState] = []
    stream, began = Stream(heard.append), time.monotonic_ns()
    stream.start(replace(plan, began_ns=began))
    wait_for(heard, 10)
    late = 52_000_000  # the new plan began between the sixth and the seventh state
    stream.start(replace(plan, began_ns=began + late, stamp_ns=plan.stamp_ns + late))
    wait_for(heard, 20)
    stream.close(1.0)
    stamps = [state.header.stamp.sec * 10**9 + state.header.stamp.nanosec for state in heard]
    steps = np.diff(stamps)
    assert (steps > 0).all()
    assert sorted(set(steps)) == [2_000_000, 10_000_000]


def stamps_of(heard: list[JointState]) -> list[int]:
    return [state.header.stamp.sec * 10**9 + state.header.stamp.nanosec for state in heard]


def test_states_follow_a_clock_that_starts_late_stands_still_and_jumps(
        plan_of: PlanFactory) -> None:
    plan = replace(streamed(sample_plan(plan_of('ei50'), SamplingSettings()), 10.0),
                   by_clock=True, stamp_ns=0)
    heard: list[JointState] = []
    stream, tenth = Stream(heard.append), 10**8
    stream.start(plan)
    time.sleep(0.1)
    assert not heard  # the clock has not come
    start = 10**15
    for count in range(5):
        stream.tick(start + count * tenth)
        wait_for(heard, count + 1)
    time.sleep(0.2)
    assert stamps_of(heard) == [start + count * tenth for count in range(5)]
    back = 5 * 10**9
    for count in range(8):  # it begins anew: the motion goes on from where it is
        stream.tick(back + count * tenth)
        wait_for(heard, (5, 6, 7, 8, 9, 10, 10, 11)[count])
    stream.close(1.0)
    assert stamps_of(heard)[5:] == pytest.approx([back + count * tenth for count in range(1, 7)],
                                                 abs=10**6)
    expected = [state.position for state in ReferenceStates(plan).messages()]
    np.testing.assert_array_equal([state.position for state in heard], expected)


def test_states_of_a_held_arm_begin_with_the_hold(plan_of: PlanFactory) -> None:
    plan = plan_of('ei50')
    waited = sample_plan(plan, SamplingSettings(start_hold=0.5))
    states = list(ReferenceStates(streamed(waited, 10.0)).messages())
    bare = list(ReferenceStates(streamed(sample_plan(plan, SamplingSettings()), 10.0)).messages())
    assert len(states) == len(bare) + 5
    for state in states[:5]:
        assert state.position == pytest.approx(bare[0].position, abs=1e-12)
        assert not any(state.velocity) and not any(state.effort)
    for state, other in zip(states[6:-1], bare[1:-1], strict=True):
        assert state.position == pytest.approx(other.position, abs=1e-6)


def test_all_states_come_while_the_solver_is_at_work(planner: Planner,
                                                     heard: list[Heard]) -> None:
    heard.clear()
    planner.report(publish=True, duration=2.0)
    goal = planner.plan_goal(**LONG)
    planner.wait('all states', lambda: len(heard) == 201)
    assert not goal.answer.done()
    assert goal.cancel()
    assert np.diff([state.stamp for state in heard[:-1]]) == pytest.approx(10**7)
    assert all(state.published >= state.stamp for state in heard)  # none before it is due


def test_process_that_died_is_an_error_until_a_plan_starts_it_again(
        planner: Planner, heard: list[Heard]) -> None:
    statuses: list[DiagnosticArray] = planner.listen(DiagnosticArray, '/diagnostics', 10)
    (streamer,) = children(planner.process.process.pid)
    os.kill(streamer, signal.SIGKILL)
    planner.wait('error', lambda: bool(statuses) and stream_status(statuses) == (
        DiagnosticStatus.ERROR, 'the process that streams ~/reference_states was ended by '
        'SIGKILL; it is started again with the next plan that is published'))
    assert statuses[-1].status[0].level == DiagnosticStatus.OK  # plans are made all the same
    heard.clear()
    assert planner.report(publish=True, duration=6.0).error_code == 0
    planner.wait('states', lambda: bool(heard))
    planner.wait('recovery', lambda: stream_status(statuses) == (DiagnosticStatus.OK, 'ready'))


AGAIN = 'the process that streams ~/reference_states has ended: starting it again'


def streamer_of(monkeypatch: pytest.MonkeyPatch, node: FakeNode,
                *processes: FakeProcess) -> Streamer:
    """Return a streamer that starts these processes one after another."""
    left = iter(processes)
    monkeypatch.setattr('subprocess.Popen', lambda *_, **__: next(left))
    return Streamer(node)  # type: ignore[arg-type]


def track_of(reference: SampledPlan) -> Track:
    """Return what is published of a plan."""
    return Track.of(reference, 0)


@pytest.mark.parametrize('dead', [FakeProcess(BrokenPipe()), FakeProcess(io.BytesIO(), 1)])
def test_plan_is_not_lost_where_the_process_is_gone_or_dies_just_then(
        monkeypatch: pytest.MonkeyPatch, plan_of: PlanFactory, dead: FakeProcess) -> None:
    sent, node, plan = io.BytesIO(), FakeNode(), plan_of('ei50')
    reference = sample_plan(plan, SamplingSettings())
    streamer = streamer_of(monkeypatch, node, dead, FakeProcess(sent))
    streamer.start(plan, track_of(reference), PlannerSettings.for_arm(plan.arm))
    assert pickle.loads(sent.getvalue()).times_ns.tolist() == reference.times_ns.tolist()
    assert node.said == [AGAIN]


def test_process_that_dies_again_does_not_spoil_the_plan(monkeypatch: pytest.MonkeyPatch,
                                                         plan_of: PlanFactory) -> None:
    node, plan = FakeNode(), plan_of('ei50')
    dead = [FakeProcess(BrokenPipe()) for _ in range(2)]
    streamer = streamer_of(monkeypatch, node, *dead)
    streamer.start(plan, track_of(sample_plan(plan, SamplingSettings())),
                   PlannerSettings.for_arm(plan.arm))
    assert node.said == [AGAIN, 'the plan is not streamed: Broken pipe']


@pytest.mark.parametrize(('code', 'end'), [
    (None, None), (1, 'has ended with code 1'), (-15, 'was ended by SIGTERM'),
    (-99, 'was ended by signal 99')])
def test_failure_tells_how_the_process_ended(monkeypatch: pytest.MonkeyPatch, code: int | None,
                                             end: str | None) -> None:
    streamer = streamer_of(monkeypatch, FakeNode(), FakeProcess(io.BytesIO(), code))
    assert streamer.failure == ('' if end is None else (
        f'the process that streams ~/reference_states {end}; it is started again with the next '
        'plan that is published'))


def test_process_that_streams_ends_with_a_planner_that_is_killed(tmp_path: Path) -> None:
    with Planner(tmp_path, 'korayem_rigid', 'mortal', record=False) as planner:
        check_that_the_stream_ends(planner, signal.SIGKILL, -9)


def test_plan_that_replaces_another_is_not_stamped_before_it(plan_of: PlanFactory) -> None:
    reference = sample_plan(plan_of('ei50'), SamplingSettings())
    heard: list[JointState] = []
    stream, began = Stream(heard.append), time.monotonic_ns()
    first = replace(streamed(reference, 200.0), began_ns=began)
    stream.start(first)
    wait_for(heard, 20)
    # its clock was read a moment later than that of the first one
    stream.start(replace(first, stamp_ns=first.stamp_ns - 5_500_000))
    wait_for(heard, 40)
    stream.close(PATIENCE)
    assert (np.diff(stamps_of(heard)) > 0).all()
