"""How often people mean each task with an object of a class, before anything is seen."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import yaml

from intent_inference.motion.motion_network import NOTHING
from intent_perception.basics.arrays import Array
from intent_perception.basics.checked_files import read_yaml
from intent_perception.basics.safe_files import write_text

ANY = "any"
_OWN_PURPOSE = {
    **dict.fromkeys(("bottle", "glass", "mug"), "pouring"),
    **dict.fromkeys(("knife", "hammer", "screwdriver"), "tool-use"),
}
_OWN_WEIGHT = 2.0
"""Of what a thing is made for, against any other task."""
_NOTHING_WEIGHT = 0.5
"""Of no task at all against each single task: people take things mostly to use them."""
_TRUST = 5.0
"""The priors weigh as much as so many demonstrations of one person."""


@dataclass(frozen=True)
class ClassPriors:
    """Weights of the meanings, by object class; what is not said weighs as by default."""

    weights: dict[str, dict[str, float]]
    """Class, or `any`, to meaning to weight."""

    @classmethod
    def load(cls, path: Path | str) -> "ClassPriors":
        """Return the priors of a YAML file: `{mug: {hand-over: 2, none of these: 1}, any: {…}}`.

        Raises:
            ValueError: if the file holds no weights above 0.
        """
        content = read_yaml(path)
        if not isinstance(content, dict) or not all(isinstance(v, dict) for v in content.values()):
            raise ValueError(f"{path}: expected {{class: {{task: weight}}}}, got {content!r}")
        weights: dict[str, dict[str, float]] = {}
        for kind, own in content.items():
            for task, weight in own.items():
                if isinstance(weight, bool) or not isinstance(weight, int | float) or weight <= 0:
                    raise ValueError(f"{path}: expected a weight above 0 of {task}, got {weight!r}")
            weights[str(kind)] = {str(task): float(weight) for task, weight in own.items()}
        return cls(weights)

    def after(self, shown: Sequence[tuple[str, str]], tasks: tuple[str, ...]) -> "ClassPriors":
        """Return the priors of a person who was seen to mean something, one count each.

        Args:
            shown: object class and task of each demonstration.
            tasks: T tasks of the model.
        """
        weights = {kind: dict(own) for kind, own in self.weights.items()}
        for kind in dict.fromkeys(kind for kind, _ in shown):
            counted = max(_TRUST, sum(self.weights.get(kind, {}).values()))
            before = counted * np.exp(self.of(kind, tasks))
            weights[kind] = dict(zip((*tasks, NOTHING), before.tolist(), strict=True))
        for kind, task in shown:
            weights[kind][task] += 1.0
        return ClassPriors(weights)

    def save(self, path: Path) -> None:
        """Write the weights as `load` reads them."""
        write_text(path, yaml.safe_dump(self.weights, sort_keys=False))

    def of(self, object_class: str, tasks: tuple[str, ...]) -> Array:
        """Return log p(meaning) (T + 1,) of the tasks and, last, of none of these."""
        meanings = (*tasks, NOTHING)
        weight = dict.fromkeys(tasks, 1.0) | {NOTHING: _NOTHING_WEIGHT}
        weight |= {_OWN_PURPOSE[object_class]: _OWN_WEIGHT} if object_class in _OWN_PURPOSE else {}
        weight |= self.weights.get(ANY, {}) | self.weights.get(object_class, {})
        values = np.array([weight[meaning] for meaning in meanings])
        return np.asarray(np.log(values / values.sum()))
