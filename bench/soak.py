"""
What a planner answers, and what it costs and leaves, under mixed requests for some minutes.

Run by ``tools/run python -m bench soak``, or by ``-m bench.soak``, which writes no page but fails
if an answer is not the one that was due, the node grows, or something is left when it has ended.

"""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass
import math
import os
from pathlib import Path
import sys
import tempfile
import time
from typing import Any

from bench.leftovers import relatives, shared_memory
from bench.soak_client import SoakClient
from bench.stress import LONG
from flex_planner.ros.runtime.processes import NodeProcess
from flex_planner_interfaces.msg import PlanReport
from geometry_msgs.msg import Point
import numpy as np
import rclpy

SECONDS, TURNS, READS = 330.0, 32, 12
ENDING = 10.0  # [s]
NODE = 'flex_planner.ros.planner.node'
# [MB] over the second half, [ms]
GROWTH, LATENCY = 3.0, 50.0
BAD_VALUES: dict[str, tuple[dict[str, Any], int]] = {
    'too heavy': ({'payload_mass': 200.0}, PlanReport.INFEASIBLE),
    'not a number': ({'duration': math.nan}, PlanReport.NOT_FINITE),
    'out of range': ({'payload_mass': -1.0}, PlanReport.OUT_OF_RANGE),
    'wrong length': ({'effort_weights': [1.0] * 100_000}, PlanReport.INVALID_SIZE),
    'no time': ({'allowed_planning_time': 1e-3}, PlanReport.TIMEOUT)}
CODES = {value: name for name in dir(PlanReport)
         if name.isupper() and isinstance(value := getattr(PlanReport, name), int)}
PARAMETERS = [('tolerance', 1e-3, True), ('tolerance', math.nan, False),
              ('record', True, True), ('elbow', 0, False)]


@dataclass(frozen=True, slots=True, kw_only=True)
class Soak:
    """
    The figures of a soak.

    Attributes
    ----------
    seconds : float
        How long it was.
    answers : dict
        For each kind of request, how many were answered with which code.
    wrong : list of str
        Kinds with another code than the one that was due.
    memory, growth : float
        Resident memory of the node at the end, and how much of it is of the second half [MB].
    descriptors : int
        By how many open files it has grown in the second half.
    latency : float
        99th percentile of the time to read a parameter while a plan is made [ms].
    reads : int
        How often one was read.
    recordings : int
        How many requests it recorded.
    left : list of str
        Processes and files that are there when the node has ended.
    exit_code : int
        Of the node.

    """

    seconds: float
    answers: dict[str, dict[str, int]]
    wrong: list[str]
    memory: float
    growth: float
    descriptors: int
    latency: float
    reads: int
    recordings: int
    left: list[str]
    exit_code: int

    @property
    def good(self) -> bool:
        """Return whether all was as it has to be."""
        return (not self.wrong and not self.left and self.exit_code == 0
                and self.growth < GROWTH and self.descriptors <= 0 and self.latency < LATENCY)


class Turns:
    """Asks for everything once a turn, and keeps answers, sizes and times."""

    def __init__(self, client: SoakClient, pid: int) -> None:
        self._client, self._process = client, Path('/proc', str(pid))
        self.answers: Counter[tuple[str, str]] = Counter()
        self.wrong: list[str] = []
        self.latencies: list[float] = []
        self.sizes: list[tuple[float, int]] = []  # memory [MB], open files

    def turn(self, k: int) -> None:
        """Send all kinds of requests once."""
        client, payload = self._client, 0.5 + 1e-3 * k
        self._plan('plan', PlanReport.NONE, payload_mass=payload, publish=True)
        self._note('goal', client.plan_goal(payload_mass=payload).report(), PlanReport.NONE)
        for kind, (fields, code) in BAD_VALUES.items():
            self._plan(kind, code, **fields)
        self._note('goal out of reach', client.plan_goal(goal_point=Point(x=3.0)).report(),
                   PlanReport.UNREACHABLE)
        self._note('search', client.search(payload_mass=4.0, payload_accuracy=0.1),
                   PlanReport.NONE)
        self._cancel(payload)
        for name, value, accepted in PARAMETERS:
            self._tell('parameter', 'set' if client.set_parameter(name, value) else 'refused',
                       'set' if accepted else 'refused')

    def _plan(self, kind: str, code: int, **fields: Any) -> None:
        """Ask for a plan by the service."""
        self._note(kind, self._client.plan(**fields), code)

    def _cancel(self, payload: float) -> None:
        """Cancel a goal that waits, the one at work that it waits for, and a search."""
        client = self._client
        running = client.plan_goal(**LONG, payload_mass=payload)
        client.spin_until(running.works)
        waiting = client.plan_goal(payload_mass=payload)
        self.latencies += [client.latency() for _ in range(READS)]
        for kind, goal in (('canceled while it waits', waiting),
                           ('canceled at work', running),
                           ('search canceled', client.search_goal(**LONG))):
            goal.cancel()
            self._note(kind, goal.report(), PlanReport.CANCELED)

    def _note(self, kind: str, report: PlanReport, due: int) -> None:
        """Count an answer."""
        self._tell(kind, CODES[report.error_code], CODES[due])

    def _tell(self, kind: str, answer: str, due: str) -> None:
        """Count an answer in words, and see how large the node is."""
        self.answers[kind, answer] += 1
        if answer != due:
            self.wrong.append(f'{kind}: {answer}, not {due}')
        pages = int(Path(self._process, 'statm').read_text().split()[1])
        self.sizes.append((pages * os.sysconf('SC_PAGE_SIZE') / 2**20,
                           len(os.listdir(self._process / 'fd'))))


