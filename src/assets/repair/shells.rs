//! Shells: pieces of surface connected across edges, their orientation and how they lie in one another.
//!
//! Repairs and unchanged parts:
//! - Inside a shell, faces that disagree with their neighbours are reversed to agree with the majority.
//! - A closed shell outside all others must enclose a positive volume. If it does not, it is reversed, **together with
//!   every shell inside it**: so a mesh that is inside out as a whole becomes right, with its cavities, and a shell
//!   inside another keeps its meaning: wound against its container it is a cavity, wound alike it is a solid inside a
//!   solid. A cavity is never turned into a solid.
//! - Open shells cannot be judged one by one (the inner wall of a cup looks inside out on its own), so they are reversed together
//!   or not at all, by the sign of the volume under all of them.

use nalgebra::{Point3, Vector3};

use super::{
    bounds::Bounds,
    edges::{BOUNDARY, CROWDED, Edges, NEXT, from},
};
use kernel::geom::TriMesh;

/// One shell.
#[derive(Clone, Debug)]
pub(crate) struct Shell {
    /// Faces.
    pub(crate) faces: u32,
    /// Every edge is left as often as it is entered.
    pub(crate) closed: bool,
    /// No winding of its faces is consistent (a Moebius strip).
    one_sided: bool,
    /// Twice the area [m^2].
    area: f64,
    /// Six times the volume under the faces, seen from the middle of the mesh's box [m^3].
    volume: f64,
    /// Twice the sum of the area vectors [m^2]; zero for a closed shell.
    drift: Vector3<f64>,
    /// Six times the sum of area times centroid [m^3].
    centroid: Vector3<f64>,
    bounds: Bounds,
}

/// The shells of a mesh, all faces oriented.
pub(crate) struct Shells {
    pub(crate) shells: Vec<Shell>,
    /// Shell of each face.
    pub(crate) of_face: Vec<u32>,
    /// Faces reversed because they disagreed with their neighbours.
    pub(crate) flipped: u32,
    /// Faces reversed with their whole shell.
    pub(crate) inside_out: u32,
    /// A shell has no consistent winding (a Moebius strip).
    pub(crate) mixed: bool,
    /// Share of the area that belongs to such shells.
    pub(crate) one_sided: f64,
    /// The smallest closed shell around each closed shell.
    pub(crate) container: Vec<Option<u32>>,
    /// Shells wound against the shell that they lie in.
    pub(crate) cavities: u32,
    /// Shells wound as the shell that they lie in.
    pub(crate) solids_in_solids: u32,
    /// Two closed shells whose boxes meet without one lying in the other: they may overlap.
    pub(crate) may_overlap: bool,
    /// There were too many closed shells to compare each with each: some count as lying in no other.
    pub(crate) is_crowd: bool,
    /// Volume under all faces [m^3], after turning; exact for closed shells.
    pub(crate) volume: f64,
    /// Area of all faces [m^2].
    pub(crate) area: f64,
    /// |sum of area vectors| / area: 0 for a closed mesh, 1 for a flat sheet.
    pub(crate) openness: f64,
    /// Sum over shells of |sum of area vectors| / area: 1 for a soup of flat sheets, whichever way each faces.
    pub(crate) openness_by_shell: f64,
}

