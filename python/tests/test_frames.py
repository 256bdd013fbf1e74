"""Slices, names of objects, and pandas frames against the index and the stored records."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import numpy as np
import pandas
import pyarrow.parquet as parquet
import pytest
from conftest import FOLDERS
from graspmill import (
    TRIAL_VERDICTS,
    VERDICTS,
    CompletionSample,
    Dataset,
    GraspSample,
    MissingPackage,
    ShuffledChunks,
    grasp_frame,
)


@pytest.mark.parametrize(
    "asked", [slice(0, 3), slice(-3, None), slice(None, None, 2), slice(5, 1, -1), slice(4, 4), slice(2, 10**6)]
)
def test_a_slice_is_a_dataset_of_these_samples(data: Path, asked: slice) -> None:
    pairs = Dataset(data / "pairs", CompletionSample, split="training")
    some, expected = pairs[asked], range(len(pairs))[asked]
    assert isinstance(some, Dataset) and len(some) == len(expected)
    assert [sample.index for sample in some] == [int(pairs.indices[place]) for place in expected]
    assert some.column("item").tolist() == pairs.column("item")[asked].tolist()
    assert [sample.index for sample in some.gather(range(len(some)))] == some.indices.tolist()
    shuffled = [sample.index for sample in ShuffledChunks(some, seed=3, buffer=4)]
    assert sorted(shuffled) == sorted(some.indices.tolist())
    for place in expected:
        assert pairs[place].payload("pair") == some[list(expected).index(place)].payload("pair")


def test_a_slice_leaves_its_dataset_as_it_was(data: Path) -> None:
    pairs = Dataset(data / "pairs", CompletionSample)
    whole, first = len(pairs), pairs[0].index
    assert pairs[10:20][0].index == int(pairs.indices[10]) and pairs[10:20][2:4][1].index == int(pairs.indices[13])
    assert (len(pairs), pairs[0].index) == (whole, first)
    with pytest.raises(IndexError, match="index 3 of 3 samples"):
        pairs[0:3][3]


def test_objects_are_those_of_the_selection(data: Path) -> None:
    pairs = Dataset(data / "pairs")
    assert pairs.objects == {row["name"]: row["object"] for row in pairs.folder.objects()}
    for split in ("training", "validation", "test"):
        some = Dataset(data / "pairs", split=split)
        assert set(some.objects.items()) == set(zip(some.column("object"), some.column("subject")))
        assert 0 < len(some.objects) < len(pairs.objects)
    one = next(iter(pairs.objects))
    assert list(Dataset(data / "pairs", objects=[one]).objects) == [one] and pairs[:0].objects == {}


@pytest.mark.parametrize("name", FOLDERS)
def test_frames_are_the_index(data: Path, name: str) -> None:
    samples = Dataset(data / name)
    table = parquet.read_table(data / name / "index.parquet")
    plain = [column for column in table.column_names if not column.startswith("digest_")]
    whole = samples.index.frame()
    assert whole.columns.tolist() == plain and len(whole) == samples.folder.samples
    for column in plain:
        absent = "" if column in ("reason", "detail") else None
        expected = [absent if value is None else value for value in table[column].to_pylist()]
        assert whole[column].tolist() == expected, column
    frame = samples.frame()
    assert frame["sample_index"].tolist() == samples.indices.tolist() and frame["kept"].all()
    pandas.testing.assert_frame_equal(frame, whole[whole["kept"]].reset_index(drop=True))
    pandas.testing.assert_frame_equal(samples[::-2].frame(), frame[::-2].reset_index(drop=True))


def test_the_frame_of_grasps_has_a_row_per_grasp(data: Path) -> None:
    runs = Dataset(data / "set/grasps", GraspSample)
    frame = grasp_frame(runs)
    assert len(frame) == sum(len(run.grasps) for run in runs) > 0
    first = 0
    for place, run in enumerate(runs):
        grasps, trials = run.grasps, run.trials
        rows = frame[first : first + len(grasps)].reset_index(drop=True)
        first += len(grasps)
        for name in ("sample_index", "object", "subject", "split", "item"):
            assert set(rows[name]) == {runs.column(name)[place]}
        assert rows["rank"].tolist() == list(range(len(grasps)))
        assert rows["verdict"].tolist() == [VERDICTS[verdict] for verdict in grasps["verdict"]]
        assert rows["type"].fillna(-1).tolist() == grasps["type"].tolist()
        for name in ("object_from_base", "object_from_approach"):
            assert np.array_equal(np.stack(rows[name]).reshape(-1, 4, 4), grasps[name])
        for name in ("posture", "opening", "joints", "joints_before", "amplitudes"):
            assert np.array_equal(np.stack(rows[name]), grasps[name])
        for name in ("energy", "epsilon_force", "epsilon_wrench", "volume", "penetration", "advance", "width"):
            assert np.array_equal(rows[name].to_numpy(), grasps[name], equal_nan=True)
        closed = grasps["verdict"] != VERDICTS.index("penetrates")
        assert [len(each) for each in rows["clearances"]] == (closed * run.run["resting_poses"]).tolist()
        tried = rows.iloc[trials["grasp"]]
        assert tried["trial"].tolist() == [TRIAL_VERDICTS[verdict] for verdict in trials["verdict"]]
        assert tried["held"].tolist() == (trials["verdict"] == 0).tolist()
        for name in ("perturbed", "perturbed_held", "roll_outs", "roll_outs_held"):
            assert tried[name].tolist() == trials[name].tolist()
        under_variants = trials["variants"] > 0
        assert (tried["robust"].notna() == under_variants).all()
        assert tried["table_pose"].fillna(-1).tolist() == trials["table_pose"].tolist()
        assert tried["held_on_table"].fillna(False).tolist() == trials["held_on_table"].tolist()
        robust = trials["variants_held"] == trials["variants"]
        assert tried["robust"][under_variants].tolist() == robust[under_variants].tolist()
        assert rows["held"].isna().sum() == len(rows) - len(trials)
        pandas.testing.assert_frame_equal(run.frame(), rows[run.frame().columns])
    assert set(frame["held"].dropna()) == {True, False}
    untried = grasp_frame(Dataset(data / "set/grasps", GraspSample, channels=["run"]))
    assert len(untried) == len(frame) and "held" not in untried
    assert grasp_frame(runs[:0]).empty


@pytest.mark.parametrize(
    ("package", "call", "words"),
    [
        ("pandas", "graspmill.Dataset(sys.argv[1]).frame()", "a frame needs pandas, which is not installed; `pip"),
        ("torch", "import graspmill.torch", "--torch-backend=cpu`"),
    ],
)
def test_missing_packages_come_with_a_remedy(data: Path, package: str, call: str, words: str) -> None:
    """In a process where the import of the package fails, as it does where it is not installed."""
    block = (
        "import sys, graspmill\n"
        "class Absent:\n"
        "    def find_spec(self, name, path=None, target=None):\n"
        f"        if name == {package!r}: raise ModuleNotFoundError('absent', name=name)\n"
        "sys.meta_path.insert(0, Absent())\n"
        f"try: {call}\n"
        "except graspmill.MissingPackage as error: print(error.name, '|', error)\n"
    )
    command = [sys.executable, "-c", block, str(data / "pairs")]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert done.stdout.startswith(f"{package} | ") and words in done.stdout, done.stderr
    assert issubclass(MissingPackage, ImportError)
