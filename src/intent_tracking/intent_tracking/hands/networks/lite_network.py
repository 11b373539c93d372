"""A network of `network_files` on LiteRT, TensorFlow's small runtime for CPUs."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from intent_perception.basics.arrays import Floats
from intent_tracking.hands.networks.network_files import network_file


class LiteNetwork:
    """A network with one square RGB input in 0..1; one thread, so that results repeat."""

    def __init__(self, name: str, shapes: tuple[tuple[int, ...], ...]) -> None:
        """Load a network.

        Args:
            name: its name in `network_files`.
            shapes: what its outputs must look like, in the order of their names.

        Raises:
            ValueError: if the file or the runtime is absent or the outputs are other ones.
        """
        path = network_file(name)
        try:
            from ai_edge_litert.interpreter import Interpreter
        except ImportError as error:
            raise ValueError(
                f"the hand networks need LiteRT ({error}); run `pip install ai-edge-litert`"
            ) from error
        self._interpreter: Any = Interpreter(str(path), num_threads=1)
        self._interpreter.allocate_tensors()
        image = self._interpreter.get_input_details()[0]
        outputs = sorted(self._interpreter.get_output_details(), key=lambda one: one["name"])
        found = tuple(tuple(int(n) for n in one["shape"][1:]) for one in outputs)
        if found != shapes:
            raise ValueError(f"expected outputs {shapes} from {path}, got {found}")
        self.size = int(image["shape"][1])
        """Rows and columns of its input."""
        self._input = int(image["index"])
        self._outputs = [int(one["index"]) for one in outputs]
        self._scaled = np.zeros((1, self.size, self.size, 3), np.float32)

    def __call__(self, image: NDArray[np.uint8]) -> tuple[Floats, ...]:
        """Return copies of the outputs for an RGB image (size, size, 3)."""
        np.multiply(image, np.float32(1.0 / 255.0), out=self._scaled[0])
        self._interpreter.set_tensor(self._input, self._scaled)
        self._interpreter.invoke()
        return tuple(self._interpreter.get_tensor(index)[0] for index in self._outputs)
