"""From a training to a model folder: network, facts, card, and samples with their answers."""

from __future__ import annotations

import hashlib
import json
import logging
import os
import platform
import shutil
import warnings
from pathlib import Path
from typing import Any

import matplotlib
import numpy as np
import numpy.typing as npt
import onnx
import onnxruntime
import onnxscript
import torch
from torch import nn
from torch.nn.functional import max_pool3d

from .. import __version__
from .data import RESOLUTION, Held, score
from .loop import SPLITS, Trainer, joined, overlaps, predict
from .networks import parameters_of
from .recipe import Recipe

matplotlib.use("Agg")
from matplotlib import pyplot  # noqa: E402

FORMAT = "graspmill model 1"
OPSET = 18
PLACEMENT = {"fill": 0.8, "anchor": [0.5, 0.5, 0.45]}
"""Share of the grid that the longest side of the seen points' box fills, and where in the grid its centre lies."""
SAMPLES_COMPARED, TOLERANCE = 64, 1e-4
GOLDEN = 4
GOLDEN_STEP = 2.0**-17
"""Answers are rounded to multiples, a twelfth of the tolerance of readers: they pack to a quarter."""
LEVELS = np.linspace(0.2, 0.8, 13)


class WrongExport(RuntimeError):
    """The exported network does not compute what the trained one does."""


class Exported(nn.Module):
    """The network with named inputs, and probabilities as named outputs."""

    def __init__(self, network: nn.Module, channels: int, outputs: int) -> None:
        super().__init__()
        self.network, self.channels, self.outputs = network, channels, outputs

    def forward(self, *grids: torch.Tensor) -> tuple[torch.Tensor, ...]:
        found = torch.sigmoid(self.network(joined(grids, self.channels)))
        return tuple(found[:, index : index + 1] for index in range(self.outputs))


def write_onnx(network: nn.Module, recipe: Recipe, path: Path) -> None:
    """The network as ONNX, weights inside, for any count of samples."""
    exported = Exported(network, recipe.channels, len(recipe.outputs)).eval()
    examples = tuple(torch.zeros(2, 1, *(RESOLUTION,) * 3) for _ in recipe.inputs)
    batch = torch.export.Dim("batch", min=1)
    names = {"input_names": list(recipe.inputs), "output_names": list(recipe.outputs)}
    shapes = (tuple({0: batch} for _ in examples),)
    logging.getLogger("torch.onnx").setLevel(logging.ERROR)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        settings: dict[str, Any] = {"dynamo": True, "opset_version": OPSET, "external_data": False, "verbose": False}
        program = torch.onnx.export(exported, examples, dynamic_shapes=shapes, **names, **settings)
    assert program is not None
    model = program.model_proto
    # Where each node came from in the trainer's source is nobody's business, and differs from machine to machine.
    for node in model.graph.node:
        del node.metadata_props[:]
        node.doc_string = ""
    for value in (*model.graph.value_info, *model.graph.input, *model.graph.output, *model.graph.initializer):
        del value.metadata_props[:]
    del model.metadata_props[:], model.graph.metadata_props[:]
    path.write_bytes(model.SerializeToString(deterministic=True))


def answers(path: Path, arrays: dict[str, npt.NDArray[Any]], recipe: Recipe) -> npt.NDArray[np.float32]:
    """Answers of ONNX Runtime to samples, (samples, outputs, n, n, n)."""
    settings = onnxruntime.SessionOptions()
    settings.intra_op_num_threads = 1
    session = onnxruntime.InferenceSession(path, settings, providers=["CPUExecutionProvider"])
    found = []
    for row in range(len(arrays["partial"])):
        feed = {name: arrays[name][row][None, None].astype(np.float32) for name in recipe.inputs}
        found.append(np.concatenate(session.run(list(recipe.outputs), feed), axis=1))
    return np.concatenate(found)


def normalised(coverage: torch.Tensor) -> torch.Tensor:
    """Share of each cell that is solid over the largest among its 27 neighbours: thin walls stay, and nothing grows."""
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


def draw_curves(run: Path) -> None:
    """`curves.svg` and `curves.png`: the loss, and the overlap of each split, by step."""
    lines = [json.loads(line) for line in (run / "log.jsonl").read_text(encoding="utf-8").splitlines()]
    steps = [line["step"] for line in lines]
    matplotlib.rcParams["svg.hashsalt"] = "graspmill"
    figure, (left, right) = pyplot.subplots(1, 2, figsize=(9, 3.5), layout="constrained")
    left.plot(steps, [line["loss"] for line in lines], marker=".")
    left.set(xlabel="step", ylabel="cross-entropy per output", ylim=(0, None))
    for split, name in SPLITS.items():
        if split in lines[-1]["iou"]:
            right.plot(steps, [line["iou"][split]["all"] for line in lines], marker=".", label=name)
    right.set(xlabel="step", ylabel="IoU of occupied cells", ylim=(0, 1))
    right.legend()
    figure.savefig(run / "curves.svg", metadata={"Date": None})
    figure.savefig(run / "curves.png", dpi=120, metadata={"Software": None})
    pyplot.close(figure)


