"""Samples for the trainer: inputs and targets of a recipe, in an order and with losses that a seed decides."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from ..completion import TOUCH, CompletionSample, PairBatch
from ..dataset import Dataset
from ..shuffle import ShuffledChunks
from .recipe import Augmentation, BadRecipe, Recipe

RESOLUTION = 40
Arrays = dict[str, npt.NDArray[Any]]
"""``partial``, ``free``, ``touch``, ``occupancy`` (bool) and ``coverage`` (uint8), each (samples, n, n, n)."""


@dataclass(frozen=True)
class Source:
    """A dataset that is trained on: its selections by split, and its digests."""

    folder: Path
    splits: dict[str, Dataset[CompletionSample]]
    root: str
    job: str
    split_of: dict[str, str]
    """Split of each object, by digest."""


def open_sources(folders: Sequence[Path], recipe: Recipe) -> list[Source]:
    """The datasets' training, holdout and validation samples; the test samples stay closed.

    Raises ``BadRecipe`` for data that the recipe cannot be trained with, ``DatasetError`` for data that cannot be read.
    """
    sources = [_open(folder, recipe) for folder in folders]
    if recipe.roots and sorted(recipe.roots) != sorted(source.root for source in sources):
        found = ", ".join(f"{source.folder} has {source.root}" for source in sources)
        raise BadRecipe(f"the recipe is for datasets of the roots {', '.join(recipe.roots)}; {found}")
    split_of: dict[str, str] = {}
    for source in sources:
        for digest, split in source.split_of.items():
            if split_of.setdefault(digest, split) != split:
                problem = f"{source.folder}: the object {digest[:12]} is for {split}, in another dataset for "
                raise BadRecipe(problem + f"{split_of[digest]}; give both jobs the same objects and split")
    return sources


def _open(folder: Path, recipe: Recipe) -> Source:
    whole = Dataset(folder, CompletionSample)
    stored, channels = whole.folder.channels, ["pair"]
    needs = {"free": ["visibility"], "touch": [name for name in TOUCH if name in stored], "coverage": ["coverage"]}
    settings = {"visibility": "channels.visibility = true", "coverage": "channels.coverage = true"}
    for part in (*recipe.inputs, *recipe.outputs):
        for channel in needs.get(part, []):
            if channel not in stored:
                raise BadRecipe(f"{folder}: it has no channel {channel}; make it with {settings[channel]}")
            channels.append(channel)
        if part == "touch" and not needs["touch"]:
            raise BadRecipe(f"{folder}: it has no touch; make it with touch.random_rays = true")
    # Tells hollow and thin objects from others.
    channels += ["coverage"] if "coverage" in stored else []
    names = ("training", "holdout", "validation")
    splits = {name: Dataset(folder, CompletionSample, split=name, channels=channels) for name in names}
    for name in ("training", "validation"):
        if not len(splits[name]):
            raise BadRecipe(f"{folder}: it has no {name} samples; give the job's [split] {name} objects")
    resolution = splits["training"][0].resolution
    if resolution != RESOLUTION:
        raise BadRecipe(f"{folder}: grids of {resolution} cells a side; these networks complete {RESOLUTION}")
    manifest = whole.folder.manifest
    split_of = {row["object"]: row["split"] for row in whole.folder.splits()["objects"]}
    return Source(folder, splits, whole.folder.root, manifest["job"], split_of)


def arrays_of(samples: Sequence[CompletionSample], recipe: Recipe) -> Arrays:
    """The grids of samples that a recipe needs, and coverage where it is read."""
    batch = PairBatch.of(samples)
    found: Arrays = {"partial": batch.cells("partial"), "occupancy": batch.cells("complete")}
    if "free" in recipe.inputs:
        found["free"] = batch.cells("free")
    if "touch" in recipe.inputs:
        found["touch"] = batch.cells("tactile")
    if samples[0].has("coverage"):
        found["coverage"] = np.stack([sample.coverage for sample in samples])
    return found


def _indices(cells: npt.NDArray[np.bool_]) -> npt.NDArray[np.int64]:
    """(cells, 3), as `np.argwhere`, which takes ten times as long."""
    return np.stack(np.unravel_index(np.flatnonzero(cells), cells.shape), axis=1)


def augment(arrays: Arrays, settings: Augmentation, seed: int, step: int) -> None:
    """Takes away from the inputs, in place: of each sample by its own random numbers, whatever else is in the batch."""
    for place in range(len(arrays["partial"])):
        draws = np.random.default_rng([seed, step, place])
        # All are drawn whatever the variant is, so that variants see the same losses.
        hides, share, angle, drops, blanks, keeps = draws.random(6)
        partial, free = arrays["partial"][place], arrays.get("free")
        cells = _indices(partial)
        if hides < settings.hidden_share and len(cells):
            # Columns of the image beyond a line across it: nothing is seen there, neither surface nor free space.
            way = np.array([np.cos(2 * np.pi * angle), np.sin(2 * np.pi * angle)])
            line = np.quantile(cells[:, :2] @ way, 1 - settings.hide * share)
            x, y = np.indices(partial.shape[:2])
            beyond = x * way[0] + y * way[1] > line
            partial[beyond] = False
            if free is not None:
                free[place][beyond] = False
        lost = draws.random(len(cells)) < settings.drop * drops
        partial[tuple(cells[lost].T)] = False
        if free is not None and blanks < settings.blank_free:
            free[place] = False
        if "touch" in arrays:
            touched = _indices(arrays["touch"][place])
            kept = draws.permutation(len(touched))[: int(keeps * (settings.contacts + 1))]
            arrays["touch"][place] = False
            arrays["touch"][place][tuple(touched[kept].T)] = True


def samples_of(sources: Sequence[Source], recipe: Recipe, epoch: int) -> Iterator[CompletionSample]:
    """The training samples of all sources, each once, mixed in an order of (seed, epoch)."""
    data = [source.splits["training"] for source in sources]
    settings: dict[str, Any] = {"epoch": epoch, "buffer": recipe.training.buffer}
    orders: list[Iterator[Any]] = [iter(ShuffledChunks(each, seed=recipe.seed, **settings)) for each in data]
    left = np.array([len(each) for each in data])
    draws = np.random.default_rng([recipe.seed, epoch])
    while left.sum():
        source = int(np.searchsorted(np.cumsum(left), draws.integers(left.sum()), side="right"))
        left[source] -= 1
        yield next(orders[source])


def batches_of(sources: Sequence[Source], recipe: Recipe, first: int) -> Iterator[Arrays]:
    """The batches of the steps from `first` on, endless: step k has the samples from k times the batch on, epoch after
    epoch."""
    size, total = recipe.training.batch, sum(len(source.splits["training"]) for source in sources)
    epoch, skipped = divmod(first * size, total)
    held: list[CompletionSample] = []
    step = first
    while True:
        for sample in samples_of(sources, recipe, epoch):
            if skipped:
                skipped -= 1
                continue
            held.append(sample)
            if len(held) == size:
                arrays = arrays_of(held, recipe)
                augment(arrays, recipe.augmentation, recipe.seed, step)
                yield arrays
                held, step = [], step + 1
        epoch += 1


@dataclass(frozen=True)
class Held:
    """Samples that the network is tried on, evenly taken from a split."""

    arrays: Arrays
    objects: npt.NDArray[np.str_]
    """Object of each sample."""

    @classmethod
    def of(cls, sources: Sequence[Source], split: str, recipe: Recipe) -> Held | None:
        """None where the split is empty."""
        samples, objects = [], []
        sets = [source.splits[split] for source in sources if len(source.splits[split])]
        for data in sets:
            count = min(len(data), -(-recipe.validation.samples // len(sets)))
            places = np.linspace(0, len(data) - 1, count).round().astype(int).tolist()
            samples += data.gather(places)
            objects += data.column("object")[places].tolist()
        return cls(arrays_of(samples, recipe), np.array(objects)) if samples else None

    def strata(self) -> dict[str, npt.NDArray[np.bool_]]:
        """Which samples each stratum holds. An object is hollow or thin where less than half of the volume of its
        occupied cells is solid, over its samples here."""
        found = {"all": np.ones(len(self.objects), np.bool_)}
        if "coverage" in self.arrays:
            solid = self.arrays["coverage"].sum(axis=(1, 2, 3), dtype=np.int64) / 255
            cells = self.arrays["occupancy"].sum(axis=(1, 2, 3))
            thin = np.zeros(len(self.objects), np.bool_)
            for name in np.unique(self.objects):
                mine = self.objects == name
                thin[mine] = solid[mine].sum() < 0.5 * cells[mine].sum()
            found |= {"hollow or thin": thin, "rest": ~thin}
        return found


def score(overlaps: npt.NDArray[np.float64], objects: npt.NDArray[np.str_]) -> dict[str, float | int]:
    """Mean over objects of the mean of each object's samples, with its 95 % interval by 10,000 bootstraps."""
    if not len(overlaps):
        return {"objects": 0, "samples": 0}
    means = np.array([overlaps[objects == name].mean() for name in np.unique(objects)])
    drawn = np.random.default_rng(0).integers(len(means), size=(10_000, len(means)))
    low, high = np.quantile(means[drawn].mean(axis=1), [0.025, 0.975])
    ends = {"mean": float(means.mean()), "low": float(low), "high": float(high)}
    return {name: round(value, 4) for name, value in ends.items()} | {"objects": len(means), "samples": len(overlaps)}
