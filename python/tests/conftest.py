"""Datasets that tests/python_package.rs made with the program: GRASPMILL_DATA is their folder."""

from __future__ import annotations

import os
from pathlib import Path

import pytest


@pytest.fixture(scope="session")
def data() -> Path:
    """The folder that holds them all."""
    folder = os.environ.get("GRASPMILL_DATA")
    if not folder:
        pytest.exit("set GRASPMILL_DATA, or run `cargo test --release --test python_package`, which makes the data", 2)
    return Path(folder)


FOLDERS = ("pairs", "felt", "set/touch", "set/grasps", "set/patches", "axes", "sphere")
"""Datasets of every product and channel."""