def measure(seconds: float = SECONDS, turns: int = TURNS) -> Soak:
    """Run a soak of so many turns, spread over so many seconds."""
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        (folder / 'tmp').mkdir()
        # its processes are known by it, and all that they forget is in it
        os.environ.update(TMPDIR=f'{folder}/tmp', ROS_LOG_DIR=f'{folder}/log')
        return _measure(folder, seconds, turns)


def _measure(folder: Path, seconds: float, turns: int) -> Soak:
    """Run a soak whose files are in a folder."""
    recordings, began = folder / 'recordings', time.monotonic()
    rclpy.init()
    with NodeProcess(NODE, {'arm': 'korayem_ei50', 'recording_folder': recordings},
                     log=folder / 'planner.log') as node:
        client = SoakClient()
        done = Turns(client, node.process.pid)
        for k in range(turns):
            done.turn(k)
            time.sleep(max(0.0, began + seconds * (k + 1) / turns - time.monotonic()))
        taken = time.monotonic() - began
        client.spin_until(client.plan_goal(**LONG).works)  # it has to leave at work, too
        files = shared_memory(relatives(f'TMPDIR={folder}/tmp'))
        code = node.stop()
        client.close()
    rclpy.try_shutdown()
    left = _processes_left(f'TMPDIR={folder}/tmp')
    files += [*folder.glob('tmp/*'), *recordings.glob('.*')]
    return _figures(done, seconds=taken, exit_code=code,
                    recordings=len(list(recordings.glob('*/*.mcap'))),
                    left=left + [str(file) for file in files if file.exists()])


def _processes_left(variable: str) -> list[str]:
    """Return the processes that do not end by themselves, soon after their node."""
    end = time.monotonic() + ENDING
    while (processes := relatives(variable)) and time.monotonic() < end:
        time.sleep(0.1)
    return [f'process {process.name}' for process in processes]


def _figures(done: Turns, **others: Any) -> Soak:
    """Return what turns have shown."""
    answers: dict[str, dict[str, int]] = {}
    for (kind, answer), count in done.answers.items():
        answers.setdefault(kind, {})[answer] = count
    middle, some = len(done.sizes) // 2, len(done.sizes) // 20
    half = np.median(done.sizes[middle - some:middle + some + 1], axis=0)
    end = np.median(done.sizes[-2 * some - 1:], axis=0)
    return Soak(answers=answers, wrong=done.wrong, memory=float(end[0]),
                growth=float(end[0] - half[0]), descriptors=int(end[1] - half[1]),
                latency=float(np.percentile(done.latencies, 99)), reads=len(done.latencies),
                **others)


def table(soak: Soak) -> str:
    """Return the answers as Markdown."""
    rows = [f'| {kind} | {sum(codes.values())} | '
            f'{", ".join(f"{code} {count}" for code, count in codes.items())} |'
            for kind, codes in soak.answers.items()]
    return '\n'.join(['| request | number | answers |', '|---|---|---|', *rows])


def summary(soak: Soak) -> str:
    """Return the other figures in words."""
    count = sum(sum(codes.values()) for codes in soak.answers.values())
    return (f'{count} requests in {soak.seconds:.0f} s, {soak.recordings} recordings. '
            f'Answers that were not due: {", ".join(soak.wrong) or "none"}. In the second half '
            f'the node grew by {soak.growth:.1f} MB to {soak.memory:.0f} MB, and by '
            f'{soak.descriptors} open files. A parameter was read within {soak.latency:.1f} ms '
            f'in 99 % of {soak.reads} times while a plan was made. Told to end at work, the node '
            f'ended with code {soak.exit_code}; left of it: {", ".join(soak.left) or "nothing"}.')


def main() -> int:
    """Run a soak, show it, and return the exit code."""
    soak = measure()
    print(table(soak), summary(soak), sep='\n\n')
    return 0 if soak.good else 1


if __name__ == '__main__':
    sys.exit(main())
