"""With PyTorch: networks that find grasps in images, on patches and on whole images, and the models that come out."""

from __future__ import annotations

import hashlib
import json
import os
import signal
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

torch = pytest.importorskip("torch")

import onnxruntime  # noqa: E402
from graspmill import Dataset, PatchSample  # noqa: E402
from graspmill.train import loop  # noqa: E402
from graspmill.train.__main__ import main  # noqa: E402
from graspmill.train.heatmap_networks import Heatmap, HeatmapSmall, LocalContrast, heatmap_network_of  # noqa: E402
from graspmill.train.networks import parameters_of  # noqa: E402
from graspmill.train.patches import Held, arrays_of, cut, image_of, open_sources  # noqa: E402
from graspmill.train.recipe import HeatmapRecipe, read_recipe  # noqa: E402
from graspmill.train.strict import BadRecipe  # noqa: E402

SMALL = """
network = "heatmap-small"
[sizes]
width = 4
[training]
steps = 12
batch = 8
rate = 1e-2
average = 0.8
buffer = 8
noise = 0.1
[validation]
every = 5
samples = 64
"""


def train(data: Path, out: Path, *arguments: str, text: str = SMALL) -> int:
    recipe = out.with_suffix(".toml")
    recipe.write_text(text)
    return main([str(recipe), "--data", str(data / "held"), "--out", str(out), "--threads", "1", *arguments])


def weights(run: Path) -> dict[str, Any]:
    last = max((run / "checkpoints").glob("step-*.pt"))
    state = torch.load(last, weights_only=True)
    return {f"{part}.{name}": value for part in ("network", "average") for name, value in state[part].items()}


