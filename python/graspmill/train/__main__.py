"""``python -m graspmill.train``: the command line.

Exit codes: 0 a model is made; 1 it came out wrong; 2 bad recipe, data or arguments; 74 input or output failed; 75
interrupted, to be resumed.
"""

from __future__ import annotations

import argparse
import os
import sys
import time
from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

from ..errors import BadSelection, DatasetError, MissingPackage
from . import data, patches
from .recipe import AnyRecipe, Recipe, read_recipe
from .sources import Source
from .strict import BadRecipe

EXTRA = "`pip install 'graspmill[train]'` installs everything that training needs"


SECONDS_OF_WATCHING = 0.5


def idle_ticks(counts: str, cores: set[int]) -> int:
    """Ticks of the clock in which these cores did nothing or waited for a disk, by the text of /proc/stat."""
    rows = [line.split() for line in counts.splitlines()]
    return sum(int(row[4]) + int(row[5]) for row in rows if row and row[0] in {f"cpu{core}" for core in cores})


def idle_cores() -> int:
    """Cores that are idle now, at least 1: two threads on a busy machine are slower than one.

    The load average would still include work that has just ended, such as making the data. It is used only on systems that do
    not count the work of their cores, as Linux does.
    """
    cores = os.sched_getaffinity(0)
    counts = Path("/proc/stat")
    if counts.exists():
        before, began = idle_ticks(counts.read_text(), cores), time.monotonic()
        time.sleep(SECONDS_OF_WATCHING)
        ticks = (time.monotonic() - began) * os.sysconf("SC_CLK_TCK")
        idle = (idle_ticks(counts.read_text(), cores) - before) / ticks
    else:
        idle = len(cores) - os.getloadavg()[0]
    return max(1, min(len(cores), round(idle)))


def write_whole(path: Path, text: str) -> None:
    temporary = path.with_name(f".{path.name}.tmp")
    temporary.write_text(text, encoding="utf-8")
    os.replace(temporary, path)


def open_sources(folders: list[Path], recipe: AnyRecipe) -> Sequence[Source[Any]]:
    """The datasets that a recipe is trained on."""
    return data.open_sources(folders, recipe) if isinstance(recipe, Recipe) else patches.open_sources(folders, recipe)


def task_of(recipe: AnyRecipe, sources: Sequence[Source[Any]]) -> tuple[Any, Callable[..., Path]]:
    """The task of a recipe, and the function that makes a model folder of its network: the first use of PyTorch."""
    if isinstance(recipe, Recipe):
        from .completing import Completion
        from .completion_export import export

        return Completion(recipe, sources), export
    from .heatmap_export import export as export_heatmap
    from .heatmaps import Heatmaps

    return Heatmaps(recipe, sources), export_heatmap


def train(given: argparse.Namespace) -> int:
    recipe = read_recipe(given.recipe)
    recipe = recipe if given.seed is None else replace(recipe, seed=given.seed)
    sources = open_sources(given.data, recipe)
    recipe = replace(recipe, roots=tuple(source.root for source in sources))
    stored: Path = given.out / "recipe.toml"
    if given.resume and not stored.exists():
        raise BadRecipe(f"{given.out}: no training to resume; leave out --resume")
    if given.resume and read_recipe(stored) != recipe:
        raise BadRecipe(
            f"{stored}: another recipe, seed or data; resume with those of this file, or give another --out"
        )
    if not given.resume and stored.exists():
        raise BadRecipe(f"{given.out}: contains a training; give --resume to continue it, or another --out")
    try:
        from . import loop
        from .export import WrongExport

        task, export = task_of(recipe, sources)
    except ModuleNotFoundError as error:
        if error.name not in ("torch", "onnx", "onnxscript", "onnxruntime", "matplotlib"):
            raise
        raise MissingPackage(error.name, "graspmill.train", EXTRA) from None
    if given.device == "cuda" and not loop.torch.cuda.is_available():
        raise BadRecipe("PyTorch finds no CUDA device; give --device cpu")
    given.out.mkdir(parents=True, exist_ok=True)
    write_whole(stored, recipe.text())
    trainer = loop.Trainer(task, given.out, given.device, given.threads or idle_cores())
    if given.resume:
        trainer.resume(given.threads)
    count = sum(len(source.splits["training"]) for source in sources)
    print(
        f"{recipe.name}: {recipe.training.steps} steps of {recipe.training.batch} of {count} samples, "
        f"from step {trainer.step}; {given.device}, {trainer.setting['threads']} threads",
        file=sys.stderr,
    )
    try:
        trainer.train()
    except loop.Interrupted:
        print(f"interrupted at step {trainer.step}; give --resume to continue", file=sys.stderr)
        return 75
    try:
        print(export(trainer, task))
    except WrongExport as error:
        print(f"error: {error}", file=sys.stderr)
        return 1
    return 0


def main(arguments: list[str] | None = None) -> int:
    parser = argparse.ArgumentParser(
        prog="python -m graspmill.train",
        description="Trains a network that completes shapes, or one that finds grasps in images.",
    )
    parser.add_argument(
        "recipe", type=Path, metavar="RECIPE", help="TOML file, or name of a recipe of the package, such as completion-quick"
    )
    parser.add_argument(
        "--data", type=Path, action="append", required=True, metavar="DIR", help="dataset to train on; can be repeated"
    )
    parser.add_argument("--out", type=Path, required=True, metavar="RUN", help="folder for log, checkpoints and model")
    parser.add_argument("--device", choices=("cpu", "cuda"), default="cpu")
    parser.add_argument("--threads", type=int, help="threads of PyTorch; default: the idle cores")
    parser.add_argument("--seed", type=int, help="instead of the recipe's seed")
    parser.add_argument("--resume", action="store_true", help="continue the training in RUN")
    given = parser.parse_args(arguments)
    if (given.seed or 0) < 0 or (given.threads is not None and given.threads < 1):
        parser.error("--seed from 0, --threads from 1")
    try:
        return train(given)
    except (BadRecipe, BadSelection, DatasetError, MissingPackage) as error:
        print(f"error: {error}", file=sys.stderr)
        return 2
    except OSError as error:
        print(f"error: {error}; fix it, then give --resume", file=sys.stderr)
        return 74


if __name__ == "__main__":
    sys.exit(main())
