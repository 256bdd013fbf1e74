"""Which data, inputs and networks complete shapes best? Trainings of one recipe that differ in a few keys, and their scores.

A study is a file of benches/studies: datasets, each made from a job; arms, each a recipe with a few keys of its own; tests
(study_tests.py). Every arm is trained with every seed by `python -m graspmill.train`, many at a time, and completes every test
that has the inputs it needs. The folder `rows` has a file per arm and seed with a row per test and sample; study_table.py
draws tables from them. What is there already is not made again, so that a study that was interrupted goes on.

    [datasets.clean]
    job = "jobs/model-quick.toml"          from the project's folder
    set = ["sensor.profile=\\"none\\""]      as `graspmill run --set`
    parts = ["clean", "d435"]              of a job that makes a set: its datasets that count

    [recipe]                               keys of all arms, over those of a recipe by name
    base = "completion-standard"

    [[arms]]
    name = "depth"
    data = ["clean"]
    recipe = { variant = "depth" }         keys of its own
    base = "completion-thesis"             in place of the study's
    fault = "another body"                 that is planted in the samples (study_fault.py)
    threads = 2                            of PyTorch

Run by `make study STUDY=profiles`; a GPU (--device cuda) does it in minutes, two cores in hours.
"""

from __future__ import annotations

import argparse
import csv
import gzip
import json
import multiprocessing
import os
import subprocess
import sys
import time
from concurrent.futures import ProcessPoolExecutor, as_completed
from pathlib import Path
from typing import Any

import numpy as np

import study_tests
from study_table import METRICS

sys.path.insert(0, str(Path(__file__).resolve().parent.parent / "python"))
from graspmill.train.recipe import Recipe, read_recipe  # noqa: E402

if sys.version_info >= (3, 11):
    import tomllib
else:
    import tomli as tomllib

HOME = Path(__file__).resolve().parent.parent
BATCH = 64
COLUMNS = ("arm", "seed", "test", "sample", "object", "thin", "hidden", "end_on", *METRICS)
Scores = dict[str, list[np.ndarray]]
"""Per sample of each test three overlaps (of the occupied cells, of those that are not seen, of the solid), and whether it is
recognised among those that look the same."""


def make_datasets(study: dict[str, Any], program: str, out: Path) -> dict[str, list[Path]]:
    """The folders of each dataset, made where they are not there yet."""
    found = {}
    for name, table in study["datasets"].items():
        folder = out / "data" / name
        settings = [word for each in table.get("set", []) for word in ("--set", each)]
        command = [program, "run", str(HOME / table["job"]), "--out", str(folder), "--progress", "none", *settings]
        # Exit code 3: some meshes were refused, and the others are there.
        if (code := subprocess.run(command, stdout=subprocess.DEVNULL).returncode) not in (0, 3):
            raise SystemExit(f"{' '.join(command)}: exit code {code}")
        found[name] = [folder / part for part in table["parts"]] if "parts" in table else [folder]
    return found


def recipe_text(study: dict[str, Any], arm: dict[str, Any], steps: int | None) -> str:
    """The recipe of an arm as TOML: the base, the study's keys, the arm's; with this number of steps."""
    keys = dict(study.get("recipe", {}))
    base = keys.pop("base", "completion-standard")
    file = HOME / "python/graspmill/train/recipes" / f"{arm.get('base', base)}.toml"
    table = tomllib.loads(file.read_text(encoding="utf-8"))
    for own in (keys, arm.get("recipe", {})):
        for name, value in own.items():
            table[name] = {**table.get(name, {}), **value} if isinstance(value, dict) else value
    if steps:
        table["training"]["steps"] = steps
    table["name"] = arm["name"]
    lines = [f"{name} = {json.dumps(value)}" for name, value in table.items() if not isinstance(value, dict)]
    for name, section in table.items():
        if isinstance(section, dict):
            lines += [f"[{name}]", *(f"{key} = {json.dumps(value)}" for key, value in section.items())]
    return "\n".join(lines) + "\n"


def overlap(cells: np.ndarray, truth: np.ndarray) -> np.ndarray:
    """Jaccard overlap of each sample, 1 where both are empty."""
    both, either = (cells & truth).sum(axis=(1, 2, 3)), (cells | truth).sum(axis=(1, 2, 3))
    return np.where(either > 0, both / np.maximum(either, 1), 1.0)


