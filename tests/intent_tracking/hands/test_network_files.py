import hashlib
import zipfile

import pytest

from intent_tracking.hands.fetch_networks_command import main
from intent_tracking.hands.networks import network_files
from intent_tracking.hands.networks.network_files import (
    CHECKSUMS,
    COMMAND,
    missing_networks,
    network_file,
    network_folders,
    unpack_networks,
)


@pytest.fixture
def folder(tmp_path, monkeypatch):
    monkeypatch.setenv("INTENT_HAND_NETWORKS", str(tmp_path / "networks"))
    return tmp_path / "networks"


@pytest.fixture
def wheel(tmp_path, monkeypatch):
    """A wheel with four small files, and their checksums in place of the true ones."""
    path = tmp_path / "made_up.whl"
    with zipfile.ZipFile(path, "w") as archive:
        for name in CHECKSUMS:
            archive.writestr(f"mediapipe/modules/{name.rsplit('_', 1)[0]}/{name}.tflite", name)
    sums = {name: hashlib.sha256(name.encode()).hexdigest() for name in CHECKSUMS}
    monkeypatch.setattr(network_files, "CHECKSUMS", sums)
    return path


def test_environment_variable_names_the_only_folder(folder):
    assert network_folders() == (folder,)


def test_absent_file_is_refused_with_the_command_that_gets_it(folder):
    with pytest.raises(ValueError, match=COMMAND):
        network_file("palm_detection_lite")


def test_damaged_file_is_refused_with_the_command_that_gets_it(folder):
    folder.mkdir()
    (folder / "palm_detection_lite.tflite").write_bytes(b"half a file")
    with pytest.raises(ValueError, match=f"SHA-256 differs.*{COMMAND}"):
        network_file("palm_detection_lite")


def test_unknown_network_is_refused():
    with pytest.raises(ValueError, match="palm_detection_lite"):
        network_file("foot")


def test_unpacked_files_are_found(folder, wheel):
    folder.mkdir()
    unpack_networks(wheel, folder)
    assert missing_networks() == ()
    assert network_file("hand_landmark_full").read_text() == "hand_landmark_full"


def test_wheel_with_another_network_leaves_nothing_behind(folder, wheel, monkeypatch):
    folder.mkdir()
    monkeypatch.setattr(network_files, "CHECKSUMS", dict.fromkeys(CHECKSUMS, "0" * 64))
    with pytest.raises(ValueError, match="another SHA-256"):
        unpack_networks(wheel, folder)
    assert list(folder.iterdir()) == []


def test_wheel_without_networks_is_refused(tmp_path):
    with zipfile.ZipFile(tmp_path / "later.whl", "w") as archive:
        archive.writestr("mediapipe/__init__.py", "")
    with pytest.raises(ValueError, match="holds no mediapipe/modules"):
        unpack_networks(tmp_path / "later.whl", tmp_path)


def test_command_without_an_index_says_so_and_returns_2(folder, monkeypatch, capsys):
    monkeypatch.setenv("PIP_NO_INDEX", "1")
    assert main([]) == 2
    assert "pip cannot download mediapipe" in capsys.readouterr().err
