"""The parts of `make study`, on grids and rows made by hand: recipes, tests, faults, scores, tables."""

from __future__ import annotations

import gzip
import sys
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

BENCHES = Path(__file__).resolve().parents[2] / "benches"
sys.path.insert(0, str(BENCHES))

import study  # noqa: E402
import study_fault  # noqa: E402
import study_law  # noqa: E402
import study_table  # noqa: E402
from data_faults import of_others  # noqa: E402
from graspmill.train.recipe import Recipe, read_recipe, tomllib  # noqa: E402
from default_view import N  # noqa: E402
from study_tests import Samples, changed, packed  # noqa: E402

STUDIES = sorted((BENCHES / "studies").glob("*.toml"))


def cells(*boxes: tuple[int, int]) -> np.ndarray:
    """Grids of which the cells from one number to before another are occupied; (boxes, N, N, N)."""
    grids = np.zeros((len(boxes), N**3), bool)
    for grid, (first, end) in zip(grids, boxes):
        grid[first:end] = True
    return grids.reshape(-1, N, N, N)


def four() -> Samples:
    """Two samples of a cup and two of a ball."""
    bits = {
        "partial": packed(cells((0, 10), (10, 20), (20, 30), (30, 40))),
        "touch": packed(cells((100, 101), (101, 103), (103, 106), (106, 110))),
        "occupancy": packed(cells((0, 200), (0, 1), (0, N), (0, 2 * N))),
    }
    thin = np.array([True, True, False, False])
    return Samples(bits, np.array(["cup", "cup", "ball", "ball"]), thin, np.array([0, 0.5, 0, 0]))


@pytest.mark.parametrize("file", STUDIES, ids=lambda file: file.stem)
def test_every_arm_is_a_recipe_on_datasets_that_are_there(file: Path, tmp_path: Path) -> None:
    table = tomllib.loads(file.read_text(encoding="utf-8"))
    for arm in table["arms"]:
        path = tmp_path / f"{arm['name']}.toml"
        path.write_text(study.recipe_text(table, arm, 7))
        recipe = read_recipe(path)
        assert isinstance(recipe, Recipe) and recipe.training.steps == 7
        assert set(arm["data"]) <= set(table["datasets"]) and arm.get("fault", "shifted") in study_fault.FAULTS
    for dataset in table["datasets"].values():
        assert (study.HOME / dataset["job"]).exists()
    names = [arm["name"] for arm in table["arms"]]
    assert len(set(names)) == len(names)


def test_an_arm_has_keys_of_its_own_over_those_of_the_study() -> None:
    table = {"recipe": {"base": "completion-quick", "outputs": ["occupancy"], "augmentation": {"drop": 0.5}}}
    arm = {"name": "own", "recipe": {"variant": "depth", "augmentation": {"hide": 0.1}}}
    found = tomllib.loads(study.recipe_text(table, arm, None))
    assert found["augmentation"] == {"drop": 0.5, "hide": 0.1} and found["training"]["steps"] == 800
    assert (found["name"], found["variant"], found["outputs"]) == ("own", "depth", ["occupancy"])


def test_first_seeds_come_first() -> None:
    table = {"seeds": 2, "arms": [{"name": "a"}, {"name": "b"}]}
    assert [(arm["name"], seed) for arm, seed in study.queue_of(table, None)] == [("a", 0), ("b", 0), ("a", 1), ("b", 1)]
    assert [(arm["name"], seed) for arm, seed in study.queue_of(table, "b")] == [("b", 0), ("b", 1)]


def test_overlaps_are_of_cells_and_of_volumes() -> None:
    assert study.overlap(cells((0, 4), (0, 0)), cells((2, 6), (0, 0))).tolist() == [2 / 6, 1]
    found, share = np.zeros((1, N, N, N)), np.zeros((1, N, N, N))
    found[0, 0, 0, :3], share[0, 0, 0, :3] = [1, 0.5, 0], [0.25, 0.75, 0.5]
    # Least 0.25 + 0.5, most 1 + 0.75 + 0.5.
    assert study.overlap_of_solid(found, share).tolist() == [0.75 / 2.25]


