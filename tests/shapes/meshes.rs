//! Meshes of completed grids: files read by trimesh and MuJoCo, the quadratic programme against SciPy.

use std::f64::consts::PI;

use graspmill::{
    geom::{GridPlacement, OccupancyGrid, TriMesh},
    seed::Stream,
    surface::{
        CompletedMesh, CubeField, LaplacianRule, MeshBody, NeighbourWeights, OBSTACLE_THRESHOLD, SmoothingProblem,
        Solver, TablePlane, Volume, marching_cubes, write_mjcf, write_obj, write_ply, write_stl,
    },
    voxel::{InsideTest, solid_occupancy},
};
use serde_json::{Value, json};

use crate::support::{files::read_json, meshes::built_in_mesh, program::Program, workspace::Workspace};

fn placement(resolution: u32) -> GridPlacement {
    GridPlacement { resolution, centre: [0.05, -0.1, 0.8].into(), cell_size: 0.005 }
}

/// Cells of a grid whose centre lies in a built-in shape, which fills four fifths of it.
fn grid_of(name: &str, n: u32) -> OccupancyGrid {
    let mesh = built_in_mesh(name);
    let solid = solid_occupancy(&mesh, InsideTest::Crossings, false);
    let bounds = mesh.aabb().expect("a shape");
    let cell = bounds.longest_side() / (0.8 * f64::from(n));
    let mut grid = OccupancyGrid::new(n);
    for index in 0..n.pow(3) {
        let at = [index / n / n, index / n % n, index % n];
        let fine = (0..3).map(|axis| {
            let point = bounds.centre()[axis] + (f64::from(at[axis]) + 0.5 - 0.5 * f64::from(n)) * cell;
            (point - solid.origin[axis]) / solid.pitch
        });
        let fine: Vec<f64> = fine.collect();
        if fine.iter().all(|value| (0.0..256.0).contains(value))
            && solid.get(fine[0] as usize, fine[1] as usize, fine[2] as usize)
        {
            grid.set(at);
        }
    }
    assert!(grid.count() > 0, "{name} is in its grid");
    grid
}

fn field_of(grid: &OccupancyGrid) -> CubeField {
    let mut field = CubeField::filled(grid.resolution() as usize, 0.0);
    grid.cells().for_each(|cell| *field.at_mut(cell.map(|index| index as usize)) = 1.0);
    field
}

/// Meshes of noise at several densities, and of built-in shapes by both ways.
fn meshes() -> Vec<TriMesh> {
    let mut draw = Stream::of_job(3, b"", "noise");
    let mut meshes = Vec::new();
    for density in [0.02, 0.3, 0.5, 0.9] {
        let values = (0..12_usize.pow(3)).map(|_| if draw.unit() < density { 1.0 } else { 0.0 }).collect();
        let field = CubeField::from_values(12, values).expect("a cube");
        meshes.push(CompletedMesh::obstacle(&field, &placement(12), OBSTACLE_THRESHOLD).mesh);
    }
    for name in ["can-01", "cup-01", "bowl-01"] {
        let grid = grid_of(name, 24);
        meshes.push(CompletedMesh::obstacle(&field_of(&grid), &placement(24), OBSTACLE_THRESHOLD).mesh);
        meshes.push(CompletedMesh::merge_observed(&grid, &[], &placement(24)).completed.mesh);
    }
    meshes
}

#[test]
fn trimesh_reads_closed_meshes_of_the_same_volume_from_every_kind_of_file() {
    let work = Workspace::new();
    let meshes = meshes();
    for (index, mesh) in meshes.iter().enumerate() {
        let comments = ["frame: camera_cv".to_owned(), "a second line".to_owned()];
        work.write(format!("{index}.ply"), write_ply(mesh, &comments));
        work.write(format!("{index}.obj"), write_obj(mesh, &comments));
        work.write(format!("{index}.stl"), write_stl(mesh));
    }
    let lines = "
import json, sys, trimesh
found = []
for index in range(int(sys.argv[2])):
    for kind in ('ply', 'obj', 'stl'):
        mesh = trimesh.load(f'{sys.argv[1]}/{index}.{kind}', process=False)
        if kind == 'stl':
            mesh.merge_vertices()
        found.append([bool(mesh.is_watertight), bool(mesh.is_winding_consistent), float(mesh.volume), len(mesh.faces)])
print(json.dumps(found))
";
    let found: Value = Program::python_lines(lines).arg(work.folder()).arg(meshes.len().to_string()).succeed().json();
    let found = found.as_array().expect("a list");
    assert_eq!(found.len(), 3 * meshes.len());
    for (index, facts) in found.iter().enumerate() {
        let mesh = &meshes[index / 3];
        assert_eq!((&facts[0], &facts[1]), (&json!(true), &json!(true)), "mesh {}, file {}", index / 3, index % 3);
        let volume = facts[2].as_f64().expect("a volume");
        assert!((volume / mesh.signed_volume() - 1.0).abs() < 1e-4, "{volume} {}", mesh.signed_volume());
        assert_eq!(facts[3], json!(mesh.triangles.len()));
    }
}

