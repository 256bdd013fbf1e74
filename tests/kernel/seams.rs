//! Vertices at seams: joined within rounding, in every format and order; and the cost of an open mesh.

use std::{collections::BTreeSet, fs, path::Path};

use graspmill::{
    assets::{AssetRecord, InsideMethod, Repair, prepare},
    geom::TriMesh,
    seed::Stream,
    voxel::solid_occupancy,
};

use super::meshes::{reversed, shrunk, source};
use crate::support::{
    meshes::{block, built_in_mesh, write_stl},
    program::Program,
    workspace::Workspace,
};

/// A ball of loose triangles whose corners are moved by up to `moved` along each axis [m].
fn loose_ball(moved: f32) -> (TriMesh, TriMesh) {
    let ball = built_in_mesh("half-sphere-sphere@500");
    let mut draw = Stream::of_job(8, b"", "seams");
    let mut loose = TriMesh::default();
    for face in &ball.triangles {
        let first = loose.vertices.len() as u32;
        for &vertex in face {
            let moved = ball.vertices[vertex as usize].map(|part| part + moved * draw.uniform(-1.0, 1.0) as f32);
            loose.vertices.push(moved);
        }
        loose.triangles.push([first, first + 1, first + 2]);
    }
    (ball, loose)
}

fn rows(mesh: &TriMesh, vertex: &str, face: &str, first: u32) -> String {
    let vertices = mesh.vertices.iter().map(|[x, y, z]| format!("{vertex}{x:?} {y:?} {z:?}\n"));
    let faces = mesh.triangles.iter().map(|face_corners| {
        let [a, b, c] = face_corners.map(|corner| corner + first);
        format!("{face}{a} {b} {c}\n")
    });
    vertices.chain(faces).collect()
}

/// The mesh in every format.
fn write_all(folder: &Path, name: &str, mesh: &TriMesh) -> Vec<std::path::PathBuf> {
    let path = |ending: &str| folder.join(format!("{name}.{ending}"));
    let (vertices, faces) = (mesh.vertices.len(), mesh.triangles.len());
    let corner = |vertex: u32| mesh.vertices[vertex as usize].map(|part| format!("{part:?}")).join(" ");
    let facets = mesh.triangles.iter().map(|face| {
        let corners = face.map(|vertex| format!("vertex {}\n", corner(vertex))).concat();
        format!("facet normal 0 0 0\nouter loop\n{corners}endloop\nendfacet\n")
    });
    let ply = format!(
        "ply\nformat ascii 1.0\nelement vertex {vertices}\nproperty float x\nproperty float y\nproperty float z\n\
         element face {faces}\nproperty list uchar int vertex_indices\nend_header\n"
    );
    let write = |ending: &str, text: String| fs::write(path(ending), text).expect("a mesh file");
    write("obj", rows(mesh, "v ", "f ", 1));
    write("off", format!("OFF\n{vertices} {faces} 0\n{}", rows(mesh, "", "3 ", 0)));
    write("ply", ply + &rows(mesh, "", "3 ", 0));
    write("text.stl", format!("solid x\n{}endsolid x\n", facets.collect::<String>()));
    write_stl(&path("stl"), mesh);
    ["obj", "off", "ply", "text.stl", "stl"].map(path).to_vec()
}

fn record(path: &Path) -> AssetRecord {
    prepare(&source(path)).unwrap_or_else(|refusal| panic!("{refusal}")).record
}

#[test]
fn seams_within_rounding_are_joined_in_every_format_and_said() {
    let folder = Workspace::new();
    // The ball is 100 mm wide: corners are at most 90 nm apart, a millionth is 100.
    let (ball, loose) = loose_ball(2.6e-8);
    // Corners that are at one position by chance are one vertex without being joined.
    let positions: BTreeSet<[u32; 3]> = loose.vertices.iter().map(|vertex| vertex.map(f32::to_bits)).collect();
    let joined = positions.len() - ball.vertices.len();
    let mut geometries = Vec::new();
    for path in write_all(folder.folder(), "loose", &loose) {
        let record = record(&path);
        assert!(record.watertight && record.inside == InsideMethod::Crossings, "{record:#?}");
        assert_eq!((record.vertices, record.triangles), (ball.vertices.len() as u32, ball.triangles.len() as u32));
        assert!(record.warnings.is_empty() && record.solid_effort.is_none(), "{record:#?}");
        assert_eq!(record.repairs, [Repair::JoinedVertices { count: joined as u32 }], "{}", path.display());
        geometries.push(record.geometry);
    }
    assert!(geometries.iter().all(|geometry| *geometry == geometries[0]));
    let text = Program::on("meshes", "check").arg(folder.path("loose.obj")).expect_code(0).stdout;
    let said = format!("repaired {joined} vertices at a seam joined");
    assert!(text.contains(&said) && !text.contains("open"), "{text}");

    // In another order of faces, corners and vertices: the same triangles.
    let count = loose.vertices.len() as u32;
    let mut other = TriMesh {
        vertices: loose.vertices.iter().rev().copied().collect(),
        triangles: loose.triangles.iter().map(|face| face.map(|vertex| count - 1 - vertex)).collect(),
    };
    other.triangles.reverse();
    other.triangles.iter_mut().for_each(|face| face.rotate_left(1));
    fs::write(folder.path("other.obj"), rows(&other, "v ", "f ", 1)).expect("a mesh file");
    assert_eq!(record(&folder.path("other.obj")).geometry, geometries[0]);
    // Two hundred times as far apart they are not one.
    let (_, apart) = loose_ball(5e-6);
    fs::write(folder.path("apart.obj"), rows(&apart, "v ", "f ", 1)).expect("a mesh file");
    assert!(!record(&folder.path("apart.obj")).watertight);
}

