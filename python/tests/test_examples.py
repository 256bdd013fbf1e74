"""The examples run unchanged."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest

EXAMPLES = Path(__file__).parent.parent / "examples"


@pytest.mark.parametrize(
    ("name", "folder"),
    [
        ("touch", "felt"),
        ("patches", "set/patches"),
        ("grasps", "set/grasps"),
        ("reachability", "axes"),
        ("reachability", "sphere"),
    ],
)
def test_an_example_runs(data: Path, name: str, folder: str) -> None:
    command = [sys.executable, str(EXAMPLES / f"{name}.py"), str(data / folder)]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert done.returncode == 0 and done.stdout.strip(), done.stderr
