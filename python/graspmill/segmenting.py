"""Objects in a depth image: runs ``graspmill segment`` on an array, and reads its results.

All lengths are in metres, all positions in the camera's frame: x right, y down, z forward. ``docs/completing.md`` explains the method.
"""

from __future__ import annotations

import json
import os
import shutil
import subprocess
import tempfile
import zlib
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .errors import DatasetError, unreadable

Floats = NDArray[np.float64]

CONTAINER_LABEL = 65534
"""Label of pixels of a container's walls and rim."""
PLANE_LABEL = 65535
"""Label of pixels of the support plane."""


@dataclass(frozen=True)
class SupportPlane:
    """Plane on which the objects are: ``normal @ point + offset = 0``."""

    normal: Floats
    """Unit normal towards the camera, float64 (3,)."""
    offset: float
    """Height of the camera above the plane [m]."""
    position: Floats
    """Origin of the plane's frame: the point nearest to the camera [m], float64 (3,)."""
    quaternion: Floats
    """Unit quaternion w, x, y, z of the plane's frame in the camera's, float64 (4,); z is the normal."""


@dataclass(frozen=True)
class ContainerWall:
    """Inner face of a wall: ``normal @ point + offset = 0``."""

    normal: Floats
    """Unit normal into the container, float64 (3,)."""
    offset: float
    """Distance of the camera from the face, positive on the container's side [m]."""
    seen: bool
    """Whether the image shows the face; the position of others follows from the walls beside them."""


@dataclass(frozen=True)
class SegmentedContainer:
    """Bin or tote around the objects; its floor is the support plane."""

    rim: float
    """Height of the rim above the floor [m]."""
    walls: tuple[ContainerWall, ...]
    """Walls, up to four."""


@dataclass(frozen=True)
class SegmentedBox:
    """Upright box of smallest footprint around the visible points of an object."""

    centre: Floats
    """Middle [m], float64 (3,)."""
    axes: Floats
    """Unit axes, one per row: the longer and the shorter side of the footprint, and the plane's normal. float64 (3, 3)."""
    size: Floats
    """Full lengths along the axes [m], float64 (3,)."""


@dataclass(frozen=True)
class SegmentedObject:
    """An object of a segmented image."""

    name: str
    """Name, ``object-1`` for the label 1."""
    label: int
    """Value of its pixels in the labels."""
    centre: Floats
    """Mean of the visible points [m], float64 (3,)."""
    height: float | None
    """Largest height above the plane [m]; ``None`` without a plane."""
    box: SegmentedBox | None
    """Box around the visible points; ``None`` if all points are outliers."""
    confidence: float
    """Share of the outline at which the image shows that the object ends, from 0 to 1. It is no probability."""
    leans_on: dict[str, float]
    """Things that it leans on (names of objects, ``ground``, ``container``), with the length of the shared border [m]."""
    refusal: str | None
    """Reason why it cannot be completed; ``None`` if it can."""
    vertices: NDArray[np.float32]
    """Vertices of the visible surface [m], float32 (n, 3)."""
    triangles: NDArray[np.uint32]
    """Vertices of each triangle of the visible surface, uint32 (m, 3)."""


@dataclass(frozen=True)
class Segmentation:
    """Results of ``graspmill segment`` for one image."""

    labels: NDArray[np.uint16]
    """Label of each pixel, uint16 (height, width): 0 nothing, n the n-th object, 65534 container, 65535 plane."""
    plane: SupportPlane | None
    """Support plane; ``None`` if none was found."""
    container: SegmentedContainer | None
    """Container around the objects; ``None`` if none was found."""
    objects: tuple[SegmentedObject, ...]
    """Objects, the largest first."""


class SegmentationFailed(Exception):
    """A call of ``graspmill segment`` without a result; the message is that of the program."""


def _installed_program() -> str | None:
    own = Path(__file__).resolve().parent / "_bin" / "graspmill"
    return str(own) if own.is_file() else shutil.which("graspmill")


