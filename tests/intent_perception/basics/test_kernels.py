"""Compiled code takes called kernels in whole, so that there is one copy that a call can meet."""

import re
from typing import Any

import numpy as np
import pytest

from intent_perception.basics.kernels import exact_kernel, inlined_kernel, kernel, summing_kernel


def total(values: Any, power: Any) -> Any:
    """A sum too long to be taken in unasked, thrice over."""
    sums = np.zeros(4, np.float32)
    for k in range(len(values)):
        x = values[k]
        for step in range(power):
            x = np.sin(x * np.float32(1.1)) + np.sqrt(abs(x)) / np.float32(step + 1)
            sums[step % 4] += x * x
        sums[k % 4] += np.exp(-x) + np.cos(x)
    return sums[0] + sums[1] * sums[2] - sums[3]


@pytest.mark.parametrize("decorator", [kernel, exact_kernel, summing_kernel, inlined_kernel])
def test_no_call_of_another_kernel_is_left_in_compiled_code(decorator: Any) -> None:
    inner = decorator(total)

    def outer(values: Any) -> Any:
        return inner(values, 3) + inner(values[1:], 5) * inner(values[2:], 7)

    compiled = kernel(outer)
    values = np.linspace(0.0, 1.0, 100, dtype=np.float32)
    assert np.isfinite(compiled(values))
    assembly = "".join(compiled.inspect_asm().values())
    assert not re.findall(r"^\s+(?:call|jmp|movabs)\w*\s+.*total.*$", assembly, re.M)
