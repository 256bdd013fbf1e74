"""Reachability against `graspmill query reach --json`, on both kinds of grid, and blocks against the field."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from graspmill import LABELS, Dataset, ReachabilityField, ReachabilitySample

GRIDS = ("axes", "sphere")


@pytest.mark.parametrize("name", GRIDS)
def test_values_are_those_of_the_program(data: Path, name: str) -> None:
    answers = json.loads((data / f"{name}.json").read_text(encoding="utf-8"))
    field = ReachabilityField(data / name)
    assert (field.robot, field.joints, field.target, field.frame, field.unit) == tuple(
        answers[key] for key in ("robot", "joints", "target", "frame", "unit")
    )
    rows = answers["poses"]
    poses = np.array([row["pose"] for row in rows])
    values, gradients = field.distance_and_gradient(poses)
    assert np.abs(values - [row["distance"] for row in rows]).max() < 1e-6
    assert np.abs(gradients - np.array([row["gradient"] for row in rows])).max() < 1e-6
    nearest = field.nearest(poses)
    assert nearest.cells.tolist() == [row["nearest"]["cell"] for row in rows]
    assert nearest.names == [row["nearest"]["label"] for row in rows]
    assert nearest.inside.tolist() == [row["inside_grid"] for row in rows]
    assert 0 < nearest.inside.sum() < len(rows) and len(set(nearest.names)) > 1
    assert np.abs(nearest.poses - np.array([row["nearest"]["pose"] for row in rows])).max() < 1e-9
    witnesses = field.witnesses()
    for row in rows:
        found = witnesses[row["nearest"]["cell"]]
        if "witness" in row["nearest"]:
            assert found.tolist() == row["nearest"]["witness"]
        else:
            assert np.isnan(found).all()


@pytest.mark.parametrize("name", GRIDS)
def test_centres_have_the_values_of_their_cells(data: Path, name: str) -> None:
    field = ReachabilityField(data / name)
    cells = np.arange(0, field.labels.size, 5)
    poses = field.poses(cells)
    assert np.abs(field.distance(poses) - field.distances.reshape(-1)[cells]).max() < 1e-9
    assert np.array_equal(field.nearest(poses).cells, cells)
    turned = poses + np.array([0, 0, 0, 2, -4, 2]) * np.pi
    assert np.abs(field.distance(turned) - field.distance(poses)).max() < 1e-6
    assert field.distance(poses.reshape(-1, 1, 6)).shape == (len(poses), 1)
    assert np.isnan(field.distance([np.nan, 0, 0, 0, 0, 0]))
    with pytest.raises(ValueError, match="x, y, z, roll, pitch, yaw"):
        field.distance([0.0, 0.0])


@pytest.mark.parametrize("name", GRIDS)
def test_blocks_are_the_fields_labels(data: Path, name: str) -> None:
    blocks = Dataset(data / name, ReachabilitySample)
    field = ReachabilityField(data / name)
    labels = np.concatenate([block.labels for block in blocks])
    assert np.array_equal(labels, field.labels.reshape(-1)) and set(labels) <= set(range(len(LABELS)))
    assert ((field.distances < 0) == (field.labels == 2)).all()
    for block in blocks:
        assert block.witnesses.shape == ((block.labels == 2).sum(), len(field.joints))
        assert np.array_equal(block.proofs == 4, block.labels == 2)
    assert np.array_equal(blocks.column("reachable"), [np.sum(block.labels == 2) for block in blocks])
