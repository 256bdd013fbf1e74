//! Containers from mesh files, and from the boxes and meshes of MJCF files.

use std::{
    collections::BTreeMap,
    f64::consts::TAU,
    path::{Path, PathBuf},
    sync::Arc,
};

use super::{room::Slab, spec::ContainerSpec};
use crate::sections::{check_content, spec::UnitSpec, tidy};
use assets::{MeshSource, PreparedMesh, ScaleRule, SizeRule, prepare};
use form::Checker;
use format::ContainerMesh;
use kernel::{
    geom::{Ray, Shape, SimdLevel, TriMesh, TriangleTree, Triangles},
    words::Show,
};
use nalgebra::{Point3, Unit, Vector3};
use robot::collision::Bodies;
use sim::RobotModel;

/// Longest sides that pass [m].
const SIZES: SizeRule = SizeRule { min: 0.05, max: 10.0 };

/// Smallest room inside: sides along x and y, and height [m].
const LEAST_ROOM: [f64; 2] = [0.05, 0.01];

/// Heights at which walls are looked for, and directions at each.
const LEVELS: u32 = 64;
const DIRECTIONS: u32 = 64;

/// Points along a side of the room below which a floor is looked for.
const FLOOR_POINTS: u32 = 24;

/// Surfaces as near as this to the top are not below it, as a share of the height.
const TOP: f64 = 0.02;

/// A container's file, with the unit of its numbers.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct VesselFile {
    pub(super) path: PathBuf,
    pub(super) unit: Option<UnitSpec>,
}

/// A reason why a mesh is no container, and the remedy.
struct NoVessel {
    found: String,
    remedy: &'static str,
}

const ROTATE_IT: &str = "rotate the mesh so that z points out of its opening";
const MEND_IT: &str = "close the hole, or use a mesh whose walls and floor have no holes below its rim";

/// Reads the mesh of a job's container; `None` when something is wrong with it, which is reported.
pub(super) fn read(
    checker: &mut Checker,
    spec: &ContainerSpec,
    file: &Path,
    folder: &Path,
) -> Option<(VesselFile, ContainerMesh)> {
    for key in ["container.inner_size", "container.wall"] {
        if checker.has(key) {
            checker.contradiction(key, "container.mesh", "the mesh sets the size of the container");
        }
    }
    let path = tidy(&folder.join(file));
    let mesh = match path.extension().is_some_and(|ending| ending == "xml") {
        true => mesh_of_description(checker, spec, &path),
        false => mesh_of_file(checker, spec, &path),
    }?;
    let shape = match shape_of(mesh) {
        Ok(shape) => shape,
        Err(NoVessel { found, remedy }) => {
            let found = format!("{}: {found}", path.shown());
            checker.invalid("container.mesh", "a mesh with a floor and walls around it", found).help(remedy);
            return None;
        }
    };
    check_content(checker, "container", "container", &path, shape.digest(), spec.content.as_deref())
        .then_some((VesselFile { path, unit: spec.unit }, shape))
}

/// The mesh of a file.
fn mesh_of_file(checker: &mut Checker, spec: &ContainerSpec, path: &Path) -> Option<TriMesh> {
    let name = path.file_stem().map(|stem| stem.to_string_lossy().into_owned()).unwrap_or_default();
    let scale = ScaleRule::MetresPerUnit(spec.unit.map_or(1.0, |unit| unit.0.metres));
    match prepare(&MeshSource { scale, size: SIZES, ..MeshSource::of_file(name, path) }) {
        Ok(PreparedMesh { mesh, .. }) => Some(mesh),
        Err(refusal) => {
            let found = format!("{}: {}", refusal.file, refusal.problem);
            checker.invalid("container.mesh", "a mesh of walls and floor", found).help(refusal.remedy);
            None
        }
    }
}

/// The boxes and meshes of an MJCF file that can collide, as one mesh. They may overlap.
fn mesh_of_description(checker: &mut Checker, spec: &ContainerSpec, path: &Path) -> Option<TriMesh> {
    if spec.unit.is_some() {
        checker.contradiction("container.unit", "container.mesh", "an MJCF file is in metres");
    }
    let bodies = match RobotModel::open_container(path).and_then(|model| model.bodies(&[], &BTreeMap::new())) {
        Ok(Bodies { bodies, .. }) => bodies,
        Err(error) => {
            let found = format!("{}: {error}", path.shown());
            checker.invalid("container.mesh", "an MJCF file of boxes and meshes", found);
            return None;
        }
    };
    let mut mesh = TriMesh::default();
    for body in &bodies {
        for geometry in &body.geometries {
            let Some(part) = triangles_of(&geometry.shape) else {
                let found = format!("{}: body {} has a geom that is round", path.shown(), body.name);
                let report = checker.invalid("container.mesh", "an MJCF file of boxes and meshes", found);
                report.help("use a box or a mesh, or give it contype=\"0\" conaffinity=\"0\" if nothing can hit it");
                return None;
            };
            let first = mesh.vertices.len() as u32;
            let place = |corner: &Point3<f64>| -> [f32; 3] {
                (geometry.link_from_shape * corner).coords.map(|value| value as f32).into()
            };
            mesh.vertices.extend(part.corners.iter().map(place));
            mesh.triangles.extend(part.triangles.iter().map(|corners| corners.map(|corner| first + corner)));
        }
    }
    let longest = mesh.aabb().map_or(0.0, |bounds| bounds.longest_side());
    if !(SIZES.min..=SIZES.max).contains(&longest) {
        let found = format!("{}: geoms whose longest side is {longest:.3} m", path.shown());
        checker.invalid("container.mesh", "walls and floor of 5 cm to 10 m", found);
        return None;
    }
    Some(mesh)
}

