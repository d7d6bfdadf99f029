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
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any, Protocol

from flex_planner.base.compiled_library import build_library, find_library
from flex_planner.base.compiler import CompilerError
from flex_planner.base.library_cache import warn_once
from flex_planner.base.validation import Array
import numpy as np

# straight-line code gains nothing from more, and -O1 takes up to five times as long
_OPTIONS = ('-Og',)

Builder = Callable[[], Mapping[str, tuple[Any, int]]]

_POINTERS = ctypes.POINTER(ctypes.c_void_p)


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

    def prepare(self, inputs: Sequence[Array]) -> tuple[list[Array], list[Array]]:
        """Return contiguous inputs and empty outputs, after a check of the shapes."""
        arrays = [np.ascontiguousarray(values, dtype=float) for values in inputs]
        count = arrays[0].shape[0]
        shapes = [(count, size) for size in self.inputs[:self.batched]]
        shapes += [(size,) for size in self.inputs[self.batched:]]  # type: ignore[misc]
        given = [array.shape for array in arrays]
        if given != shapes:
            raise ValueError(f'inputs have shapes {given}, expected {shapes}')
        # a matrix comes transposed from CasADi's column order, so rows and columns swap
        outputs = [np.empty((count, rows) if columns == 1 else (count, columns, rows))
                   for rows, columns in self.outputs]
        return arrays, outputs


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
        arrays, outputs = self._signature.prepare(inputs)
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
        arrays, outputs = self._signature.prepare(inputs)
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


def load_functions(key: str, build: Builder) -> dict[str, BatchFunction]:
    """
    Return compiled functions: from the disk if they are there, else built and kept.

    Parameters
    ----------
    key : str
        From `content_key`; equal keys mean equal functions.
    build : callable
        Returns the CasADi functions and the number of batched inputs of each, by name.

    """
    functions = find_library(key, _load)
    if functions is not None:
        return functions
    built = build()
    signatures = {name: Signature.of(f, batched) for name, (f, batched) in built.items()}
    try:
        return build_library(key, _source(built), lambda library: _bind(library, signatures),
                             record={name: asdict(s) for name, s in signatures.items()},
                             options=_OPTIONS)
    except CompilerError as error:
        warn_once(f'{error}: functions are interpreted, which makes a plan 10 to 50 times slower')
    return {name: _InterpretedFunction(f, signatures[name]) for name, (f, _) in built.items()}


def _load(library: Path, functions: Mapping[str, Any]) -> dict[str, BatchFunction]:
    """Load a library with the functions that its entry names."""
    return _bind(library, {
        name: Signature(entry['batched'], tuple(entry['inputs']),
                        tuple((rows, columns) for rows, columns in entry['outputs']))
        for name, entry in functions.items()})


def _source(built: Mapping[str, tuple[Any, int]]) -> str:
    """Return the C source of all functions with a loop over points around each."""
    import casadi as ca

    generator = ca.CodeGenerator('functions', {'with_header': False})
    for function, _ in built.values():
        generator.add(function)
    loops = (_loop(name, function, batched) for name, (function, batched) in built.items())
    return '\n'.join([str(generator.dump()), '#include <stdlib.h>', *loops])


def _loop(name: str, function: Any, batched: int) -> str:
    """Return C code that evaluates a function at n points; 1 means out of memory."""
    signature = Signature.of(function, batched)
    arguments = ''.join(
        f'    arg[{i}] = in[{i}]' + (f' + k*{size}' if i < batched else '') + ';\n'
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


def _bind(library: Path, signatures: Mapping[str, Signature]) -> dict[str, BatchFunction]:
    """Load a library."""
    handle = ctypes.CDLL(str(library))
    return {name: _NativeFunction(handle, name, signature)
            for name, signature in signatures.items()}
