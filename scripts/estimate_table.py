#!/usr/bin/env python3
"""Compares what `estimate` tells of jobs with what `run` takes: bytes on disk and processor time.

Every job of the folder that `estimate` expects to end within ten minutes of wall-clock time is run, the jobs of sets one by one; it
prints a table and fails where a job is beyond the bounds. Jobs that cannot run here, and those that take longer, are listed with the
reason. Python's standard library is enough.
"""

import argparse
import json
import pathlib
import shutil
import subprocess
import sys
import tempfile
import tomllib

# Bounds of told / measured - 1. Of processor time, a difference below half a second is none: `estimate` speaks of whole seconds.
BYTES, SECONDS = 0.15, 0.30
FEW_SECONDS = 0.5
# Wall-clock time up to which a job is run [s].
LONGEST = 600.0
# Files of a dataset's folder that no estimate counts: for viewers, for people, and about the run itself.
UNCOUNTED = {"preview.mcap", "report.html", "notes.json"}


def jobs_of(file: pathlib.Path) -> list[dict]:
    """The job of a file, or those of a set in their order: name, file, settings, and inputs by section."""
    table = tomllib.loads(file.read_text())
    if table.get("product") != "set":
        # A job that reads a dataset is given the one that the job of that name made here.
        sections = {name: value for name, value in table.items() if isinstance(value, dict) and "dataset" in value}
        inputs = {name: pathlib.Path(value["dataset"]).name for name, value in sections.items()}
        return [{"name": file.stem, "file": file, "set": [], "inputs": inputs}]
    return [
        {
            "name": f"{file.stem}/{job['name']}",
            "file": file.parent / job["job"],
            "set": job.get("set", []),
            "inputs": {section: f"{file.stem}/{name}" for section, name in job.get("inputs", {}).items()},
        }
        for job in table["jobs"]
    ]


class Table:
    def __init__(self, arguments: argparse.Namespace, folder: pathlib.Path) -> None:
        self.program, self.threads, self.folder = arguments.graspmill, arguments.threads, folder
        self.rows, self.passed_over, self.beyond = [], [], []

    def call(self, verb: str, job: dict, *more: str) -> tuple[dict | None, str]:
        """The answer of the program as JSON, or the first line of its complaint."""
        words = [self.program, verb, str(job["file"]), "--json", *more]
        if self.threads:
            words += ["--threads", str(self.threads)]
        for setting in job["set"]:
            words += ["--set", setting]
        for section, name in job["inputs"].items():
            words += ["--set", f"{section}.dataset={self.folder / name}"]
        done = subprocess.run(words, capture_output=True, text=True, check=False)
        if done.returncode not in (0, 3):
            complaint = next((line for line in done.stderr.splitlines() if "error" in line or ":" in line), "no word")
            return None, f"exit code {done.returncode}: {complaint.strip()}"
        return json.loads(done.stdout), ""

    def add(self, job: dict) -> None:
        """Estimates and runs a job."""
        name, out = job["name"], self.folder / job["name"]
        told, complaint = self.call("estimate", job)
        if told is None:
            return self.pass_over(name, complaint)
        if told["seconds"] > LONGEST:
            return self.pass_over(name, f"{told['seconds'] / 60:.0f} minutes on {told['threads']} threads")
        out.parent.mkdir(exist_ok=True)
        done, complaint = self.call("run", job, "--out", str(out), "--progress", "none")
        if done is None:
            return self.pass_over(name, complaint)
        files = [file for file in out.rglob("*") if file.is_file() and file.name not in UNCOUNTED]
        size = sum(file.stat().st_size for file in files)
        row = [told["bytes"] / 1e6, size / 1e6, told["core_seconds"], done["core_seconds"]]
        off = [told["bytes"] / size - 1, told["core_seconds"] / done["core_seconds"] - 1]
        is_time_within = abs(off[1]) <= SECONDS or abs(row[2] - row[3]) < FEW_SECONDS
        is_within = abs(off[0]) <= BYTES and is_time_within
        self.rows.append(name)
        self.beyond += [] if is_within else [name]
        mark = "" if is_within else "  <- beyond"
        size_columns = f"{row[0]:9.2f} {row[1]:9.2f} {off[0]:+7.1%}"
        print(f"{name:34} {size_columns} {row[2]:9.1f} {row[3]:9.1f} {off[1]:+7.1%}{mark}", flush=True)

    def pass_over(self, name: str, reason: str) -> None:
        self.passed_over.append(f"{name}: {reason}")


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--graspmill", default="target/release/graspmill", help="the program")
    parser.add_argument("--threads", type=int, help="threads; by default every core")
    parser.add_argument("--keep", type=pathlib.Path, help="a folder for the datasets, which stay; by default they go")
    parser.add_argument("jobs", nargs="*", type=pathlib.Path, help="job files; by default all of jobs/")
    arguments = parser.parse_args()
    files = arguments.jobs or sorted(pathlib.Path("jobs").glob("*.toml"))
    folder = arguments.keep or pathlib.Path(tempfile.mkdtemp(prefix="estimates-"))
    table = Table(arguments, folder)
    print(f"{'job':34} {'told MB':>9} {'on disk':>9} {'off':>7} {'told s':>9} {'used':>9} {'off':>7}")
    try:
        for file in files:
            for job in jobs_of(file):
                table.add(job)
    finally:
        if not arguments.keep:
            shutil.rmtree(folder)
    for line in table.passed_over:
        print(f"not run: {line}")
    print(f"{len(table.rows)} jobs, {len(table.beyond)} beyond {BYTES:.0%} of bytes or {SECONDS:.0%} of processor time")
    if not table.rows:
        print("no job was run")
    return 1 if table.beyond or not table.rows else 0


if __name__ == "__main__":
    sys.exit(main())
