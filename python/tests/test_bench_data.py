"""The parts of `make bench-data`, on grids made by hand: measures, planted faults, trivial completions, the table."""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
import pytest

sys.path.insert(0, str(Path(__file__).resolve().parents[2] / "benches"))

from data_baselines import extruded, hull, mirrored, nearest_neighbour  # noqa: E402
from data_faults import (  # noqa: E402
    ALL,
    FAULTS,
    HOLLOW,
    Fault,
    by_object,
    filled,
    interval,
    is_held_out,
    is_tested,
    jaccard,
    mixed_up,
    of_another_view,
    shell_of,
    strata,
    unpack,
)
from data_table import DATA, FAULT, LEAK, TRIVIAL, Row, Table  # noqa: E402
from default_view import N  # noqa: E402
from scipy.spatial import Delaunay  # noqa: E402

FAR_EYE = np.array([[N / 2, N / 2, -1e9]])
BY_NAME = {fault.name: fault for fault in FAULTS}


def box(low: tuple[int, int, int], high: tuple[int, int, int]) -> np.ndarray:
    """One grid whose cells from `low` to before `high` are occupied; (1, N, N, N)."""
    grid = np.zeros((1, N, N, N), bool)
    grid[0, low[0] : high[0], low[1] : high[1], low[2] : high[2]] = True
    return grid


def cup() -> np.ndarray:
    """A box open at its top (y = 10), with walls and a floor of two cells."""
    return box((10, 10, 10), (20, 20, 20)) & ~box((12, 10, 12), (18, 18, 18))


def test_jaccard_is_cells_in_both_over_cells_in_either() -> None:
    found = jaccard(box((0, 0, 0), (4, 4, 4)), box((2, 0, 0), (6, 4, 4)))
    assert found.tolist() == [32 / 96]
    assert jaccard(np.zeros((1, N, N, N), bool), np.zeros((1, N, N, N), bool)).tolist() == [0]


def test_the_interval_is_over_objects() -> None:
    scores, objects = np.array([0.0, 1.0, 0.5, 0.5, 0.5, 2.0]), np.array([0, 0, 1, 1, 1, 2])
    assert by_object(scores, objects).tolist() == [0.5, 0.5, 2.0]
    assert interval(np.full(7, 0.25)) == (0.25, 0.25)
    # Of a normal sample the bootstrap's interval is nearly the mean -+ 1.96 standard errors.
    sample = np.random.default_rng(1).normal(3.0, 1.0, 400)
    error = 1.96 * sample.std() / 20
    assert interval(sample) == pytest.approx((sample.mean() - error, sample.mean() + error), abs=0.02)


@pytest.mark.parametrize(
    ("name", "expected"),
    [
        ("truth one cell off in x", box((3, 3, 5), (8, 6, 9))),
        ("truth one cell off in y", box((2, 4, 5), (7, 7, 9))),
        ("truth one cell off in z", box((2, 3, 6), (7, 6, 10))),
        ("x and y of the truth swapped", box((3, 2, 5), (6, 7, 9))),
        ("truth mirrored", box((N - 7, 3, 5), (N - 2, 6, 9))),
        ("shell instead of solid", box((2, 3, 5), (7, 6, 9)) & ~box((3, 4, 6), (6, 5, 8))),
        ("hollows filled in", box((2, 3, 5), (7, 6, 9))),
    ],
)
def test_a_fault_changes_what_it_says(name: str, expected: np.ndarray) -> None:
    grids = box((2, 3, 5), (7, 6, 9))
    kept = grids.copy()
    assert np.array_equal(BY_NAME[name].change(grids), expected)
    assert np.array_equal(grids, kept), "the right grids stay right"


def test_what_is_shifted_out_of_the_grid_is_lost() -> None:
    assert BY_NAME["truth one cell off in x"].change(box((N - 1, 0, 0), (N, 4, 4))).sum() == 0
    assert shell_of(box((0, 0, 0), (5, 5, 5))).sum() == 125 - 27, "the grid's edge is an edge"


def test_filling_closes_a_cup_and_nothing_else() -> None:
    assert np.array_equal(filled(cup()), box((10, 10, 10), (20, 20, 20)))
    apart = box((2, 2, 2), (4, 4, 4)) | box((8, 8, 8), (10, 10, 10))
    assert np.array_equal(filled(apart), apart)


def test_partners_are_mixed_up_as_said() -> None:
    objects = np.repeat(["a", "b", "c", "d"], 25)
    rows = mixed_up(objects, np.random.default_rng(0))
    assert (rows != np.arange(100)).sum() == 20 and sorted(rows) == list(range(100))
    rows = of_another_view(objects, np.random.default_rng(0))
    assert np.array_equal(objects[rows], objects)
    assert (rows != np.arange(100)).all() and sorted(rows) == list(range(100))


