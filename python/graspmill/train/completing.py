"""Completion as a task of the trainer: grids in, the cross-entropy of occupancy and coverage, overlaps as scores."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np
import torch
from torch import nn
from torch.nn.functional import binary_cross_entropy_with_logits

from .data import Held, Source, batches_of
from .networks import network_of
from .recipe import Recipe
from .sources import SPLITS, Arrays, score


def inputs_of(arrays: Arrays, recipe: Recipe, device: torch.device) -> list[torch.Tensor]:
    """The model's inputs, each (samples, 1, n, n, n), float32."""
    return [torch.from_numpy(arrays[name]).to(device)[:, None].float() for name in recipe.inputs]


def joined(inputs: list[torch.Tensor] | tuple[torch.Tensor, ...], channels: int) -> torch.Tensor:
    """Input of the network itself: the inputs as channels, or all in one grid where it has a single channel."""
    if channels == len(inputs):
        return torch.cat(list(inputs), dim=1)
    partial, touch = inputs
    return 1 - (1 - partial - touch).relu()


def targets_of(arrays: Arrays, recipe: Recipe, device: torch.device) -> torch.Tensor:
    grids = [torch.from_numpy(arrays[name]).to(device)[:, None].float() for name in recipe.outputs]
    return torch.cat([grid / 255 if name == "coverage" else grid for name, grid in zip(recipe.outputs, grids)], dim=1)


def predict(network: nn.Module, arrays: Arrays, recipe: Recipe, device: torch.device) -> torch.Tensor:
    """Probabilities, (samples, outputs, n, n, n)."""
    network.eval()
    found = []
    with torch.no_grad():
        for first in range(0, len(arrays["partial"]), 32):
            rows = {name: array[first : first + 32] for name, array in arrays.items()}
            part = inputs_of(rows, recipe, device)
            found.append(torch.sigmoid(network(joined(part, recipe.channels)).float()).cpu())
    return torch.cat(found)


def overlaps(cells: torch.Tensor, truth: torch.Tensor) -> np.ndarray[Any, np.dtype[np.float64]]:
    """Jaccard overlap of each sample, 1 where both are empty."""
    both, either = (cells & truth).flatten(1).sum(1), (cells | truth).flatten(1).sum(1)
    return torch.where(either > 0, both / either.clamp(min=1), torch.ones(())).double().numpy()


class Completion:
    """The task of a recipe that completes shapes."""

    measure, measured, rises = "iou", "IoU", True
    labels = ("cross-entropy per output", "IoU of occupied cells")
    # A step of `unet` takes half the time on an H100 (24 ms for 51), one of `block` as long as before.
    memory_format = torch.channels_last_3d

    def __init__(self, recipe: Recipe, sources: Sequence[Source]) -> None:
        self.recipe, self.sources = recipe, sources
        self.terms = len(recipe.outputs)
        tried = {split: Held.of(sources, split, recipe) for split in SPLITS}
        self.held = {split: held for split, held in tried.items() if held is not None}

    def network(self) -> nn.Module:
        recipe = self.recipe
        return network_of(recipe.network, recipe.channels, len(recipe.outputs), recipe.sizes)

    def optimiser(self, network: nn.Module) -> torch.optim.Optimizer:
        return torch.optim.Adam(network.parameters(), lr=self.recipe.training.rate, fused=True)

    def batches(self, step: int) -> Iterator[Arrays]:
        return batches_of(self.sources, self.recipe, step)

    def answer(self, network: nn.Module, arrays: Arrays, device: torch.device) -> torch.Tensor:
        """Logits of a batch."""
        found: torch.Tensor = network(joined(inputs_of(arrays, self.recipe, device), self.recipe.channels))
        return found

    def loss(self, network: nn.Module, found: torch.Tensor, arrays: Arrays) -> torch.Tensor:
        """Binary cross-entropy, the mean of the outputs."""
        return binary_cross_entropy_with_logits(found, targets_of(arrays, self.recipe, found.device))

    def scores(self, network: nn.Module, device: torch.device) -> dict[str, dict[str, float]]:
        """Overlap of occupied cells at 0.5 by split and stratum."""
        found: dict[str, dict[str, float]] = {}
        for split, held in self.held.items():
            cells = predict(network, held.arrays, self.recipe, device)[:, 0] > 0.5
            each = overlaps(cells, torch.from_numpy(held.arrays[self.recipe.outputs[0]] > 0))
            means = {name: score(each[rows], held.objects[rows]) for name, rows in held.strata().items()}
            found[split] = {name: mean["mean"] for name, mean in means.items() if "mean" in mean}
        return found
