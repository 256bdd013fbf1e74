"""Reads a release with programs that are not ours; prints how many records its Croissant metadata gives.

python tests/peers/release.py FOLDER
"""

import os
import subprocess
import sys
from pathlib import Path

import mlcroissant


def records(folder: Path) -> int:
    """Rows of the record set `samples`; every field that the metadata names must be there."""
    dataset = mlcroissant.Dataset(str(folder / "croissant.json"))
    complaints = dataset.metadata.issues.report()
    if complaints:
        raise SystemExit(f"mlcroissant: {complaints}")
    fields = {field.id for set_ in dataset.metadata.record_sets if set_.id == "samples" for field in set_.fields}
    count = 0
    for row in dataset.records("samples"):
        if set(row) != fields:
            raise SystemExit(f"mlcroissant: row {count} has {sorted(row)}, not {sorted(fields)}")
        count += 1
    return count


def check(program: str, *arguments: str) -> None:
    """Requires that a program in the folder of this Python reports no fault."""
    path = Path(sys.executable).with_name(program)
    done = subprocess.run([path, *arguments], capture_output=True, text=True, env={**os.environ, "TERM": "dumb"})
    if done.returncode != 0:
        raise SystemExit(f"{program} {' '.join(arguments)}: {done.stdout}{done.stderr}")


def main() -> None:
    folder = Path(sys.argv[1])
    check("cffconvert", "--validate", "--infile", str(folder / "CITATION.cff"))
    check("rerun", "mcap", "check", str(folder / "preview.mcap"))
    print(records(folder))


if __name__ == "__main__":
    main()
