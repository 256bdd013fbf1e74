"""The model folder of a network that completes shapes."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
import torch
from torch import nn
from torch.nn.functional import max_pool3d

from .completing import Completion, joined, overlaps, predict
from .data import RESOLUTION, Held
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
from .loop import Trainer
from .networks import parameters_of
from .recipe import Recipe
from .sources import score

FORMAT = "graspmill model 1"
PLACEMENT = {"fill": 0.8, "anchor": [0.5, 0.5, 0.45]}
"""Share of the grid that the longest side of the seen points' box fills, and the position of its centre in the grid."""
SAMPLES_COMPARED = 64
LEVELS = np.linspace(0.2, 0.8, 13)


class Exported(nn.Module):
    """The network with named inputs, and probabilities as named outputs."""

    def __init__(self, network: nn.Module, channels: int, outputs: int) -> None:
        super().__init__()
        self.network, self.channels, self.outputs = network, channels, outputs

    def forward(self, *grids: torch.Tensor) -> tuple[torch.Tensor, ...]:
        found = torch.sigmoid(self.network(joined(grids, self.channels)))
        return tuple(found[:, index : index + 1] for index in range(self.outputs))


def write_completion(network: nn.Module, recipe: Recipe, path: Path) -> None:
    """The network as ONNX, for any count of samples."""
    exported = Exported(network, recipe.channels, len(recipe.outputs)).eval()
    examples = tuple(torch.zeros(2, 1, *(RESOLUTION,) * 3) for _ in recipe.inputs)
    batch = torch.export.Dim("batch", min=1)
    shapes = (tuple({0: batch} for _ in examples),)
    write_onnx(exported, examples, shapes, (list(recipe.inputs), list(recipe.outputs)), path)


def answers(path: Path, arrays: dict[str, npt.NDArray[Any]], recipe: Recipe) -> npt.NDArray[np.float32]:
    """Answers of ONNX Runtime to samples, (samples, outputs, n, n, n)."""
    session = session_of(path)
    found = []
    for row in range(len(arrays["partial"])):
        feed = {name: arrays[name][row][None, None].astype(np.float32) for name in recipe.inputs}
        found.append(np.concatenate(session.run(list(recipe.outputs), feed), axis=1))
    return np.concatenate(found)


def normalised(coverage: torch.Tensor) -> torch.Tensor:
    """Share of each cell that is solid over the largest among its 27 neighbours: thin walls are kept, and nothing grows."""
    largest = max_pool3d(coverage[:, None], 3, stride=1, padding=1)[:, 0]
    return torch.where(largest > 0.05, coverage / largest.clamp(min=1e-6), torch.zeros(()))


def best_level(found: torch.Tensor, truth: torch.Tensor, held: Held) -> float:
    """The level at which cells overlap the true ones most, by mean over objects."""
    means = [score(overlaps(found > level, truth), held.objects)["mean"] for level in LEVELS]
    return round(float(LEVELS[int(np.argmax(means))]), 2)


def thresholds_of(found: torch.Tensor, held: Held, recipe: Recipe) -> dict[str, float]:
    """Levels of each output, chosen on validation objects; that of coverage is of normalised coverage."""
    chosen = {"occupancy": 0.5, "coverage": 0.5}
    for index, name in enumerate(recipe.outputs):
        cells, truth = found[:, index], torch.from_numpy(held.arrays[name])
        if name == "coverage":
            occupied = found[:, recipe.outputs.index("occupancy")] > 0.3 if "occupancy" in recipe.outputs else 1
            cells, truth = normalised(cells) * occupied, normalised(truth.float() / 255) > 0.5
        chosen[name] = best_level(cells, truth, held)
    return chosen


def card(facts: dict[str, Any], trainer: Trainer, recipe: Recipe, difference: float) -> str:
    """The card of a model, as Markdown."""
    return template_of("card.md").format(
        **{name: facts[name] for name in ("network", "resolution", "steps", "seed")},
        **facts["thresholds"],
        name=recipe.name,
        parameters=parameters_of(trainer.average),
        inputs=", ".join(recipe.inputs),
        outputs=", ".join(recipe.outputs),
        batch=recipe.training.batch,
        scores=rows_of_scores(facts["scores"]),
        difference=difference,
        data=sources_of_data(trainer),
        objects=sources_of_objects(trainer),
    )


def export(trainer: Trainer, task: Completion) -> Path:
    """Writes the best weights as RUN/model; raises `WrongExport` unless ONNX Runtime agrees with PyTorch."""
    recipe, cpu = task.recipe, torch.device("cpu")
    folder = begin_folder(trainer)
    network = trainer.average
    write_completion(network, recipe, folder / "model.onnx")

    found = {split: predict(network, held.arrays, recipe, cpu) for split, held in task.held.items()}
    held = task.held["validation"]
    spread = np.linspace(0, len(held.objects) - 1, SAMPLES_COMPARED).round().astype(int)
    compared = {name: array[spread] for name, array in held.arrays.items()}
    theirs, ours = answers(folder / "model.onnx", compared, recipe), found["validation"][spread].numpy()
    difference = expect_same(theirs, ours, "ONNX Runtime and PyTorch")
    chosen = np.linspace(0, len(spread) - 1, GOLDEN).round().astype(int)
    golden = {name: compared[name][chosen][:, None].astype(np.float32) for name in recipe.inputs}
    golden |= {name: rounded(ours[chosen][:, index : index + 1]) for index, name in enumerate(recipe.outputs)}
    np.savez_compressed(folder / "golden.npz", **golden)  # type: ignore[arg-type]

    scores = {}
    for split, each in task.held.items():
        truth = torch.from_numpy(each.arrays[recipe.outputs[0]] > 0)
        overlap = overlaps(found[split][:, 0] > 0.5, truth)
        scores[split] = {name: score(overlap[rows], each.objects[rows]) for name, rows in each.strata().items()}
    facts: dict[str, Any] = {
        "format": FORMAT,
        "network": recipe.network,
        "inputs": list(recipe.inputs),
        "outputs": list(recipe.outputs),
        "resolution": RESOLUTION,
        "placement": PLACEMENT,
        "thresholds": thresholds_of(found["validation"], held, recipe),
        **facts_of_training(trainer),
        "scores": scores,
    }
    return finish_folder(trainer, folder, facts, card(facts, trainer, recipe, difference))
