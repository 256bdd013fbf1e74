"""Heatmaps as a task of the trainer: patches in, the squared error of labels, which is the score, too."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np
import numpy.typing as npt
import torch
from torch import nn

from .heatmap_networks import OnImages, heatmap_network_of
from .patches import Held, Source, batches_of, types_of
from .recipe import HeatmapRecipe
from .sources import SPLITS, Arrays, score
from .strict import BadRecipe


def answers_to_patches(network: OnImages, arrays: Arrays, device: torch.device) -> npt.NDArray[np.float32]:
    """Numbers of each patch, (patches, 4 types)."""
    network.eval()
    found = []
    with torch.no_grad():
        for squares in torch.from_numpy(arrays["image"]).split(64):
            found.append(network.of_patches(squares.to(device)).float().cpu())
    return torch.cat(found).numpy()


class Heatmaps:
    """The task of a recipe that finds grasps in images."""

    measure, measured, rises = "error", "squared error", False
    labels = ("squared error and penalty", "squared error of labels")
    terms = 1
    memory_format = torch.contiguous_format

    def __init__(self, recipe: HeatmapRecipe, sources: Sequence[Source]) -> None:
        self.recipe, self.sources = recipe, sources
        self.types = types_of(sources)
        tried = {split: Held.of(sources, split, recipe) for split in SPLITS}
        self.held = {split: held for split, held in tried.items() if held is not None}
        for split in ("training", "validation"):
            if not self.held[split].arrays["mask"].any():
                problem = f"no number of the {split} samples is one to learn from"
                raise BadRecipe(f"{problem}: give more data, or change `targets` and `points`")

    def network(self) -> OnImages:
        return heatmap_network_of(self.recipe, len(self.types))

    def optimiser(self, network: nn.Module) -> torch.optim.Optimizer:
        settings = self.recipe.training
        if settings.optimiser == "sgd":
            return torch.optim.SGD(network.parameters(), lr=settings.rate)
        return torch.optim.Adam(network.parameters(), lr=settings.rate, fused=True)

    def batches(self, step: int) -> Iterator[Arrays]:
        return batches_of(self.sources, self.recipe, step)

    def answer(self, network: OnImages, arrays: Arrays, device: torch.device) -> torch.Tensor:
        """Numbers of a batch of patches."""
        squares, noise = (torch.from_numpy(arrays[name]).to(device) for name in ("image", "noise"))
        return network.of_patches(squares, noise)

    def loss(self, network: nn.Module, found: torch.Tensor, arrays: Arrays) -> torch.Tensor:
        """Mean squared error of the numbers that are learnt, and the penalty of the absolute weights."""
        labels, mask = (torch.from_numpy(arrays[name]).to(found.device) for name in ("labels", "mask"))
        error = ((found - labels) ** 2 * mask).sum() / mask.sum().clamp(min=1)
        if not self.recipe.training.l1:
            return error
        weights = (values for values in network.parameters() if values.dim() > 1)
        return error + self.recipe.training.l1 * torch.stack([values.abs().sum() for values in weights]).sum()

    def scores(self, network: nn.Module, device: torch.device) -> dict[str, dict[str, float]]:
        """Squared error by split and stratum."""
        found: dict[str, dict[str, float]] = {}
        for split, means in self.intervals(network, device).items():
            found[split] = {name: mean["mean"] for name, mean in means.items() if "mean" in mean}
        return found

    def intervals(self, network: nn.Module, device: torch.device) -> dict[str, dict[str, dict[str, float | int]]]:
        """Squared error by split and stratum with its interval over objects; also, as `constant`, that of all
        points by the mean labels of the training samples."""
        assert isinstance(network, OnImages)
        training = self.held["training"].arrays
        known = training["mask"].sum(axis=0).clip(min=1)
        constant = (training["labels"] * training["mask"]).sum(axis=0) / known
        found = {}
        for split, held in self.held.items():
            errors = held.errors(answers_to_patches(network, held.arrays, device))
            shape = held.arrays["labels"].shape
            errors["constant"] = held.errors(np.broadcast_to(constant, shape).astype(np.float32))["all"]
            found[split] = {name: score(values, objects) for name, (values, objects) in errors.items()}
        return found
