"""Recipes, and the samples that the trainer makes of a dataset; without PyTorch."""

from __future__ import annotations

import itertools
import os
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from graspmill import CompletionSample, Dataset

if sys.version_info < (3, 11):
    pytest.importorskip("tomli")

from graspmill.train.__main__ import idle_cores, idle_ticks, main
from graspmill.train.data import Held, augment, batches_of, open_sources
from graspmill.train.recipe import Augmentation, Recipe, Training, read_recipe
from graspmill.train.sources import score
from graspmill.train.strict import BadRecipe

RECIPES = Path(sys.modules["graspmill.train.recipe"].__file__ or "").parent / "recipes"
TOUCHED = replace(Recipe(), variant="depth-touch", training=Training(batch=7, buffer=32))


def test_idle_cores_are_counted_by_what_each_does() -> None:
    counts = "cpu  9 0 9 70 7 0 0 0 0 0\ncpu0 4 0 4 30 2 0 0 0 0 0\ncpu1 5 0 5 40 5 0 0 0 0 0\nintr 12 0 9 9 9 9\n"
    assert [idle_ticks(counts, cores) for cores in ({0}, {1}, {0, 1}, {2})] == [32, 45, 77, 0]
    assert 1 <= idle_cores() <= len(os.sched_getaffinity(0))


@pytest.mark.parametrize("file", sorted(RECIPES.glob("*.toml")), ids=lambda file: file.stem)
def test_recipes_are_written_back_with_every_default(file: Path, tmp_path: Path) -> None:
    recipe = read_recipe(file)
    assert recipe.name == file.stem and recipe == read_recipe(Path(file.stem))
    (tmp_path / "recipe.toml").write_text(recipe.text())
    assert read_recipe(tmp_path / "recipe.toml") == recipe
    assert recipe.text().count("=") > file.read_text().count("=")


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("[training]\nstpes = 3", "unknown key `training.stpes`; did you mean `steps`?"),
        ("netwrok = 'unet'", "did you mean `network`?"),
        ("network = 'resnet'", "one of block, unet, thesis"),
        ("network = 'unet'\n[sizes]\nfine = 8", "unknown key `sizes.fine`; there are width"),
        ("[sizes]\nfine = 0", "a whole number from 1"),
        ("[training]\nsteps = 1.5", "a whole number from 1"),
        ("[training]\nsteps = true", "a whole number from 1"),
        ("[augmentation]\nhide = 2", "a number from 0 to 0.95"),
        ("outputs = ['coverage', 'occupancy']", "in this order"),
        ("outputs = []", "some of occupancy, coverage"),
        ("training = 3", "`training` must be a table"),
        ("network = 'heatmap'\n[augmentation]\ndrop = 0", "unknown key `augmentation`"),
        ("network = 'heatmap'\n[training]\nbatch = 30", "give a multiple of 4"),
        ("network = 'heatmap-small'\npixels = 'grey'", "one of depth, rgbd"),
        ("name = ", "it is not TOML"),
    ],
)
def test_mistakes_are_named_with_the_remedy(text: str, said: str, tmp_path: Path) -> None:
    file = tmp_path / "recipe.toml"
    file.write_text(text)
    with pytest.raises(BadRecipe, match="recipe.toml") as error:
        read_recipe(file)
    assert said in str(error.value)


def test_the_order_begins_anywhere(data: Path) -> None:
    """Batches from step k on are those of a training that came to step k, over the end of an epoch and with two
    datasets."""
    sources = open_sources([data / "pairs"] * 2, replace(TOUCHED, variant="depth-touch"))
    whole = list(itertools.islice(batches_of(sources, TOUCHED, 0), 40))
    per_epoch = 2 * len(sources[0].splits["training"]) // 7
    assert per_epoch < 38
    for first in (1, per_epoch, 37):
        for expected, found in zip(whole[first:], batches_of(sources, TOUCHED, first)):
            assert expected.keys() == found.keys() == {"partial", "free", "touch", "occupancy", "coverage"}
            assert all(np.array_equal(expected[name], found[name]) for name in expected)
    other = next(batches_of(sources, replace(TOUCHED, seed=1), 0))
    assert not np.array_equal(other["occupancy"], whole[0]["occupancy"])