def segment(
    depth: NDArray[Any],
    intrinsics: Sequence[float],
    *,
    pixel_centre: float = 0.0,
    options: Sequence[str] = (),
    program: str | os.PathLike[str] | None = None,
) -> Segmentation:
    """Segments a depth image.

    ``depth`` has the shape (height, width): floats in metres, where values that are not positive and finite mean no return, or
    uint16 in millimetres, where 0 and 65535 mean no return. ``intrinsics`` are fx, fy, cx, cy [px]; ``pixel_centre`` is the
    coordinate of the first pixel's centre, 0 (OpenCV, ROS) or 0.5. ``options`` are further options of the command, such as
    ``["--container", "off"]``. ``program`` is the path of graspmill; by default it is the
    program that a wheel installed with this package, or else the one in PATH.

    Raises ``FileNotFoundError`` where the program is not found, ``ValueError`` for an array of another shape or type, and
    ``SegmentationFailed`` where the program refuses the image.
    """
    depth = np.asarray(depth)
    if depth.ndim != 2 or len(intrinsics) != 4:
        raise ValueError(f"depth has the shape {depth.shape}, and intrinsics {len(intrinsics)} numbers; pass (height, width) and 4")
    if depth.dtype != np.uint16:
        if not np.issubdtype(depth.dtype, np.floating):
            raise ValueError(f"depth has the type {depth.dtype}; pass floats in metres, or uint16 in millimetres")
        depth = depth.astype("<f4")
    found = _installed_program() if program is None else os.fspath(program)
    if found is None:
        raise FileNotFoundError("graspmill is not in PATH; pass its path as `program`")
    with tempfile.TemporaryDirectory() as folder:
        image, out = Path(folder) / "depth.npy", Path(folder) / "scene"
        np.save(image, np.ascontiguousarray(depth))
        numbers = ",".join(repr(float(number)) for number in intrinsics)
        centre = "0" if pixel_centre == 0 else repr(float(pixel_centre))
        command = [found, "segment", str(image), f"--intrinsics={numbers}", "--pixel-centre", centre, "--out", str(out)]
        done = subprocess.run([*command, *options], capture_output=True, text=True, check=False)
        # 3: written, but an object is refused, or there is none.
        if done.returncode not in (0, 3):
            raise SegmentationFailed(done.stderr.strip() or f"exit code {done.returncode}")
        return read_segmentation(out)


def read_segmentation(folder: str | os.PathLike[str]) -> Segmentation:
    """Reads a folder that ``graspmill segment`` wrote for one image.

    Raises ``DatasetError`` where a file of it is missing or damaged.
    """
    place = Path(folder)
    path = place / "scene.json"
    remedy = "pass a folder that `graspmill segment` wrote for one image, and the subfolder of one image of several"
    try:
        scene = json.loads(path.read_text(encoding="utf-8"))
        if not str(scene["format"]).startswith("graspmill scene "):
            raise ValueError("it describes no segmented image")
        path = place / scene["labels"]
        labels = _read_labels(path)
        objects = []
        for number, row in enumerate(scene["objects"], 1):
            path = place / (row["surface"] or "scene.json")
            objects.append(_object(row, number, place))
        return Segmentation(labels, _plane(scene["plane"]), _container(scene["container"]), tuple(objects))
    except OSError as error:
        raise unreadable(path, error) from None
    except (KeyError, TypeError, ValueError, zlib.error) as error:
        raise DatasetError(path, f"it has not the expected content ({error})", remedy) from None


def _floats(values: Any) -> Floats:
    return np.array(values, dtype=np.float64)


def _plane(row: dict[str, Any] | None) -> SupportPlane | None:
    if row is None:
        return None
    return SupportPlane(_floats(row["normal"]), row["offset"], _floats(row["position"]), _floats(row["quaternion"]))


def _container(row: dict[str, Any] | None) -> SegmentedContainer | None:
    if row is None:
        return None
    walls = tuple(ContainerWall(_floats(wall["normal"]), wall["offset"], wall["seen"]) for wall in row["walls"])
    return SegmentedContainer(row["rim"], walls)


