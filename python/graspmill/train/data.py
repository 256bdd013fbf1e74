"""Samples of completion for the trainer: inputs and targets of a recipe, with losses that a seed decides."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import numpy.typing as npt

from ..amodal import AmodalSample
from ..completion import TOUCH, CompletionSample, PairBatch
from ..folder import Folder
from . import sources
from .recipe import Augmentation, Recipe
from .sources import Arrays, expect_agreement, open_source, spread
from .strict import BadRecipe

RESOLUTION = 40
KINDS: dict[str, type[CompletionSample]] = {kind.product: kind for kind in (CompletionSample, AmodalSample)}
"""Products that are trained on. Pairs of the bodies of scenes are completion pairs, too."""
Source = sources.Source[CompletionSample]


def open_sources(folders: Sequence[Path], recipe: Recipe) -> list[Source]:
    """The datasets' training, holdout and validation samples; the test samples stay closed.

    Raises ``BadRecipe`` for data that the recipe cannot be trained with, ``DatasetError`` for data that cannot be read.
    """
    opened = [_open(folder, recipe) for folder in folders]
    expect_agreement(opened, recipe)
    return opened


def _open(folder: Path, recipe: Recipe) -> Source:
    found = Folder(folder)
    kind = KINDS.get(found.product)
    if kind is None:
        raise BadRecipe(f"{folder}: a dataset of {found.product}; these networks learn from pairs: {' or '.join(KINDS)}")
    # The record of a body's surroundings names its object.
    stored, channels = found.channels, ["pair", *(["clutter"] if kind is AmodalSample else [])]
    needs = {"free": ["visibility"], "touch": [name for name in TOUCH if name in stored], "coverage": ["coverage"]}
    settings = {"visibility": "channels.visibility = true", "coverage": "channels.coverage = true"}
    for part in (*recipe.inputs, *recipe.outputs):
        for channel in needs.get(part, []):
            if channel not in stored:
                raise BadRecipe(f"{folder}: it has no channel {channel}; make it with {settings[channel]}")
            channels.append(channel)
        if part == "touch" and not needs["touch"]:
            raise BadRecipe(f"{folder}: it has no touch; make it with touch.random_rays = true")
    # Distinguishes hollow and thin objects from others.
    channels += ["coverage"] if "coverage" in stored else []
    source: Source = open_source(folder, kind, channels, recipe.objects)
    resolution = source.splits["training"][0].resolution
    if resolution != RESOLUTION:
        raise BadRecipe(f"{folder}: grids of {resolution} cells a side; these networks complete {RESOLUTION}")
    return source


def arrays_of(samples: Sequence[CompletionSample], recipe: Recipe) -> Arrays:
    """The grids of samples that a recipe needs, and coverage where it is read: ``partial``, ``free``, ``touch``,
    ``occupancy`` (bool) and ``coverage`` (uint8), each (samples, n, n, n). Cells of the table or of a bin's floor count as free,
    as when a picture is completed."""
    batch = PairBatch.of(samples)
    found: Arrays = {"partial": batch.cells("partial"), "occupancy": batch.cells("complete")}
    if "free" in recipe.inputs:
        found["free"] = batch.cells("free")
        for free, sample in zip(found["free"], samples, strict=True):
            if isinstance(sample, AmodalSample):
                free |= sample.below_support
    if "touch" in recipe.inputs:
        found["touch"] = batch.cells("tactile")
    if samples[0].has("coverage"):
        found["coverage"] = np.stack([sample.coverage for sample in samples])
    return found


def augment(arrays: Arrays, settings: Augmentation, seed: int, step: int) -> None:
    """Removes parts of the inputs, in place: for each sample by its own random numbers, independent of the rest of the batch."""
    x, y = np.indices(arrays["partial"].shape[1:3])
    for place in range(len(arrays["partial"])):
        draws = np.random.default_rng([seed, step, place])
        # All are drawn for every variant, so that variants see the same losses.
        hides, share, angle, drops, blanks, keeps = draws.random(6)
        partial, free = arrays["partial"][place], arrays.get("free")
        cells = np.flatnonzero(partial)
        if hides < settings.hidden_share and len(cells):
            # Columns of the image beyond a line across it: nothing is seen there, neither surface nor free space.
            along = x * np.cos(2 * np.pi * angle) + y * np.sin(2 * np.pi * angle)
            seen = np.sort(along.reshape(-1)[cells // partial.shape[2]])
            beyond = along > seen[int((1 - settings.hide * share) * (len(seen) - 1))]
            partial[beyond] = False
            if free is not None:
                free[place][beyond] = False
        partial.flat[cells[draws.random(len(cells)) < settings.drop * drops]] = False
        if free is not None and blanks < settings.blank_free:
            free[place] = False
        if "touch" in arrays:
            touch = arrays["touch"][place]
            touched = np.flatnonzero(touch)
            lost = draws.permutation(len(touched))[int(keeps * (settings.contacts + 1)) :]
            touch.flat[touched[lost]] = False


def batches_of(opened: Sequence[Source], recipe: Recipe, first: int) -> Iterator[Arrays]:
    """The batches of the steps from `first` on, endless."""

    def finish(samples: list[CompletionSample], step: int) -> Arrays:
        arrays = arrays_of(samples, recipe)
        augment(arrays, recipe.augmentation, recipe.seed, step)
        return arrays

    return sources.batches_of(opened, recipe, recipe.training.batch, first, finish)


@dataclass(frozen=True)
class Held:
    """Samples to evaluate the network on, evenly taken from a split."""

    arrays: Arrays
    objects: npt.NDArray[np.str_]
    """Object of each sample."""

    @classmethod
    def of(cls, opened: Sequence[Source], split: str, recipe: Recipe) -> Held | None:
        """None where the split is empty."""
        samples, objects = spread(opened, split, recipe.validation.samples)
        return cls(arrays_of(samples, recipe), objects) if samples else None

    def strata(self) -> dict[str, npt.NDArray[np.bool_]]:
        """Samples of each stratum. An object is hollow or thin where less than half of the volume of its
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