/// Finds the shells and orients the faces of `mesh`.
pub(crate) fn orient(mesh: &mut TriMesh, edges: &Edges) -> Shells {
    // Neighbours agree first; then whole shells get their sign.
    let (of_face, reversed, one_sided) = flood(&mesh.triangles, edges);
    let flipped = reversed.iter().filter(|&&reversed| reversed).count() as u32;
    if flipped > 0 {
        reverse(&mut mesh.triangles, |face| reversed[face]);
    }

    // Volume, area and openness of each shell, and which shells are closed.
    let mut shells = measure(mesh, &of_face);
    find_open(&mesh.triangles, edges, &of_face, &reversed, &mut shells);
    one_sided.iter().for_each(|&shell| shells[shell as usize].one_sided = true);
    // Containers of closed shells, and the sign of each shell, from its outermost container.
    let container = containers(mesh, &of_face, &shells);
    let signs = judge(&shells, &container.of_shell);
    let inside_out = shells.iter().zip(&signs).filter(|&(_, &sign)| sign < 0.0).map(|(shell, _)| shell.faces).sum();
    if inside_out > 0 {
        reverse(&mut mesh.triangles, |face| signs[of_face[face] as usize] < 0.0);
    }
    for (shell, &sign) in shells.iter_mut().zip(&signs) {
        shell.volume *= sign;
        shell.drift *= sign;
    }
    // A closed shell of opposite sign to its container is a cavity, one of equal sign a solid in a solid.
    let opposed = |shell: usize, outer: u32| shells[shell].volume.signum() != shells[outer as usize].volume.signum();
    let nested = |wanted: bool| {
        let pairs = container.of_shell.iter().enumerate().filter_map(|(shell, outer)| Some((shell, (*outer)?)));
        pairs.filter(|&(shell, outer)| shells[shell].closed && opposed(shell, outer) == wanted).count() as u32
    };
    let area: f64 = shells.iter().map(|shell| shell.area).sum();
    let drift: Vector3<f64> = shells.iter().map(|shell| shell.drift).sum();
    let of_area = |part: f64, without_area: f64| if area > 0.0 { part / area } else { without_area };
    Shells {
        cavities: nested(true),
        solids_in_solids: nested(false),
        may_overlap: container.may_overlap,
        is_crowd: container.is_crowd,
        container: container.of_shell,
        volume: volume_of(&shells, |_| true) / 6.0,
        area: area / 2.0,
        openness: of_area(drift.norm(), 1.0),
        openness_by_shell: of_area(shells.iter().map(|shell| shell.drift.norm()).sum(), 1.0),
        one_sided: of_area(shells.iter().filter(|shell| shell.one_sided).map(|shell| shell.area).sum(), 0.0),
        shells,
        of_face,
        flipped,
        inside_out,
        mixed: !one_sided.is_empty(),
    }
}

/// Labels the shells, finds the faces to reverse so that neighbours agree, and the shells in which that is impossible, with
/// repeats.
fn flood(faces: &[[u32; 3]], edges: &Edges) -> (Vec<u32>, Vec<bool>, Vec<u32>) {
    const NONE: u32 = u32::MAX;
    let mut of_face = vec![NONE; faces.len()];
    let mut reversed = vec![false; faces.len()];
    let (mut stack, mut members) = (Vec::new(), Vec::new());
    let (mut shell, mut one_sided) = (0, Vec::new());
    for seed in 0..faces.len() {
        if of_face[seed] != NONE {
            continue;
        }
        of_face[seed] = shell;
        stack.push(seed as u32);
        members.clear();
        let mut flips = 0;
        // Flood fill across edges of two faces.
        while let Some(face) = stack.pop() {
            if edges.same_direction > 0 {
                members.push(face);
                flips += usize::from(reversed[face as usize]);
            }
            for half in 3 * face..3 * face + 3 {
                let other = edges.partner[half as usize];
                if other == BOUNDARY || other == CROWDED {
                    continue;
                }
                let neighbour = other as usize / 3;
                let disagrees = edges.same_direction > 0 && from(faces, half) == from(faces, other);
                let wanted = reversed[face as usize] ^ disagrees;
                if of_face[neighbour] == NONE {
                    of_face[neighbour] = shell;
                    reversed[neighbour] = wanted;
                    stack.push(neighbour as u32);
                } else if reversed[neighbour] != wanted {
                    one_sided.push(shell);
                }
            }
        }
        // Keep the orientation of the majority.
        if 2 * flips > members.len() {
            members.iter().for_each(|&face| reversed[face as usize] ^= true);
        }
        shell += 1;
    }
    (of_face, reversed, one_sided)
}

fn reverse(faces: &mut [[u32; 3]], chosen: impl Fn(usize) -> bool) {
    for (index, face) in faces.iter_mut().enumerate() {
        if chosen(index) {
            face.swap(1, 2);
        }
    }
}

