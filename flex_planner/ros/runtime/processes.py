"""Nodes in processes of their own, started and ended by whoever uses them."""

from __future__ import annotations

from collections.abc import Mapping
from contextlib import ExitStack
from pathlib import Path
import signal
import subprocess
import sys
from types import TracebackType

_PATIENCE = 5.0
_START = 'flex_planner.ros.runtime.start'


class NodeProcess:
    """
    A node running in its own process, for a with block.

    Parameters
    ----------
    module : str
        Module that runs the node, e.g. ``flex_planner.ros.planner.node``.
    parameters : mapping
        Node parameters; lists and texts in YAML notation are taken as they are.
    remappings : mapping of str to str
        Names to be replaced.
    log : Path, optional
        File for what the node says; default: the standard error of this process.
    parameter_file : Path, optional
        Parameters as ROS keeps them in YAML; those given one by one count more.

    """

    def __init__(self, module: str, parameters: Mapping[str, object] | None = None,
                 remappings: Mapping[str, str] | None = None, log: Path | None = None,
                 parameter_file: Path | None = None) -> None:
        pairs = [f'{name}:={_yaml(value)}' for name, value in (parameters or {}).items()]
        rules = [f'{name}:={target}' for name, target in (remappings or {}).items()]
        arguments = ['--params-file', str(parameter_file)] if parameter_file else []
        arguments += [word for pair in pairs for word in ('-p', pair)]
        arguments += [word for rule in rules for word in ('-r', rule)]
        with ExitStack() as stack:
            output = stack.enter_context(log.open('wb')) if log else None
            # a session of its own: Ctrl-C in the terminal reaches the node through stop() only
            self.process = subprocess.Popen(
                [sys.executable, '-m', _START, module, '--ros-args', *arguments],
                stdout=output, stderr=output, start_new_session=True)

    def stop(self, number: signal.Signals = signal.SIGINT) -> int:
        """End the process by a signal, by force after 5 s, and return its exit code."""
        if self.process.poll() is None:
            self.process.send_signal(number)
        try:
            return self.process.wait(_PATIENCE)
        except subprocess.TimeoutExpired:
            self.process.kill()
            return self.process.wait()

    def __enter__(self) -> NodeProcess:
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None,
                 trace: TracebackType | None) -> None:
        self.stop()


def _yaml(value: object) -> str:
    """Return a parameter value in the notation of --ros-args."""
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, (list, tuple)):
        return f'[{", ".join(_yaml(entry) for entry in value)}]'
    return str(value)
