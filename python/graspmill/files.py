"""Bytes of files by offset: reads any number of files with few of them open at a time."""

from __future__ import annotations

import errno
import os
import sys
import threading
from collections import OrderedDict
from dataclasses import dataclass
from pathlib import Path

from .errors import VERIFY, DamagedFile, unreadable
from .inside import descriptor_of

_MOST_OPEN = 64
"""Files that a process keeps open, at most, for any number of shards; a limit of 1,024 is common."""
_SHARE = 4
"""One of this number of files that the system allows: the rest of the program uses the others."""


if sys.platform == "win32":
    _seeking = threading.Lock()

    def _most_open() -> int:
        return _MOST_OPEN

    def _read_at(descriptor: int, size: int, place: int) -> bytes:
        with _seeking:
            os.lseek(descriptor, place, os.SEEK_SET)
            return os.read(descriptor, size)

else:
    import resource

    def _most_open() -> int:
        """Files that may be open now."""
        limit = resource.getrlimit(resource.RLIMIT_NOFILE)[0]
        return _MOST_OPEN if limit == resource.RLIM_INFINITY else max(1, min(_MOST_OPEN, limit // _SHARE))

    def _read_at(descriptor: int, size: int, place: int) -> bytes:
        """At most ``size`` bytes from offset ``place`` on; threads and forked processes share no file position."""
        return os.pread(descriptor, size, place)


class _OpenFile:
    """A descriptor that is closed with its last reference: a read on another thread may still hold it."""

    def __init__(self, path: Path) -> None:
        self.descriptor = descriptor_of(path)

    def __del__(self) -> None:
        if hasattr(self, "descriptor"):
            os.close(self.descriptor)


class _OpenFiles:
    """The most recently read files."""

    def __init__(self) -> None:
        self._files: OrderedDict[Path, _OpenFile] = OrderedDict()
        self._lock = threading.Lock()

    def get(self, path: Path) -> _OpenFile:
        """The open file of a path; opened if it is not among the most recent ones."""
        with self._lock:
            found = self._files.get(path)
            if found is not None:
                self._files.move_to_end(path)
                return found
        try:
            opened = _OpenFile(path)
        except OSError as error:
            if error.errno != errno.EMFILE:
                raise
            # The rest of the program uses the others.
            with self._lock:
                self._files.clear()
            opened = _OpenFile(path)
        with self._lock:
            self._files[path] = opened
            while len(self._files) > _most_open():
                self._files.popitem(last=False)
        return opened

    def forget(self, path: Path) -> None:
        """Opens the file again at the next read."""
        with self._lock:
            self._files.pop(path, None)

    def count(self) -> int:
        """Files that are open."""
        return len(self._files)

    def begin_anew(self) -> None:
        """A forked process has copies of the descriptors; the lock may have been held by a thread that it lacks."""
        self._lock = threading.Lock()


open_files = _OpenFiles()
"""The open files of this process."""
if hasattr(os, "register_at_fork"):
    os.register_at_fork(after_in_child=open_files.begin_anew)


@dataclass(frozen=True)
class _Identity:
    """Facts that distinguish a file from another one that takes its name later."""

    device: int
    inode: int
    size: int
    modified: int

    @staticmethod
    def of(file: _OpenFile) -> _Identity:
        """The facts of an open file. The argument keeps it open: another thread may drop it from the open files meanwhile."""
        facts = os.fstat(file.descriptor)
        return _Identity(facts.st_dev, facts.st_ino, facts.st_size, facts.st_mtime_ns)


class FileBytes:
    """A regular file that is read by offset, ``size`` bytes long. It is closed and opened again between reads, and refused when
    another file has taken its name since.

    Raises ``DamagedFile`` where it is missing, empty, reached through a link or not a regular file, ``DatasetError`` where the
    system does not allow reading it.
    """

    def __init__(self, path: Path) -> None:
        self.path = path
        # Another file may have taken the name of one that was read before.
        open_files.forget(path)
        self._identity = _Identity.of(self._open())
        self.size = self._identity.size
        if self.size == 0:
            raise DamagedFile(path, "it is empty", VERIFY)

    def read(self, place: int, size: int) -> memoryview:
        """The bytes from offset ``place`` on; fewer at the end of the file."""
        size = min(size, self.size - place)
        if size <= 0:
            return memoryview(b"")
        file = self._open()
        if _Identity.of(file) != self._identity:
            raise DamagedFile(self.path, "it was changed since it was opened", "open the dataset again")
        try:
            data = _read_at(file.descriptor, size, place)
            while len(data) < size and (more := _read_at(file.descriptor, size - len(data), place + len(data))):
                data += more
        except OSError as error:
            raise unreadable(self.path, error) from error
        return memoryview(data)

    def _open(self) -> _OpenFile:
        try:
            return open_files.get(self.path)
        except FileNotFoundError:
            raise DamagedFile(self.path, "it is missing", VERIFY) from None
        except OSError as error:
            raise unreadable(self.path, error) from error
