"""With PyTorch: networks, trainings that are interrupted and resumed, and the models that come out."""

from __future__ import annotations

import hashlib
import json
import os
import random
import signal
import subprocess
import sys
import time
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

torch = pytest.importorskip("torch")

import onnx  # noqa: E402
import onnxruntime  # noqa: E402
from graspmill import AmodalSample, Dataset  # noqa: E402
from graspmill.train import loop  # noqa: E402
from graspmill.train.__main__ import main  # noqa: E402
from graspmill.train.data import arrays_of, open_sources  # noqa: E402
from graspmill.train.networks import Block, Thesis, UNet, from_blocks, parameters_of, to_blocks  # noqa: E402
from graspmill.train.recipe import Recipe, Training  # noqa: E402

SMALL = """
[sizes]
fine = 4
coarse = 8
middle = 16
[training]
steps = 24
batch = 8
rate = 1e-2
average = 0.8
buffer = 16
[validation]
every = 7
samples = 64
"""
STEPS = 24


def train(data: Path, out: Path, *arguments: str, head: str = "", text: str = SMALL) -> int:
    recipe = out.with_suffix(".toml")
    recipe.write_text(head + text)
    return main([str(recipe), "--data", str(data / "pairs"), "--out", str(out), "--threads", "1", *arguments])


def weights(run: Path) -> dict[str, Any]:
    """Weights in the last checkpoint."""
    last = max((run / "checkpoints").glob("step-*.pt"))
    state = torch.load(last, weights_only=True)
    return {f"{part}.{name}": value for part in ("network", "average") for name, value in state[part].items()}


def log(run: Path) -> list[dict[str, Any]]:
    lines = [json.loads(line) for line in (run / "log.jsonl").read_text().splitlines()]
    return [{name: value for name, value in line.items() if name != "samples_per_second"} for line in lines]


