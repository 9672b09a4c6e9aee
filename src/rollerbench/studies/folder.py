"""Folders that studies write, and may replace."""

import json
import tempfile
from collections.abc import Mapping
from pathlib import Path

from rollerbench.description.files import write_atomically
from rollerbench.errors import ResourceError


def claim(folder: Path, *, files: set[str], folders: set[str], index: str, what: str) -> set[str]:
    """Checks that a study may be written to a folder, and makes it.

    Args:
        folder: The folder.
        files: Names of the files that the study writes.
        folders: Names of the folders in it that the study writes.
        index: That of the files which lists the figures.
        what: What the study is called in messages: "reproduction".

    Returns:
        Names of the figures of an earlier study.

    Raises:
        ResourceError: the folder cannot be written, or holds something else.
    """
    accepted = f"accepted: a new folder, or that of an earlier {what}"
    if folder.exists() and not folder.is_dir():
        raise ResourceError(f"{folder}: is a file; {accepted}")
    foreign = sorted({path.name for path in folder.iterdir()} - files - folders) if folder.is_dir() else []
    if foreign:
        raise ResourceError(f"{folder}: holds something else ({', '.join(foreign[:3])}); {accepted}")
    for name in files | folders:
        path = folder / name
        if path.exists() and path.is_dir() != (name in folders):
            raise ResourceError(f"{path}: is {'a file' if name in folders else 'a folder'}; {accepted}")
    try:
        folder.mkdir(parents=True, exist_ok=True)
        tempfile.TemporaryFile(dir=folder).close()
        earlier = json.loads((folder / index).read_text(encoding="utf-8"))["figures"]
        return {name for name in earlier if isinstance(name, str)}
    except (FileNotFoundError, ValueError, KeyError, TypeError):
        return set()
    except OSError as error:
        raise ResourceError(f"{folder}: cannot be written: {error}") from error


def write_figures(folder: Path, svgs: Mapping[str, str], earlier: set[str]) -> list[str]:
    """Writes figures/NAME.svg and removes those of an earlier study that are no more; returns the files' names."""
    (folder / "figures").mkdir(exist_ok=True)
    drawn = {f"{name}.svg": svg for name, svg in svgs.items()}
    for name, svg in drawn.items():
        write_atomically(folder / "figures" / name, svg)
    for old in (folder / "figures").glob("*.svg"):
        if old.name in earlier and old.name not in drawn:
            old.unlink()
    return sorted(drawn)
