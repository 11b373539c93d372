"""Compiled elimination: one pass over the flat arrays of `network.Schedule` answers a query."""

import numpy as np
from numpy.typing import NDArray

from intent_perception.basics.arrays import Array, Mask
from intent_perception.basics.kernels import summing_kernel

Index = NDArray[np.int64]


@summing_kernel
def run_schedule(
    likelihoods: Array,
    buffer: Array,
    steps: Index,
    gates: Index,
    factors: Index,
    maps: Index,
    networks: Index,
    finals: Index,
    target_likelihood: Index,
    posterior: Array,
    evidence: Array,
) -> None:
    """Fill posterior (G, N, K) and log evidence (G, N); the arrays are those of `Schedule`."""
    widest = np.max(steps[:, 1]) if len(steps) else 1
    active = np.empty(widest, dtype=np.int64)
    weight = np.empty(widest)
    product = np.empty(widest)
    barren = np.zeros(len(steps), dtype=np.bool_)
    for g in range(networks.shape[0]):  # one network's tables stay in the processor's cache
        for n in range(likelihoods.shape[0]):
            log_scale = 0.0
            for s in range(networks[g, 0], networks[g, 1]):
                barren[s] = _is_barren(likelihoods[n], steps[s], factors, barren)
                if barren[s]:
                    buffer[steps[s, 2] : steps[s, 2] + steps[s, 3]] = 1.0
                else:
                    largest = _eliminate(
                        likelihoods[n], buffer, steps[s], gates, factors, maps, active, weight,
                        product,
                    )  # fmt: skip
                    log_scale += np.log(largest)
            total = 0.0
            for k in range(posterior.shape[2]):
                joint = 1.0
                if target_likelihood[g] >= 0:
                    joint = likelihoods[n, target_likelihood[g] + k]
                for f in range(networks[g, 2], networks[g, 3]):
                    joint *= buffer[finals[f, 0] + k * finals[f, 1]]
                posterior[g, n, k] = joint
                total += joint
            for k in range(posterior.shape[2]):
                posterior[g, n, k] /= total
            evidence[g, n] = log_scale + np.log(total)


@summing_kernel
def _is_barren(likelihood: Array, step: Index, factors: Index, barren: Mask) -> bool:
    """Return whether nothing is known of a variable and all below it: its message is all ones."""
    if step[8] == 0:
        return False
    for j in range(step[0], step[0] + step[1]):
        if likelihood[j] != 1.0:
            return False
    for f in range(step[4], step[5]):
        if factors[f, 3] >= 0 and not barren[factors[f, 3]]:
            return False
    return True


@summing_kernel
def _eliminate(
    likelihood: Array,
    buffer: Array,
    step: Index,
    gates: Index,
    factors: Index,
    maps: Index,
    active: Index,
    weight: Array,
    product: Array,
) -> float:
    """Write one step's message, scaled to a largest entry of 1; return what it was scaled by."""
    start, states, out, size, first, end, first_gate, end_gate, _ = step
    count = 0
    for j in range(states):
        weight[j] = likelihood[start + j]
        product[j] = weight[j]
        if weight[j] > 0.0:
            active[count] = j
            count += 1
    table, stride, place = factors[first, 0], factors[first, 1], factors[first, 2]
    dense, several = stride == 1 and 3 * count > states, end > first + 1
    largest, last = 0.0, -1
    for o in range(size):
        total = 0.0
        if _possible(likelihood, gates, maps, first_gate, end_gate, o):
            # The other factors change only where the message's slower variables do.
            if several and (last < 0 or _moved(factors, maps, first, end, o, last)):
                _multiply(product, weight, buffer, factors, maps, first, end, o, active, count)
                last = o
            base = table + maps[place + o]
            if dense:
                for j in range(states):
                    total += product[j] * buffer[base + j]
            else:
                for a in range(count):
                    total += product[active[a]] * buffer[base + active[a] * stride]
        buffer[out + o] = total
        largest = max(largest, total)
    if largest > 0.0:
        scale = 1.0 / largest
        for o in range(out, out + size):
            buffer[o] *= scale
    return largest


@summing_kernel
def _moved(factors: Index, maps: Index, first: int, end: int, entry: int, last: int) -> bool:
    """Return whether a factor other than the first is read elsewhere than for the last entry."""
    for f in range(first + 1, end):
        if maps[factors[f, 2] + entry] != maps[factors[f, 2] + last]:
            return True
    return False


@summing_kernel
def _multiply(
    product: Array, weight: Array, buffer: Array, factors: Index, maps: Index, first: int, end: int,
    entry: int, active: Index, count: int,
) -> None:  # fmt: skip
    """Fill the likelihood times all factors but the first, for one entry of the message."""
    for a in range(count):
        product[active[a]] = weight[active[a]]
    for f in range(first + 1, end):
        base, stride = factors[f, 0] + maps[factors[f, 2] + entry], factors[f, 1]
        for a in range(count):
            product[active[a]] *= buffer[base + active[a] * stride]


@summing_kernel
def _possible(
    likelihood: Array, gates: Index, maps: Index, first: int, end: int, entry: int
) -> bool:
    """Return whether no variable of a message's entry is in a state that evidence rules out."""
    for g in range(first, end):
        if likelihood[gates[g, 0] + maps[gates[g, 1] + entry]] == 0.0:
            return False
    return True