@pytest.fixture(scope="module")
def finished(data: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    run = tmp_path_factory.mktemp("finished") / "run"
    assert train(data, run) == 0
    return run


def test_networks_have_the_parameters_that_are_stated() -> None:
    with torch.device("meta"):
        assert parameters_of(Thesis(1, 1)) == 430_357_576
        assert Thesis(1, 1)(torch.zeros(1, 1, 40, 40, 40)).shape == (1, 1, 40, 40, 40)
        assert parameters_of(Block(2, 2)) == 4_339_136
        assert parameters_of(UNet(2, 2, 8)) == 351_034


def test_blocks_hold_the_cells_of_their_corner() -> None:
    grids = torch.rand(2, 3, 40, 40, 40)
    blocks = to_blocks(grids)
    assert torch.equal(from_blocks(blocks), grids)
    cell = (2 * 16 + 1 * 4 + 3) + 64 * 1
    assert blocks[1, cell, 7, 5, 9] == grids[1, 1, 7 * 4 + 2, 5 * 4 + 1, 9 * 4 + 3]


def test_one_cycle_rises_and_falls() -> None:
    settings = Training(steps=100, rate=1.0)
    rates = [loop.rate_at(step, settings) for step in range(100)]
    assert rates[0] == pytest.approx(1 / 25) and max(rates) == rates[30] == pytest.approx(1)
    assert rates[:31] == sorted(rates[:31]) and rates[30:] == sorted(rates[30:], reverse=True) and rates[-1] < 2e-3


@pytest.mark.parametrize("number", [signal.SIGTERM, signal.SIGINT])
def test_interrupted_three_times_it_ends_with_the_same_weights(
    data: Path, finished: Path, tmp_path: Path, number: signal.Signals, monkeypatch: pytest.MonkeyPatch
) -> None:
    steps = sorted(random.Random(int(number)).sample(range(1, STEPS), 3))
    whole = loop.Trainer.learn

    def learn(trainer: loop.Trainer, arrays: Any) -> None:
        whole(trainer, arrays)
        if trainer.step in steps:
            os.kill(os.getpid(), number)

    monkeypatch.setattr(loop.Trainer, "learn", learn)
    run = tmp_path / "run"
    codes = [train(data, run, *["--resume"] * (turn > 0)) for turn in range(4)]
    assert codes == [75, 75, 75, 0], steps
    expected, found = weights(finished), weights(run)
    assert expected.keys() == found.keys() and all(torch.equal(expected[name], found[name]) for name in expected)
    assert log(run) == log(finished)
    assert sorted(path.name for path in (run / "checkpoints").iterdir()) == [
        "best.pt",
        "step-0000021.pt",
        "step-0000024.pt",
    ]


def test_killed_outright_it_goes_on_from_its_last_checkpoint(data: Path, finished: Path, tmp_path: Path) -> None:
    run, recipe = tmp_path / "run", tmp_path / "run.toml"
    recipe.write_text(SMALL)
    command = [sys.executable, "-m", "graspmill.train", str(recipe), "--data", str(data / "pairs"), "--out", str(run)]
    with subprocess.Popen([*command, "--threads", "1"], stderr=subprocess.DEVNULL) as process:
        while process.poll() is None and not list(run.glob("checkpoints/step-0000014.pt")):
            time.sleep(0.01)
        process.kill()
    assert train(data, run, "--resume") == 0
    expected, found = weights(finished), weights(run)
    assert all(torch.equal(expected[name], found[name]) for name in expected) and log(run) == log(finished)


def test_a_resumed_training_keeps_its_threads(data: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    run = tmp_path / "run"
    assert train(data, run, "--threads", "2", text=SMALL.replace("steps = 24", "steps = 2")) == 0
    capsys.readouterr()
    recipe = run.with_suffix(".toml")
    assert main([str(recipe), "--data", str(data / "pairs"), "--out", str(run), "--resume"]) == 0
    assert "2 threads" in capsys.readouterr().err
    assert main([str(recipe), "--data", str(data / "pairs"), "--out", str(run), "--resume", "--threads", "1"]) == 0
    assert "begun with 2 threads" in capsys.readouterr().err


def test_the_seed_decides(data: Path, finished: Path, tmp_path: Path) -> None:
    runs = {}
    for name, seed in (("again", "0"), ("other", "1")):
        assert train(data, tmp_path / name, "--seed", seed) == 0
        runs[name] = weights(tmp_path / name)
    expected = weights(finished)
    assert all(torch.equal(expected[name], runs["again"][name]) for name in expected)
    assert not torch.equal(expected["average.enter.weight"], runs["other"]["average.enter.weight"])


def test_a_training_is_not_mixed_with_another(data: Path, finished: Path, capsys: pytest.CaptureFixture[str]) -> None:
    for arguments, said in (
        ([], "give --resume to continue it"),
        (["--resume", "--seed", "5"], "another recipe, seed or data"),
    ):
        assert train(data, finished, *arguments) == 2
        assert said in capsys.readouterr().err


def test_a_model_folder_holds_what_it_says(data: Path, finished: Path) -> None:
    model = finished / "model"
    facts = json.loads((model / "model.json").read_text())
    assert list(facts) == [
        *("format", "network", "inputs", "outputs", "resolution", "placement", "thresholds", "seed", "steps", "data"),
        *("split", "versions", "scores", "files"),
    ]
    assert facts["format"] == "graspmill model 1" and facts["inputs"] == ["partial", "free"]
    manifest = json.loads((data / "pairs" / "manifest.json").read_text())
    assert facts["data"] == [{"root": manifest["root"], "job": manifest["job"]}]
    digests = {path.name: hashlib.sha256(path.read_bytes()).hexdigest() for path in model.iterdir()}
    del digests["model.json"]
    assert facts["files"] == digests
    card = (model / "card.md").read_text()
    assert manifest["root"] in card and "CC0-1.0" in card and "validation objects | all" in card

    network = onnx.load(model / "model.onnx")
    plain = {
        "Concat",
        "Reshape",
        "Transpose",
        "Conv",
        "ConvTranspose",
        "Gemm",
        "MatMul",
        "Relu",
        "Add",
        "Sigmoid",
        "Slice",
    }
    assert {node.op_type for node in network.graph.node} <= plain and network.opset_import[0].version == 18
    golden = dict(np.load(model / "golden.npz"))
    assert all(array.shape == (4, 1, 40, 40, 40) and array.dtype == np.float32 for array in golden.values())
    session = onnxruntime.InferenceSession(model / "model.onnx")
    for rows in (slice(0, 1), slice(0, 4)):
        found = session.run(["occupancy", "coverage"], {name: golden[name][rows] for name in facts["inputs"]})
        for name, values in zip(facts["outputs"], found):
            assert np.abs(values - golden[name][rows]).max() < 1e-5


@pytest.mark.parametrize(
    ("head", "inputs"),
    [
        ("variant = 'depth'", ["partial"]),
        ("variant = 'depth-touch'", ["partial", "free", "touch"]),
        ("variant = 'depth-or-touch'", ["partial", "touch"]),
        ("variant = 'touch'\noutputs = ['occupancy']", ["touch"]),
        ("network = 'unet'", ["partial", "free"]),
    ],
)
def test_every_variant_comes_out(data: Path, tmp_path: Path, head: str, inputs: list[str]) -> None:
    sizes = "[sizes]\nwidth = 2" if "unet" in head else "[sizes]\nfine = 4\ncoarse = 4\nmiddle = 8"
    text = f"\n{sizes}\n[training]\nsteps = 2\nbatch = 4\nbuffer = 8\n[validation]\nsamples = 64\n"
    assert train(data, tmp_path / "run", head=head, text=text) == 0
    model = tmp_path / "run" / "model"
    facts = json.loads((model / "model.json").read_text())
    assert facts["inputs"] == inputs and set(facts["thresholds"]) == {"occupancy", "coverage"}
    session = onnxruntime.InferenceSession(model / "model.onnx")
    assert [each.name for each in session.get_inputs()] == inputs
    if "or-touch" in head:
        # Seen and touched cells are in one grid: it makes no difference which of both a cell is, or both.
        golden = dict(np.load(model / "golden.npz"))
        either, nothing = np.maximum(golden["partial"], golden["touch"]), np.zeros_like(golden["touch"])
        found = [
            session.run(None, {"partial": p, "touch": t})
            for p, t in ((either, nothing), (golden["partial"], golden["touch"]))
        ]
        assert golden["touch"].any() and np.array_equal(found[0], found[1])


BRIEF = "[sizes]\nfine = 4\ncoarse = 4\nmiddle = 8\n[training]\nsteps = 2\nbatch = 4\nbuffer = 8\n[validation]\nsamples = 64\n"


def test_a_nested_subset_of_the_training_objects_is_learnt_from(data: Path) -> None:
    recipe = Recipe(variant="depth", outputs=("occupancy",))
    found = [open_sources([data / "pairs"], replace(recipe, objects=count))[0].splits for count in (1, 2, 0)]
    objects = [{split: set(np.unique(each[split].column("object"))) for split in each} for each in found]
    assert len(objects[0]["training"]) == 1 and len(objects[1]["training"]) == 2 and len(objects[2]["training"]) == 4
    assert objects[0]["training"] < objects[1]["training"] < objects[2]["training"]
    assert objects[0]["holdout"] <= objects[0]["training"] and objects[0]["validation"] == objects[2]["validation"]


def test_a_subset_that_the_job_does_not_have_is_refused(
    data: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert train(data, tmp_path / "run", head="objects = 3\n", text=BRIEF) == 2
    assert "the dataset has subsets of 1, 2 objects: give the job's split.training_subsets" in capsys.readouterr().err


def test_pairs_in_clutter_train_a_model(data: Path, tmp_path: Path) -> None:
    recipe, run = tmp_path / "recipe.toml", tmp_path / "run"
    recipe.write_text(BRIEF)
    assert main([str(recipe), "--data", str(data / "cluttered"), "--out", str(run), "--threads", "1"]) == 0
    facts = json.loads((run / "model" / "model.json").read_text())
    cluttered = Dataset(data / "cluttered", AmodalSample, split="validation")
    bodies = {sample.clutter.object for sample in cluttered}
    assert facts["scores"]["validation"]["all"]["objects"] == len(bodies) == 3
    assert {"hollow or thin", "rest"} <= set(facts["scores"]["validation"])
    assert "CC0-1.0" in (run / "model" / "card.md").read_text()


def test_cells_of_the_floor_count_as_free(data: Path) -> None:
    samples = list(Dataset(data / "cluttered", AmodalSample, split="training")[:6])
    arrays = arrays_of(samples, replace(Recipe(), outputs=("occupancy",)))
    found = 0
    for sample, free in zip(samples, arrays["free"]):
        pair, n = sample.pair, sample.resolution
        centres = pair.grid.centres(np.indices((n, n, n)).transpose(1, 2, 3, 0))
        in_world = centres @ pair.world_from_camera[:3, :3].T + pair.world_from_camera[:3, 3]
        below = (in_world[..., 2] < 0) & sample.clutter.others_solid & ~sample.partial
        np.testing.assert_array_equal(free, sample.free | below)
        found += int(below.sum())
    assert found > 0