#[test]
fn closed_surfaces_keep_every_feature() {
    let folder = Workspace::new();
    // A cube of 0.1 m with a pit that is 50 nm wide: closed, and not touched.
    let pit = reversed(block([0.05, 0.05, 0.05], [0.05 + 5e-8, 0.06, 0.06]), |_| true);
    let mesh = super::meshes::join(&[block([0.0; 3], [0.1; 3]), pit]);
    fs::write(folder.path("pit.obj"), rows(&mesh, "v ", "f ", 1)).expect("a mesh file");
    let record = record(&folder.path("pit.obj"));
    assert!(record.watertight && record.repairs.is_empty(), "{record:#?}");
    assert_eq!((record.vertices, record.bodies), (16, 2));
}

/// The solid of loose triangles is that of their original surface, at a cost that is reported before the work starts.
#[test]
fn a_mesh_whose_solid_is_dear_is_warned_of_before_and_the_remedy_helps() {
    let folder = Workspace::new();
    let (ball, _) = loose_ball(0.0);
    let loose = shrunk(&ball);
    fs::write(folder.path("loose.obj"), rows(&loose, "v ", "f ", 1)).expect("a mesh file");
    let prepared = prepare(&source(&folder.path("loose.obj"))).expect("a usable mesh");
    let times = prepared.record.solid_effort.expect("a dear mesh");
    assert!((100..100_000).contains(&times), "{times}");
    let [cells, closed] = [(&prepared.mesh, InsideMethod::WindingNumber), (&ball, InsideMethod::Crossings)]
        .map(|(mesh, inside)| solid_occupancy(mesh, inside.test(), false).count() as f64);
    assert!((cells / closed - 1.0).abs() < 2e-3, "{cells} {closed}");

    let warning = format!("it is open: its solid takes about {times} times as long to make as that of a closed mesh");
    let remedy = "merge its vertices by distance and fill its holes in a mesh editor";
    let flat = |text: String| text.split_whitespace().collect::<Vec<_>>().join(" ");
    let text = flat(Program::on("meshes", "check").arg(folder.path("loose.obj")).expect_code(0).stdout);
    assert!(text.contains(&warning) && text.contains(remedy), "{text}");
    let job = "name = \"loose\"\nseed = 1\nviews = { even = 2 }\n[[objects]]\nlist = [\"loose.obj\"]\n\
               [split]\nvalidation_objects = 0\ntest_objects = 0\n";
    let job = folder.write("loose.toml", job);
    let text = flat(Program::on("estimate", &job).expect_code(0).stdout);
    assert!(text.contains(&format!("warning: loose: {warning}")), "{text}");
    // Before the meshes are ready.
    let run = Program::on("run", &job).option("--out", folder.path("out")).option("--progress", "plain");
    let text = run.expect_code(0).stderr;
    let (first, ready) = (text.find(&format!("warning: loose: {warning}")), text.find("meshes 1/1"));
    assert!(first.is_some() && first < ready, "{text}");

    // The remedy, by an editor that is not ours: corners within 0.1 mm are one.
    let merge = "import sys, numpy, trimesh\nfrom scipy.sparse import coo_array\n\
                 from scipy.sparse.csgraph import connected_components\nfrom scipy.spatial import cKDTree\n\
                 mesh = trimesh.load(sys.argv[1], process=False)\n\
                 one, other = cKDTree(mesh.vertices).query_pairs(1e-4, output_type='ndarray').T\n\
                 joined = coo_array((numpy.ones(len(one)), (one, other)), shape=2 * [len(mesh.vertices)])\n\
                 count, group = connected_components(joined, directed=False)\n\
                 kept = numpy.empty((count, 3))\nkept[group] = mesh.vertices\n\
                 trimesh.Trimesh(kept, group[mesh.faces], process=False).export(sys.argv[2])\n";
    Program::python_lines(merge).args(["loose.obj", "merged.ply"].map(|name| folder.path(name))).succeed();
    let merged = record(&folder.path("merged.ply"));
    assert!(merged.watertight && merged.solid_effort.is_none(), "{merged:#?}");
}
