"""The training itself: steps, tries, checkpoints. Interrupted and resumed, it ends with the same weights (on a CPU)."""

from __future__ import annotations

import json
import math
import os
import signal
import sys
import time
from collections.abc import Iterator, Mapping, Sequence
from copy import deepcopy
from pathlib import Path
from typing import Any, Protocol

import torch
from torch import nn
from torch.optim.swa_utils import get_ema_multi_avg_fn

from .recipe import AnyRecipe, Training
from .sources import Arrays, Source
from .strict import BadRecipe

SPLIT_NAMES = {"training": "training views", "holdout": "holdout views", "validation": "validation objects"}
CHECKPOINTS_KEPT = 2
SECONDS_OF_SILENCE = 20.0
WARM_UP = 0.3
"""Share of the steps in which the rate of one cycle rises, from a 25th of its peak."""


class Interrupted(Exception):
    """A signal requested the end; the progress is in a checkpoint."""


def rate_at(step: int, settings: Training) -> float:
    """Learning rate of a step; one cycle after Smith and Topin 2018, its parts cosines."""
    if settings.schedule == "constant":
        return settings.rate
    place, rise = step / settings.steps, WARM_UP
    low, share = (1 / 25, place / rise) if place < rise else (1e-4, (1 - place) / (1 - rise))
    return settings.rate * (low + (1 - low) * (1 - math.cos(math.pi * share)) / 2)


class Task(Protocol):
    """A task: data, network and loss, and the score that measures how well it is learnt."""

    recipe: Any
    sources: Sequence[Source[Any]]
    held: Mapping[str, Any]
    """Samples of each split that the network is tried on."""
    measure: str
    """Name of the score in the log."""
    measured: str
    """Name of the score in messages."""
    rises: bool
    """Whether a higher score is better."""
    labels: tuple[str, str]
    """Names of loss and score in pictures."""
    terms: int
    """Equal terms that the loss is the mean of."""
    memory_format: torch.memory_format
    """Layout of the weights in the memory of a GPU."""

    def network(self) -> nn.Module:
        """The network with its first weights."""

    def optimiser(self, network: nn.Module) -> torch.optim.Optimizer:
        """The optimiser of these weights, at the recipe's rate."""

    def batches(self, step: int) -> Iterator[Arrays]:
        """Batches from this step on, endless."""

    def answer(self, network: Any, arrays: Arrays, device: torch.device) -> torch.Tensor:
        """The network's answer to a batch."""

    def loss(self, network: nn.Module, found: torch.Tensor, arrays: Arrays) -> torch.Tensor:
        """The loss of an answer, whose gradient changes the weights."""

    def scores(self, network: nn.Module, device: torch.device) -> dict[str, dict[str, float]]:
        """The score of each split, by stratum; `all` is that of every sample."""


