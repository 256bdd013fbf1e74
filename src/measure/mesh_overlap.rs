//! Overlap of the volumes of two closed meshes.

use kernel::geom::TriMesh;

use crate::inside::MeshInside;

/// Cells along the longest side of the box around both meshes.
const CELLS: usize = 80;

/// Intersection over union of the volumes of two closed meshes, the same in both orders: counts of cells whose centres are
/// inside, of a grid over the box of both with 80 cells along its longest side and one more all round. Two meshes without
/// triangles agree.
pub fn mesh_overlap(one: &TriMesh, other: &TriMesh) -> f64 {
    let bounds = [one.aabb(), other.aabb()];
    let mut boxes = bounds.into_iter().flatten();
    let Some(first) = boxes.next() else { return 1.0 };
    let (low, high) = boxes.fold((first.min, first.max), |(low, high), next| (low.inf(&next.min), high.sup(&next.max)));
    let cell = (high - low).max() / CELLS as f64;
    if cell <= 0.0 {
        return 0.0;
    }
    let counts: [usize; 3] = std::array::from_fn(|axis| ((high[axis] - low[axis]) / cell).ceil() as usize + 2);
    let centre = |axis: usize, index: usize| low[axis] + (index as f64 - 0.5) * cell;
    let insides = [MeshInside::new(one), MeshInside::new(other)];
    let (mut both, mut either) = (0_u64, 0_u64);
    for (x, y) in (0..counts[0]).flat_map(|x| (0..counts[1]).map(move |y| (x, y))) {
        let columns = insides.each_ref().map(|inside| {
            let mut crossings = inside.crossings(centre(0, x), centre(1, y));
            crossings.sort_by(|a, b| a.0.total_cmp(&b.0));
            crossings
        });
        if columns.iter().all(Vec::is_empty) {
            continue;
        }
        // Along the column: windings change as surfaces are crossed.
        let mut next = [0; 2];
        let mut windings = [0; 2];
        for z in 0..counts[2] {
            let height = centre(2, z);
            for mesh in 0..2 {
                while let Some((at, sense)) = columns[mesh].get(next[mesh]).filter(|(at, _)| *at <= height) {
                    debug_assert!(at.is_finite());
                    windings[mesh] += sense;
                    next[mesh] += 1;
                }
            }
            both += u64::from(windings.iter().all(|winding| *winding != 0));
            either += u64::from(windings.iter().any(|winding| *winding != 0));
        }
    }
    if either == 0 { 0.0 } else { both as f64 / either as f64 }
}

#[cfg(test)]
pub(crate) mod tests {
    use std::f64::consts::PI;

    use super::*;
    use crate::surfaces::tests::cuboid;

    /// A ball out of rings.
    pub(crate) fn ball(centre: [f64; 3], radius: f64) -> TriMesh {
        let (rings, spokes) = (60_usize, 120_usize);
        let vertex = |ring: usize, spoke: usize| {
            let (polar, turn) = (PI * ring as f64 / rings as f64, 2.0 * PI * spoke as f64 / spokes as f64);
            let unit = [f64::sin(polar) * f64::cos(turn), f64::sin(polar) * f64::sin(turn), f64::cos(polar)];
            std::array::from_fn(|axis| (centre[axis] + radius * unit[axis]) as f32)
        };
        let mut mesh = TriMesh { vertices: vec![vertex(0, 0), vertex(rings, 0)], triangles: Vec::new() };
        (1..rings).for_each(|ring| mesh.vertices.extend((0..spokes).map(|spoke| vertex(ring, spoke))));
        let at = |ring: usize, spoke: usize| match ring {
            0 => 0,
            _ if ring == rings => 1,
            _ => (2 + (ring - 1) * spokes + spoke % spokes) as u32,
        };
        for (ring, spoke) in (0..rings).flat_map(|ring| (0..spokes).map(move |spoke| (ring, spoke))) {
            let corners = [at(ring, spoke), at(ring + 1, spoke), at(ring + 1, spoke + 1), at(ring, spoke + 1)];
            if ring + 1 < rings {
                mesh.triangles.push([corners[0], corners[1], corners[2]]);
            }
            if ring > 0 {
                mesh.triangles.push([corners[0], corners[2], corners[3]]);
            }
        }
        mesh
    }

    #[test]
    fn boxes_and_balls_overlap_as_closed_forms_say() {
        let one = cuboid([0.0; 3], [0.1, 0.08, 0.06]);
        assert_eq!(mesh_overlap(&one, &one), 1.0);
        for shift in [0.01, 0.033, 0.07] {
            let other = cuboid([shift, 0.0, 0.0], [0.1, 0.08, 0.06]);
            let wanted = (0.1 - shift) / (0.1 + shift);
            let found = mesh_overlap(&one, &other);
            // Half a cell at each of the faces that differ.
            assert!((found - wanted).abs() < 0.03, "{found}, not {wanted}");
            assert_eq!(found, mesh_overlap(&other, &one), "the same in both orders");
        }
        assert_eq!(mesh_overlap(&one, &cuboid([1.0; 3], [0.1; 3])), 0.0);
        let (small, large) = (ball([0.0; 3], 0.08), ball([0.0; 3], 0.1));
        assert!(small.signed_volume() > 0.0);
        let wanted = small.signed_volume() / large.signed_volume();
        assert!((mesh_overlap(&small, &large) - wanted).abs() < 0.01);
        // Two balls whose centres are a radius apart share 5/16 of a ball's volume.
        let found = mesh_overlap(&large, &ball([0.1, 0.0, 0.0], 0.1));
        assert!((found - (5.0 / 16.0) / (2.0 - 5.0 / 16.0)).abs() < 0.01, "{found}");
        assert_eq!(mesh_overlap(&TriMesh::default(), &TriMesh::default()), 1.0);
        assert_eq!(mesh_overlap(&TriMesh::default(), &one), 0.0);
    }
}