/// Triangles of a box or a mesh, wound outward; `None` of what is round.
fn triangles_of(shape: &Shape) -> Option<Arc<Triangles>> {
    match shape {
        Shape::Box { half } => {
            let corner = |index: usize| {
                Point3::from([0, 1, 2].map(|axis| if index >> axis & 1 == 1 { half[axis] } else { -half[axis] }))
            };
            let sides = [[0, 4, 6, 2], [1, 3, 7, 5], [0, 1, 5, 4], [2, 6, 7, 3], [0, 2, 3, 1], [4, 5, 7, 6]];
            let triangles = sides.iter().flat_map(|[a, b, c, d]| [[*a, *b, *c], [*a, *c, *d]]);
            Some(Arc::new(Triangles { corners: (0..8).map(corner).collect(), triangles: triangles.collect() }))
        }
        Shape::Mesh(mesh) => Some(Arc::clone(mesh)),
        Shape::Sphere { .. } | Shape::Capsule { .. } | Shape::Cylinder { .. } => None,
    }
}

/// Whether a surface is closed: each edge is walked as often in one direction as in the other, by positions.
fn is_closed(mesh: &TriMesh) -> bool {
    let place = |index: u32| mesh.vertices[index as usize].map(|value| (value + 0.0).to_bits());
    let mut walks: BTreeMap<[[u32; 3]; 2], i64> = BTreeMap::new();
    for [a, b, c] in mesh.triangles.iter().map(|corners| corners.map(place)) {
        for (from, to) in [(a, b), (b, c), (c, a)] {
            *walks.entry([from.min(to), from.max(to)]).or_default() += if from < to { 1 } else { -1 };
        }
    }
    walks.values().all(|balance| *balance == 0)
}

/// The container that a mesh is: its origin moves to the middle of the floor, below the middle of its bounds.
fn shape_of(mut mesh: TriMesh) -> Result<ContainerMesh, NoVessel> {
    let refuse = |found: String, remedy| Err(NoVessel { found, remedy });
    if !is_closed(&mesh) {
        let remedy = "give walls and floor a thickness, and close the surface: bodies touch it from both sides";
        return refuse("its surface is not closed".to_owned(), remedy);
    }
    if mesh.triangles.len() > ContainerMesh::MAX_TRIANGLES {
        let remedy = "simplify it: 20,000 triangles are enough, and every record of a scene contains all of them";
        return refuse(format!("{} triangles", mesh.triangles.len()), remedy);
    }
    let bounds = mesh.aabb().expect("a mesh has vertices");
    let rays = Rays { tree: TriangleTree::new(&mesh), reach: 2.0 * (bounds.max - bounds.min).norm() };
    let (middle, top, height) = (bounds.centre(), bounds.max.z, bounds.max.z - bounds.min.z);
    let above = |x: f64, y: f64| Point3::new(x, y, top + height);
    let Some(floor) = rays.hit(above(middle.x, middle.y), -Vector3::z()).map(|distance| top + height - distance) else {
        return refuse("there is no floor below the middle of its bounds".to_owned(), MEND_IT);
    };
    if floor > top - TOP * height {
        return refuse("at the middle of its bounds it is as high as its rim".to_owned(), ROTATE_IT);
    }
    let foot = Point3::new(middle.x, middle.y, floor);
    let half = [middle.x - bounds.min.x, middle.y - bounds.min.y];
    let height = rays.walled_height(&foot, top - floor)?;
    // Floors are seldom flat: what is lower than the first level belongs to them.
    let walls = Slab { low: (top - floor) * 0.5 / f64::from(LEVELS), high: height };
    let share = walls.share_beside(&mesh, &foot, half);
    let inner = [2.0 * share * half[0], 2.0 * share * half[1], height];
    if inner[0] < LEAST_ROOM[0] || inner[1] < LEAST_ROOM[0] {
        let found = format!("the space between its walls is {:.3} x {:.3} m", inner[0], inner[1]);
        return refuse(found, "use a container with at least 5 x 5 cm between its walls");
    }
    let [x, y, _] = inner;
    let along = |side: f64, index: u32| side * (f64::from(index) / f64::from(FLOOR_POINTS - 1) - 0.5);
    for (row, column) in (0..FLOOR_POINTS).flat_map(|row| (0..FLOOR_POINTS).map(move |column| (row, column))) {
        let offset = Vector3::new(along(x, column), along(y, row), 0.0);
        if rays.hit(above(foot.x + offset.x, foot.y + offset.y), -Vector3::z()).is_none() {
            let found = format!("its floor has a hole at x {:.3}, y {:.3} m from its middle", offset.x, offset.y);
            return refuse(found, MEND_IT);
        }
    }
    for vertex in &mut mesh.vertices {
        *vertex = (Point3::from(vertex.map(f64::from)) - foot).map(|value| value as f32).into();
    }
    Ok(ContainerMesh::new(mesh, inner))
}