def sources_of_objects(trainer: Trainer) -> list[str]:
    """A line per licence: how many objects of training have it, and whom to cite."""
    rows: dict[tuple[str, str], set[str]] = {}
    for source in trainer.sources:
        for row in source.splits["training"].folder.objects():
            if source.split_of[row["object"]] == "training":
                terms = (row.get("licence") or "no licence stated", row.get("citation") or "")
                rows.setdefault(terms, set()).add(row["object"])
    return [
        f"- {len(objects)} objects: {licence}" + (f"; {citation}" if citation else "")
        for (licence, citation), objects in sorted(rows.items())
    ]


def card(facts: dict[str, Any], trainer: Trainer, difference: float) -> str:
    """The card of a model, as Markdown."""
    recipe = trainer.recipe
    rows = [
        f"| {SPLITS[split]} | {stratum} | {found['mean']:.3f} | {found['low']:.3f} to {found['high']:.3f} "
        f"| {found['objects']} | {found['samples']} |"
        for split, strata in facts["scores"].items()
        for stratum, found in strata.items()
        if found["objects"]
    ]
    template = (Path(__file__).parent / "card.md").read_text(encoding="utf-8")
    return template.format(
        **{name: facts[name] for name in ("network", "resolution", "steps", "seed")},
        **facts["thresholds"],
        name=recipe.name,
        parameters=parameters_of(trainer.average),
        inputs=", ".join(recipe.inputs),
        outputs=", ".join(recipe.outputs),
        batch=recipe.training.batch,
        scores="\n".join(rows),
        difference=difference,
        data="\n".join(f"- root `{source.root}`, job `{source.job}`" for source in trainer.sources),
        objects="\n".join(sources_of_objects(trainer)),
    )


def digest(data: bytes) -> str:
    return hashlib.sha256(data).hexdigest()


def export(trainer: Trainer) -> Path:
    """Writes the best weights as RUN/model; raises `WrongExport` unless ONNX Runtime agrees with PyTorch."""
    recipe, run = trainer.recipe, trainer.run
    trainer.load(run / "checkpoints" / "best.pt")
    network = trainer.average.cpu().eval()
    cpu = torch.device("cpu")
    torch.use_deterministic_algorithms(True)
    folder = run / ".model.tmp"
    shutil.rmtree(folder, ignore_errors=True)
    folder.mkdir()
    draw_curves(run)
    write_onnx(network, recipe, folder / "model.onnx")
    onnx.checker.check_model(folder / "model.onnx", full_check=True)

    found = {split: predict(network, held.arrays, recipe, cpu) for split, held in trainer.held.items()}
    held = trainer.held["validation"]
    spread = np.linspace(0, len(held.objects) - 1, SAMPLES_COMPARED).round().astype(int)
    compared = {name: array[spread] for name, array in held.arrays.items()}
    difference = float(
        np.abs(answers(folder / "model.onnx", compared, recipe) - found["validation"][spread].numpy()).max()
    )
    if not difference <= TOLERANCE:
        raise WrongExport(f"ONNX Runtime and PyTorch differ by {difference:.2e} on {len(spread)} samples")
    chosen = np.linspace(0, len(spread) - 1, GOLDEN).round().astype(int)
    golden = {name: compared[name][chosen][:, None].astype(np.float32) for name in recipe.inputs}
    for index, name in enumerate(recipe.outputs):
        probability = found["validation"][spread[chosen]][:, index : index + 1].numpy()
        golden[name] = (np.round(probability / GOLDEN_STEP) * GOLDEN_STEP).astype(np.float32)
    np.savez_compressed(folder / "golden.npz", **golden)  # type: ignore[arg-type]

    scores = {}
    for split, each in trainer.held.items():
        truth = torch.from_numpy(each.arrays[recipe.outputs[0]] > 0)
        overlap = overlaps(found[split][:, 0] > 0.5, truth)
        scores[split] = {name: score(overlap[rows], each.objects[rows]) for name, rows in each.strata().items()}
    split_rows = sorted({item for source in trainer.sources for item in source.split_of.items()})
    versions = {
        "graspmill": __version__,
        "torch": str(torch.__version__),
        "onnx": onnx.__version__,
        "onnxscript": onnxscript.__version__,
        "numpy": np.__version__,
    }
    machine = {"machine": platform.machine(), "level": torch.backends.cpu.get_cpu_capability()} | trainer.setting
    facts: dict[str, Any] = {
        "format": FORMAT,
        "network": recipe.network,
        "inputs": list(recipe.inputs),
        "outputs": list(recipe.outputs),
        "resolution": RESOLUTION,
        "placement": PLACEMENT,
        "thresholds": thresholds_of(found["validation"], held, recipe),
        "seed": recipe.seed,
        "steps": trainer.step,
        "data": [{"root": source.root, "job": source.job} for source in trainer.sources],
        "split": {"sha256": digest(json.dumps(split_rows).encode()), "objects": len(split_rows)},
        "versions": versions | machine,
        "scores": scores,
    }
    for name in ("recipe.toml", "curves.svg", "curves.png"):
        shutil.copyfile(run / name, folder / name)
    (folder / "card.md").write_text(card(facts, trainer, difference), encoding="utf-8")
    facts["files"] = {path.name: digest(path.read_bytes()) for path in sorted(folder.iterdir())}
    (folder / "model.json").write_text(json.dumps(facts, indent=2) + "\n", encoding="utf-8")
    shutil.rmtree(run / "model", ignore_errors=True)
    os.replace(folder, run / "model")
    return run / "model"
