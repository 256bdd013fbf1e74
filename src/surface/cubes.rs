//! Marching cubes over a padded grid: meshes that are closed and manifold by construction.

use kernel::geom::TriMesh;

use crate::{
    cases::{CORNERS, EDGES, case_table},
    field::CubeField,
};

/// Cuts stay this share of an edge away from its ends, so that vertices of different edges stay apart.
const CLOSEST_CUT: f64 = 0.001;

/// The surface where the field crosses `level`; inside is where it is larger. NaN counts as outside.
///
/// The grid is padded by one layer of `outside` (not above `level`), so the surface is closed whatever the field holds; every
/// edge of a triangle is shared by exactly two, in opposite senses, and the triangles of a vertex form one fan. `position`
/// maps coordinates [cells] (centres at +0.5) to a vertex. Triangles are wound outward.
///
/// # Panics
/// If `outside` is above `level`, or the surface has 2^32 vertices.
pub fn marching_cubes(field: &CubeField, level: f32, outside: f32, position: impl Fn([f64; 3]) -> [f32; 3]) -> TriMesh {
    assert!(outside <= level, "the padding lies outside");
    let side = field.side() + 2;
    let mut mesh = TriMesh::default();
    let mut sweep = Sweep { side, level, position, vertices: &mut mesh.vertices };
    // Two planes of values across x, and the vertices on their edges: along y and z in each plane, along x between them.
    let mut values = [vec![outside; side * side], vec![outside; side * side]];
    let mut in_plane = [vec![[0; 2]; side * side], vec![[0; 2]; side * side]];
    let mut between = vec![0; side * side];
    for x in 0..side - 1 {
        values.swap(0, 1);
        in_plane.swap(0, 1);
        load_plane(field, x + 1, outside, &mut values[1]);
        sweep.cut_plane(x + 1, &values[1], &mut in_plane[1]);
        sweep.cut_between(x, &values, &mut between);
        for start in (0..side - 1).map(|y| y * side) {
            // A bit per corner of the cubes' four columns along z.
            let inside = |at: usize| {
                let rows = [(0, at), (1, at), (0, at + side), (1, at + side)];
                rows.iter()
                    .enumerate()
                    .fold(0, |case, (bit, (plane, index))| case | usize::from(values[*plane][*index] > level) << bit)
            };
            let mut low = inside(start);
            for at in start..start + side - 1 {
                let high = inside(at + 1);
                let case = low | high << (CORNERS / 2);
                low = high;
                if case == 0 || case == 255 {
                    continue;
                }
                let vertex = |edge: u8| {
                    let edge = EDGES[usize::from(edge)];
                    let [x, y, z] = [0, 1, 2].map(|axis| edge.corner >> axis & 1);
                    let index = at + y * side + z;
                    if edge.axis == 0 { between[index] } else { in_plane[x][index][edge.axis - 1] }
                };
                mesh.triangles.extend(case_table()[case].iter().map(|triangle| triangle.map(vertex)));
            }
        }
    }
    mesh
}

/// Values of one plane across x of the padded grid.
fn load_plane(field: &CubeField, x: usize, outside: f32, plane: &mut [f32]) {
    let (n, side) = (field.side(), field.side() + 2);
    plane.fill(outside);
    if x == 0 || x > n {
        return;
    }
    for y in 0..n {
        let row = &field.values()[((x - 1) * n + y) * n..][..n];
        plane[(y + 1) * side + 1..][..n].copy_from_slice(row);
    }
}

/// Cuts edges of the padded grid in a fixed order.
struct Sweep<'a, F> {
    side: usize,
    level: f32,
    position: F,
    vertices: &'a mut Vec<[f32; 3]>,
}

