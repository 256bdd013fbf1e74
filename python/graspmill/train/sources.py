"""Datasets that a training reads: splits, an order that a seed decides, samples to try the network on, and scores."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Generic

import numpy as np
import numpy.typing as npt

from ..amodal import AmodalSample
from ..dataset import Dataset, S
from ..shuffle import ShuffledChunks
from .recipe import AnyRecipe
from .strict import BadRecipe

SPLITS = ("training", "holdout", "validation")
"""Splits that are read; the test samples stay closed."""
Arrays = dict[str, npt.NDArray[Any]]
"""Arrays of a batch by name, the first axis counts samples."""


@dataclass(frozen=True)
class Source(Generic[S]):
    """A dataset that is trained on: its selections by split, and its digests."""

    folder: Path
    splits: dict[str, Dataset[S]]
    root: str
    job: str
    split_of: dict[str, str]
    """Split of each object, by digest."""


def open_source(folder: Path, kind: type[S], channels: Sequence[str], objects: int = 0) -> Source[S]:
    """A dataset's training, holdout and validation samples; of a number of training objects, or of all. Raises
    ``BadRecipe`` if some are missing."""
    whole = Dataset(folder, kind)
    subset = _subset(whole, objects) if objects else None
    subsets = {"training": subset, "holdout": subset, "validation": None}
    splits = {name: Dataset(folder, kind, split=name, channels=channels, subset=subsets[name]) for name in SPLITS}
    for name in ("training", "validation"):
        if not len(splits[name]):
            raise BadRecipe(f"{folder}: it has no {name} samples; give the job's [split] {name} objects")
    split_of = {row["object"]: row["split"] for row in whole.folder.splits()["objects"]}
    return Source(folder, splits, whole.folder.root, whole.folder.manifest["job"], split_of)


def _subset(whole: Dataset[Any], objects: int) -> int:
    """The index of the nested training subset with this number of objects."""
    subsets: list[int] = whole.folder.splits()["training_subsets"]
    if objects not in subsets:
        found = f"subsets of {', '.join(map(str, subsets))} objects" if subsets else "no training subsets"
        problem = f"`objects` is {objects}; the dataset has {found}"
        raise BadRecipe(f"{whole.folder.path}: {problem}: give the job's split.training_subsets such a count")
    return subsets.index(objects)


def expect_agreement(sources: Sequence[Source[Any]], recipe: AnyRecipe) -> None:
    """Raises ``BadRecipe`` for other datasets than the recipe's, and where they do not agree on the objects' splits."""
    if recipe.roots and sorted(recipe.roots) != sorted(source.root for source in sources):
        found = ", ".join(f"{source.folder} has {source.root}" for source in sources)
        raise BadRecipe(f"the recipe is for datasets of the roots {', '.join(recipe.roots)}; {found}")
    split_of: dict[str, str] = {}
    for source in sources:
        for digest, split in source.split_of.items():
            if split_of.setdefault(digest, split) != split:
                problem = f"{source.folder}: the object {digest[:12]} is for {split}, in another dataset for "
                raise BadRecipe(problem + f"{split_of[digest]}; give both jobs the same objects and split")


def samples_of(sources: Sequence[Source[S]], recipe: AnyRecipe, epoch: int) -> Iterator[S]:
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


def batches_of(
    sources: Sequence[Source[S]], recipe: AnyRecipe, size: int, first: int, finish: Callable[[list[S], int], Arrays]
) -> Iterator[Arrays]:
    """The batches of the steps from `first` on, endless: step k has the samples from k times the size on, epoch after
    epoch, made into arrays by `finish`, which takes samples and step."""
    total = sum(len(source.splits["training"]) for source in sources)
    epoch, skipped = divmod(first * size, total)
    held: list[S] = []
    step = first
    while True:
        for sample in samples_of(sources, recipe, epoch):
            if skipped:
                skipped -= 1
                continue
            held.append(sample)
            if len(held) == size:
                yield finish(held, step)
                held, step = [], step + 1
        epoch += 1


def objects_of(data: Dataset[S], samples: Sequence[S], places: Sequence[int]) -> list[str]:
    """The object of each of these samples: its name, or for a body of a scene its digest."""
    if issubclass(data.kind, AmodalSample):
        return [sample.clutter.object for sample in samples if isinstance(sample, AmodalSample)]
    names: list[str] = data.column("object")[list(places)].tolist()
    return names


def spread(sources: Sequence[Source[S]], split: str, most: int) -> tuple[list[S], npt.NDArray[np.str_]]:
    """Samples of a split, evenly taken from each dataset, about this number in total, and the object of each; none if the split
    is empty."""
    samples: list[S] = []
    objects: list[str] = []
    sets = [source.splits[split] for source in sources if len(source.splits[split])]
    for data in sets:
        count = min(len(data), -(-most // len(sets)))
        places = np.linspace(0, len(data) - 1, count).round().astype(int).tolist()
        found = data.gather(places)
        samples += found
        objects += objects_of(data, found, places)
    return samples, np.array(objects)


def score(values: npt.NDArray[np.float64], objects: npt.NDArray[np.str_]) -> dict[str, float | int]:
    """Mean over objects of the mean of each object's samples, with its 95 % interval by 10,000 bootstraps."""
    if not len(values):
        return {"objects": 0, "samples": 0}
    means = np.array([values[objects == name].mean() for name in np.unique(objects)])
    drawn = np.random.default_rng(0).integers(len(means), size=(10_000, len(means)))
    low, high = np.quantile(means[drawn].mean(axis=1), [0.025, 0.975])
    ends = {"mean": float(means.mean()), "low": float(low), "high": float(high)}
    return {name: round(value, 4) for name, value in ends.items()} | {"objects": len(means), "samples": len(values)}
