"""The training itself: steps, tries, checkpoints. Interrupted and resumed, it ends with the same weights (on a CPU)."""

from __future__ import annotations

import json
import math
import os
import signal
import sys
import time
from copy import deepcopy
from pathlib import Path
from typing import Any

import numpy as np
import torch
from torch import nn
from torch.nn.functional import binary_cross_entropy_with_logits

from .data import Arrays, Held, Source, batches_of, score
from .networks import network_of
from .recipe import BadRecipe, Recipe, Training

SPLITS = {"training": "training views", "holdout": "holdout views", "validation": "validation objects"}
CHECKPOINTS_KEPT = 2
SECONDS_OF_SILENCE = 20.0
WARM_UP = 0.3
"""Share of the steps in which the rate of one cycle rises, from a 25th of its peak."""


class Interrupted(Exception):
    """A signal asked for the end; what was done is in a checkpoint."""


def rate_at(step: int, settings: Training) -> float:
    """Learning rate of a step; one cycle after Smith and Topin 2018, its parts cosines."""
    if settings.schedule == "constant":
        return settings.rate
    place, rise = step / settings.steps, WARM_UP
    low, share = (1 / 25, place / rise) if place < rise else (1e-4, (1 - place) / (1 - rise))
    return settings.rate * (low + (1 - low) * (1 - math.cos(math.pi * share)) / 2)


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


def rows_of(arrays: Arrays, first: int, end: int) -> Arrays:
    return {name: array[first:end] for name, array in arrays.items()}


def predict(network: nn.Module, arrays: Arrays, recipe: Recipe, device: torch.device) -> torch.Tensor:
    """Probabilities, (samples, outputs, n, n, n)."""
    network.eval()
    found = []
    with torch.no_grad():
        for first in range(0, len(arrays["partial"]), 32):
            part = inputs_of(rows_of(arrays, first, first + 32), recipe, device)
            found.append(torch.sigmoid(network(joined(part, recipe.channels)).float()).cpu())
    return torch.cat(found)


def overlaps(cells: torch.Tensor, truth: torch.Tensor) -> np.ndarray[Any, np.dtype[np.float64]]:
    """Jaccard overlap of each sample, 1 where both are empty."""
    both, either = (cells & truth).flatten(1).sum(1), (cells | truth).flatten(1).sum(1)
    return torch.where(either > 0, both / either.clamp(min=1), torch.ones(())).double().numpy()


