"""Errors of reading a dataset. Every error names the file and the remedy."""

from __future__ import annotations

import errno
from pathlib import Path

VERIFY = "`graspmill verify` finds what is damaged, `graspmill run` with the same job makes it again"


class DatasetError(Exception):
    """A dataset that cannot be read: which file, what is wrong with it, and the remedy."""

    def __init__(self, path: Path, problem: str, remedy: str) -> None:
        super().__init__(path, problem, remedy)
        self.path = path
        self.problem = problem
        self.remedy = remedy

    def __str__(self) -> str:
        return f"{self.path}: {self.problem}; {self.remedy}"


class UnfinishedDataset(DatasetError):
    """A folder without a manifest: its run was interrupted, or it never was a dataset."""


class UnknownFormat(DatasetError):
    """A dataset of another format version, or with content that this version does not know."""


class DamagedFile(DatasetError):
    """A file that does not match its own checksums, or the manifest."""


_REMEDIES = {
    errno.EACCES: "change its permissions, or those of a folder above it",
    errno.EPERM: "change its permissions, or those of a folder above it",
    errno.EMFILE: "this process has too many open files: close some, or raise the limit (`ulimit -n`)",
    errno.ENFILE: "this machine has too many open files: end programs that hold many",
    errno.ENOMEM: "free some memory, and try again",
    errno.ENOENT: "check the path",
    errno.ENOTDIR: "check the path: a part of it is a file",
    errno.ELOOP: "check the path: a link in it leads back to itself",
    errno.ENAMETOOLONG: "check the path: a name in it is too long",
    errno.EISDIR: "check the path: a folder has the name of a file",
    errno.ESTALE: "it changed on the server of its file system: open the dataset again",
    errno.ETIMEDOUT: "check the connection to the server of its file system",
    errno.EIO: "check the disk, or the connection to the server of its file system",
}
"""What to do about an error of the operating system, by its number."""


def unreadable(path: Path, error: OSError) -> DatasetError:
    """The error of a file that the operating system does not allow to be read."""
    remedy = _REMEDIES.get(error.errno or 0, "check the path, its permissions and the disk")
    return DatasetError(path, f"it cannot be read ({error.strerror or error})", remedy)


class WrongProduct(DatasetError):
    """A dataset of another product than the requested one."""


class BadSelection(ValueError):
    """A split, object, subset or channel that the dataset does not have."""


class MissingPackage(ImportError):
    """A Python package that is not installed, which a part of this package needs in addition to NumPy and zstandard."""

    def __init__(self, package: str, purpose: str, remedy: str) -> None:
        super().__init__(f"{purpose} needs {package}, which is not installed; {remedy}", name=package)
