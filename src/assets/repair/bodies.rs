//! Tests whether the bodies of a mesh belong together: a scan may lack the part that joins them, such as the glass of a
//! lid between its rim and its handle.

use serde::{Deserialize, Serialize};

use super::{bounds::Bounds, shells::Shells};
use kernel::geom::{Sets, TriMesh, TriangleTree};

/// Parts of a mesh that nothing joins.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct LooseParts {
    /// Number of parts; bodies that touch, nearly touch or lie in one another are one part.
    pub parts: u32,
    /// Distance between the two parts that are nearest to each other, from the vertices of one to the faces of the other [m].
    pub gap: f64,
    /// Distance below which two bodies count as one part [m].
    pub joined_below: f64,
}

impl LooseParts {
    /// Bodies nearer than this are not loose [m]; of a large object, those nearer than [`Self::SHARE`] of its longest side.
    pub const GAP: f64 = 1e-3;
    /// Share of the longest side.
    pub const SHARE: f64 = 1.0 / 200.0;
}

/// More bodies than this are not compared with one another, as with shells.
const MAX_BODIES: usize = 4096;
/// Largest number of tree queries of the search, some seconds; bodies that it leaves undecided count as joined.
const MAX_QUESTIONS: u64 = 20_000_000;

/// Bodies of a mesh: connected by shared vertices.
pub(crate) struct Bodies {
    sets: Sets,
    shells: usize,
    /// Number of bodies.
    pub(crate) count: u32,
}

impl Bodies {
    pub(crate) fn of(mesh: &TriMesh, shells: &Shells) -> Self {
        let count = shells.shells.len();
        let mut sets = Sets::new(count);
        let mut shell_of_vertex = vec![u32::MAX; if count > 1 { mesh.vertices.len() } else { 0 }];
        for (face, &shell) in mesh.triangles.iter().zip(&shells.of_face).filter(|_| count > 1) {
            for &vertex in face {
                let known = &mut shell_of_vertex[vertex as usize];
                if *known == u32::MAX {
                    *known = shell;
                } else if *known != shell {
                    sets.unite(*known, shell);
                }
            }
        }
        let mut bodies = Self { sets, shells: count, count: 0 };
        bodies.count = bodies.roots().len() as u32;
        bodies
    }

    fn roots(&mut self) -> Vec<u32> {
        (0..self.shells as u32).filter(|&shell| self.sets.root(shell) == shell).collect()
    }

    /// The parts that nothing joins; `None` where all hangs together, or where there are too many bodies to tell.
    pub(crate) fn loose(self, mesh: &TriMesh, shells: &Shells) -> Option<LooseParts> {
        let Grouped { pieces, parts, gap } = self.grouped(mesh, shells)?;
        let mut nearest = f32::INFINITY;
        for (one, part) in pieces.iter().zip(&parts) {
            for (other, _) in pieces.iter().zip(&parts).filter(|(_, other)| *other != part) {
                nearest = one.distance_squared(other, nearest);
            }
        }
        let distance = libm::sqrt(f64::from(nearest));
        let count = distinct(&parts).len();
        (count > 1).then_some(LooseParts { parts: count as u32, gap: distance, joined_below: gap })
    }

    /// The parts as separate meshes, whose triangles share no vertex; none if [`Self::loose`] finds none.
    pub(crate) fn apart(self, mesh: &TriMesh, shells: &Shells) -> Vec<TriMesh> {
        let Some(Grouped { pieces, parts, .. }) = self.grouped(mesh, shells) else { return Vec::new() };
        let numbers = distinct(&parts);
        if numbers.len() < 2 {
            return Vec::new();
        }
        let mut meshes = vec![TriMesh::default(); numbers.len()];
        for (piece, part) in pieces.iter().zip(&parts) {
            let own = &mut meshes[numbers.binary_search(part).expect("every part has a number")];
            let first = own.vertices.len() as u32;
            own.vertices.extend(&piece.mesh.vertices);
            own.triangles.extend(piece.mesh.triangles.iter().map(|face| face.map(|vertex| first + vertex)));
        }
        meshes
    }