#[test]
fn mujoco_weighs_completed_objects_as_closed_forms_do() {
    let work = Workspace::new();
    // A ball of 12 cells, by its distance field.
    let mut field = CubeField::filled(40, 0.0);
    for cell in field.cells() {
        let squares = cell.map(|index| (index as f64 + 0.5 - 20.0).powi(2));
        *field.at_mut(cell) = (12.5 - squares.iter().sum::<f64>().sqrt()) as f32;
    }
    let placement = placement(40);
    let ball = CompletedMesh::obstacle(&field, &placement, OBSTACLE_THRESHOLD).mesh;
    work.write("ball.obj", write_obj(&ball, &[]));
    let body = MeshBody { name: "ball".to_owned(), file: "ball.obj".to_owned(), density: 700.0 };
    let table = TablePlane { point: [0.0, 0.1, 0.8], normal: [0.0, -1.0, 0.0] };
    work.write("scene.xml", write_mjcf(&[body], Some(&table), None));
    let lines = "
import json, mujoco, sys
model = mujoco.MjModel.from_xml_path(f'{sys.argv[1]}/scene.xml')
data = mujoco.MjData(model)
mujoco.mj_forward(model, data)
body = model.body('ball').id
print(json.dumps([float(model.body_mass[body]), *map(float, data.xipos[body]), *map(float, model.opt.gravity)]))
";
    let found: Value = Program::python_lines(lines).arg(work.folder()).succeed().json();
    let found: Vec<f64> = found.as_array().expect("a list").iter().filter_map(Value::as_f64).collect();
    let mass = 700.0 * 4.0 / 3.0 * PI * (12.0 * placement.cell_size).powi(3);
    assert!((found[0] / mass - 1.0).abs() < 0.01, "{} kg, {mass} kg", found[0]);
    // The ball's middle is the grid's; the placement's centre lies at (20, 20, 18).
    for (axis, wanted) in [0.05, -0.1, 0.8 + 2.0 * placement.cell_size].into_iter().enumerate() {
        assert!((found[1 + axis] - wanted).abs() < 1e-4, "{found:?}");
    }
    assert!((found[5] - 9.81).abs() < 1e-9, "gravity pulls down the picture: {found:?}");
}

/// Solves a quadratic programme by L-BFGS-B of SciPy, out of its rows and bounds in a folder, and compares what the folder holds.
const BY_SCIPY: &str = "
import json, numpy as np, scipy.optimize, scipy.sparse, sys
folder = sys.argv[1]
rows = np.fromfile(f'{folder}/rows.bin', '<u4').reshape(-1, 3)
bounds = np.fromfile(f'{folder}/bounds.bin', '<f4').astype(float).reshape(-1, 2)
ours, thesis = (np.fromfile(f'{folder}/{name}.bin', '<f4').astype(float) for name in ('ours', 'thesis'))
data = np.tile([1.0, -2.0, 1.0], len(rows))
h = scipy.sparse.csr_matrix((data, (np.repeat(np.arange(len(rows)), 3), rows.ravel())), (len(rows), len(bounds)))
r = (h.T @ h).tocsr()
start = np.where(bounds[:, 0] >= 0, bounds[:, 0], bounds[:, 1])
result = scipy.optimize.minimize(lambda f: (0.5 * f @ (r @ f), r @ f), start, jac=True, method='L-BFGS-B',
    bounds=bounds, options=dict(maxiter=20000, maxfun=40000, ftol=1e-13, gtol=1e-8, maxcor=30))
