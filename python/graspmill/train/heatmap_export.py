"""The model folder of a network that finds grasps in images."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import torch
from torch import nn

from .export import (
    GOLDEN,
    begin_folder,
    expect_same,
    facts_of_training,
    finish_folder,
    rounded,
    rows_of_scores,
    session_of,
    sources_of_data,
    sources_of_objects,
    template_of,
    write_onnx,
)
from .heatmap_networks import OnImages
from .heatmaps import Heatmaps
from .loop import Trainer
from .networks import parameters_of
from .patches import FIELD, SIDE, STRIDE, cut, image_of
from .recipe import PIXELS
from .sources import spread

FORMAT = "graspmill heatmap model 1"
COMPARED_PATCHES = 16
"""Cells of each image that are compared with their patches."""


def write_heatmap(network: nn.Module, image: torch.Tensor, path: Path) -> None:
    """The network as ONNX, for any count of images of any size."""
    shapes = ({0: torch.export.Dim("batch", min=1), 2: torch.export.Dim.DYNAMIC, 3: torch.export.Dim.DYNAMIC},)
    write_onnx(network, (image,), shapes, (["image"], ["heatmap"]), path)


def cells_of_patches(network: OnImages, image: np.ndarray[Any, np.dtype[np.float32]], found: torch.Tensor) -> float:
    """The largest difference between cells of an image's map, (outputs, rows, columns), and the same cells by the
    patches that they see; raises `WrongExport` when it is too large."""
    last = [(side - FIELD) // STRIDE for side in image.shape[1:]]
    rows, columns = (np.linspace(0, end, COMPARED_PATCHES).round().astype(int) for end in last)
    columns = np.roll(columns, COMPARED_PATCHES // 3)
    squares = cut(image, STRIDE * np.stack([columns, rows], axis=1))
    with torch.no_grad():
        patches = network.of_patches(torch.from_numpy(squares))
    return expect_same(found[:, rows, columns].T.numpy(), patches.numpy(), "patches and whole images")


def export(trainer: Trainer, task: Heatmaps) -> Path:
    """Writes the best weights as RUN/model; raises `WrongExport` unless ONNX Runtime agrees with PyTorch about whole
    images, and whole images with their patches."""
    recipe = task.recipe
    folder = begin_folder(trainer)
    network = trainer.average
    assert isinstance(network, OnImages)
    samples, _ = spread(task.sources, "validation", GOLDEN)
    images = np.stack([image_of(sample, recipe) for sample in samples])
    write_heatmap(network, torch.from_numpy(images[:2]), folder / "model.onnx")

    with torch.no_grad():
        found = network(torch.from_numpy(images))
    of_patches = max(cells_of_patches(network, image, each) for image, each in zip(images, found))
    session = session_of(folder / "model.onnx")
    theirs = np.concatenate([session.run(["heatmap"], {"image": image[None]})[0] for image in images])
    difference = expect_same(theirs, found.numpy(), "ONNX Runtime and PyTorch")
    np.savez_compressed(folder / "golden.npz", image=images, heatmap=rounded(found.numpy()))

    facts: dict[str, Any] = {
        "format": FORMAT,
        "network": recipe.network,
        "channels": list(PIXELS[recipe.pixels]),
        "types": task.types,
        "points": ["palm", "f0", "f1", "f2"],
        "stride": STRIDE,
        "first_pixel": SIDE // 2,
        "field": FIELD,
        **facts_of_training(trainer),
        "scores": task.intervals(network, torch.device("cpu")),
    }
    card = template_of("heatmap_card.md").format(
        **{name: facts[name] for name in ("network", "stride", "first_pixel", "field", "steps", "seed")},
        name=recipe.name,
        parameters=parameters_of(network),
        channels=", ".join(PIXELS[recipe.pixels]),
        types=", ".join(str(kind) for kind in task.types),
        outputs=4 * len(task.types),
        targets="every number of the labels" if recipe.targets == "all" else "numbers that trials determine",
        points="all points" if recipe.points == "all" else "points that nothing in the image hides",
        batch=recipe.training.batch,
        scores=rows_of_scores(facts["scores"]),
        difference=difference,
        of_patches=of_patches,
        data=sources_of_data(trainer),
        objects=sources_of_objects(trainer),
    )
    return finish_folder(trainer, folder, facts, card)