impl<F: Fn([f64; 3]) -> [f32; 3]> Sweep<'_, F> {
    /// Vertices on the edges along y and z of one plane across x.
    fn cut_plane(&mut self, x: usize, values: &[f32], vertices: &mut [[u32; 2]]) {
        let side = self.side;
        for (index, vertex) in vertices.iter_mut().enumerate() {
            let (y, z) = (index / side, index % side);
            if y + 1 < side {
                self.cut([x, y, z], 1, values[index], values[index + side], &mut vertex[0]);
            }
            if z + 1 < side {
                self.cut([x, y, z], 2, values[index], values[index + 1], &mut vertex[1]);
            }
        }
    }

    /// Vertices on the edges along x from one plane to the next.
    fn cut_between(&mut self, x: usize, values: &[Vec<f32>; 2], vertices: &mut [u32]) {
        for (index, vertex) in vertices.iter_mut().enumerate() {
            self.cut([x, index / self.side, index % self.side], 0, values[0][index], values[1][index], vertex);
        }
    }

    /// A vertex where an edge that begins at `corner` of the padded grid crosses the level.
    fn cut(&mut self, corner: [usize; 3], axis: usize, from: f32, to: f32, vertex: &mut u32) {
        if (from > self.level) == (to > self.level) {
            return;
        }
        let share = (f64::from(self.level) - f64::from(from)) / (f64::from(to) - f64::from(from));
        // NaN and infinities determine the side of a corner, but no distance.
        let share = if share.is_finite() { share.clamp(CLOSEST_CUT, 1.0 - CLOSEST_CUT) } else { 0.5 };
        // Corner (1, 1, 1) of the padded grid is the centre of cell (0, 0, 0).
        let mut point = corner.map(|index| index as f64 - 0.5);
        point[axis] += share;
        *vertex = u32::try_from(self.vertices.len()).expect("fewer than 2^32 vertices");
        self.vertices.push((self.position)(point));
    }
}

#[cfg(test)]
pub(crate) mod tests {
    use std::{collections::BTreeMap, f64::consts::PI};

    use kernel::seed::Stream;
    use proptest::prelude::*;

    use super::*;

    /// Coordinates [cells] as they are.
    pub(crate) fn in_cells(point: [f64; 3]) -> [f32; 3] {
        point.map(|value| value as f32)
    }

    /// Fails where a mesh is not closed or not manifold, or has a vertex without triangles.
    pub(crate) fn assert_closed_and_manifold(mesh: &TriMesh) {
        let mut edges = BTreeMap::new();
        let mut fans = vec![Vec::new(); mesh.vertices.len()];
        for [a, b, c] in &mesh.triangles {
            for [from, to, opposite] in [[a, b, c], [b, c, a], [c, a, b]] {
                assert!(edges.insert((*from, *to), ()).is_none(), "edge {from} to {to} occurs twice in one direction");
                fans[*from as usize].push((*to, *opposite));
            }
        }
        assert!(edges.keys().all(|(from, to)| edges.contains_key(&(*to, *from))), "an open edge");
        for fan in &fans {
            // From spoke to spoke round the vertex: one turn meets all of them.
            let follow: BTreeMap<u32, u32> = fan.iter().copied().collect();
            let first = fan.first().expect("a vertex belongs to a triangle").0;
            let (mut at, mut met) = (follow[&first], 1);
            while at != first {
                (at, met) = (follow[&at], met + 1);
            }
            assert_eq!(met, fan.len(), "one fan per vertex");
        }
    }

    /// Share of a field's cells by a function of their centres [cells].
    fn field_of(side: usize, mut value: impl FnMut([f64; 3]) -> f64) -> CubeField {
        let mut field = CubeField::filled(side, 0.0);
        for cell in field.cells() {
            *field.at_mut(cell) = value(cell.map(|index| index as f64 + 0.5)) as f32;
        }
        field
    }

    /// Noise of any density, of two values or of all between, checkerboards, single cells, nothing and everything.
    fn drawn_field(number: u32, draw: &mut Stream) -> CubeField {
        let side = 1 + draw.below(24) as usize;
        let density = draw.unit();
        match number % 5 {
            0 => field_of(side, |_| f64::from(u8::from(draw.unit() < density))),
            1 => field_of(side, |_| draw.unit() * 2.0 * density),
            2 => {
                let width = 1 + draw.below(4) as usize;
                field_of(side, |centre| {
                    let blocks: usize = centre.iter().map(|value| *value as usize / width).sum();
                    f64::from(u8::from(blocks.is_multiple_of(2)))
                })
            }
            3 => {
                let chosen = draw.below(side.pow(3) as u64) as usize;
                let mut field = CubeField::filled(side, 0.0);
                let cell = field.cells().nth(chosen).expect("a cell of the grid");
                *field.at_mut(cell) = 1.0;
                field
            }
            _ => CubeField::filled(side, if density < 0.5 { 0.0 } else { 1.0 }),
        }
    }

