"""Model files: arrays and a JSON header in one npz archive, no pickle, with a schema version."""

import json
from pathlib import Path
from typing import Any

import numpy as np

from intent_inference import SHARE
from intent_inference.network.conditional_tables import DirichletPrior
from intent_inference.network.model_check import check_model
from intent_inference.network.probability_calibration import OddsCalibration
from intent_inference.network.task_model import Member, TaskModel, TaskNetworks
from intent_inference.quantisation.mixture import GaussianMixture
from intent_inference.quantisation.quantiser import Quantiser, Standardisation
from intent_perception.basics.array_files import read_arrays
from intent_perception.basics.arrays import Array
from intent_perception.basics.safe_files import write_arrays

SCHEMA = 1
_HEADER = "header"
_REMEDY = "train it again with `python -m intent_inference.train`"

Arrays = dict[str, Array]


class ModelFileError(ValueError):
    """A model file that cannot be used; the message names the cause and the remedy."""


def save_model(model: TaskModel, path: Path | str) -> None:
    """Write a model to a file, without pickle; ValueError where that is impossible."""
    arrays: Arrays = {}
    header = {
        "schema": SCHEMA,
        "classes": list(model.classes),
        "variables": list(model.variables),
        "description": model.description,
        "quantisers": {
            key: _pack_quantiser(key, quantiser, arrays)
            for key, quantiser in model.quantisers.items()
        },
        "networks": [
            _pack_networks(f"task{i}", networks, arrays)
            for i, networks in enumerate(model.networks)
        ],
    }
    text = json.dumps(header).encode()
    write_arrays(path, {_HEADER: np.frombuffer(text, dtype=np.uint8), **arrays})


def shipped_model(name: str = "human") -> TaskModel:
    """Return a shipped model: "human" (BN^H) or "schunk" (BN^R)."""
    return load_model(SHARE / "models" / f"{name}.npz")


def load_model(path: Path | str) -> TaskModel:
    """Return the model of a file.

    Raises:
        ModelFileError: if the file is missing, damaged, or of another schema version.
    """
    path = Path(path)
    if not path.exists():
        raise ModelFileError(f"no model file {path}: {_REMEDY}")
    try:
        arrays = read_arrays(path, "model file")
    except ValueError as error:
        raise ModelFileError(f"{error}: {_REMEDY}") from error
    try:
        header = json.loads(arrays.pop(_HEADER).tobytes().decode())
    except (KeyError, ValueError, RecursionError) as error:
        raise ModelFileError(f"{path} is damaged or no model file ({error}): {_REMEDY}") from error
    schema = header.get("schema") if isinstance(header, dict) else None
    if schema != SCHEMA:
        raise ModelFileError(
            f"{path} has schema version {schema}, this program reads {SCHEMA}: {_REMEDY}"
        )
    try:
        model = _unpack_model(header, arrays)
        check_model(model)
    except (KeyError, TypeError, ValueError, AttributeError, IndexError) as error:
        raise ModelFileError(f"{path} cannot be used ({error}): {_REMEDY}") from error
    except np.linalg.LinAlgError as error:
        raise ModelFileError(f"{path} cannot be used ({error}): {_REMEDY}") from error
    return model


def _pack_quantiser(key: str, quantiser: Quantiser, arrays: Arrays) -> dict[str, str]:
    standardisation, mixture = quantiser.standardisation, quantiser.mixture
    name = quantiser.variable
    arrays[f"{name}:mean"] = standardisation.mean
    arrays[f"{name}:axes"] = standardisation.axes
    arrays[f"{name}:back"] = standardisation.back
    arrays[f"{key}:weights"] = mixture.weights
    arrays[f"{key}:means"] = mixture.means
    arrays[f"{key}:covariances"] = mixture.covariances
    return {"variable": name}


def _pack_networks(name: str, networks: TaskNetworks, arrays: Arrays) -> dict[str, Any]:
    members = []
    for i, member in enumerate(networks.members):
        for variable, counts in member.counts.items():
            arrays[f"{name}:{i}:{variable}"] = counts
        members.append({
            "recipe": member.recipe,
            "parents": {v: list(p) for v, p in member.parents.items()},
            "keys": member.keys,
            "prior": {"strength": member.prior.strength, "back_off": member.prior.back_off},
        })  # fmt: skip
    calibrations = []
    for i, calibration in enumerate(networks.calibrations):
        for part in ("weights", "knots", "levels"):
            arrays[f"{name}:calibration{i}:{part}"] = getattr(calibration, part)
        calibrations.append(list(calibration.observed))
    return {"task": networks.task, "members": members, "calibrations": calibrations}


def _unpack_model(header: dict[str, Any], arrays: Arrays) -> TaskModel:
    quantisers = {}
    for key, entry in header["quantisers"].items():
        name = entry["variable"]
        standardisation = Standardisation(
            arrays[f"{name}:mean"], arrays[f"{name}:axes"], arrays[f"{name}:back"]
        )
        mixture = GaussianMixture(
            arrays[f"{key}:weights"], arrays[f"{key}:means"], arrays[f"{key}:covariances"]
        )
        quantisers[key] = Quantiser(name, standardisation, mixture)
    return TaskModel(
        classes=tuple(header["classes"]),
        variables=tuple(header["variables"]),
        quantisers=quantisers,
        networks=tuple(
            _unpack_networks(f"task{i}", entry, arrays)
            for i, entry in enumerate(header["networks"])
        ),
        description=dict(header["description"]),
    )


def _unpack_networks(name: str, entry: dict[str, Any], arrays: Arrays) -> TaskNetworks:
    members = []
    for i, stored in enumerate(entry["members"]):
        parents = {v: tuple(p) for v, p in stored["parents"].items()}
        members.append(
            Member(
                recipe=stored["recipe"],
                parents=parents,
                keys=dict(stored["keys"]),
                counts={v: arrays[f"{name}:{i}:{v}"] for v in parents},
                prior=DirichletPrior(**stored["prior"]),
            )
        )
    calibrations = tuple(
        OddsCalibration(
            tuple(observed),
            *(arrays[f"{name}:calibration{i}:{part}"] for part in ("weights", "knots", "levels")),
        )
        for i, observed in enumerate(entry["calibrations"])
    )
    return TaskNetworks(entry["task"], tuple(members), calibrations)