/// A mesh for rays.
struct Rays {
    tree: TriangleTree,
    reach: f64,
}

impl Rays {
    /// Distance at which a ray meets the surface first [m].
    fn hit(&self, origin: Point3<f64>, direction: Vector3<f64>) -> Option<f64> {
        let ray = Ray::new(&origin, &Unit::new_normalize(direction));
        self.tree.first_hit(SimdLevel::detect(), &ray, self.reach).map(|hit| hit.distance)
    }

    /// Height above the floor to which walls surround it: that of the lowest rim, or of a hole [m].
    fn walled_height(&self, foot: &Point3<f64>, height: f64) -> Result<f64, NoVessel> {
        let is_closed = |level: u32| {
            let from = foot + Vector3::z() * (height * (f64::from(level) + 0.5) / f64::from(LEVELS));
            (0..DIRECTIONS).all(|direction| {
                let angle = TAU * (f64::from(direction) + 0.5) / f64::from(DIRECTIONS);
                self.hit(from, Vector3::new(libm::cos(angle), libm::sin(angle), 0.0)).is_some()
            })
        };
        let closed = (0..LEVELS).take_while(|level| is_closed(*level)).count();
        let walled = height * closed as f64 / f64::from(LEVELS);
        if closed == 0 || walled < LEAST_ROOM[1] {
            let found = format!("its walls are closed all around to {walled:.3} m above the floor");
            return Err(NoVessel { found, remedy: MEND_IT });
        }
        Ok(walled)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn with_box(mut mesh: TriMesh, low: [f64; 3], high: [f64; 3]) -> TriMesh {
        let half = [0, 1, 2].map(|axis| (high[axis] - low[axis]) / 2.0);
        let part = triangles_of(&Shape::Box { half }).expect("a box");
        let (first, middle) = (mesh.vertices.len() as u32, [0, 1, 2].map(|axis| (high[axis] + low[axis]) / 2.0));
        mesh.vertices
            .extend(part.corners.iter().map(|corner| [0, 1, 2].map(|axis| (corner[axis] + middle[axis]) as f32)));
        mesh.triangles.extend(part.triangles.iter().map(|corners| corners.map(|corner| first + corner)));
        mesh
    }

    #[test]
    fn the_room_ends_at_posts_however_thin() {
        let bin = TriMesh::open_box([0.4, 0.3, 0.16], 0.02);
        let inner = |mesh: TriMesh| shape_of(mesh).map(|shape| shape.inner()).map_err(|refused| refused.found);
        // Ground plans are alike to the bounds, 0.44 x 0.34 m: the long walls are met first.
        let whole = inner(bin.clone()).expect("a container");
        for (found, expected) in whole.into_iter().zip([0.44 * 0.3 / 0.34, 0.3, 0.16]) {
            assert!((found - expected).abs() < 1e-6, "{whole:?}");
        }
        // A post of a millimetre, at an angle that no search at steps of 5.6 degrees would meet.
        let post = inner(with_box(bin.clone(), [0.1, 0.0125, -0.01], [0.101, 0.0135, 0.1])).expect("a container");
        assert!((post[0] - 0.2).abs() < 1e-6 && (post[1] - 0.2 * 0.34 / 0.44).abs() < 1e-6, "{post:?}");
        // A rib of the floor is not a wall.
        let rib = inner(with_box(bin.clone(), [0.1, -0.1, -0.01], [0.101, 0.1, 0.001])).expect("a container");
        assert_eq!(rib, whole);
        let narrow = inner(with_box(bin, [0.02, 0.0, -0.01], [0.021, 0.001, 0.1]));
        assert!(narrow.expect_err("a post in the way").contains("0.040 x 0.031 m"));
    }
}
