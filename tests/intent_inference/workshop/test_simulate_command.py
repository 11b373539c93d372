"""The command: tables, resume, refusals, and objects spread over processes or a cluster."""

import json
import os
from pathlib import Path

import numpy as np
import pytest

from intent_inference.workshop.simulation.campaign import (
    CampaignConfig,
    generate_all,
    generate_object,
)
from intent_inference.workshop.simulation.grasp_table import read_rows
from intent_inference.workshop.simulation.simulate_command import main
from intent_inference.workshop.simulation.simulated_grasp import load_grasps

DATA = Path(os.environ.get("INTENT_DATA", Path(__file__).parents[4] / "shared" / "data"))
MESHES = DATA / "meshes" / "contactdb_object_sim"


def command(tmp_path, *more):
    return [
        "--hand", "schunk", "--archive", str(tmp_path / "raw"), "--out", str(tmp_path / "d.csv.gz"),
        "--per-object", "3", "--rounds", "6", "--json", str(tmp_path / "d.json"), *more,
    ]  # fmt: skip


def database(tmp_path, *entries):
    text = "objects:\n" + "".join(
        f"  - {{name: {name}, mesh: {mesh}, unit: {unit}, class: {kind}}}\n"
        for name, mesh, unit, kind in entries
    )
    (tmp_path / "objects.yaml").write_text(text)
    return str(tmp_path / "objects.yaml")


@pytest.mark.slow
def test_an_interrupted_run_goes_on_where_it_stopped(tmp_path):
    assert main(command(tmp_path, "--objects", "screwdriver_0")) == 0
    first = load_grasps(tmp_path / "raw" / "schunk" / "screwdriver_0.npz")[0]
    config = CampaignConfig("schunk", tmp_path / "raw", held_per_object=len(first) + 1)
    generate_object(config, "screwdriver_0")
    second = load_grasps(tmp_path / "raw" / "schunk" / "screwdriver_0.npz")[0]
    assert len(second) > len(first)
    np.testing.assert_array_equal(first[0].T_object_hand, second[0].T_object_hand)


@pytest.mark.slow
def test_relabelling_gives_the_same_table_without_simulating(tmp_path):
    assert main(command(tmp_path, "--objects", "screwdriver_1")) == 0
    table = (tmp_path / "d.csv.gz").read_bytes()
    assert main(command(tmp_path, "--objects", "screwdriver_1", "--relabel")) == 0
    assert (tmp_path / "d.csv.gz").read_bytes() == table


@pytest.mark.slow
@pytest.mark.skipif(not MESHES.is_dir(), reason="no real meshes here")
def test_real_meshes_go_through_the_same_command_with_empty_labels(tmp_path):
    models = database(tmp_path, ("bottle", MESHES / "waterbottle.stl", "m", "bottle"))
    assert main(command(tmp_path, "--models", models)) == 0
    rows = read_rows(tmp_path / "d.csv.gz")
    assert {row["pouring"] for row in rows} == {""}
    assert 0.0 < float(rows[0]["conv"]) <= 1.0


@pytest.mark.slow
@pytest.mark.skipif(not MESHES.is_dir(), reason="no real meshes here")
def test_an_open_mesh_is_left_out_with_the_reason(tmp_path):
    models = database(tmp_path, ("bowl", MESHES / "bowl.stl", "m", "bowl"))
    assert main(command(tmp_path, "--models", models)) == 1
    assert "volume" in json.loads((tmp_path / "d.json").read_text())["refused"]["bowl"]


def test_an_unknown_object_is_refused_with_its_name(tmp_path, capsys):
    assert main(command(tmp_path, "--objects", "spoon_9")) == 2
    assert "spoon_9" in capsys.readouterr().err


@pytest.mark.slow
def test_two_dask_workers_give_what_one_process_gives(tmp_path):
    distributed = pytest.importorskip("distributed")
    names = ["screwdriver_0", "screwdriver_1"]
    alone = CampaignConfig("schunk", tmp_path / "alone", held_per_object=2, most_rounds=2)
    spread = CampaignConfig("schunk", tmp_path / "spread", held_per_object=2, most_rounds=2)
    generate_all(alone, names)
    cluster = distributed.LocalCluster(
        n_workers=2, threads_per_worker=1, processes=True, dashboard_address=None
    )
    with cluster, distributed.Client(cluster):
        generate_all(spread, names, jobs=2, backend="dask")
    for name in names:
        ours = load_grasps(alone.path_of(name))[0]
        theirs = load_grasps(spread.path_of(name))[0]
        np.testing.assert_array_equal(ours[0].T_object_hand, theirs[0].T_object_hand)
