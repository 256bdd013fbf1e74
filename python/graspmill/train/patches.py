"""Patches of grasps for the trainer, cut out of whole images: the input of a cell of a heatmap, and its target."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import numpy.typing as npt

from ..dataset import Dataset
from ..patches import PatchSample
from . import sources
from .recipe import PIXELS, HeatmapRecipe
from .sources import Arrays, expect_agreement, open_source, spread
from .strict import BadRecipe

SIDE = 72
"""Pixels along each side of the stored patches; the point is in the middle."""
FIELD = 73
"""Pixels that a cell of a heatmap sees along each side: a patch, and one row and column more."""
STRIDE = 8
"""Pixels between the cells of a heatmap: cell (i, j) sees the patch about the pixel (SIDE / 2 + STRIDE i, ...)."""
MARGIN = 8
"""Pixels around them that decide how these are normalised."""
POINTS = {"all": slice(0, 4), "palm": slice(0, 1), "fingertips": slice(1, 4)}
"""Points that each stratum of the scores has."""
Source = sources.Source[PatchSample]


def open_sources(folders: Sequence[Path], recipe: HeatmapRecipe) -> list[Source]:
    """The datasets' training, holdout and validation samples; the test samples stay closed.

    Raises ``BadRecipe`` for data that the recipe cannot be trained with, ``DatasetError`` for data that cannot be read.
    """
    opened = [_open(folder, recipe) for folder in folders]
    expect_agreement(opened, recipe)
    for source in opened:
        if types_of([source]) != types_of(opened):
            found, first = types_of([source]), types_of(opened)
            raise BadRecipe(f"{source.folder}: grasp types {found}, in {opened[0].folder} {first}")
        if size_of(source) != size_of(opened[0]):
            found, first = size_of(source), size_of(opened[0])
            raise BadRecipe(f"{source.folder}: images of {found} pixels, in {opened[0].folder} of {first}")
    return opened


def _open(folder: Path, recipe: HeatmapRecipe) -> Source:
    needs = {"image": "images.full = true"}
    if recipe.pixels == "rgbd":
        needs["image_colour"] = "images.full = true and render.colour = true"
    if recipe.targets == "tested":
        needs["trial"] = 'patches.label = "trial"'
    if recipe.points == "visible":
        needs["visibility"] = "patches.visibility = true"
    stored = Dataset(folder, PatchSample).folder.channels
    for channel, setting in needs.items():
        if channel not in stored:
            raise BadRecipe(f"{folder}: it has no channel {channel}; make it with {setting}, or change the recipe")
    source = open_source(folder, PatchSample, ["patch", *needs])
    side = int(source.splits["training"][0].patch["side"])
    if side != SIDE:
        raise BadRecipe(f"{folder}: patches of {side} pixels per side; these networks learn from {SIDE}")
    return source


def types_of(opened: Sequence[Source]) -> list[int]:
    """Grasp types of the labels, those of the first dataset."""
    return opened[0].splits["training"][0].types


def size_of(source: Source) -> list[int]:
    """Width and height of a dataset's images, px."""
    camera = source.splits["training"][0].camera
    return [camera.width, camera.height]


def image_of(sample: PatchSample, recipe: HeatmapRecipe) -> npt.NDArray[np.float32]:
    """The whole image, (channels, height, width): red, green and blue from 0 to 1, depth in metres, 0 = no return."""
    camera, box = sample.camera, sample.image
    image = np.zeros((len(PIXELS[recipe.pixels]), camera.height, camera.width), np.float32)
    height, width = box.metres.shape
    image[-1, box.top : box.top + height, box.left : box.left + width] = np.nan_to_num(box.metres, nan=0.0)
    if recipe.pixels == "rgbd":
        image[:3] = np.moveaxis(sample.image_colour.whole(camera), -1, 0) / np.float32(255)
    return image


def cut(image: npt.NDArray[np.float32], corners: npt.NDArray[np.int64]) -> npt.NDArray[np.float32]:
    """The squares that cells with these corners (left, top) see, with the margin that normalises them: (corners,
    channels + 1, side, side). The last channel is 1 inside of the image and 0 outside, where all others are 0."""
    whole = np.concatenate([image, np.ones_like(image[:1])])
    padded = np.pad(whole, ((0, 0), *((MARGIN, MARGIN + FIELD - SIDE),) * 2))
    side = FIELD + 2 * MARGIN
    return np.stack([padded[:, top : top + side, left : left + side] for left, top in corners])


def arrays_of(samples: Sequence[PatchSample], recipe: HeatmapRecipe) -> Arrays:
    """``image`` (patches, channels + 1, side, side) float32 as `cut` gives it, ``labels`` (patches, 4 types) float32,
    and ``mask``, which of them are learnt; four patches per sample."""
    masks = []
    for sample in samples:
        known = sample.tested if recipe.targets == "tested" else np.ones_like(sample.labels, bool)
        masks.append(known & sample.visible[:, None] if recipe.points == "visible" else known)
    images = [cut(image_of(sample, recipe), sample.corners) for sample in samples]
    labels = [sample.labels for sample in samples]
    return {name: np.concatenate(parts) for name, parts in (("image", images), ("labels", labels), ("mask", masks))}


def batches_of(opened: Sequence[Source], recipe: HeatmapRecipe, first: int) -> Iterator[Arrays]:
    """The batches of the steps from `first` on, endless, with ``noise`` for the pixels of each patch."""
    settings, channels = recipe.training, len(PIXELS[recipe.pixels])

    def finish(samples: list[PatchSample], step: int) -> Arrays:
        arrays = arrays_of(samples, recipe)
        shape = (4, channels, FIELD, FIELD)
        draws = [np.random.default_rng([recipe.seed, step, place]) for place in range(len(samples))]
        noise = [each.standard_normal(shape, np.float32) * np.float32(settings.noise) for each in draws]
        return arrays | {"noise": np.concatenate(noise)}

    return sources.batches_of(opened, recipe, settings.batch // 4, first, finish)


@dataclass(frozen=True)
class Held:
    """Samples to evaluate the network on, evenly taken from a split."""

    arrays: Arrays
    objects: npt.NDArray[np.str_]
    """Object of each sample, which has four patches."""

    @classmethod
    def of(cls, opened: Sequence[Source], split: str, recipe: HeatmapRecipe) -> Held | None:
        """None where the split is empty."""
        samples, objects = spread(opened, split, recipe.validation.samples)
        return cls(arrays_of(samples, recipe), objects) if samples else None

    def errors(self, found: npt.NDArray[np.float32]) -> dict[str, tuple[npt.NDArray[np.float64], npt.NDArray[np.str_]]]:
        """Mean squared error of the numbers that the recipe learns, (patches, 4 types), by stratum: per sample that has
        such numbers, and the objects of these."""
        count = len(self.objects)
        mask = self.arrays["mask"].reshape(count, 4, -1)
        squares = (found.astype(np.float64).reshape(mask.shape) - self.arrays["labels"].reshape(mask.shape)) ** 2
        strata = {}
        for name, points in POINTS.items():
            numbers = mask[:, points].sum(axis=(1, 2))
            rows = numbers > 0
            sums = (squares * mask)[:, points].sum(axis=(1, 2))
            strata[name] = sums[rows] / numbers[rows], self.objects[rows]
        return strata
