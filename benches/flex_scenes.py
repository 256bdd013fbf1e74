"""The judge of bench-peers: scenes as stock MuJoCo has them, bodies as rigid flexes of the meshes' own triangles."""
import mujoco
import numpy as np
import trimesh


def box(size, position, rest=""):
    sides = " ".join(str(half) for half in size)
    return f'<geom type="box" size="{sides}" pos="{" ".join(map(str, position))}"{rest}/>'


def boxes_of_bin(x, y, z, wall):
    """Floor and walls of a bin with this room inside: half sides and centre of each box [m]."""
    boxes = [((x / 2 + wall, y / 2 + wall, wall / 2), (0, 0, -wall / 2))]
    for sign in (-1, 1):
        boxes.append(((wall / 2, y / 2 + wall, z / 2), (sign * (x + wall) / 2, 0, z / 2)))
        boxes.append(((x / 2, wall / 2, z / 2), (0, sign * (y + wall) / 2, z / 2)))
    return boxes


def container(sample):
    """The container out of MuJoCo's own solids."""
    kind, sizes = sample.container
    if kind == "plane":
        return '<geom type="plane" size="5 5 1"/>'
    tilt = sizes[4] if len(sizes) > 4 else 0.0
    rotation = trimesh.transformations.rotation_matrix(np.radians(tilt), (1, 0, 0))[:3, :3]
    return "".join(box(half, rotation @ centre, f' axisangle="1 0 0 {tilt}"') for half, centre in boxes_of_bin(*sizes[:4]))


def inertial(row, mass):
    """Mass, centre and inertia of a body of this row of the table of assets."""
    inertia = np.array(row["inertia_per_kilogram"]).reshape(3, 3) * mass
    full = [inertia[i, j] for i, j in ((0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2))]
    centre, full = (" ".join(map(str, values)) for values in (row["centre_of_mass"], full))
    return f'<inertial pos="{centre}" mass="{mass}" fullinertia="{full}"/>'


def triangles(mesh):
    """Vertices and triangles that MuJoCo takes: welded, none without area, none twice."""
    mesh = mesh.copy()
    mesh.merge_vertices(digits_vertex=6)
    mesh.update_faces(mesh.nondegenerate_faces(height=1e-9))
    mesh.update_faces(mesh.unique_faces())
    mesh.remove_unreferenced_vertices()
    return mesh.vertices, mesh.faces


def spec_of(sample, meshes, facts):
    bodies = []
    for number, (object_id, pose) in enumerate(zip(sample.objects, sample.world_from_object)):
        quaternion = np.zeros(4)
        mujoco.mju_mat2Quat(quaternion, pose[:3, :3].flatten())
        points, faces = triangles(meshes[object_id])
        text = " ".join(f"{value:.9g}" for value in points.ravel())
        elements = " ".join(map(str, faces.ravel()))
        bodies.append(
            f'<body name="b{number}" pos="{" ".join(map(repr, map(float, pose[:3, 3])))}" '
            f'quat="{" ".join(map(repr, map(float, quaternion)))}"><freejoint/>'
            f"{inertial(facts[object_id], sample.masses[number])}"
            f'<flexcomp name="f{number}" type="direct" dim="2" rigid="true" radius="1e-5" point="{text}" element="{elements}">'
            f'<contact selfcollide="none" condim="6" friction="{sample.frictions[number]} 0.005 0.002" '
            f'solref="0.004 1" solimp="0.95 0.995 0.0005"/></flexcomp></body>'
        )
    return (
        '<mujoco><option timestep="0.002" integrator="implicitfast" cone="elliptic" impratio="100"/><size memory="512M"/>'
        '<default><geom condim="6" friction="0 0 0" solref="0.004 1" solimp="0.95 0.995 0.0005"/></default>'
        f"<worldbody>{container(sample)}{''.join(bodies)}</worldbody></mujoco>"
    )


def motion(sample, meshes, facts, seconds):
    """Motion of each centre of mass [m] when the bodies are stepped from their poses, at rest."""
    model = mujoco.MjModel.from_xml_string(spec_of(sample, meshes, facts))
    state = mujoco.MjData(model)
    mujoco.mj_forward(model, state)
    before = state.xipos[1:].copy()
    for _ in range(round(seconds / model.opt.timestep)):
        mujoco.mj_step(model, state)
    return np.linalg.norm(state.xipos[1:] - before, axis=1)[: len(sample.objects)]


class Meshes(dict):
    """Meshes by the digest of their object, read on demand from a folder with a file NAME.* per object."""

    def __init__(self, folder, facts):
        super().__init__()
        self.files = {path.stem: path for path in folder.rglob("*") if path.suffix in (".stl", ".ply", ".obj", ".off")}
        self.facts = facts

    def __missing__(self, object_id):
        row = self.facts[object_id]
        mesh = trimesh.load(self.files[row["name"]], force="mesh", process=False)
        # Frame and unit must be the dataset's, or nothing below means anything.
        off = np.abs(mesh.bounds[0] - row["lower"]).max()
        assert off < 1e-5, f"{row['name']}: {off} m off"
        self[object_id] = mesh
        return mesh