def test_families_are_held_out_whole() -> None:
    names = ["025_mug", "065-a_cups", "065-b_cups", "013_apple", "055_baseball"]
    assert [is_held_out(name) for name in names] == [True, True, True, False, True]
    assert [is_tested(name) for name in names] == [True, True, False, False, True]


def test_strata_go_by_the_share_of_the_hull() -> None:
    masks = strata(np.array([0.1, 0.9, 0.39, 0.45]))
    assert masks[ALL].all() and masks[HOLLOW].tolist() == [True, False, True, False]


def test_cells_are_extruded_along_their_rays() -> None:
    plate = box((10, 10, 10), (14, 14, 11)) | box((20, 20, 19), (21, 21, 20))
    straight = box((10, 10, 10), (14, 14, 20)) | box((20, 20, 19), (21, 21, 20))
    assert np.array_equal(extruded(plate, FAR_EYE), straight)
    # Seen 5 cells off the axis and 10 before the eye, the ray is 9.25 to 9.5 cells off where it ends, 18.5 to 19 before
    # it.
    eye = np.array([[10.5, 10.5, 0.5]])
    ray = extruded(box((15, 10, 10), (16, 11, 11)) | box((10, 10, 19), (11, 11, 20)), eye)[0]
    assert np.flatnonzero(ray[11:, 10, 19]).tolist() == [19 - 11, 20 - 11]


def test_the_front_of_a_ball_is_mirrored_to_the_ball() -> None:
    x, y, z = np.indices((N, N, N)) - 20
    ball = x**2 + y**2 + z**2 <= 100
    front = ball & (np.cumsum(ball, axis=2) == 1)
    assert jaccard(mirrored(front[None]), ball[None])[0] > 0.99


def test_the_hull_is_that_of_another_way() -> None:
    rng = np.random.default_rng(3)
    for cells in (cup()[0], rng.random((N, N, N)) < 0.0005):
        corners = np.argwhere(cells)
        inside = Delaunay(corners).find_simplex(np.argwhere(np.ones_like(cells)), tol=1e-9) >= 0
        assert np.array_equal(hull(cells[None])[0], inside.reshape(N, N, N))
    flat = box((3, 3, 7), (9, 9, 8))
    assert np.array_equal(hull(flat), flat)


def test_the_nearest_training_pair_is_the_pair_itself() -> None:
    partial = np.concatenate([box((k, k, k), (k + 8, k + 8, k + 8)) for k in (0, 8, 16, 24)])
    complete = np.concatenate([box((k, 0, 0), (k + 1, 1, 1)) for k in range(4)])
    bits = [np.packbits(grids.reshape(4, -1), axis=1, bitorder="little") for grids in (partial, complete)]
    assert np.array_equal(unpack(bits[0]), partial)
    assert np.array_equal(nearest_neighbour(partial[::-1], *bits), complete[::-1])


def test_the_table_tells_faults_from_good_data() -> None:
    good = np.linspace(0.4, 0.8, 8)
    noise = np.tile([0.05, -0.05], 4)
    rows = [
        Row("as made", DATA, good),
        Row("worse", FAULT, good - 0.02 + noise / 10),
        Row("the same", FAULT, good + noise),
        Row("worse of some", FAULT, good - np.repeat([0.0, 0.1], 4), stratum="some"),
        Row("trivial", TRIVIAL, good - 0.3),
        Row("leak", LEAK, good - 0.1, against="trivial"),
        Row("no leak", LEAK, good - 0.3, against="trivial"),
    ]
    table = Table(rows, {ALL: np.ones(8, bool), "some": np.repeat([False, True], 4)})
    assert table.untold(FAULT) == ["the same"] and table.untold(LEAK) == ["no leak"] and table.untold(TRIVIAL) == []
    assert table.loss(rows[3], "some")[0] == pytest.approx(0.1)
    told = [line.split("  ")[0] for line in table.text().splitlines() if "*" in line]
    assert told == ["worse", "worse of some", "(trivial)", "leak"]
    facts = {fact["name"]: fact for fact in table.facts()}
    assert facts["leak"]["told"] and facts["leak"]["strata"]["some"]["loss"]["mean"] == pytest.approx(-0.2)


def test_no_fault_leaves_the_pairs_as_they_are() -> None:
    objects = np.repeat(["a", "b"], 10)
    for fault in FAULTS:
        moved = (fault.partners(objects, np.random.default_rng(0)) != np.arange(20)).any()
        assert moved or not np.array_equal(fault.change(cup()), cup()), fault.name
    assert np.array_equal(Fault("none").change(cup()), cup())
