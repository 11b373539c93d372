"""A folder for results in which only own files are ever replaced or removed."""

import hashlib
import json
import tempfile
from collections.abc import Collection, Iterator
from contextlib import contextmanager
from pathlib import Path

from intent_perception.basics.safe_files import unwritten, write_text

LIST = ".own_files.json"
"""What has been written into the folder: name to SHA-256 of the content."""


class OwnFolder:
    """A folder that belongs to a user, and in it the files of a program.

    A file counts as the program's own only while it has the content that was written. Files of
    other names are never touched; a stranger under a name that the program needs is refused.
    """

    def __init__(self, path: Path) -> None:
        """Take a folder, made when the first file is put into it.

        Raises:
            ValueError: if it is no folder.
        """
        self.path = path
        if path.exists() and not path.is_dir():
            raise ValueError(f"expected a folder for the results, {path} is a file: give another")

    def check(self, names: Collection[str]) -> None:
        """Refuse a folder that holds somebody else's file under one of the names.

        Raises:
            ValueError: that names the file and the remedy.
        """
        own = self._own()
        for name in sorted(names):
            place = self.path / name
            present = place.exists() or place.is_symlink()
            if present and (name not in own or own[name] != _content(place)):
                raise ValueError(
                    f"{self.path} holds {name}, which is not from an earlier run or was changed "
                    "since: move it away or give another folder"
                )

    def clear(self, names: Collection[str]) -> None:
        """Remove what earlier runs have written, after `check`."""
        self.check(names)
        for name, content in self._own().items():
            if _content(self.path / name) == content:
                (self.path / name).unlink()
        if (self.path / LIST).exists():
            self._note({})

    def put(self, part: Path, name: str) -> Path:
        """Move a finished file of the same disk into the folder; return its place.

        Raises:
            ValueError: if a stranger stands there, or the folder cannot be written.
        """
        self.check([name])
        place = self.path / name
        try:
            place.parent.mkdir(parents=True, exist_ok=True)
            # Noted first: a file that is there and not in the list would count as a stranger.
            self._note({**self._own(), name: _content(part)})
            part.replace(place)
        except OSError as error:
            raise unwritten(place, error) from error
        return place

    def put_all(self, folder: Path) -> None:
        """Replace all own files by those of a finished folder on the same disk."""
        names = sorted(str(f.relative_to(folder)) for f in folder.rglob("*") if f.is_file())
        self.clear(names)
        for name in names:
            self.put(folder / name, name)

    def _own(self) -> dict[str, str]:
        try:
            kept = json.loads((self.path / LIST).read_text())
        except (OSError, ValueError):
            return {}
        if not isinstance(kept, dict):
            return {}
        inside = [n for n in kept if ".." not in Path(n).parts and not Path(n).is_absolute()]
        return {name: str(kept[name]) for name in inside}

    def _note(self, own: dict[str, str]) -> None:
        write_text(self.path / LIST, json.dumps(own, indent=1) + "\n")


@contextmanager
def made_beside(path: Path) -> Iterator[Path]:
    """Give a place for a folder of the same name beside another one, whose files it then replaces.

    The place does not exist yet. Whatever goes wrong, the other folder stays as it was; files in it
    that are not from an earlier run are refused before anything is made.

    Raises:
        ValueError: if strangers stand in the folder, or it cannot be written.
    """
    folder = OwnFolder(path)
    if path.is_dir():
        folder.check([file.name for file in path.iterdir() if file.name != LIST])
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryDirectory(prefix=".part-", dir=path.parent) as aside:
            yield Path(aside) / path.name
            folder.put_all(Path(aside) / path.name)
    except OSError as error:
        raise unwritten(path, error) from error


def _content(path: Path) -> str:
    """Return the SHA-256 of a file, "" where there is none."""
    if not path.is_file() or path.is_symlink():
        return ""
    with path.open("rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()