def test_every_sample_comes_once_an_epoch_and_none_of_the_test_split(data: Path) -> None:
    recipe = replace(Recipe(), training=Training(batch=1, buffer=16))
    sources = open_sources([data / "pairs"], recipe)
    training = Dataset(data / "pairs", CompletionSample, split="training")
    found = [batch["occupancy"][0] for batch in itertools.islice(batches_of(sources, recipe, 0), len(training))]
    assert sorted(grid.tobytes() for grid in found) == sorted(sample.complete.tobytes() for sample in training)
    assert set(sources[0].splits) == {"training", "holdout", "validation"}
    indices = np.concatenate([selection.indices for selection in sources[0].splits.values()])
    assert not set(indices) & set(Dataset(data / "pairs", split="test").indices)


def test_losses_are_taken_by_the_sample(data: Path) -> None:
    """Losses depend on seed, step and index alone; targets lose nothing."""
    settings = replace(
        TOUCHED, augmentation=Augmentation(hidden_share=1, hide=0.5, drop=0.2, contacts=5, blank_free=0.5)
    )
    held = Held.of(open_sources([data / "pairs"], settings), "training", settings)
    assert held is not None
    full = {name: array[:12] for name, array in held.arrays.items()}
    several, one, other = ({name: array[:count].copy() for name, array in full.items()} for count in (12, 1, 12))
    augment(several, settings.augmentation, 3, 5)
    augment(one, settings.augmentation, 3, 5)
    augment(other, settings.augmentation, 3, 6)
    assert all(np.array_equal(several[name][:1], one[name]) for name in full)
    assert not np.array_equal(several["partial"], other["partial"])
    for name in ("partial", "free", "touch"):
        assert not (several[name] & ~full[name]).any() and several[name].sum() < full[name].sum(), name
    assert np.array_equal(several["occupancy"], full["occupancy"])
    assert several["touch"].sum(axis=(1, 2, 3)).max() <= 5
    kept = several["partial"].sum(axis=(1, 2, 3)) / full["partial"].sum(axis=(1, 2, 3))
    assert 0.3 < kept.min() < 0.9


def test_strata_part_objects_whole(data: Path) -> None:
    held = Held.of(open_sources([data / "pairs"], Recipe()), "training", Recipe())
    assert held is not None
    strata = held.strata()
    assert np.array_equal(strata["rest"], ~strata["hollow or thin"])
    thin = set(held.objects[strata["hollow or thin"]])
    assert thin and not thin & set(held.objects[strata["rest"]]) and "box-01" not in thin


def test_scores_count_objects_not_samples() -> None:
    found = score(np.array([1.0, 1.0, 1.0, 0.0]), np.array(["a", "a", "a", "b"]))
    assert found == {"mean": 0.5, "low": 0.0, "high": 1.0, "objects": 2, "samples": 4}
    assert score(np.array([]), np.array([])) == {"objects": 0, "samples": 0}


def test_data_that_cannot_be_trained_with_is_refused(data: Path, tmp_path: Path) -> None:
    for folder, recipe, said in (
        ("felt", Recipe(variant="depth"), "no channel coverage; make it with channels.coverage = true"),
        ("felt", Recipe(variant="touch", outputs=("occupancy",)), "give the job's [split]"),
        ("pairs", Recipe(roots=("0" * 64,)), "the recipe is for datasets of the roots 000"),
    ):
        with pytest.raises(BadRecipe) as error:
            open_sources([data / folder], recipe)
        assert said in str(error.value)


def test_the_command_line_says_what_is_wrong(data: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    pairs, out = str(data / "pairs"), str(tmp_path / "run")
    for arguments, said in (
        (
            ["nothing", "--data", pairs, "--out", out],
            "there are completion-quick, completion-standard, completion-tabletop, completion-thesis, heatmap-standard, heatmap-thesis",
        ),
        (["completion-quick", "--data", str(tmp_path), "--out", out], "manifest.json"),
        (["completion-quick", "--data", str(data / "set/grasps"), "--out", out], "learn from pairs: completion or"),
        (["completion-quick", "--data", pairs, "--out", out, "--resume"], "no training to resume"),
    ):
        assert main(arguments) == 2
        assert said in capsys.readouterr().err


def test_without_pytorch_the_remedy_is_told(data: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    try:
        import torch  # noqa: F401
    except ModuleNotFoundError:
        assert main(["completion-quick", "--data", str(data / "pairs"), "--out", str(tmp_path / "run")]) == 2
        said = capsys.readouterr().err
        assert "torch, which is not installed" in said and "graspmill[train]" in said
    else:
        pytest.skip("PyTorch is installed")