    /// The bodies, and which part each is of; `None` of one body, where all hangs together, or where there are too many to tell.
    fn grouped(mut self, mesh: &TriMesh, shells: &Shells) -> Option<Grouped> {
        // A surface inside a body cannot leave it: a cavity's wall, a filling.
        for (shell, outer) in (0..).zip(&shells.container) {
            if let Some(outer) = outer {
                self.sets.unite(shell, *outer);
            }
        }
        let roots = self.roots();
        if roots.len() < 2 || roots.len() > MAX_BODIES {
            return None;
        }
        let longest = mesh.aabb().map_or(0.0, |bounds| bounds.longest_side());
        let gap = LooseParts::GAP.max(LooseParts::SHARE * longest);
        let pieces = self.pieces(mesh, shells, &roots);
        let mut joined = joined(&pieces, gap)?;
        let parts = (0..pieces.len() as u32).map(|piece| joined.root(piece)).collect();
        Some(Grouped { pieces, parts, gap })
    }

    /// The bodies as separate meshes.
    fn pieces(&mut self, mesh: &TriMesh, shells: &Shells, roots: &[u32]) -> Vec<Piece> {
        let mut faces: Vec<Vec<[u32; 3]>> = vec![Vec::new(); roots.len()];
        for (face, &shell) in mesh.triangles.iter().zip(&shells.of_face) {
            let root = self.sets.root(shell);
            let piece = roots.binary_search(&root).expect("every shell has a root");
            faces[piece].push(*face);
        }
        faces.into_iter().map(|faces| Piece::of(mesh, &faces)).collect()
    }
}

/// Bodies and the parts that they make.
struct Grouped {
    pieces: Vec<Piece>,
    /// Number of the part of each body.
    parts: Vec<u32>,
    /// Distance below which two bodies are one part [m].
    gap: f64,
}

/// Numbers that occur, sorted.
fn distinct(numbers: &[u32]) -> Vec<u32> {
    let mut numbers = numbers.to_vec();
    numbers.sort_unstable();
    numbers.dedup();
    numbers
}

/// One body.
struct Piece {
    mesh: TriMesh,
    tree: TriangleTree,
    bounds: Bounds,
}

impl Piece {
    fn of(whole: &TriMesh, faces: &[[u32; 3]]) -> Self {
        let mut mesh = TriMesh::default();
        let mut bounds = Bounds::EMPTY;
        for face in faces {
            let first = mesh.vertices.len() as u32;
            for &vertex in face {
                mesh.vertices.push(whole.vertices[vertex as usize]);
                bounds.add(whole.vertices[vertex as usize]);
            }
            mesh.triangles.push([first, first + 1, first + 2]);
        }
        Self { tree: TriangleTree::new(&mesh), mesh, bounds }
    }

    /// Whether a face of this body is nearer to another body than a gap, to a quarter of it. Counts its queries.
    fn comes_near(&self, other: &Self, gap: f32, questions: &mut u64) -> bool {
        let mut waiting: Vec<[[f32; 3]; 3]> =
            self.mesh.triangles.iter().map(|face| face.map(|vertex| self.mesh.vertices[vertex as usize])).collect();
        while let Some([a, b, c]) = waiting.pop() {
            *questions += 1;
            if *questions > MAX_QUESTIONS {
                return true;
            }
            let middle: [f32; 3] = std::array::from_fn(|axis| (a[axis] + b[axis] + c[axis]) / 3.0);
            let far = |corner: [f32; 3]| (0..3).map(|axis| (corner[axis] - middle[axis]).powi(2)).sum::<f32>();
            let radius = far(a).max(far(b)).max(far(c)).sqrt();
            let reach = gap + radius;
            let Some((_, found)) = other.tree.nearest_with_distance(middle, reach * reach) else { continue };
            if found <= gap * gap {
                return true;
            }
            if radius > gap / 4.0 {
                let between = |one: [f32; 3], two: [f32; 3]| std::array::from_fn(|axis| (one[axis] + two[axis]) / 2.0);
                let [ab, bc, ca] = [between(a, b), between(b, c), between(c, a)];
                waiting.extend([[a, ab, ca], [ab, b, bc], [ca, bc, c], [ab, bc, ca]]);
            }
        }
        false
    }

    /// The smaller of a squared distance and that of this body's vertices from another [m^2].
    fn distance_squared(&self, other: &Self, mut bound: f32) -> f32 {
        if self.bounds.distance_squared(&other.bounds) >= f64::from(bound) {
            return bound;
        }
        for vertex in &self.mesh.vertices {
            bound = other.tree.nearest_with_distance(*vertex, bound).map_or(bound, |(_, found)| found);
        }
        bound
    }
}

