"""From a training to a model folder: what every kind of model has in it."""

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

from .. import __version__
from .loop import SPLIT_NAMES, Trainer

matplotlib.use("Agg")
from matplotlib import pyplot  # noqa: E402

OPSET = 18
TOLERANCE = 1e-4
"""Largest difference between PyTorch and ONNX Runtime."""
GOLDEN = 4
GOLDEN_STEP = 2.0**-17
"""Answers are rounded to multiples, a twelfth of the tolerance of readers: they pack to a quarter."""


class WrongExport(RuntimeError):
    """The exported network does not compute what the trained one does."""


def write_onnx(
    network: nn.Module, examples: tuple[torch.Tensor, ...], shapes: Any, names: tuple[list[str], list[str]], path: Path
) -> None:
    """The network as ONNX, weights inside. `shapes` are the dynamic ones of its inputs, as `torch.export` requires them;
    `names` those of inputs and outputs."""
    logging.getLogger("torch.onnx").setLevel(logging.ERROR)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        settings: dict[str, Any] = {"dynamo": True, "opset_version": OPSET, "external_data": False, "verbose": False}
        settings |= {"input_names": names[0], "output_names": names[1]}
        program = torch.onnx.export(network, examples, dynamic_shapes=shapes, **settings)
    assert program is not None
    model = program.model_proto
    # The origin of each node in the trainer's source is irrelevant, and differs between machines.
    for node in model.graph.node:
        del node.metadata_props[:]
        node.doc_string = ""
    for value in (*model.graph.value_info, *model.graph.input, *model.graph.output, *model.graph.initializer):
        del value.metadata_props[:]
    del model.metadata_props[:], model.graph.metadata_props[:]
    path.write_bytes(model.SerializeToString(deterministic=True))
    onnx.checker.check_model(path, full_check=True)


def session_of(path: Path) -> onnxruntime.InferenceSession:
    """ONNX Runtime on one thread."""
    settings = onnxruntime.SessionOptions()
    settings.intra_op_num_threads = 1
    return onnxruntime.InferenceSession(path, settings, providers=["CPUExecutionProvider"])


def expect_same(theirs: npt.NDArray[np.float32], ours: npt.NDArray[np.float32], what: str) -> float:
    """The largest difference; raises `WrongExport` when it is too large."""
    difference = float(np.abs(theirs - ours).max())
    if not difference <= TOLERANCE:
        raise WrongExport(f"{what} differ by {difference:.2e} on {len(ours)} samples")
    return difference


def rounded(values: npt.NDArray[np.float32]) -> npt.NDArray[np.float32]:
    """Answers as `golden.npz` has them."""
    return (np.round(values / GOLDEN_STEP) * GOLDEN_STEP).astype(np.float32)


def draw_curves(trainer: Trainer) -> None:
    """`curves.svg` and `curves.png`: the loss, and the score of each split, by step."""
    run, task = trainer.run, trainer.task
    lines = [json.loads(line) for line in (run / "log.jsonl").read_text(encoding="utf-8").splitlines()]
    steps = [line["step"] for line in lines]
    matplotlib.rcParams["svg.hashsalt"] = "graspmill"
    figure, (left, right) = pyplot.subplots(1, 2, figsize=(9, 3.5), layout="constrained")
    left.plot(steps, [line["loss"] for line in lines], marker=".")
    left.set(xlabel="step", ylabel=task.labels[0], ylim=(0, None))
    for split, name in SPLIT_NAMES.items():
        if split in lines[-1][task.measure]:
            right.plot(steps, [line[task.measure][split]["all"] for line in lines], marker=".", label=name)
    right.set(xlabel="step", ylabel=task.labels[1], ylim=(0, 1) if task.rises else (0, None))
    right.legend()
    figure.savefig(run / "curves.svg", metadata={"Date": None})
    figure.savefig(run / "curves.png", dpi=120, metadata={"Software": None})
    pyplot.close(figure)


def rows_of_scores(scores: dict[str, dict[str, dict[str, Any]]]) -> str:
    """Rows of a card's table: a line per split and stratum."""
    return "\n".join(
        f"| {SPLIT_NAMES[split]} | {stratum} | {found['mean']:.3f} | {found['low']:.3f} to {found['high']:.3f} "
        f"| {found['objects']} | {found['samples']} |"
        for split, strata in scores.items()
        for stratum, found in strata.items()
        if found["objects"]
    )


def sources_of_objects(trainer: Trainer) -> str:
    """A line per licence: how many objects of training have it, and whom to cite."""
    rows: dict[tuple[str, str], set[str]] = {}
    for source in trainer.task.sources:
        for row in source.splits["training"].folder.objects():
            if source.split_of[row["object"]] == "training":
                terms = (row.get("licence") or "no licence stated", row.get("citation") or "")
                rows.setdefault(terms, set()).add(row["object"])
    return "\n".join(
        f"- {len(objects)} objects: {licence}" + (f"; {citation}" if citation else "")
        for (licence, citation), objects in sorted(rows.items())
    )


def sources_of_data(trainer: Trainer) -> str:
    """A line per dataset: the digests that name it."""
    return "\n".join(f"- root `{source.root}`, job `{source.job}`" for source in trainer.task.sources)


def facts_of_training(trainer: Trainer) -> dict[str, Any]:
    """Seed, steps, data, split and versions, as `model.json` has them."""
    sources = trainer.task.sources
    split_rows = sorted({item for source in sources for item in source.split_of.items()})
    versions = {
        "graspmill": __version__,
        "torch": str(torch.__version__),
        "onnx": onnx.__version__,
        "onnxscript": onnxscript.__version__,
        "numpy": np.__version__,
    }
    machine = {"machine": platform.machine(), "level": torch.backends.cpu.get_cpu_capability()} | trainer.setting
    return {
        "seed": trainer.recipe.seed,
        "steps": trainer.step,
        "data": [{"root": source.root, "job": source.job} for source in sources],
        "split": {"sha256": digest(json.dumps(split_rows).encode()), "objects": len(split_rows)},
        "versions": versions | machine,
    }


def digest(data: bytes) -> str:
    return hashlib.sha256(data).hexdigest()


def template_of(name: str) -> str:
    return (Path(__file__).parent / name).read_text(encoding="utf-8")


def begin_folder(trainer: Trainer) -> Path:
    """The best weights in place of the last ones, the curves, and an empty folder for the model."""
    trainer.load(trainer.run / "checkpoints" / "best.pt")
    trainer.average.cpu().to(memory_format=torch.contiguous_format).eval()
    torch.use_deterministic_algorithms(True)
    folder = trainer.run / ".model.tmp"
    shutil.rmtree(folder, ignore_errors=True)
    folder.mkdir()
    draw_curves(trainer)
    return folder


def finish_folder(trainer: Trainer, folder: Path, facts: dict[str, Any], card: str) -> Path:
    """Adds recipe, curves, card and `model.json` with the digests of all, and puts the folder where it belongs."""
    run = trainer.run
    for name in ("recipe.toml", "curves.svg", "curves.png"):
        shutil.copyfile(run / name, folder / name)
    (folder / "card.md").write_text(card, encoding="utf-8")
    facts["files"] = {path.name: digest(path.read_bytes()) for path in sorted(folder.iterdir())}
    (folder / "model.json").write_text(json.dumps(facts, indent=2) + "\n", encoding="utf-8")
    shutil.rmtree(run / "model", ignore_errors=True)
    os.replace(folder, run / "model")
    return run / "model"
