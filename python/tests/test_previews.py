"""The preview of grasps, read by the official MCAP reader: clouds of points lie on the object and on the hand."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import igl
import numpy as np
from graspmill import Dataset, GraspSample, object_meshes
from mcap.reader import make_reader
from mcap_protobuf.decoder import DecoderFactory

TOPICS = ("/preview/object_points", "/preview/hand_points", "/preview/contact_points")


def points_of(cloud: Any) -> np.ndarray[Any, np.dtype[np.float32]]:
    """The positions of a cloud, after its own description of the fields."""
    assert [field.name for field in cloud.fields] == ["x", "y", "z", "red", "green", "blue", "alpha"]
    assert [field.offset for field in cloud.fields] == [0, 4, 8, 12, 13, 14, 15] and cloud.point_stride == 16
    rows = np.frombuffer(cloud.data, np.dtype([("at", "<f4", 3), ("colour", "u1", 4)]))
    assert len(rows) and (rows["colour"] == rows["colour"][0]).all() and rows["colour"][0, 3] == 255
    return rows["at"]


def test_grasps_are_drawn_as_points(data: Path) -> None:
    meshes = object_meshes(data / "set/grasps")
    grasps: list[Any] = []
    for run in Dataset(data / "set/grasps", GraspSample):
        contacts = run.contacts
        grasps += [contacts[contacts["grasp"] == rank]["point"] for rank in range(len(run.grasps))]
    drawn: dict[int, dict[str, Any]] = {}
    with (data / "set/grasps/preview.mcap").open("rb") as file:
        reader = make_reader(file, decoder_factories=[DecoderFactory()])
        for _, channel, message, cloud in reader.iter_decoded_messages():
            drawn.setdefault(message.log_time, {})[channel.topic] = cloud
    assert len(drawn) == len(meshes)
    for messages in drawn.values():
        object_points, hand_points, contact_points = (points_of(messages[topic]) for topic in TOPICS)
        ways = []
        for mesh in meshes.values():
            corners = mesh.vertices.astype(np.float64)
            squared = igl.point_mesh_squared_distance(object_points.astype(np.float64), corners, mesh.triangles)[0]
            ways.append(np.sqrt(squared.max()))
        # All of one object's surface, to its ends.
        mesh = list(meshes.values())[int(np.argmin(ways))]
        assert min(ways) < 1e-6 and len(object_points) > 5000
        for end in (np.min, np.max):
            assert np.allclose(end(object_points, axis=0), end(mesh.vertices, axis=0), atol=5e-3)
        # Contacts of a grasp; each lies on the object, and the hand's points come near.
        assert any(len(own) == len(contact_points) and np.allclose(own, contact_points, atol=1e-6) for own in grasps)
        gaps = np.linalg.norm(hand_points[None] - contact_points[:, None], axis=2).min(axis=1)
        assert len(hand_points) > 1000 and gaps.max() < 0.01