/// Pairs of bodies that are nearer to each other than a gap; `None` if all are joined.
fn joined(pieces: &[Piece], gap: f64) -> Option<Sets> {
    let mut sets = Sets::new(pieces.len());
    let mut parts = pieces.len();
    let mut questions = 0;
    for (index, one) in pieces.iter().enumerate() {
        for (other_index, other) in pieces.iter().enumerate().skip(index + 1) {
            let (first, second) = (index as u32, other_index as u32);
            if one.bounds.distance_squared(&other.bounds) > gap * gap || sets.root(first) == sets.root(second) {
                continue;
            }
            let [few, many] =
                if one.mesh.triangles.len() <= other.mesh.triangles.len() { [one, other] } else { [other, one] };
            if few.comes_near(many, gap as f32, &mut questions) {
                sets.unite(first, second);
                parts -= 1;
                if parts == 1 {
                    return None;
                }
            }
        }
    }
    Some(sets)
}

#[cfg(test)]
mod tests {
    use crate::{LooseParts, MeshSource, prepare};

    /// Two cubes of 100 mm, the second one shifted along x.
    fn two_cubes(shift: f64) -> Option<LooseParts> {
        let mut text = String::new();
        for (cube, x) in [0.0, shift].into_iter().enumerate() {
            for corner in 0..8 {
                let at = |bit: i32| f64::from(corner >> bit & 1) * 0.1;
                text += &format!("v {} {} {}\n", x + at(0), at(1), at(2));
            }
            for [a, b, c] in [
                [1, 3, 4],
                [1, 4, 2],
                [5, 6, 8],
                [5, 8, 7],
                [1, 2, 6],
                [1, 6, 5],
                [3, 7, 8],
                [3, 8, 4],
                [1, 5, 7],
                [1, 7, 3],
                [2, 4, 8],
                [2, 8, 6],
            ] {
                text += &format!("f {} {} {}\n", a + 8 * cube, b + 8 * cube, c + 8 * cube);
            }
        }
        let file = tempfile::Builder::new().suffix(".obj").tempfile().expect("a temporary file");
        std::fs::write(file.path(), text).expect("it is written");
        let record = prepare(&MeshSource::of_file("cubes", file.path())).expect("two cubes").record;
        assert_eq!(record.bodies, 2);
        assert_eq!(record.warnings.iter().any(|warning| warning.contains("loose parts")), record.loose.is_some());
        record.loose
    }

    #[test]
    fn parts_are_loose_from_a_gap_on() {
        // Overlapping, touching within the gap of a 1/200 of 0.2 m, and apart.
        assert_eq!(two_cubes(0.05), None);
        assert_eq!(two_cubes(0.1009), None);
        for shift in [0.102, 0.15] {
            let LooseParts { parts, gap, joined_below } = two_cubes(shift).expect("two parts");
            assert_eq!(parts, 2);
            assert!((gap - (shift - 0.1)).abs() < 1e-6, "{gap}");
            assert!((joined_below - (0.1 + shift) / 200.0).abs() < 1e-8, "{joined_below}");
        }
    }

    #[test]
    fn faces_that_cross_far_from_any_vertex_join_their_bodies() {
        // A long rod through the middle of a wide plate.
        let boxes = [[-0.2, -0.2, -0.005, 0.2, 0.2, 0.005], [-0.004, -0.004, -0.3, 0.004, 0.004, 0.3]];
        let mut text = String::new();
        for (number, [x0, y0, z0, x1, y1, z1]) in boxes.into_iter().enumerate() {
            for corner in 0..8 {
                let pick = |bit: i32, low: f64, high: f64| if corner >> bit & 1 == 1 { high } else { low };
                text += &format!("v {} {} {}\n", pick(0, x0, x1), pick(1, y0, y1), pick(2, z0, z1));
            }
            for [a, b, c] in [
                [1, 3, 4],
                [1, 4, 2],
                [5, 6, 8],
                [5, 8, 7],
                [1, 2, 6],
                [1, 6, 5],
                [3, 7, 8],
                [3, 8, 4],
                [1, 5, 7],
                [1, 7, 3],
                [2, 4, 8],
                [2, 8, 6],
            ] {
                text += &format!("f {} {} {}\n", a + 8 * number, b + 8 * number, c + 8 * number);
            }
        }
        let file = tempfile::Builder::new().suffix(".obj").tempfile().expect("a temporary file");
        std::fs::write(file.path(), text).expect("it is written");
        let record = prepare(&MeshSource::of_file("rod", file.path())).expect("a rod and a plate").record;
        assert_eq!((record.bodies, record.loose), (2, None));
    }
}