# Voxels at the border have no margin: one of their bounds is 0.
border = (bounds == 0).any(axis=1)
energy = lambda f: float(0.5 * f @ (r @ f))
apart = lambda f: [float(np.abs(f - result.x)[border].mean()), float(np.abs(f - result.x)[border].max())]
json.dump(dict(variables=len(bounds), scipy=float(result.fun), ours=energy(ours), thesis=energy(thesis),
    apart=apart(ours), thesis_apart=apart(thesis)), open(f'{folder}/found.json', 'w'))
";

/// Solves the same by Clarabel's interior points; the same numbers as SciPy's, of our solution.
const BY_CLARABEL: &str = "
import json, sys
import clarabel, numpy as np, scipy.sparse

folder = sys.argv[1]
rows = np.fromfile(f'{folder}/rows.bin', '<u4').reshape(-1, 3)
bounds = np.fromfile(f'{folder}/bounds.bin', '<f4').astype(float).reshape(-1, 2)
ours = np.fromfile(f'{folder}/ours.bin', '<f4').astype(float)
count = len(bounds)
data = np.tile([1.0, -2.0, 1.0], len(rows))
h = scipy.sparse.csr_matrix((data, (np.repeat(np.arange(len(rows)), 3), rows.ravel())), (len(rows), count))
r = (h.T @ h).tocsc()
one = scipy.sparse.identity(count, format='csc')
settings = clarabel.DefaultSettings()
settings.verbose = False
solver = clarabel.DefaultSolver(scipy.sparse.triu(r).tocsc(), np.zeros(count), scipy.sparse.vstack([one, -one]).tocsc(),
    np.concatenate([bounds[:, 1], -bounds[:, 0]]), [clarabel.NonnegativeConeT(2 * count)], settings)
solution = solver.solve()
theirs = np.array(solution.x)
border = (bounds == 0).any(axis=1)
apart = np.abs(ours - theirs)[border]
energy = lambda f: float(0.5 * f @ (r @ f))
print(json.dumps([str(solution.status), energy(ours) / energy(theirs), float(apart.mean()), float(apart.max())]))
";

/// A programme of a built-in shape, whose rows and bounds it leaves in the workspace with our solution.
struct Written {
    problem: SmoothingProblem,
    variables: Vec<usize>,
    field: CubeField,
}

impl Written {
    fn new(work: &Workspace, name: &str, n: u32) -> Self {
        let problem = SmoothingProblem::new(&Volume::upsampled(&grid_of(name, n), 1));
        let variables: Vec<usize> = problem.variables().collect();
        let index_of = |voxel: usize| variables.binary_search(&voxel).expect("a variable") as u32;
        let rows: Vec<u8> = problem.rows().flatten().flat_map(|voxel| index_of(voxel).to_le_bytes()).collect();
        let bounds = variables.iter().flat_map(|voxel| <[f32; 2]>::from(problem.bounds(*voxel)));
        work.write("rows.bin", rows);
        work.write("bounds.bin", bounds.flat_map(f32::to_le_bytes).collect::<Vec<_>>());
        let field = problem.solve(Solver::Accelerated { steps: 500 });
        let written = Self { problem, variables, field };
        written.write(work, "ours.bin", &written.field);
        written
    }

    fn write(&self, work: &Workspace, file: &str, field: &CubeField) {
        let values = self.variables.iter().flat_map(|voxel| field.values()[*voxel].to_le_bytes());
        work.write(file, values.collect::<Vec<_>>());
    }
}

#[test]
#[ignore = "slow: SciPy takes a minute"]
fn the_quadratic_programme_is_solved_as_scipy_solves_it() {
    let work = Workspace::new();
    for (name, n) in [("can-01", 12), ("cup-01", 14), ("bowl-01", 14)] {
        let written = Written::new(&work, name, n);
        written.write(&work, "thesis.bin", &written.problem.solve(Solver::DampedJacobi { sweeps: 500 }));
        Program::python_lines(BY_SCIPY).arg(work.folder()).succeed();
        let found = read_json(work.path("found.json"));
        println!("{name}: {found}");
        let number = |key: &str| found[key].as_f64().expect("a number");
        // Energy within 0.1 %; at the border 0.005 voxel in the mean and 0.06 at most.
        assert!(number("ours") <= 1.001 * number("scipy"), "{name}: {found}");
        assert!(number("ours") >= 0.9999 * number("scipy"), "{name}: SciPy converged: {found}");
        let apart = |key: &str, index: usize| found[key][index].as_f64().expect("a number");
        assert!(apart("apart", 0) <= 0.005 && apart("apart", 1) <= 0.06, "{name}: {found}");
        // The thesis's 500 sweeps stop earlier.
        assert!(number("thesis") > number("ours") && apart("thesis_apart", 0) > apart("apart", 0), "{name}: {found}");
        assert!((written.problem.energy(&written.field) / number("ours") - 1.0).abs() < 1e-6, "{name}: {found}");
    }
}