def test_twins_are_recognised_by_the_truth_that_a_completion_overlaps_most() -> None:
    bits = {
        "partial": packed(cells((0, 10), (0, 10), (0, 10), (30, 40))),
        "occupancy": packed(cells((0, 20), (0, 30), (0, 60), (30, 60))),
    }
    test = Samples(bits, np.array(["a", "b", "c", "d"]), np.zeros(4, bool), np.zeros(4))
    assert [twins.tolist() for twins in test.twins()] == [[1, 2], [0, 2], [0, 1], []]
    same = replace(test, bits=test.bits | {"occupancy": packed(cells((0, 100), (0, 96), (0, 60), (0, 60)))})
    assert [twins.tolist() for twins in same.twins()] == [[2], [2], [0, 1], []], "the first two are one shape"
    # The second answers as the third should; the first answers with what lies as near to the second.
    found = study.recognised(packed(cells((0, 24), (0, 60), (0, 55), (0, 1))), test)
    assert found[:3].tolist() == [1, 0, 1] and np.isnan(found[3])
    between = study.recognised(packed(cells((0, 0), (0, 0), (0, 60), (0, 1))), test)
    assert between[:3].tolist() == [0, 0, 1], "what overlaps no truth tells nothing"


def test_a_test_comes_back_from_its_file(tmp_path: Path) -> None:
    four().save(tmp_path / "test.npz")
    again = Samples.load(tmp_path / "test.npz")
    assert again.objects.tolist() == four().objects.tolist() and again.thin.tolist() == four().thin.tolist()
    assert np.array_equal(again.cells("touch", slice(0, 4)), four().cells("touch", slice(0, 4))) and again.share is None
    # 200 cells are five rows along z; one cell; one row; two.
    assert again.end_on().tolist() == [N / 5, 1, N, N / 2]


def test_changed_inputs_are_those_of_another_object_or_of_what_is_seen() -> None:
    test = four()
    others = of_others(test.objects)
    assert all(test.objects[row] != test.objects[other] for row, other in enumerate(others))
    swapped = changed(test, "touch of others")
    assert np.array_equal(swapped.bits["touch"], test.bits["touch"][others])
    seen = changed(test, "touch of what is seen")
    assert np.array_equal(seen.bits["touch"], test.bits["partial"]), "ten seen cells, fewer than rays"
    assert not changed(test, "no touch").bits["touch"].any() and test.bits["touch"].any()
    assert changed(test, "").bits == test.bits
    with pytest.raises(ValueError, match="'sideways'"):
        changed(test, "sideways")


def test_faults_change_what_they_say() -> None:
    def arrays() -> dict[str, np.ndarray]:
        return {"partial": cells((0, 10), (10, 20)), "free": cells((20, 60), (0, 5)), "occupancy": cells((0, 50), (7, 9))}

    found = arrays()
    study_fault.another_body(found, [])
    assert np.array_equal(found["occupancy"], arrays()["occupancy"][::-1])
    found = arrays()
    study_fault.shifted(found, [])
    assert np.array_equal(found["occupancy"][:, 2:], arrays()["occupancy"][:, :-2])
    found = arrays()
    others: Any = [SimpleNamespace(clutter=SimpleNamespace(others_seen=grid)) for grid in cells((30, 40), (40, 50))]
    study_fault.neighbours_left_in(found, others)
    assert np.array_equal(found["partial"], arrays()["partial"] | cells((30, 40), (40, 50)))
    assert not (found["partial"] & found["free"])[0, 0, 0, 30:40].any()


