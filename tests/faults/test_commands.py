"""Commands end with an answer or one sentence: on full disks, at Ctrl-C, at SIGTERM, at bombs."""

import os
import resource
import signal
import struct
import subprocess
import sys
import time
import zlib
from pathlib import Path

import numpy as np
import pytest
from tests.intent_inference.network.test_model_file import write_table

from intent_inference import SHARE
from intent_inference.network.model_file import load_model

ROOT = Path(__file__).resolve().parents[2]
MODEL = SHARE / "models" / "human.npz"


def run(*arguments: str, **options: object) -> subprocess.CompletedProcess[str]:
    command = [sys.executable, "-m", *arguments]
    return subprocess.run(
        command, capture_output=True, text=True, timeout=120, check=False, **options
    )  # type: ignore[call-overload,no-any-return]


def small_files() -> None:
    """As on a full disk: no file may grow beyond 20 kB."""
    signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
    resource.setrlimit(resource.RLIMIT_FSIZE, (20_000, 20_000))


def one_sentence(text: str) -> bool:
    return len(text.strip().splitlines()) == 1 and "Traceback" not in text


@pytest.mark.slow
def test_a_full_disk_loses_nothing_that_was_taught(tmp_path: Path) -> None:
    model, more = tmp_path / "mine.npz", write_table(tmp_path / "more.csv.gz", 20)
    model.write_bytes(MODEL.read_bytes())
    command = ("intent_inference.train", "add", "--model", str(model), "--data", str(more))
    done = run(*command, preexec_fn=small_files)
    assert done.returncode == 1
    assert "cannot write" in done.stderr
    assert "what was there is unchanged" in done.stderr
    assert "Traceback" not in done.stderr
    assert model.read_bytes() == MODEL.read_bytes()
    assert sorted(file.name for file in tmp_path.iterdir()) == ["mine.npz", "more.csv.gz"]
    assert run(*command).returncode == 0
    assert load_model(model).description["added"] == "20"


@pytest.mark.slow
def test_an_output_that_cannot_be_written_is_refused_before_the_work(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("")
    out = str(tmp_path / "file" / "m.npz")
    began = time.monotonic()
    done = run("intent_inference.train", "--data", "none.csv", "--out", out)
    assert done.returncode == 2
    assert "cannot write" in done.stderr
    assert "Traceback" not in done.stderr
    assert time.monotonic() - began < 60


@pytest.mark.slow
def test_one_damaged_frame_does_not_cost_a_track(tmp_path: Path) -> None:
    from intent_perception.bags.bag_files import BagWriter, read_messages

    source, bag = ROOT / "bags" / "robot_table", tmp_path / "bag"
    with BagWriter(bag) as writer:
        for number, message in enumerate(read_messages(source)):
            cut = message.data[: len(message.data) // 3] if number == 10 else message.data
            writer.append_raw(type(message)(message.topic, message.type, message.received, cut))
    out = tmp_path / "track.npz"
    done = run("intent_tracking.track", str(bag), "--objects", "none", "--out", str(out))
    assert done.returncode == 0
    assert "left out: " in done.stderr
    assert done.stdout.startswith("7 frames, ")
    with np.load(out) as track:
        assert len(track["stamp"]) == 7


@pytest.mark.slow
@pytest.mark.parametrize("delay", [0.15, 0.5, 1.0, 2.0])
@pytest.mark.parametrize(("number", "status"), [(signal.SIGINT, 130), (signal.SIGTERM, 143)])
def test_a_signal_ends_a_command_quietly_from_its_first_moment_on(
    tmp_path: Path, delay: float, number: int, status: int
) -> None:
    data = SHARE / "data" / "human.csv.gz"
    command = ["-m", "intent_inference.train", "--data", str(data), "--out", str(tmp_path / "m")]
    process = subprocess.Popen([sys.executable, *command], stderr=subprocess.PIPE, text=True)
    time.sleep(delay)
    process.send_signal(number)
    _, said = process.communicate(timeout=60)
    assert "Traceback" not in said
    assert process.returncode in (status, -number)
    assert not list(tmp_path.iterdir())


def png_of(width: int, height: int) -> bytes:
    """A PNG whose few bytes claim any size, with right checksums."""

    def part(kind: bytes, content: bytes) -> bytes:
        check = struct.pack(">I", zlib.crc32(kind + content))
        return struct.pack(">I", len(content)) + kind + content + check

    head = struct.pack(">IIBBBBB", width, height, 8, 2, 0, 0, 0)
    body = zlib.compress(bytes(1_000_000))
    return b"\x89PNG\r\n\x1a\n" + part(b"IHDR", head) + part(b"IDAT", body) + part(b"IEND", b"")


@pytest.mark.slow
def test_a_small_picture_that_claims_a_huge_size_is_refused_without_its_memory(
    tmp_path: Path,
) -> None:
    (tmp_path / "bomb.png").write_bytes(png_of(20_000, 20_000))
    camera = tmp_path / "camera.json"
    camera.write_text('{"width": 640, "height": 480, "fx": 525, "fy": 525, "cx": 320, "cy": 240}')
    command = ("--rgb", str(tmp_path / "bomb.png"), "--camera", str(camera))
    done = run("intent_perception.calibrate", *command)
    assert done.returncode == 1
    assert "claims 20000 x 20000" in done.stderr
    assert one_sentence(done.stderr)


@pytest.mark.slow
def test_a_pipe_in_place_of_a_file_does_not_hang(tmp_path: Path) -> None:
    os.mkfifo(tmp_path / "pipe.npz")
    table = write_table(tmp_path / "t.csv.gz", 20)
    model = str(tmp_path / "pipe.npz")
    done = run("intent_inference.train", "add", "--model", model, "--data", str(table))
    assert done.returncode == 1
    assert "pipe" in done.stderr
    assert one_sentence(done.stderr)


def test_yaml_that_grows_without_measure_is_refused_at_once(tmp_path: Path) -> None:
    from intent_perception.basics.checked_files import read_yaml

    lines = ["a0: &a0 [x, x, x, x, x, x, x, x, x]"]
    lines += [f"a{k}: &a{k} [{', '.join([f'*a{k - 1}'] * 9)}]" for k in range(1, 12)]
    (tmp_path / "bomb.yaml").write_text("\n".join(lines))
    with pytest.raises(ValueError, match="write it without aliases"):
        read_yaml(tmp_path / "bomb.yaml")


def test_a_zip_that_claims_less_than_it_holds_is_refused(tmp_path: Path) -> None:
    from intent_perception.basics.array_files import read_arrays

    np.savez_compressed(tmp_path / "a.npz", a=np.zeros(10_000_000))
    content = (tmp_path / "a.npz").read_bytes()
    real, false = struct.pack("<I", 80_000_128), struct.pack("<I", 208)
    (tmp_path / "a.npz").write_bytes(content.replace(real, false))
    with pytest.raises(ValueError, match="is damaged or no array file"):
        read_arrays(tmp_path / "a.npz", "array file")