def _object(row: dict[str, Any], label: int, place: Path) -> SegmentedObject:
    box = row["box"]
    surface = row["surface"]
    vertices, triangles = _read_surface(place / surface) if surface else (np.zeros((0, 3), "f4"), np.zeros((0, 3), "u4"))
    return SegmentedObject(
        name=row["name"],
        label=label,
        centre=_floats(row["centre"]),
        height=row["height"],
        box=box and SegmentedBox(_floats(box["centre"]), _floats(box["axes"]), _floats(box["size"])),
        confidence=row["confidence"],
        leans_on={support["on"]: support["border"] for support in row["leans_on"]},
        refusal=row["refusal"],
        vertices=vertices,
        triangles=triangles,
    )


def _chunks(content: bytes) -> Iterator[tuple[bytes, bytes]]:
    """Chunks of a PNG: type and data."""
    at = 8
    while at + 12 <= len(content):
        length = int.from_bytes(content[at : at + 4], "big")
        yield content[at + 4 : at + 8], content[at + 8 : at + 8 + length]
        at += 12 + length


def _read_labels(path: Path) -> NDArray[np.uint16]:
    """A grey PNG of 16 bits without interlacing, as the program writes it."""
    content = path.read_bytes()
    chunks = list(_chunks(content))
    if not chunks or chunks[0][0] != b"IHDR" or chunks[0][1][8:10] != b"\x10\x00":
        raise ValueError("no grey PNG of 16 bits")
    head = chunks[0][1]
    width, height = int.from_bytes(head[:4], "big"), int.from_bytes(head[4:8], "big")
    raw = zlib.decompress(b"".join(data for kind, data in chunks if kind == b"IDAT"))
    rows = np.frombuffer(raw, np.uint8).reshape(height, 1 + 2 * width)
    bytes_of = np.zeros((height + 1, 2 * width), np.uint8)
    for row, line in enumerate(rows):
        bytes_of[row + 1] = _unfiltered(int(line[0]), line[1:], bytes_of[row])
    labels: NDArray[np.uint16] = bytes_of[1:].copy().view(">u2").astype(np.uint16)
    return labels


def _unfiltered(kind: int, line: NDArray[np.uint8], above: NDArray[np.uint8]) -> NDArray[np.uint8]:
    """Bytes of a row of a PNG with two bytes per pixel (PNG specification, section 9.2)."""
    if kind == 0:
        return line
    if kind == 1:
        sums = np.cumsum(line.reshape(-1, 2), axis=0, dtype=np.uint8)
        return sums.reshape(-1)
    if kind == 2:
        return line + above
    if kind not in (3, 4):
        raise ValueError(f"filter {kind}")
    row = np.zeros(len(line), np.uint8)
    for at in range(len(line)):
        left, up = (int(row[at - 2]) if at > 1 else 0), int(above[at])
        corner = int(above[at - 2]) if at > 1 else 0
        if kind == 3:
            guess = (left + up) // 2
        else:
            # Paeth: the neighbour nearest to left + up - corner.
            guess = min((left, up, corner), key=lambda value: abs(left + up - corner - value))
        row[at] = (int(line[at]) + guess) & 255
    return row


def _read_surface(path: Path) -> tuple[NDArray[np.float32], NDArray[np.uint32]]:
    """A binary PLY of triangles, as the program writes it."""
    content = path.read_bytes()
    mark = b"end_header\n"
    if mark not in content:
        raise ValueError("no head of a PLY")
    end = content.index(mark) + len(mark)
    counts = {}
    for line in content[:end].decode("ascii", "replace").splitlines():
        words = line.split()
        if words[:1] == ["element"]:
            counts[words[1]] = int(words[2])
    vertices = np.frombuffer(content, "<f4", 3 * counts["vertex"], end).reshape(-1, 3)
    faces = np.frombuffer(content, np.dtype([("count", "u1"), ("corners", "<u4", 3)]), counts["face"], end + vertices.nbytes)
    return vertices.astype(np.float32), faces["corners"].astype(np.uint32)