def rows(folder: Path) -> Path:
    """Two arms and two seeds of two objects; the second arm is 0.1 better at the cup and 0.3 at the ball."""
    folder.mkdir()
    facts = {"t": (four().objects, four().thin, four().hidden, np.array([1.0, 2.0, 1.0, 1.0]))}
    for arm, gain in (("base", 0.0), ("other", 0.1)):
        for seed in range(2):
            iou = np.array([0.2, 0.4, 0.5, 0.5]) + np.array([1, 1, 3, 3]) * gain + 0.1 * seed
            found = {"t": [iou, iou / 2, np.full(4, np.nan), np.array([np.nan, seed, 1, 1])]}
            study.write_rows(study.rows_of(folder.parent, arm, seed), arm, seed, found, facts)
    return folder


def test_a_table_pairs_by_object(tmp_path: Path) -> None:
    folder = rows(tmp_path / "rows")
    assert sorted(path.name for path in folder.iterdir())[0] == "base-0.csv.gz"
    found = study_table.read(folder, "iou", [])
    assert found["all"]["base", "t"] == pytest.approx({"cup": 0.35, "ball": 0.55})
    lines = study_table.table(found, "base", seeds=True)
    assert lines[0] == "| arm | seeds | t |"
    assert lines[2].startswith("| base | 2 | 0.450 [0.350, 0.550]; 0.400 to 0.500 |")
    assert lines[3].startswith("| other | 2 | +0.200 [+0.100, +0.300]; 0.600 to 0.700 |")


def test_rows_are_chosen_by_what_stands_in_them(tmp_path: Path) -> None:
    folder = rows(tmp_path / "rows")
    chosen = [study_table.read(folder, "iou", [where])["all"] for where in ("thin=0", "hidden>0.3", "end_on<1.5")]
    assert chosen[0]["base", "t"] == pytest.approx({"ball": 0.55}) and chosen[1]["base", "t"] == pytest.approx({"cup": 0.45})
    assert chosen[2]["base", "t"] == pytest.approx({"cup": 0.25, "ball": 0.55})
    share = study_table.read(folder, "recognised", [])["all"]
    assert share["base", "t"] == {"cup": 0.5, "ball": 1}, "rows without twins do not count"
    for wrong in ("thin", "weight>1", "thin!2"):
        with pytest.raises(SystemExit, match="hidden>0.3"):
            study_table.read(folder, "iou", [wrong])
    with gzip.open(folder / "base-0.csv.gz", "rt") as file:
        assert next(file).strip() == ",".join(study.COLUMNS)


def test_a_planted_law_is_found() -> None:
    """Constant and exponent come back; a count off the law shows."""
    draws = np.random.default_rng(4).uniform(0.8, 1.2, 40)
    line = {objects: 1 - 0.3 * (objects / 100) ** -0.2 * draws / draws.mean() for objects in (14, 94, 484)}
    law = study_law.Law.of(line)
    assert np.allclose([law.constant, law.exponent], [0.3, 0.2]) and law.farthest() < 1e-9
    assert np.isclose(law.overlap(94), line[94].mean())
    low, high = law.intervals
    assert low[0] < 0.3 < high[0] and np.allclose([low[1], high[1]], 0.2)
    assert str(law).startswith("c 0.300 [0.2")
    line[14] -= 0.05
    off = study_law.Law.of(line)
    assert off.exponent > 0.2 and 0.005 < off.farthest() < 0.05


def test_lines_are_of_the_views_that_an_arm_has() -> None:
    found = {
        ("block-allx10", "training views of 10"): {"cup": 0.5, "ball": 0.7},
        ("block-allx10", "training views of 100"): {"cup": 0.1, "ball": 0.1},
        ("unet-14x100", "training views of 100"): {"cup": 0.9, "ball": 0.8},
    }
    lines = study_law.lines_of(found, ["training views of 10", "training views of 100"], 484)
    assert list(lines) == [("block", 10), ("unet", 100)]
    assert lines["block", 10][484].tolist() == [0.7, 0.5] and list(lines["unet", 100]) == [14]
    with pytest.raises(SystemExit, match="NETWORK-OBJECTSxVIEWS"):
        study_law.lines_of({("depth", "other"): {}}, ["other"], 1)