/// Ten volumes of the size of what a network completes, solids and thin walls. SciPy takes minutes for one of them.
#[test]
#[ignore = "slow: needs the peers of the benchmarks"]
fn ten_large_programmes_are_solved_as_clarabel_solves_them() {
    let work = Workspace::new();
    let mut large = 0;
    for name in [
        "can-01",
        "cup-01",
        "bowl-01",
        "mug-01",
        "bottle-01",
        "goblet-01",
        "pan-02",
        "box-01",
        "superquadric-03",
        "bowl-03",
    ] {
        let written = Written::new(&work, name, 28);
        large += usize::from(written.variables.len() > 10_000);
        let clarabel = Program::peer("peers/bin/python").args(["-c", BY_CLARABEL]).arg(work.folder());
        let (status, energy, mean, most): (String, f64, f64, f64) = clarabel.succeed().json();
        println!("{name}, {}: {status}, energy {energy}, apart {mean} and {most}", written.variables.len());
        assert!(status == "Solved" && (energy - 1.0).abs() < 1e-3 && mean <= 0.005 && most <= 0.06, "{name}");
    }
    assert!(large >= 5, "{large}");
}

/// Six steps of uniform smoothing by trimesh, whose step goes all of the way to the mean; and by libigl's cotangents, those of the
/// mesh at each step.
const SMOOTHED: &str = "
import json, sys
import igl, numpy as np, trimesh

answer = []
for path in sys.argv[1:]:
    mesh = trimesh.load(path, process=False)
    vertices, faces = np.array(mesh.vertices), np.asarray(mesh.faces, np.int32)
    operator = trimesh.smoothing.laplacian_calculation(mesh, equal_weight=True)
    trimesh.smoothing.filter_laplacian(mesh, lamb=1.0, iterations=6, volume_constraint=False, laplacian_operator=operator)
    for _ in range(6):
        cotangents = igl.cotmatrix(vertices, faces)
        vertices = vertices + (cotangents @ vertices) / -cotangents.diagonal()[:, None]
    answer.append([np.asarray(mesh.vertices).tolist(), vertices.tolist()])
print(json.dumps(answer))
";

#[test]
fn smoothing_is_that_of_trimesh_and_libigl() {
    let work = Workspace::new();
    let grid = field_of(&grid_of("mug-01", 40));
    // Steps of cells, which smoothing is for, and a mesh of triangles of many sizes.
    let meshes =
        [CompletedMesh::obstacle(&grid, &placement(40), OBSTACLE_THRESHOLD).mesh, built_in_mesh("bottle-01@1k")];
    let paths = (0..).zip(&meshes).map(|(index, mesh)| work.write(format!("{index}.ply"), write_ply(mesh, &[])));
    let run = Program::python_lines(SMOOTHED).args(paths.collect::<Vec<_>>());
    let found: Vec<[Vec<[f64; 3]>; 2]> = serde_json::from_value(run.succeed().json()).expect("vertices");
    for (mesh, theirs) in meshes.iter().zip(&found) {
        for (weights, theirs) in [NeighbourWeights::Uniform, NeighbourWeights::Cotangent].into_iter().zip(theirs) {
            let mut ours = mesh.clone();
            LaplacianRule { weights, ..LaplacianRule::default() }.smooth(&mut ours);
            assert_eq!(ours.triangles, mesh.triangles);
            let off = ours.vertices.iter().zip(theirs);
            let off = off.flat_map(|(ours, theirs)| (0..3).map(|axis| (f64::from(ours[axis]) - theirs[axis]).abs()));
            let off = off.fold(0.0, f64::max);
            let moved = ours.vertices.iter().zip(&mesh.vertices);
            let moved =
                moved.flat_map(|(ours, mesh)| (0..3).map(|axis| (ours[axis] - mesh[axis]).abs())).fold(0.0, f32::max);
            println!("{weights:?}: {off} m off, moved by up to {moved} m");
            assert!(off < 1e-7 && moved > 1e-3, "{weights:?}: {off} {moved}");
            assert!(ours.signed_volume() > 0.0 && ours.signed_volume() < mesh.signed_volume(), "smoothing shrinks");
        }
    }
}

