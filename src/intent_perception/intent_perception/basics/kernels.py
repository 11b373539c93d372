"""How numerical code is compiled: written once, so that all kernels follow the same rules.

Kernels hold no lock, divide as numpy does, and are stored on disk when they are first called. Their
calls are not checked for types: compiled code converts, and refuses what it cannot.

A kernel that calls another takes it in whole. Else there were two compiled copies of the called
one, its own and the caller's, optimised apart and with sums in different orders. Which of them a
call meets would depend on whether the caller was compiled in this process or came from disk, and
with it the last bits of every result.
"""

from collections.abc import Callable
from typing import Any

from numba import njit

_ALWAYS: dict[str, Any] = {
    "cache": True,
    "error_model": "numpy",
    "nogil": True,
    "forceinline": True,
}


def kernel(function: Callable[..., Any]) -> Any:
    """Compile a function whose sums may be taken in any order: it must see finite numbers only."""
    return njit(fastmath=True, **_ALWAYS)(function)


def borrowing_kernel(function: Callable[..., Any]) -> Any:
    """Compile a function as `kernel` does that makes no array and keeps none.

    Arrays in tuples and views of them then need no counting of references: two locked instructions
    for each array of a tuple that an inner loop hands on cost more than its arithmetic.
    """
    return njit(fastmath=True, _nrt=False, **_ALWAYS)(function)


def inlined_kernel(function: Callable[..., Any]) -> Any:
    """Compile a function as `kernel` does, into each place that calls it."""
    return njit(fastmath=True, inline="always", **_ALWAYS)(function)


def exact_kernel(function: Callable[..., Any]) -> Any:
    """Compile a function to the letter: NaN and infinity mean something, sums keep their order."""
    return njit(**_ALWAYS)(function)


def summing_kernel(function: Callable[..., Any]) -> Any:
    """Compile a function whose sums may be reordered; NaN and infinity keep their meaning."""
    return njit(fastmath={"reassoc", "contract", "arcp", "nsz"}, **_ALWAYS)(function)