/// Sums over the faces of each shell.
fn measure(mesh: &TriMesh, of_face: &[u32]) -> Vec<Shell> {
    // Positions relative to the box's middle: less cancellation far from the origin.
    let middle = mesh.aabb().map_or_else(Point3::origin, |aabb| aabb.centre());
    let count = of_face.iter().max().map_or(0, |&last| last as usize + 1);
    let empty = Shell {
        faces: 0,
        closed: true,
        one_sided: false,
        area: 0.0,
        volume: 0.0,
        drift: Vector3::zeros(),
        centroid: Vector3::zeros(),
        bounds: Bounds::EMPTY,
    };
    let mut shells = vec![empty; count];
    let mut face = 0;
    // Faces of one shell are mostly consecutive: each run is summed up in registers.
    for run in of_face.chunk_by(|a, b| a == b) {
        let sum = &mut shells[run[0] as usize];
        let mut shell = sum.clone();
        for (&corners, face) in mesh.triangles[face..face + run.len()].iter().zip(face..) {
            // Cross product of two edges: twice the area vector.
            let [a, b, c] = mesh.corners(face).map(|corner| corner - middle);
            let normal = (b - a).cross(&(c - a));
            let area = normal.norm();
            shell.area += area;
            // Divergence theorem: six times the signed volume of the tetrahedron under the face.
            shell.volume += a.dot(&normal);
            shell.drift += normal;
            // Centroid weighted by area, scaled by six like the volume.
            shell.centroid += (a + b + c) * area;
            corners.iter().for_each(|&vertex| shell.bounds.add(mesh.vertices[vertex as usize]));
        }
        shell.faces += run.len() as u32;
        *sum = shell;
        face += run.len();
    }
    shells
}

/// Marks the shells that have an open edge. `edges` were found before the faces in `reversed` were reversed.
fn find_open(faces: &[[u32; 3]], edges: &Edges, of_face: &[u32], reversed: &[bool], shells: &mut [Shell]) {
    if edges.boundary > 0 {
        for (half, &partner) in edges.partner.iter().enumerate() {
            if partner == BOUNDARY {
                shells[of_face[half / 3] as usize].closed = false;
            }
        }
    }
    for crowd in &edges.crowded {
        let shell_and_step = |&half: &u32| {
            let (face, k) = (half as usize / 3, half as usize % 3);
            // Turning a face swaps its corners 1 and 2.
            let k = if reversed[face] { 2 - k } else { k };
            (of_face[face], if faces[face][k] < faces[face][NEXT[k]] { 1 } else { -1 })
        };
        let mut steps: Vec<(u32, i32)> = crowd.iter().map(shell_and_step).collect();
        steps.sort_unstable_by_key(|(shell, _)| *shell);
        for of_shell in steps.chunk_by(|a, b| a.0 == b.0) {
            if of_shell.iter().map(|(_, step)| step).sum::<i32>() != 0 {
                shells[of_shell[0].0 as usize].closed = false;
            }
        }
    }
}

/// +1 for the shells that stay, -1 for those that are reversed.
fn judge(shells: &[Shell], container: &[Option<u32>]) -> Vec<f64> {
    let open = volume_of(shells, |shell| !shell.closed);
    let open_area: f64 = shells.iter().filter(|shell| !shell.closed).map(|shell| shell.area).sum();
    // A thousandth of the scale that the area sets: less is no evidence.
    let reverse_open = open < -1e-3 * open_area * libm::sqrt(open_area);
    (0..shells.len())
        .map(|mut shell| {
            while let Some(outer) = container[shell] {
                shell = outer as usize;
            }
            let reverses = if shells[shell].closed { shells[shell].volume < 0.0 } else { reverse_open };
            if reverses { -1.0 } else { 1.0 }
        })
        .collect()
}

/// Six times the volume under the chosen shells, seen from their common centroid.
fn volume_of(shells: &[Shell], chosen: impl Fn(&Shell) -> bool) -> f64 {
    let sum = |part: &dyn Fn(&Shell) -> f64| shells.iter().filter(|shell| chosen(shell)).map(part).sum::<f64>();
    let area = sum(&|shell| shell.area);
    let volume = sum(&|shell| shell.volume);
    if area == 0.0 || shells.iter().filter(|shell| chosen(shell)).all(|shell| shell.closed) {
        return volume;
    }
    let axes = [0, 1, 2];
    let centroid = axes.map(|axis| sum(&|shell| shell.centroid[axis]) / (3.0 * area));
    volume - axes.map(|axis| centroid[axis] * sum(&|shell| shell.drift[axis])).iter().sum::<f64>()
}

struct Containers {
    /// The smallest closed shell around each closed shell.
    of_shell: Vec<Option<u32>>,
    may_overlap: bool,
    is_crowd: bool,
}

impl Containers {
    /// Ends the search: the shells are a crowd.
    fn of_crowd(self) -> Self {
        Self { may_overlap: true, is_crowd: true, ..self }
    }
}

/// Largest number of face tests for finding the containers, a few seconds; a crowd of parts beyond it counts as
/// overlapping.
const CONTAINER_BUDGET: u64 = 500_000_000;
/// More closed shells than this are not compared with one another.
const MAX_SHELLS: usize = 16_384;

