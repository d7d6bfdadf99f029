"""
CasADi functions compiled to machine code, kept on disk, called for many points at once.

A library is found again by a key that its builder computes without CasADi, so a warm start
neither imports CasADi nor runs a compiler; see `library_cache` for where it is kept. The calls go
through ctypes, which releases the interpreter lock. Without a C compiler CasADi's virtual machine
evaluates the same functions.

"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
import ctypes
from dataclasses import asdict
from pathlib import Path
from typing import Any, Protocol

from flex_planner.base.compiled_library import build_library, find_library
from flex_planner.base.compiler import CompilerError
from flex_planner.base.library_cache import warn_once
from flex_planner.base.progress import Monitor
from flex_planner.base.validation import Array
from flex_planner.dynamics.function_source import (
    Builder,
    derive_beside,
    Signature,
    write_source,
)
import numpy as np

# straight-line code gains nothing from more, and -O1 takes up to five times as long; nor does it
# gain from tables of the values that are in use together, which take GCC half its time
_OPTIONS = ('-Og', '--param', 'ira-max-conflict-table-size=0')

_POINTERS = ctypes.POINTER(ctypes.c_void_p)


class BatchFunction(Protocol):
    """
    A function of points: the first inputs are stacked point by point, the others shared.

    Inputs of shape ``(k, size)`` or ``(size,)`` give outputs of shape ``(k, rows)`` or
    ``(k, columns, rows)``: a matrix output arrives transposed.

    """

    def __call__(self, *inputs: Array) -> tuple[Array, ...]:
        """Evaluate all points."""

    def evaluate_chain(self, *inputs: Array) -> tuple[Array, ...]:
        """
        Evaluate points one after another, each from the first output of the one before.

        As ``__call__``, but only the first point of the first input is read.

        """

    def bind_arrays(self, inputs: Sequence[Array], outputs: Sequence[Array]) -> Callable[[], None]:
        """
        Return a call that reads and writes the same arrays every time.

        For loops over single points, where creating arrays would cost more than the function.
        The arrays must be contiguous and of the shapes of ``__call__``.

        """

    @property
    def address(self) -> int | None:
        """Return the address of its loop over points, None if it is interpreted."""


class _NativeFunction:
    """A function of a compiled library."""

    def __init__(self, library: ctypes.CDLL, name: str, signature: Signature) -> None:
        self._call = getattr(library, f'{name}_batch')
        self._call.argtypes = (ctypes.c_longlong, ctypes.c_int, _POINTERS, _POINTERS)
        self._call.restype = ctypes.c_int
        self._signature = signature

    def __call__(self, *inputs: Array) -> tuple[Array, ...]:
        return self._evaluate(inputs, chain=False)

    def evaluate_chain(self, *inputs: Array) -> tuple[Array, ...]:
        return self._evaluate(inputs, chain=True)

    def _evaluate(self, inputs: Sequence[Array], *, chain: bool) -> tuple[Array, ...]:
        arrays, outputs = _prepare(self._signature, inputs)
        if self._call(len(arrays[0]), chain, _pointers(arrays), _pointers(outputs)):
            raise MemoryError('no memory to evaluate a compiled function')
        return tuple(outputs)

    def bind_arrays(self, inputs: Sequence[Array], outputs: Sequence[Array]) -> Callable[[], None]:
        count = len(inputs[0])
        sources, targets, call = _pointers(inputs), _pointers(outputs), self._call
        kept = (inputs, outputs)  # the addresses are good only while the arrays live

        def run() -> None:
            if call(count, False, sources, targets) or not kept:
                raise MemoryError('no memory to evaluate a compiled function')

        return run

    @property
    def address(self) -> int | None:
        return ctypes.cast(self._call, ctypes.c_void_p).value


def _pointers(arrays: Sequence[Array]) -> ctypes.Array[ctypes.c_void_p]:
    """Return the addresses of arrays as a C array."""
    return (ctypes.c_void_p * len(arrays))(*(array.ctypes.data for array in arrays))


class _InterpretedFunction:
    """A function evaluated by CasADi's virtual machine."""

    def __init__(self, function: Any, signature: Signature) -> None:
        self._function = function
        self._signature = signature

    def __call__(self, *inputs: Array) -> tuple[Array, ...]:
        return self._evaluate(inputs, chain=False)

    def evaluate_chain(self, *inputs: Array) -> tuple[Array, ...]:
        return self._evaluate(inputs, chain=True)

    def _evaluate(self, inputs: Sequence[Array], *, chain: bool) -> tuple[Array, ...]:
        arrays, outputs = _prepare(self._signature, inputs)
        batched, arrays[0] = self._signature.batched, arrays[0].copy()
        for point in range(len(arrays[0])):
            if chain and point:
                arrays[0][point] = outputs[0][point - 1]
            row = [array[point] for array in arrays[:batched]] + arrays[batched:]
            results = self._function.call(row)
            for output, result in zip(outputs, results, strict=True):
                output[point] = np.asarray(result.T).reshape(output[point].shape)
        return tuple(outputs)

    def bind_arrays(self, inputs: Sequence[Array], outputs: Sequence[Array]) -> Callable[[], None]:
        def run() -> None:
            for target, result in zip(outputs, self(*inputs), strict=True):
                target[...] = result

        return run

    @property
    def address(self) -> int | None:
        return None