    #[test]
    #[ignore = "slow: make test-all"]
    fn ten_thousand_fields_give_closed_manifold_meshes_wound_outward() {
        let mut draw = Stream::of_job(11, b"", "fields");
        let mut empty = 0;
        for number in 0..10_000 {
            let field = drawn_field(number, &mut draw);
            let mesh = marching_cubes(&field, 0.5, 0.0, in_cells);
            assert_closed_and_manifold(&mesh);
            let has_inside = field.values().iter().any(|value| *value > 0.5);
            assert_eq!(mesh.triangles.is_empty(), !has_inside, "field {number}");
            assert!(!has_inside || mesh.signed_volume() > 0.0, "field {number}: {}", mesh.signed_volume());
            empty += u32::from(!has_inside);
        }
        assert!((500..5000).contains(&empty), "{empty} empty fields");
    }

    proptest! {
        #[test]
        fn any_field_gives_a_closed_manifold_mesh_wound_outward(
            side in 1_usize..9,
            share in 0.0..1.0_f64,
            values in prop::collection::vec(
                prop_oneof![20 => 0.0..1.0_f32, 1 => Just(f32::NAN), 1 => Just(f32::INFINITY), 1 => Just(0.5_f32)], 512),
        ) {
            let field = CubeField::from_values(side, values[..side.pow(3)].to_vec()).expect("as many as cells");
            let level = share as f32;
            let mesh = marching_cubes(&field, level, 0.0_f32.min(level), in_cells);
            assert_closed_and_manifold(&mesh);
            let has_inside = field.values().iter().any(|value| *value > level);
            prop_assert_eq!(mesh.triangles.is_empty(), !has_inside);
            prop_assert!(!has_inside || mesh.signed_volume() > 0.0, "{}", mesh.signed_volume());
        }
    }

    #[test]
    fn every_case_stands_closed_in_a_grid() {
        for case in 0..256_u32 {
            let field = field_of(2, |centre| {
                let corner =
                    centre.iter().enumerate().map(|(axis, value)| u32::from(*value > 1.0) << axis).sum::<u32>();
                f64::from(case >> corner & 1)
            });
            let mesh = marching_cubes(&field, 0.5, 0.0, in_cells);
            assert_closed_and_manifold(&mesh);
            assert!(case == 0 || mesh.signed_volume() > 0.0, "case {case}");
        }
    }

    #[test]
    fn balls_and_boxes_have_the_volumes_of_closed_forms() {
        // A distance field is linear across the surface: what is left is the chord's error, of second order.
        let mut errors = Vec::new();
        for side in [16, 32, 64, 128] {
            let (middle, radius) = (side as f64 / 2.0 + 0.13, 0.37 * side as f64);
            let distance =
                |centre: [f64; 3]| radius - centre.map(|value| (value - middle).powi(2)).iter().sum::<f64>().sqrt();
            let volume = marching_cubes(&field_of(side, distance), 0.0, -1.0, in_cells).signed_volume();
            errors.push(1.0 - volume / (4.0 / 3.0 * PI * radius.powi(3)));
        }
        assert!(errors.windows(2).all(|pair| pair[1] > 0.0 && pair[1] < 0.3 * pair[0]), "{errors:?}");
        assert!(errors[3] < 1e-3, "{errors:?}");
        // The planes of a box are met exactly; along its edges at most half a cell's face is cut off.
        let half = [9.0, 6.4, 12.25];
        let inside = |centre: [f64; 3]| {
            (0..3).map(|axis| half[axis] - (centre[axis] - 16.0).abs()).fold(f64::INFINITY, f64::min)
        };
        let mesh = marching_cubes(&field_of(32, inside), 0.0, -1.0, in_cells);
        let bounds = mesh.aabb().expect("a box");
        for (extent, half) in bounds.extents().iter().zip(half) {
            assert!((extent - 2.0 * half).abs() < 1e-4, "{bounds:?}");
        }
        let lost = 1.0 - mesh.signed_volume() / half.iter().map(|half| 2.0 * half).product::<f64>();
        let edges = 8.0 * half.iter().sum::<f64>();
        let most = 0.5 * edges / half.iter().map(|half| 2.0 * half).product::<f64>();
        assert!(lost > 0.0 && lost < most, "{lost} {most}");
    }
}