/// Which closed shell lies in which: boxes first, then crossings of a ray from a few of its vertices.
fn containers(mesh: &TriMesh, of_face: &[u32], shells: &[Shell]) -> Containers {
    let mut found = Containers { of_shell: vec![None; shells.len()], may_overlap: false, is_crowd: false };
    let closed: Vec<u32> = (0..shells.len() as u32).filter(|&shell| shells[shell as usize].closed).collect();
    if closed.len() < 2 {
        return found;
    }
    if closed.len() > MAX_SHELLS {
        return found.of_crowd();
    }
    // Every pair of closed shells whose boxes are nested.
    let faces_of = faces_by_shell(of_face, shells);
    let mut budget = CONTAINER_BUDGET;
    for &inner in &closed {
        for &outer in &closed {
            let (a, b) = (&shells[inner as usize], &shells[outer as usize]);
            if inner == outer || a.bounds.is_apart_from(&b.bounds) {
                continue;
            }
            if !a.bounds.is_within(&b.bounds) {
                // The other order may still find that the outer one lies in the inner one.
                found.may_overlap |= !b.bounds.is_within(&a.bounds);
                continue;
            }
            // A few vertices of the inner shell must all be inside the outer one.
            let samples = 8.min(a.faces) as usize;
            let stride = a.faces as usize / samples;
            budget = budget.saturating_sub(samples as u64 * u64::from(b.faces));
            if budget == 0 {
                return found.of_crowd();
            }
            let mut points = faces_of[inner as usize]
                .iter()
                .step_by(stride)
                .take(samples)
                .map(|&face| mesh.vertices[mesh.triangles[face as usize][0] as usize]);
            if !points.all(|point| encloses(mesh, &faces_of[outer as usize], point)) {
                found.may_overlap = true;
                continue;
            }
            // The smallest enclosing shell is the container.
            let size = |shell: &Shell| shell.bounds.sides().iter().product::<f64>();
            let best = &mut found.of_shell[inner as usize];
            // Two shells of one box may each seem to hold the other: the earlier one is the container.
            let mutual = size(a) == size(b) && inner < outer;
            if !mutual && best.is_none_or(|best| size(b) < size(&shells[best as usize])) {
                *best = Some(outer);
            }
        }
    }
    found
}

/// The faces of each shell, in order.
fn faces_by_shell(of_face: &[u32], shells: &[Shell]) -> Vec<Vec<u32>> {
    let mut faces: Vec<Vec<u32>> = shells.iter().map(|shell| Vec::with_capacity(shell.faces as usize)).collect();
    of_face.iter().zip(0..).for_each(|(&shell, face)| faces[shell as usize].push(face));
    faces
}

/// Whether a ray from `point` along +x crosses the faces an odd number of times.
///
/// Edges are taken half-open in (y, z), and each edge is judged from its lower vertex, so that a ray through an edge
/// or a corner is counted once.
fn encloses(mesh: &TriMesh, faces: &[u32], point: [f32; 3]) -> bool {
    let mut odd = false;
    for face in faces.iter().map(|&face| face as usize) {
        let corners = mesh.triangles[face];
        let at = |k: usize| mesh.vertices[corners[k] as usize];
        // Faces whose z range does not hold the ray's height are skipped.
        let (low, high) = ([at(0), at(1), at(2)].map(|c| c[2]), point[2]);
        if low.iter().all(|&z| z <= high) || low.iter().all(|&z| z > high) {
            continue;
        }
        // Even-odd test of the point in the face's projection along x.
        let mut covers = false;
        for k in 0..3 {
            let (mut a, mut b) = (at(k), at(NEXT[k]));
            // Neighbours evaluate the same edge in the same order, so rounding agrees.
            if corners[k] > corners[NEXT[k]] {
                std::mem::swap(&mut a, &mut b);
            }
            if (a[2] <= point[2]) != (b[2] <= point[2]) {
                let [a, b, p] = [a, b, point].map(|corner| corner.map(f64::from));
                // Side of the point relative to the edge, as a 2D cross product in (y, z).
                let side = (b[1] - a[1]) * (p[2] - a[2]) - (p[1] - a[1]) * (b[2] - a[2]);
                covers ^= (side > 0.0) == (b[2] > a[2]);
            }
        }
        if covers {
            let [a, b, c] = mesh.corners(face);
            let normal = (b - a).cross(&(c - a));
            let p = Point3::from(point.map(f64::from));
            // The plane's x at the point's (y, z) lies ahead.
            odd ^= (a - p).dot(&normal) * normal.x > 0.0;
        }
    }
    odd
}