@pytest.fixture(scope="module")
def finished(data: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    run = tmp_path_factory.mktemp("finished") / "run"
    assert train(data, run) == 0
    return run


def test_networks_have_the_sizes_that_are_stated() -> None:
    with torch.device("meta"):
        assert parameters_of(Heatmap()) == 2_398_572
        image = torch.zeros(1, 4, 480, 640)
        sizes = []
        found = image
        for layer in Heatmap().layers:
            found = layer(found)
            if isinstance(layer, (torch.nn.Conv2d, torch.nn.MaxPool2d)):
                sizes.append(tuple(found.shape[2:]))
        # Floor for convolutions, ceil for pools (table 4.1).
        assert sizes[:7] == [(235, 315), (118, 158), (116, 156), (58, 78), (56, 76), (54, 74), (52, 72)]
        assert tuple(found.shape) == (1, 32, 52, 72)
        assert HeatmapSmall(4, 32)(image).shape == (1, 32, 51, 71)
        assert HeatmapSmall(4, 32)(torch.zeros(1, 4, 73, 73)).shape == (1, 32, 1, 1)


def test_a_cell_sees_73_pixels_8_from_the_next_one() -> None:
    for network in (Heatmap(1, 4), HeatmapSmall(1, 4, width=4)):
        network = network.double().eval()
        image = torch.randn(1, 1, 137, 161, dtype=torch.double, requires_grad=True)
        found = network(image)[0, 1, 3, 5]
        seen = torch.autograd.grad(found, image)[0][0, 0] != 0
        rows, columns = (seen.any(dim=axis).nonzero().flatten() for axis in (1, 0))
        assert rows.min() >= 8 * 3 and rows.max() < 8 * 3 + 73
        assert columns.min() >= 8 * 5 and columns.max() < 8 * 5 + 73


def test_patches_have_the_numbers_of_the_whole_image() -> None:
    """A cell of the map is what the network makes of the 73 pixels that it sees, of 72 at the far borders."""
    torch.manual_seed(1)
    network = Heatmap().double().eval()
    image = torch.randn(1, 4, 480, 640, dtype=torch.double)
    with torch.no_grad():
        heatmap = network(image)
        assert heatmap.shape == (1, 32, 52, 72)
        for row, column in ((0, 0), (17, 40), (50, 70), (51, 71), (51, 3)):
            patch = image[:, :, 8 * row : 8 * row + 73, 8 * column : 8 * column + 73]
            assert torch.allclose(network(patch)[0, :, 0, 0], heatmap[0, :, row, column], atol=1e-4)
        # The patches of 72 that the thesis cuts lack a row and a column of it.
        inner = network(image[:, :, 136:208, 320:392])[0, :, 0, 0]
        assert not torch.allclose(inner, heatmap[0, :, 17, 40], atol=1e-4)


@pytest.mark.parametrize("recipe", ["heatmap-thesis", "heatmap-standard"])
def test_squares_cut_for_training_have_the_numbers_of_the_whole_image(recipe: str) -> None:
    """Contrast normalisation included: the margin of a square is all that decides about its pixels."""
    torch.manual_seed(2)
    settings = read_recipe(Path(recipe))
    assert isinstance(settings, HeatmapRecipe)
    network = heatmap_network_of(settings, 8).eval()
    draws = np.random.default_rng(3)
    # An object before nothing, with holes, and a border of the image that has returns.
    image = draws.uniform(0, 1, (4, 480, 640)).astype(np.float32)
    image[3] += 1
    image[3, 100:400, 90:120] = 0
    image[3, draws.uniform(size=(480, 640)) < 0.1] = 0
    image = image[-1:] if settings.pixels == "depth" else image
    corners = np.array([[0, 0], [8 * 40, 8 * 17], [8 * 70, 8 * 50], [8 * 9, 8 * 13], [0, 8 * 50]])
    with torch.no_grad():
        whole = network(torch.from_numpy(image)[None])[0]
        patches = network.of_patches(torch.from_numpy(cut(image, corners)))
    columns, rows = corners.T // 8
    assert torch.allclose(patches, whole[:, rows, columns].T, atol=1e-4)
    assert (patches.std(dim=0) > 1e-4).any(), "numbers that differ from patch to patch"


def test_contrast_is_that_of_its_definition() -> None:
    """By sums over the window of one pixel, weights only where there is a return."""
    torch.manual_seed(4)
    image = torch.rand(1, 2, 20, 30) + 1
    image[0, 1, torch.rand(20, 30) < 0.3] = 0
    contrast = LocalContrast(("red", "depth"))
    found = contrast(image, torch.ones(1, 1, 20, 30))
    window = contrast.window[0, 0]
    valid = torch.stack([torch.ones(20, 30), (image[0, 1] > 0).float()])
    pixels = [(channel, row, column) for channel in (0, 1) for row in (0, 7, 12) for column in (3, 15, 29)]

    def around(values: Any, channel: int, row: int, column: int) -> float:
        total, weight = 0.0, 0.0
        for i in range(-4, 5):
            for j in range(-4, 5):
                if 0 <= row + i < 20 and 0 <= column + j < 30 and valid[channel, row + i, column + j]:
                    total += float(window[4 + i, 4 + j] * values(channel, row + i, column + j))
                    weight += float(window[4 + i, 4 + j])
        return total / weight

    def off(channel: int, row: int, column: int) -> float:
        return float(image[0, channel, row, column]) - around(lambda *at: image[0][at], channel, row, column)

    for channel, row, column in pixels:
        if not valid[channel, row, column]:
            assert found[0, channel, row, column] == 0
            continue
        deviation = around(lambda *at: off(*at) ** 2, channel, row, column) ** 0.5
        wanted = off(channel, row, column) / max(deviation, (0.05, 0.005)[channel])
        assert found[0, channel, row, column] == pytest.approx(wanted, abs=1e-4)


def test_stored_patches_are_what_is_cut(data: Path) -> None:
    recipe = replace(HeatmapRecipe(), points="all")
    samples = Dataset(data / "held", PatchSample)[:6]
    arrays = arrays_of(samples, recipe)
    for index, sample in enumerate(samples):
        stored = np.nan_to_num(sample.depth, nan=0.0)
        squares = arrays["image"][4 * index : 4 * index + 4]
        assert np.array_equal(squares[:, 0, 8:80, 8:80], stored) and squares[:, 1, 8:80, 8:80].all()
        assert np.array_equal(arrays["labels"][4 * index : 4 * index + 4], sample.labels)
        assert np.array_equal(arrays["mask"][4 * index : 4 * index + 4], sample.tested)
        # One number of each label vector is known at most.
        assert arrays["mask"][4 * index : 4 * index + 4].sum(axis=1).max() <= 1
        masked = arrays_of([sample], HeatmapRecipe())["mask"]
        assert np.array_equal(masked.any(axis=1), sample.tested.any(axis=1) & sample.visible)
    everything = arrays_of(samples, replace(recipe, targets="all"))
    assert everything["mask"].all()
    # Outside of the image nothing is.
    image = image_of(samples[0], recipe)
    corner = cut(image, np.array([[0, 0], [640 - 72, 480 - 72]]))
    assert not corner[0, 1, :8].any() and not corner[1, 1, :, -9:].any() and corner[1, 1, 8:80, 8:80].all()


def test_interrupted_it_ends_with_the_same_weights(
    data: Path, finished: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    whole = loop.Trainer.learn

    def learn(trainer: loop.Trainer, arrays: Any) -> None:
        whole(trainer, arrays)
        if trainer.step in (3, 8):
            os.kill(os.getpid(), signal.SIGTERM)

    monkeypatch.setattr(loop.Trainer, "learn", learn)
    run = tmp_path / "run"
    assert [train(data, run, *["--resume"] * (turn > 0)) for turn in range(3)] == [75, 75, 0]
    expected, found = weights(finished), weights(run)
    assert expected.keys() == found.keys() and all(torch.equal(expected[name], found[name]) for name in expected)


def test_it_learns_more_than_the_mean(data: Path, tmp_path: Path) -> None:
    """Checked on the points that it is trained on: three objects are too few to judge others by."""
    text = SMALL.replace("steps = 12", "steps = 300").replace("every = 5", "every = 100").replace("noise = 0.1", "")
    text = 'points = "all"\n' + text.replace("width = 4", "width = 8").replace("batch = 8", "batch = 16")
    run = tmp_path / "run"
    assert train(data, run, text=text) == 0
    last = json.loads((run / "log.jsonl").read_text().splitlines()[-1])
    assert last["error"]["training"]["all"] < 0.9 * last["error"]["training"]["constant"], last


def test_a_model_folder_holds_what_it_says(data: Path, finished: Path) -> None:
    model = finished / "model"
    facts = json.loads((model / "model.json").read_text())
    assert list(facts) == [
        *("format", "network", "channels", "types", "points", "stride", "first_pixel", "field", "seed", "steps"),
        *("data", "split", "versions", "scores", "files"),
    ]
    assert facts["format"] == "graspmill heatmap model 1" and facts["channels"] == ["depth"]
    manifest = json.loads((data / "held" / "manifest.json").read_text())
    assert facts["data"] == [{"root": manifest["root"], "job": manifest["job"]}]
    digests = {path.name: hashlib.sha256(path.read_bytes()).hexdigest() for path in model.iterdir()}
    del digests["model.json"]
    assert facts["files"] == digests
    card = (model / "card.md").read_text()
    assert manifest["root"] in card and "CC0-1.0" in card and "validation objects | constant" in card
    golden = dict(np.load(model / "golden.npz"))
    session = onnxruntime.InferenceSession(model / "model.onnx")
    for rows in (slice(0, 1), slice(0, None)):
        found = session.run(["heatmap"], {"image": golden["image"][rows]})[0]
        assert np.abs(found - golden["heatmap"][rows]).max() < 1e-4
    # Images of any size: a part that begins at a cell has the numbers of the whole, but near its own border.
    part = session.run(["heatmap"], {"image": golden["image"][:1, :, 80:320, 160:480]})[0]
    assert np.abs(part[:, :, 2:18, 2:28] - golden["heatmap"][:1, :, 12:28, 22:48]).max() < 1e-4


def test_table_4_1_comes_out(data: Path, tmp_path: Path) -> None:
    text = 'network = "heatmap"\ntargets = "all"\npoints = "all"\n[training]\nsteps = 2\nbatch = 4\nrate = 0.1\n'
    text += 'average = 0\nschedule = "constant"\noptimiser = "sgd"\nl1 = 1e-6\nnoise = 0.05\n'
    assert train(data, tmp_path / "run", text=text) == 0
    facts = json.loads((tmp_path / "run" / "model" / "model.json").read_text())
    golden = dict(np.load(tmp_path / "run" / "model" / "golden.npz"))
    assert golden["heatmap"].shape[1:] == (4 * len(facts["types"]), 52, 72)


def test_data_that_cannot_be_trained_with_is_refused(data: Path) -> None:
    for folder, recipe, said in (
        ("held", HeatmapRecipe(pixels="rgbd"), "images.full = true and render.colour = true"),
        ("set/patches", HeatmapRecipe(), "give the job's [split]"),
        ("held", HeatmapRecipe(roots=("0" * 64,)), "the recipe is for datasets of the roots 000"),
    ):
        with pytest.raises(BadRecipe) as error:
            open_sources([data / folder], recipe)
        assert said in str(error.value)


def test_errors_count_the_numbers_that_are_learnt() -> None:
    mask = np.zeros((8, 6), bool)
    mask[0, 1] = mask[5, 2] = True
    labels = np.zeros((8, 6), np.float32)
    labels[0, 1] = -1
    held = Held({"image": np.zeros((8, 2, 89, 89), np.float32), "labels": labels, "mask": mask}, np.array(["a", "b"]))
    errors = held.errors(np.full((8, 6), 0.5, np.float32))
    assert {name: values.tolist() for name, (values, _) in errors.items()} == {
        "all": [2.25, 0.25],
        "palm": [2.25],
        "fingertips": [0.25],
    }
    assert errors["palm"][1].tolist() == ["a"] and errors["fingertips"][1].tolist() == ["b"]