def overlap_of_solid(found: np.ndarray, share: np.ndarray) -> np.ndarray:
    """Overlap of volumes of each sample, from shares of cells from 0 to 1."""
    both, either = np.minimum(found, share), np.maximum(found, share)
    return both.sum(axis=(1, 2, 3)) / np.maximum(either.sum(axis=(1, 2, 3)), 1e-9)  # type: ignore[no-any-return]


def recognised(cells: np.ndarray, test: study_tests.Samples) -> np.ndarray:
    """1 where the cells found (packed bits) overlap the sample's own truth more than that of any other shape whose seen cells are
    the same, else 0; NaN where there is no such shape."""
    found = np.full(len(cells), np.nan)
    for row, twins in enumerate(test.twins()):
        if len(twins):
            truths = test.cells("occupancy", [row, *twins])
            overlaps = overlap(np.broadcast_to(study_tests.unpack(cells[row : row + 1]), truths.shape), truths)
            found[row] = overlaps[0] > overlaps[1:].max()
    return found


def scores(run: Path, tests: dict[str, study_tests.Samples], device: str) -> Scores:
    """The scores of a finished training on each test that has the model's inputs. A model without the output `coverage`
    counts its occupied cells as solid."""
    import torch
    from graspmill.train.completing import predict
    from graspmill.train.networks import network_of

    recipe = read_recipe(run / "recipe.toml")
    assert isinstance(recipe, Recipe)
    facts = json.loads((run / "model" / "model.json").read_text(encoding="utf-8"))
    network = network_of(recipe.network, recipe.channels, len(recipe.outputs), recipe.sizes)
    where = torch.device(device)
    state = torch.load(run / "checkpoints" / "best.pt", map_location=where, weights_only=True)
    network.load_state_dict(state["average"])
    network.to(where)
    found: Scores = {}
    for name, test in tests.items():
        if not set(recipe.inputs) <= set(test.bits):
            continue
        each, kept = [], []
        for first in range(0, len(test.objects), BATCH):
            rows = slice(first, first + BATCH)
            arrays = {plane: test.cells(plane, rows) for plane in {*recipe.inputs, "partial"}}
            answers = predict(network, arrays, recipe, where).numpy()
            cells = answers[:, 0] > facts["thresholds"]["occupancy"]
            truth, unseen = test.cells("occupancy", rows), ~arrays["partial"]
            solid = np.full(len(cells), np.nan)
            if test.share is not None:
                ours = answers[:, recipe.outputs.index("coverage")] if "coverage" in recipe.outputs else cells
                solid = overlap_of_solid(ours, test.share[rows] / np.float32(255))
            each.append([overlap(cells, truth), overlap(cells & unseen, truth & unseen), solid])
            kept.append(study_tests.packed(cells))
        found[name] = [*map(np.concatenate, zip(*each)), recognised(np.concatenate(kept), test)]
    return found


def rows_of(out: Path, arm: str, seed: int) -> Path:
    return out / "rows" / f"{arm}-{seed}.csv.gz"


def write_rows(path: Path, arm: str, seed: int, found: Scores, facts: dict[str, tuple[np.ndarray, ...]]) -> None:
    """A row per test and sample, whole or not at all."""
    temporary = path.with_name(f".{path.name}.tmp")
    with gzip.open(temporary, "wt", newline="", encoding="utf-8") as file:
        writer = csv.writer(file)
        writer.writerow(COLUMNS)
        for name, columns in found.items():
            objects, thin, hidden, end_on = facts[name]
            for sample, values in enumerate(zip(*columns)):
                covariates = [int(thin[sample]), f"{hidden[sample]:.4f}", f"{end_on[sample]:.4f}"]
                each = [f"{value:.5f}" for value in values]
                writer.writerow([arm, seed, name, sample, objects[sample], *covariates, *each])
    os.replace(temporary, path)


held: dict[str, Any] = {}


def hold(tests: Path, names: list[str]) -> None:
    held.update({name: study_tests.Samples.load(tests / f"{name}.npz") for name in names})


