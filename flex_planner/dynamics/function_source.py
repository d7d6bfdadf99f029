"""
C source of CasADi functions, derived in this process or in another one.

CasADi derives for a second or more inside calls that nothing can stop and in which no other thread
of Python runs; another process can be ended.

"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
import logging
from typing import Any, NamedTuple

from flex_planner.base.helper_process import HelperLostError, HelperPool, HelperProcess
from flex_planner.base.processes import helper_processes
from flex_planner.base.progress import Monitor

Builder = Callable[[], Mapping[str, tuple[Any, int]]]
"""Returns CasADi functions, and the number of batched inputs of each, by name."""

_POOL = HelperPool('flex_planner.dynamics.derivation_helper', kept=1)
# how often a monitor is asked [s]
_OFTEN = 0.01
_LOG = logging.getLogger(__name__)


@dataclass(frozen=True, slots=True)
class Signature:
    """Shapes of a function: entries of each input, (rows, columns) of each output."""

    batched: int
    inputs: tuple[int, ...]
    outputs: tuple[tuple[int, int], ...]

    @classmethod
    def of(cls, function: Any, batched: int) -> Signature:
        """Read the signature of a CasADi function."""
        inputs = tuple(int(function.numel_in(i)) for i in range(function.n_in()))
        outputs = tuple((int(function.size1_out(i)), int(function.size2_out(i)))
                        for i in range(function.n_out()))
        return cls(batched, inputs, outputs)


class FunctionSource(NamedTuple):
    """C source of functions with a loop over points around each, and their shapes."""

    text: str
    signatures: dict[str, Signature]


def write_source(built: Mapping[str, tuple[Any, int]]) -> FunctionSource:
    """Return the C source of CasADi functions."""
    import casadi as ca

    generator = ca.CodeGenerator('functions', {'with_header': False})
    for function, _ in built.values():
        generator.add(function)
    signatures = {name: Signature.of(f, batched) for name, (f, batched) in built.items()}
    loops = (_loop(name, function, signatures[name]) for name, (function, _) in built.items())
    return FunctionSource('\n'.join([str(generator.dump()), '#include <stdlib.h>', *loops]),
                          signatures)


def derive_beside(build: Builder, monitor: Monitor) -> FunctionSource | None:
    """
    Return the source of functions that another process derives; None where that fails.

    Parameters
    ----------
    build : callable
        Derives them; it is pickled.
    monitor : Monitor
        May stop it.

    Raises
    ------
    StoppedError
        If the monitor stopped it; the process is ended.

    """
    if not helper_processes():
        return None
    try:
        helper = _POOL.borrow(1, 1)[0]
    except OSError as error:
        _LOG.info('functions are derived in this process (%s)', error)
        return None
    try:
        answer = _ask(helper, build, monitor)
    except BaseException as error:
        helper.end()
        if not isinstance(error, HelperLostError):
            raise
        _LOG.info('functions are derived in this process: the other one %s', error)
        return None
    _POOL.give_back(helper)
    return answer


def _ask(helper: HelperProcess, build: Builder, monitor: Monitor) -> FunctionSource | None:
    """Return a helper's answer."""
    helper.send(build)
    while not HelperProcess.wait([helper], _OFTEN):
        monitor.check()
    answer: FunctionSource | None = helper.receive()
    return answer


def _loop(name: str, function: Any, signature: Signature) -> str:
    """Return C code that evaluates a function at n points; 1 means out of memory."""
    arguments = ''.join(
        f'    arg[{i}] = in[{i}]' + (f' + k*{size}' if i < signature.batched else '') + ';\n'
        for i, size in enumerate(signature.inputs))
    results = ''.join(f'    res[{i}] = out[{i}] + k*{rows * columns};\n'
                      for i, (rows, columns) in enumerate(signature.outputs))
    return f"""
int {name}_batch(long long n, int chain, const double *const *in, double *const *out) {{
  const double *arg[{function.sz_arg() + 1}];
  double *res[{function.sz_res() + 1}];
  long long iw[{function.sz_iw() + 1}];
  double *w = malloc(sizeof(double) * {function.sz_w() + 1});
  if (!w) return 1;
  for (long long k = 0; k < n; ++k) {{
{arguments}    if (chain && k) arg[0] = res[0];
{results}    {name}(arg, res, iw, w, 0);
  }}
  free(w);
  return 0;
}}
"""
