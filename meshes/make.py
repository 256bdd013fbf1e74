#!/usr/bin/env python3
"""Writes the meshes of this folder, and the tote of scenes/ beside it; the same bytes on every machine. Standard library only.

    python3 meshes/make.py [FOLDER]

Lengths are metres, z is up, every surface is closed and its triangles turn counter-clockwise seen from outside.
"""

import math
import struct
import sys
from pathlib import Path

# Radius and height of a profile from the axis round to the axis again [m].
BOTTLE = [(0, 0), (0.034, 0), (0.036, 0.004), (0.036, 0.12), (0.03, 0.145), (0.014, 0.165), (0.013, 0.19), (0, 0.19)]
BOWL = [
    (0, 0), (0.032, 0), (0.034, 0.006), (0.05, 0.016), (0.068, 0.034), (0.078, 0.058),
    (0.074, 0.058), (0.064, 0.036), (0.047, 0.02), (0.03, 0.011), (0, 0.01),
]  # fmt: skip
# Outline in x and z [m], counter-clockwise seen from -y, and its depth along y [m].
BRACKET = ([(0, 0), (0.08, 0), (0.08, 0.012), (0.012, 0.012), (0.012, 0.06), (0, 0.06)], 0.04)
WEDGE = ([(0, 0), (0.09, 0), (0, 0.05)], 0.06)
# A tote with leaning walls and a rim: half sides, radius of the corners and height of its outlines, from below the floor outside
# up over the rim and down to the floor inside [m].
TOTE = [
    (0.165, 0.115, 0.02, 0), (0.183, 0.133, 0.025, 0.135), (0.2, 0.15, 0.03, 0.135), (0.2, 0.15, 0.03, 0.15),
    (0.18, 0.13, 0.022, 0.15), (0.162, 0.112, 0.018, 0.012), (0.156, 0.106, 0.014, 0.006),
]  # fmt: skip


def lathe(profile, sides):
    """A surface of revolution about z; its profile begins and ends on the axis."""
    angles = [2 * math.pi * side / sides for side in range(sides)]
    rings = [[(radius * math.cos(angle), radius * math.sin(angle), height) for angle in angles] for radius, height in profile[1:-1]]
    return stacked(rings, profile[0][1], profile[-1][1])


def vessel(outlines, steps):
    """A surface through rectangles with round corners, each of so many steps."""
    quarters = [(1, 1, 0), (-1, 1, 1), (-1, -1, 2), (1, -1, 3)]
    rings = []
    for x, y, radius, height in outlines:
        ring = []
        for across, along, quarter in quarters:
            for step in range(steps + 1):
                angle = math.pi / 2 * (quarter + step / steps)
                ring.append((
                    across * (x - radius) + radius * math.cos(angle), along * (y - radius) + radius * math.sin(angle), height
                ))
        rings.append(ring)
    return stacked(rings, outlines[0][3], outlines[-1][3])


def stacked(rings, bottom, top):
    """A surface through rings of points about z, closed by a point on the axis at either end, at these heights."""
    points = [(0.0, 0.0, bottom), (0.0, 0.0, top)] + [point for ring in rings for point in ring]
    sides = len(rings[0])

    def at(ring, side):
        return 2 + ring * sides + side % sides

    triangles = []
    for side in range(sides):
        triangles.append((0, at(0, side + 1), at(0, side)))
        for ring in range(len(rings) - 1):
            corners = at(ring, side), at(ring, side + 1), at(ring + 1, side + 1), at(ring + 1, side)
            triangles += [corners[:3], (corners[0], *corners[2:])]
        triangles.append((1, at(len(rings) - 1, side), at(len(rings) - 1, side + 1)))
    return points, triangles


def extrude(outline, depth):
    """A prism over an outline whose first corner sees every other one."""
    count = len(outline)
    points = [(x, y, z) for y in (0.0, depth) for x, z in outline]
    triangles = []
    for corner in range(1, count - 1):
        triangles.append((0, corner, corner + 1))
        triangles.append((count, count + corner + 1, count + corner))
    for corner in range(count):
        after = (corner + 1) % count
        triangles.append((corner, count + corner, count + after))
        triangles.append((corner, count + after, after))
    return points, triangles


def rounded(mesh):
    """Coordinates to a nanometre, so that the last bit of a sine reaches no file."""
    points, triangles = mesh
    return [tuple(round(value, 9) + 0.0 for value in point) for point in points], triangles


def stl(mesh):
    """Binary STL."""
    points, triangles = mesh
    body = b"".join(
        struct.pack("<12fH", 0, 0, 0, *(value for corner in triangle for value in points[corner]), 0)
        for triangle in triangles
    )
    return b"made by meshes/make.py".ljust(80) + struct.pack("<I", len(triangles)) + body


def obj(mesh):
    """Wavefront OBJ."""
    points, triangles = mesh
    lines = ["v {:.9g} {:.9g} {:.9g}".format(*point) for point in points]
    lines += ["f {} {} {}".format(*(corner + 1 for corner in triangle)) for triangle in triangles]
    return ("\n".join(lines) + "\n").encode()


def off(mesh):
    """Object File Format."""
    points, triangles = mesh
    lines = ["OFF", f"{len(points)} {len(triangles)} 0"]
    lines += ["{:.9g} {:.9g} {:.9g}".format(*point) for point in points]
    lines += ["3 {} {} {}".format(*triangle) for triangle in triangles]
    return ("\n".join(lines) + "\n").encode()


def ply(mesh):
    """Binary PLY, little-endian."""
    points, triangles = mesh
    head = (
        "ply\nformat binary_little_endian 1.0\n"
        f"element vertex {len(points)}\nproperty float x\nproperty float y\nproperty float z\n"
        f"element face {len(triangles)}\nproperty list uchar int vertex_indices\nend_header\n"
    )
    body = b"".join(struct.pack("<3f", *point) for point in points)
    return head.encode() + body + b"".join(struct.pack("<B3i", 3, *triangle) for triangle in triangles)


MESHES = {
    "bottle.stl": lambda: stl(rounded(lathe(BOTTLE, 48))),
    "bowl.ply": lambda: ply(rounded(lathe(BOWL, 48))),
    "bracket.obj": lambda: obj(rounded(extrude(*BRACKET))),
    "wedge.off": lambda: off(rounded(extrude(*WEDGE))),
    "../scenes/tote.stl": lambda: stl(rounded(vessel(TOTE, 4))),
}


def main():
    folder = Path(sys.argv[1]) if len(sys.argv) > 1 else Path(__file__).parent
    for name, content in MESHES.items():
        (folder / name).parent.mkdir(exist_ok=True)
        (folder / name).write_bytes(content())


if __name__ == "__main__":
    main()
