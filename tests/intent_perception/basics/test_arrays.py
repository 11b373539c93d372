"""What numpy 1.26 lacks is computed as numpy 2 does."""

import numpy as np

from intent_perception.basics.arrays import set_bits


def test_set_bits_are_those_of_the_binary_numerals() -> None:
    words = np.random.default_rng(1).integers(0, 2**64, 200, dtype=np.uint64)
    words[:2] = 0, 2**64 - 1
    assert set_bits(words).tolist() == [bin(word).count("1") for word in words.tolist()]
    assert set_bits(words[::-2]).tolist() == set_bits(words)[::-2].tolist()