class Trainer:
    """A training in a folder: `log.jsonl`, `checkpoints/`."""

    def __init__(self, task: Task, run: Path, device: str, threads: int) -> None:
        self.task, self.run, self.device = task, run, torch.device(device)
        self.recipe: AnyRecipe = task.recipe
        torch.set_num_threads(threads)
        torch.use_deterministic_algorithms(self.device.type == "cpu")
        torch.manual_seed(self.recipe.seed)
        self.network = task.network().to(self.device)
        if self.device.type == "cuda":
            self.network = self.network.to(memory_format=task.memory_format)
        self.average = deepcopy(self.network)
        # Averages with what they are averages of; counts, such as those of batch norm, are copied.
        state, averages = self.network.state_dict(), self.average.state_dict()
        pairs = [(mean, state[name]) for name, mean in averages.items()]
        self.means = [mean for mean, value in pairs if mean.is_floating_point()]
        self.values = [value for mean, value in pairs if mean.is_floating_point()]
        self.counts = [pair for pair in pairs if not pair[0].is_floating_point()]
        self.optimiser = task.optimiser(self.network)
        self.step, self.loss = 0, [0.0, 0.0]
        self.best = -1.0 if task.rises else math.inf
        self.setting = {"torch": str(torch.__version__), "threads": threads, "device": device}
        self.stopping = False

    def state(self) -> dict[str, Any]:
        parts = {"network": self.network, "average": self.average, "optimiser": self.optimiser}
        state = {name: part.state_dict() for name, part in parts.items()}  # type: ignore[attr-defined]
        numbers = {"step": self.step, "loss": self.loss, "best": self.best, "random": torch.get_rng_state()}
        return state | numbers | {"setting": self.setting}

    def save(self, name: str) -> None:
        """Written completely or not at all: a temporary file, synced, then renamed."""
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
        """Goes back to the newest checkpoint, and the log with it; to the beginning if there is none. Without a number of
        threads, continues with the previous number: another one changes the last bits."""
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
        """Loads a checkpoint; returns the setting in which it was made."""
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
        """A step on a batch."""
        settings = self.recipe.training
        self.network.train()
        with torch.autocast("cuda", torch.bfloat16, enabled=self.device.type == "cuda"):
            found = self.task.answer(self.network, arrays, self.device)
        loss = self.task.loss(self.network, found.float(), arrays)
        self.optimiser.zero_grad()
        (loss * self.task.terms).backward()
        for group in self.optimiser.param_groups:
            group["lr"] = rate_at(self.step, settings)
        self.optimiser.step()
        self.step += 1
        kept = min(settings.average, self.step / (self.step + 10))
        with torch.no_grad():
            get_ema_multi_avg_fn(kept)(self.means, self.values, None)
            for mean, value in self.counts:
                mean.copy_(value)
        self.loss = [self.loss[0] + loss.item(), self.loss[1] + 1]

    def progress(self, rate: float) -> str:
        steps = self.recipe.training.steps
        left = (steps - self.step) * self.recipe.training.batch / max(rate, 1e-9)
        return f"step {self.step} of {steps}: {rate:.0f} samples/s, {left:.0f} s left"

    def try_out(self, rate: float) -> None:
        """Scores the average weights, writes a line of the log and a checkpoint."""
        found = self.task.scores(self.average, self.device)
        line = {
            "step": self.step,
            "loss": self.loss[0] / max(self.loss[1], 1),
            "rate": rate_at(self.step, self.recipe.training),
        }
        line |= {"samples_per_second": round(rate, 1), self.task.measure: found}
        with (self.run / "log.jsonl").open("a", encoding="utf-8") as log:
            log.write(json.dumps(line) + "\n")
        self.loss = [0.0, 0.0]
        score = found["validation"]["all"]
        if score > self.best if self.task.rises else score < self.best:
            self.best = score
            self.save("best.pt")
        self.checkpoint()
        scores = ", ".join(f"{SPLIT_NAMES[split]} {means['all']:.3f}" for split, means in found.items())
        loss, measured = line["loss"], self.task.measured
        print(f"{self.progress(rate)}; loss {loss:.4f}, {measured} of {scores}", file=sys.stderr, flush=True)

    def train(self) -> None:
        """To the last step; raises `Interrupted` after SIGTERM or SIGINT, with a checkpoint of that step."""
        before = {number: signal.signal(number, self.stop) for number in (signal.SIGTERM, signal.SIGINT)}
        began, from_step = time.perf_counter(), self.step
        reported = began
        batches = self.task.batches(self.step)
        try:
            while self.step < self.recipe.training.steps:
                self.learn(next(batches))
                seconds = time.perf_counter() - began
                rate = (self.step - from_step) * self.recipe.training.batch / seconds
                if self.step % self.recipe.validation.every == 0 or self.step == self.recipe.training.steps:
                    self.try_out(rate)
                    # Evaluation is not training.
                    began += time.perf_counter() - began - seconds
                    reported = time.perf_counter()
                elif time.perf_counter() - reported > SECONDS_OF_SILENCE:
                    reported = time.perf_counter()
                    print(self.progress(rate), file=sys.stderr, flush=True)
                if self.stopping:
                    self.checkpoint()
                    raise Interrupted
        finally:
            for number, handler in before.items():
                signal.signal(number, handler)

    def stop(self, *_: Any) -> None:
        self.stopping = True