def load_functions(key: str, build: Builder,
                   monitor: Monitor | None = None) -> dict[str, BatchFunction]:
    """
    Return compiled functions: from the disk if they are there, else built and kept.

    Parameters
    ----------
    key : str
        From `content_key`; equal keys mean equal functions.
    build : callable
        Returns the CasADi functions and the number of batched inputs of each, by name.
    monitor : Monitor, optional
        May stop it: another process then derives the functions, and `build` is pickled.

    Raises
    ------
    StoppedError
        If the monitor stopped it.

    """
    functions = find_library(key, _load)
    if functions is not None:
        return functions
    source = None if monitor is None else derive_beside(build, monitor)
    built = None
    if source is None:
        built = build()
        source = write_source(built)
    signatures = source.signatures
    try:
        return build_library(key, source.text, lambda library: _bind(library, signatures),
                             record={name: asdict(s) for name, s in signatures.items()},
                             options=_OPTIONS, monitor=monitor)
    except CompilerError as error:
        warn_once(f'{error}: functions are interpreted, which makes a plan 10 to 50 times slower')
    return {name: _InterpretedFunction(f, signatures[name])
            for name, (f, _) in (built or build()).items()}


def _load(library: Path, functions: Mapping[str, Any]) -> dict[str, BatchFunction]:
    """Load a library with the functions that its entry names."""
    return _bind(library, {
        name: Signature(entry['batched'], tuple(entry['inputs']),
                        tuple((rows, columns) for rows, columns in entry['outputs']))
        for name, entry in functions.items()})


def _prepare(signature: Signature, inputs: Sequence[Array]) -> tuple[list[Array], list[Array]]:
    """Return contiguous inputs and empty outputs, after a check of the shapes."""
    arrays = [np.ascontiguousarray(values, dtype=float) for values in inputs]
    count = arrays[0].shape[0]
    shapes = [(count, size) for size in signature.inputs[:signature.batched]]
    shapes += [(size,) for size in signature.inputs[signature.batched:]]  # type: ignore[misc]
    given = [array.shape for array in arrays]
    if given != shapes:
        raise ValueError(f'inputs have shapes {given}, expected {shapes}')
    # a matrix comes transposed from CasADi's column order, so rows and columns swap
    outputs = [np.empty((count, rows) if columns == 1 else (count, columns, rows))
               for rows, columns in signature.outputs]
    return arrays, outputs


def _bind(library: Path, signatures: Mapping[str, Signature]) -> dict[str, BatchFunction]:
    """Load a library."""
    handle = ctypes.CDLL(str(library))
    return {name: _NativeFunction(handle, name, signature)
            for name, signature in signatures.items()}
