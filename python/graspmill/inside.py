"""Files inside a folder that somebody else may have filled: only regular files, each up to a bound, and without following
links on the way to them. Links in the path that a caller gives are followed."""

from __future__ import annotations

import os
import stat
from pathlib import Path, PurePosixPath
from typing import BinaryIO

from .errors import VERIFY, DamagedFile, DatasetError

MOST_BYTES = 256 << 20
"""Largest table, manifest or document [bytes]; the program reads no larger one either."""

_COPY = "replace it by a copy of its target (cp -rL)"
# A folder on the way need not be readable.
_WAY = getattr(os, "O_PATH", os.O_RDONLY) | getattr(os, "O_DIRECTORY", 0) | getattr(os, "O_CLOEXEC", 0)
_BY_FOLDER = os.open in os.supports_dir_fd
_NOFOLLOW = getattr(os, "O_NOFOLLOW", 0)
_END = os.O_RDONLY | _NOFOLLOW | getattr(os, "O_NONBLOCK", 0) | getattr(os, "O_CLOEXEC", 0) | getattr(os, "O_BINARY", 0)


def open_inside(folder: Path, name: str) -> BinaryIO:
    """Opens a regular file for reading, by its path inside a folder: ``shards/x.mcap``.

    Raises ``DamagedFile`` for a link on the way and for anything that is not a regular file, ``OSError`` where the operating
    system refuses.
    """
    return os.fdopen(_descriptor_inside(folder, name), "rb")


def _descriptor_inside(folder: Path, name: str) -> int:
    path, parts = folder / name, PurePosixPath(name).parts
    if not parts or any(part in ("..", "/") for part in parts):
        raise DamagedFile(path, "it points outside the folder", VERIFY)
    if not _BY_FOLDER:
        for depth in range(1, len(parts) + 1):
            below = folder.joinpath(*parts[:depth])
            _refuse(below, os.lstat(below), depth == len(parts))
        return os.open(path, _END)
    place = os.open(folder, _WAY)
    try:
        for depth, part in enumerate(parts):
            is_last = depth == len(parts) - 1
            # Before it is opened, since that alone makes some devices act.
            below = folder.joinpath(*parts[: depth + 1])
            _refuse(below, os.stat(part, dir_fd=place, follow_symlinks=False), is_last)
            opened = os.open(part, _END if is_last else _WAY | _NOFOLLOW, dir_fd=place)
            os.close(place)
            place = opened
        _refuse(path, os.fstat(place), True)
        found, place = place, -1
        return found
    finally:
        if place >= 0:
            os.close(place)


def _refuse(path: Path, found: os.stat_result, is_last: bool) -> None:
    """Raises ``DamagedFile`` for a link, and for a last part that is not a regular file."""
    if stat.S_ISLNK(found.st_mode):
        raise DamagedFile(path, "it is a symbolic link, and links inside a dataset are not followed", _COPY)
    if is_last and not stat.S_ISREG(found.st_mode):
        raise DamagedFile(path, "it is not a regular file", VERIFY)


def descriptor_of(path: Path) -> int:
    """Descriptor of a file of a dataset by its path, open for reading; the folder ``shards`` of a shard is inside the
    dataset, too. Raises as ``open_inside``."""
    if path.parent.name == "shards":
        return _descriptor_inside(path.parent.parent, f"shards/{path.name}")
    return _descriptor_inside(path.parent, path.name)


def read_text(folder: Path, name: str) -> str:
    """The text of a file inside a folder.

    Raises ``DamagedFile``, also if it has more than ``MOST_BYTES`` or is not UTF-8, and ``OSError``.
    """
    path = folder / name
    with open_inside(folder, name) as file:
        size = os.fstat(file.fileno()).st_size
        content = file.read(MOST_BYTES + 1) if size <= MOST_BYTES else b""
    if max(size, len(content)) > MOST_BYTES:
        size = max(size, len(content))
        problem = f"it has {size} bytes, at most {MOST_BYTES} are read"
        raise DatasetError(path, problem, "check that it is the right file")
    try:
        return str(content, "utf-8")
    except UnicodeDecodeError as error:
        raise DamagedFile(path, f"it is not text ({error})", VERIFY) from error


def size_inside(folder: Path, name: str) -> int:
    """Size of a regular file inside a folder [bytes]. Raises as ``open_inside``."""
    with open_inside(folder, name) as file:
        return os.fstat(file.fileno()).st_size