class Trainer:
    """A training in a folder: `log.jsonl`, `checkpoints/`."""

    def __init__(self, recipe: Recipe, sources: list[Source], run: Path, device: str, threads: int) -> None:
        self.recipe, self.sources, self.run, self.device = recipe, sources, run, torch.device(device)
        torch.set_num_threads(threads)
        torch.use_deterministic_algorithms(self.device.type == "cpu")
        torch.manual_seed(recipe.seed)
        self.network = network_of(recipe.network, recipe.channels, len(recipe.outputs), recipe.sizes).to(self.device)
        self.average = deepcopy(self.network)
        self.optimiser = torch.optim.Adam(self.network.parameters(), lr=recipe.training.rate, fused=True)
        self.step, self.loss, self.best = 0, [0.0, 0.0], -1.0
        self.setting = {"torch": str(torch.__version__), "threads": threads, "device": device}
        tried = {split: Held.of(sources, split, recipe) for split in SPLITS}
        self.held = {split: held for split, held in tried.items() if held is not None}
        self.asked = False

    def state(self) -> dict[str, Any]:
        parts = {"network": self.network, "average": self.average, "optimiser": self.optimiser}
        state = {name: part.state_dict() for name, part in parts.items()}  # type: ignore[attr-defined]
        numbers = {"step": self.step, "loss": self.loss, "best": self.best, "random": torch.get_rng_state()}
        return state | numbers | {"setting": self.setting}

    def save(self, name: str) -> None:
        """Written whole or not at all: a temporary file, on the disk, then renamed."""
        folder = self.run / "checkpoints"
        folder.mkdir(parents=True, exist_ok=True)
        with (folder / f".{name}.tmp").open("wb") as file:
            torch.save(self.state(), file)
            file.flush()
            os.fsync(file.fileno())
        os.replace(file.name, folder / name)

    def checkpoint(self) -> None:
        self.save(f"step-{self.step:07}.pt")
        for old in sorted((self.run / "checkpoints").glob("step-*.pt"))[:-CHECKPOINTS_KEPT]:
            old.unlink()

    def resume(self, threads: int | None) -> None:
        """Goes back to the newest checkpoint, and the log with it; to the beginning where there is none. Without a
        count of threads, goes on with as many as before: others give other last bits."""
        for unfinished in (self.run / "checkpoints").glob(".*.tmp"):
            unfinished.unlink()
        found = sorted((self.run / "checkpoints").glob("step-*.pt"))
        log = self.run / "log.jsonl"
        lines = log.read_text(encoding="utf-8").splitlines(keepends=True) if log.exists() else []
        if found:
            before = self.load(found[-1])["threads"]
            if threads is None:
                torch.set_num_threads(before)
                self.setting["threads"] = before
            elif threads != before:
                print(f"begun with {before} threads: the last bits of the weights will differ", file=sys.stderr)
        log.write_text("".join(line for line in lines if line.endswith("\n") and json.loads(line)["step"] <= self.step))

    def load(self, path: Path) -> dict[str, Any]:
        """Takes over a checkpoint; returns the setting that it was made in."""
        state = torch.load(path, map_location=self.device, weights_only=True)
        for name in ("torch", "device"):
            if state["setting"][name] != self.setting[name]:
                was, now = state["setting"][name], self.setting[name]
                raise BadRecipe(f"{path}: begun with {name} {was}, resumed with {now}; the weights would differ")
        self.network.load_state_dict(state["network"])
        self.average.load_state_dict(state["average"])
        self.optimiser.load_state_dict(state["optimiser"])
        torch.set_rng_state(state["random"].cpu())
        self.step, self.loss, self.best = state["step"], state["loss"], state["best"]
        return state["setting"]  # type: ignore[no-any-return]

    def learn(self, arrays: Arrays) -> None:
        """A step: binary cross-entropy of each output, with equal weights."""
        settings = self.recipe.training
        self.network.train()
        with torch.autocast("cuda", torch.bfloat16, enabled=self.device.type == "cuda"):
            logits = self.network(joined(inputs_of(arrays, self.recipe, self.device), self.recipe.channels))
        loss = binary_cross_entropy_with_logits(logits.float(), targets_of(arrays, self.recipe, self.device))
        self.optimiser.zero_grad()
        (loss * len(self.recipe.outputs)).backward()
        for group in self.optimiser.param_groups:
            group["lr"] = rate_at(self.step, settings)
        self.optimiser.step()
        self.step += 1
        kept = min(settings.average, self.step / (self.step + 10))
        with torch.no_grad():
            state = self.network.state_dict()
            for name, mean in self.average.state_dict().items():
                if mean.is_floating_point():
                    mean.lerp_(state[name], 1 - kept)
                else:
                    mean.copy_(state[name])
        self.loss = [self.loss[0] + loss.item(), self.loss[1] + 1]

    def scores(self) -> dict[str, dict[str, float]]:
        """Overlap of occupied cells at 0.5 by split and stratum."""
        found: dict[str, dict[str, float]] = {}
        for split, held in self.held.items():
            cells = predict(self.average, held.arrays, self.recipe, self.device)[:, 0] > 0.5
            each = overlaps(cells, torch.from_numpy(held.arrays[self.recipe.outputs[0]] > 0))
            means = {name: score(each[rows], held.objects[rows]) for name, rows in held.strata().items()}
            found[split] = {name: mean["mean"] for name, mean in means.items() if "mean" in mean}
        return found

    def progress(self, rate: float) -> str:
        steps = self.recipe.training.steps
        left = (steps - self.step) * self.recipe.training.batch / max(rate, 1e-9)
        return f"step {self.step} of {steps}: {rate:.0f} samples/s, {left:.0f} s left"

    def try_out(self, rate: float) -> None:
        """Scores the average weights, writes a line of the log and a checkpoint."""
        found = self.scores()
        line = {
            "step": self.step,
            "loss": self.loss[0] / max(self.loss[1], 1),
            "rate": rate_at(self.step, self.recipe.training),
        }
        line |= {"samples_per_second": round(rate, 1), "iou": found}
        with (self.run / "log.jsonl").open("a", encoding="utf-8") as log:
            log.write(json.dumps(line) + "\n")
        self.loss = [0.0, 0.0]
        if found["validation"]["all"] > self.best:
            self.best = found["validation"]["all"]
            self.save("best.pt")
        self.checkpoint()
        said = ", ".join(f"{SPLITS[split]} {means['all']:.3f}" for split, means in found.items())
        print(f"{self.progress(rate)}; loss {line['loss']:.4f}, IoU of {said}", file=sys.stderr, flush=True)

    def train(self) -> None:
        """To the last step; raises `Interrupted` after SIGTERM or SIGINT, with a checkpoint of that step."""
        before = {number: signal.signal(number, self.ask) for number in (signal.SIGTERM, signal.SIGINT)}
        began, from_step = time.perf_counter(), self.step
        said = began
        batches = batches_of(self.sources, self.recipe, self.step)
        try:
            while self.step < self.recipe.training.steps:
                self.learn(next(batches))
                seconds = time.perf_counter() - began
                rate = (self.step - from_step) * self.recipe.training.batch / seconds
                if self.step % self.recipe.validation.every == 0 or self.step == self.recipe.training.steps:
                    self.try_out(rate)
                    # Trying is no training.
                    began += time.perf_counter() - began - seconds
                    said = time.perf_counter()
                elif time.perf_counter() - said > SECONDS_OF_SILENCE:
                    said = time.perf_counter()
                    print(self.progress(rate), file=sys.stderr, flush=True)
                if self.asked:
                    self.checkpoint()
                    raise Interrupted
        finally:
            for number, handler in before.items():
                signal.signal(number, handler)

    def ask(self, *_: Any) -> None:
        self.asked = True