def trained(
    arm: str, seed: int, data: list[str], out: Path, device: str, threads: int, fault: str | None
) -> tuple[str, int, Scores, str]:
    """Trains an arm with a seed, unless that was done; its scores, or the trainer's message if it failed."""
    run = out / "runs" / f"{arm}-{seed}"
    program = ["-m", "graspmill.train"] if fault is None else [str(HOME / "benches/study_fault.py"), fault]
    if not (run / "model" / "model.json").exists():
        run.parent.mkdir(parents=True, exist_ok=True)
        command = [sys.executable, *program, str(out / "recipes" / f"{arm}.toml"), "--out", str(run)]
        command += [word for folder in data for word in ("--data", folder)]
        command += ["--device", device, "--threads", str(threads), "--seed", str(seed)]
        command += ["--resume"] if (run / "recipe.toml").exists() else []
        paths = os.pathsep.join([str(HOME / "python"), os.environ.get("PYTHONPATH", "")])
        environment = os.environ | {"PYTHONPATH": paths, "OMP_NUM_THREADS": str(threads)}
        done = subprocess.run(command, env=environment, capture_output=True, text=True)
        (run.parent / f"{arm}-{seed}.log").write_text(done.stderr, encoding="utf-8")
        if done.returncode:
            return arm, seed, {}, f"exit code {done.returncode}: {done.stderr[-2000:]}"
    return arm, seed, scores(run, held, device), ""


def queue_of(study: dict[str, Any], only: str | None) -> list[tuple[dict[str, Any], int]]:
    """Arms with their seeds, all first seeds first."""
    arms = [arm for arm in study["arms"] if only is None or only in arm["name"]]
    return [(arm, seed) for seed in range(study["seeds"]) for arm in arms]


def main() -> int:
    arguments = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    arguments.add_argument("study", type=Path, metavar="STUDY", help="a file of benches/studies")
    arguments.add_argument("--out", type=Path, required=True, help="folder of data, trainings and rows")
    arguments.add_argument("--graspmill", default=str(HOME / "target/release/graspmill"))
    arguments.add_argument("--scans", type=Path, default=HOME / ".deps/ycb", help="what neutral pairs are made of")
    arguments.add_argument("--device", choices=("cpu", "cuda"), default="cpu")
    arguments.add_argument("--workers", type=int, default=1, help="trainings at a time")
    arguments.add_argument("--threads", type=int, default=1, help="of each training")
    arguments.add_argument("--steps", type=int, help="of every arm, in place of the recipe's")
    arguments.add_argument("--only", help="arms whose name has this part")
    arguments.add_argument("--tests-only", action="store_true", help="datasets and tests, no training")
    options = arguments.parse_args()
    began = time.perf_counter()
    study = tomllib.loads(options.study.read_text(encoding="utf-8"))
    out = options.out
    folders = make_datasets(study, options.graspmill, out)
    alone = {name: parts[0] for name, parts in folders.items()}
    alone |= {f"{name}/{part.name}": part for name, parts in folders.items() for part in parts}
    tests = study_tests.tests_of(study["tests"], alone, options.scans, out / "tests")
    for name, test in tests.items():
        count = len(np.unique(test.objects))
        print(f"{name}: {len(test.objects)} samples of {count} objects, {test.thin.mean():.0%} hollow or thin", file=sys.stderr)
    if options.tests_only:
        return 0
    facts = {name: (test.objects, test.thin, test.hidden, test.end_on()) for name, test in tests.items()}
    (out / "recipes").mkdir(exist_ok=True)
    for arm in study["arms"]:
        (out / "recipes" / f"{arm['name']}.toml").write_text(recipe_text(study, arm, options.steps), encoding="utf-8")
    (out / "rows").mkdir(exist_ok=True)
    spawn = multiprocessing.get_context("spawn")
    failed = 0
    with ProcessPoolExecutor(options.workers, spawn, hold, (out / "tests", list(tests))) as pool:
        waiting = []
        for arm, seed in queue_of(study, options.only):
            if rows_of(out, arm["name"], seed).exists():
                continue
            data = [str(part) for name in arm["data"] for part in folders[name]]
            settings = (options.device, arm.get("threads", options.threads), arm.get("fault"))
            waiting.append(pool.submit(trained, arm["name"], seed, data, out, *settings))
        for done in as_completed(waiting):
            name, number, found, problem = done.result()
            if problem:
                failed += 1
                print(f"{name}, seed {number}: {problem}", file=sys.stderr, flush=True)
                continue
            write_rows(rows_of(out, name, number), name, number, found, facts)
            said = ", ".join(f"{test} {columns[0].mean():.3f}" for test, columns in found.items())
            print(f"{time.perf_counter() - began:.0f} s: {name}, seed {number}: {said}", file=sys.stderr, flush=True)
    print(f"{len(waiting) - failed} of {len(waiting)} trainings in {time.perf_counter() - began:.0f} s")
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main())