/// VTK's marching cubes of the padded fields, (side, side, side) f32: counts of vertices, and how far ours and theirs lie apart [cells].
const BY_VTK: &str = "
import json, sys
import numpy as np, trimesh, vtk
from scipy.spatial import cKDTree
from vtk.util.numpy_support import numpy_to_vtk, vtk_to_numpy

answer = []
for number in range(int(sys.argv[2])):
    field = np.fromfile(f'{sys.argv[1]}/{number}.f32', '<f4')
    side = round(len(field) ** (1 / 3))
    image = vtk.vtkImageData()
    image.SetDimensions(side, side, side)
    # VTK's x runs fastest.
    image.GetPointData().SetScalars(numpy_to_vtk(field.reshape([side] * 3).transpose(2, 1, 0).ravel(), deep=True))
    cubes = vtk.vtkMarchingCubes()
    cubes.SetInputData(image)
    cubes.SetValue(0, 0.5)
    cubes.Update()
    theirs = vtk_to_numpy(cubes.GetOutput().GetPoints().GetData())
    ours = np.asarray(trimesh.load(f'{sys.argv[1]}/{number}.ply', process=False).vertices)
    answer.append(dict(ours=len(ours), theirs=len(theirs), apart=float(cKDTree(theirs).query(ours)[0].max()),
        back=float(cKDTree(ours).query(theirs)[0].max())))
json.dump(answer, sys.stdout)
";

/// Triangles may join the vertices of an ambiguous cell in several ways; the vertices are the same.
#[test]
#[ignore = "slow: needs the peers of the benchmarks"]
fn vtk_cuts_the_same_edges_in_the_same_places() {
    let work = Workspace::new();
    let mut draw = Stream::of_job(1, b"", "fields");
    // Values of cells: noise, smooth shapes, and noise that is far from the level nearly everywhere.
    let mut noise = |n: usize, sharp: f64| {
        let value = |draw: &mut Stream| 0.5 + (draw.unit() - 0.5) / (1.0 + sharp * draw.unit());
        CubeField::from_values(n, (0..n.pow(3)).map(|_| value(&mut draw) as f32).collect()).expect("a cube")
    };
    let mut fields = vec![noise(12, 0.0), noise(20, 9.0)];
    for (n, radius) in [(16, 5.3), (24, 9.7)] {
        let mut ball = CubeField::filled(n, 0.0);
        let middle = n as f64 / 2.0 + 0.13;
        for cell in ball.cells() {
            let distance = cell.map(|index| (index as f64 + 0.5 - middle).powi(2)).iter().sum::<f64>().sqrt();
            *ball.at_mut(cell) = (0.5 + 0.2 * (radius - distance)).clamp(0.0, 1.0) as f32;
        }
        fields.push(ball);
    }
    for (number, field) in fields.iter().enumerate() {
        let n = field.side();
        let mut padded = CubeField::filled(n + 2, 0.0);
        field.cells().for_each(|cell| *padded.at_mut(cell.map(|index| index + 1)) = field.at(cell));
        work.write(
            format!("{number}.f32"),
            padded.values().iter().flat_map(|value| value.to_le_bytes()).collect::<Vec<_>>(),
        );
        // VTK's points lie at whole numbers.
        let mesh = marching_cubes(field, 0.5, 0.0, |point| point.map(|value| (value + 0.5) as f32));
        work.write(format!("{number}.ply"), write_ply(&mesh, &[]));
    }
    let run = Program::peer("peers/bin/python").args(["-c", BY_VTK]).arg(work.folder()).arg(fields.len().to_string());
    let found: Value = run.succeed().json();
    println!("{found}");
    for row in found.as_array().expect("a row per field") {
        assert_eq!(row["ours"], row["theirs"], "{row}");
        // Cuts keep a thousandth of an edge from its ends.
        for way in ["apart", "back"] {
            assert!(row[way].as_f64().is_some_and(|distance| distance < 1.1e-3), "{row}");
        }
    }
}
