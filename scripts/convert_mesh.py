#!/usr/bin/env python3
"""Converts any mesh that trimesh reads (glTF, GLB, DAE, 3MF, ...) to a binary PLY for graspmill.

    python scripts/convert_mesh.py IN OUT.ply

All parts of a scene are joined into one mesh at their poses in the scene. Nothing is merged, repaired, scaled or rotated: the
numbers stay in the file's own unit and frame, so state the unit in the job file (glTF and GLB are in metres, y up).

Needs the Python package trimesh (`make deps-test` has it; DAE also needs pycollada, 3MF lxml and networkx).
Exit codes: 0 done; 1 the file cannot be converted; 2 wrong arguments.
"""

import sys
from pathlib import Path


def triangles_of(loaded):
    """All triangles of a mesh or a scene: vertices (n, 3) in float64, faces (m, 3)."""
    import numpy
    import trimesh

    parts = loaded.dump() if isinstance(loaded, trimesh.Scene) else [loaded]
    vertices, faces, count = [], [], 0
    for part in parts:
        if not isinstance(part, trimesh.Trimesh) or len(part.faces) == 0:
            print(f"convert: a part without faces is left out ({type(part).__name__})", file=sys.stderr)
            continue
        vertices.append(numpy.asarray(part.vertices, dtype="<f8"))
        faces.append(numpy.asarray(part.faces, dtype="<i4") + count)
        count += len(part.vertices)
    if not vertices:
        raise ValueError("it holds no triangles")
    return numpy.concatenate(vertices), numpy.concatenate(faces)


def write_ply(path, vertices, faces):
    import numpy

    rows = numpy.empty(len(faces), dtype=[("count", "u1"), ("corners", "<i4", 3)])
    rows["count"], rows["corners"] = 3, faces
    header = (
        "ply\nformat binary_little_endian 1.0\n"
        f"element vertex {len(vertices)}\nproperty double x\nproperty double y\nproperty double z\n"
        f"element face {len(faces)}\nproperty list uchar int vertex_indices\nend_header\n"
    )
    path.write_bytes(header.encode() + vertices.tobytes() + rows.tobytes())


def main(arguments):
    if len(arguments) != 2 or not arguments[1].lower().endswith(".ply"):
        print(__doc__.strip(), file=sys.stderr)
        return 2
    source, target = map(Path, arguments)
    try:
        import trimesh

        loaded = trimesh.load(source, process=False)
        vertices, faces = triangles_of(loaded)
        write_ply(target, vertices, faces)
    except Exception as error:  # Whatever a reader of foreign formats may raise.
        print(f"convert: {source}: {error}", file=sys.stderr)
        return 1
    unit = getattr(loaded, "units", None)
    print(f"{target}: {len(faces)} triangles, {len(vertices)} vertices" + (f", unit {unit}" if unit else ""))
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
