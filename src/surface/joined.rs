//! The detailed way of profile `standard`: a network's coverage joined with the surface that the camera saw.
//!
//! Where the surface was seen it lies there; what the camera sees through is outside; elsewhere it lies where coverage has it.
//! Each voxel gets a box from that, wider where less is known, and the smoothest field between the boxes (`smooth.rs`) is cut
//! at 0.

use kernel::geom::GridPlacement;

use crate::{
    field::CubeField,
    seen::{Depth, Evidence, SeenObject},
    smooth::{Boxes, PADDING},
};

/// Half the width of the box of a voxel at a seen surface [voxels].
const SEEN_WIDTH: f64 = 0.15;
/// Voxels from whose direction no ray came back are outside by this at least [voxels].
const NO_RETURN: f32 = 0.3;
/// Half the width of the box of a voxel near the surface of coverage [cells].
const COVERAGE_WIDTH: f32 = 0.25;
/// Half the width of the box of a voxel in a wall that is little thicker than a cell: smoothing would dissolve it [cells].
const WALL_WIDTH: f32 = 0.05;
/// Deeper inside or outside than this a voxel is held from one side only [cells].
const NEAR_SURFACE: f32 = 0.45;

/// Boxes of all voxels, `factor` of them per cell along each axis, in a padded volume.
///
/// `share` is normalised coverage, and its surface lies at `level`.
pub(crate) fn joined_boxes(
    share: &CubeField,
    level: f32,
    placement: &GridPlacement,
    seen: &SeenObject,
    factor: usize,
) -> Boxes {
    let side = share.side() * factor + 2 * PADDING;
    // Half a cell inside where a cell is full, half a cell outside where it is empty.
    let scaled = |share: &f32| 0.5 * (share - level) / if *share > level { 1.0 - level } else { level };
    let depths = share.values().iter().map(scaled).collect();
    let mut fields = refined(&CubeField::from_values(share.side(), depths).expect("one value per cell"), factor);
    let (scale, voxel) = (factor as f32, placement.cell_size / factor as f64);
    fields.iter_mut().for_each(|value| *value *= scale);
    let wide = (SEEN_WIDTH + seen.noise() / voxel) as f32;
    let near = NEAR_SURFACE * scale;
    // Centres of voxels in the camera's frame.
    let corner = placement.lower_corner();
    let centre = |axis: usize, index: usize| corner[axis] + (index as f64 + 0.5 - PADDING as f64) * voxel;
    let depths: Vec<Depth> = (0..side)
        .map(|index| {
            let z = centre(2, index);
            Depth { z, inverse: 1.0 / z }
        })
        .collect();
    // Nothing is known outside of the grid, so that the border keeps away from the padding's end.
    let mut evidence = vec![Evidence::Unknown; side];
    let inside = PADDING..side - PADDING;
    let completed = fields.clone();
    let is_wall = thin_walls(&completed, side, factor + 1);
    let strides = [(side * side) as isize, side as isize, 1];
    let mut boxes = Boxes { lower: Vec::with_capacity(fields.len()), upper: Vec::with_capacity(fields.len()), fields };
    for (index, stack) in boxes.fields.chunks_exact_mut(side).enumerate() {
        let (x, y) = (index / side, index % side);
        if inside.contains(&x) && inside.contains(&y) {
            let position = [centre(0, x), centre(1, y)];
            seen.evidence(position, &depths[inside.clone()], voxel, &mut evidence[inside.clone()]);
        } else {
            evidence.fill(Evidence::Unknown);
        }
        for ((z, field), evidence) in stack.iter_mut().enumerate().zip(&evidence) {
            let (mut lower, mut upper) = (f32::NEG_INFINITY, f32::INFINITY);
            let mut is_seen = false;
            match *evidence {
                Evidence::Surface(inside, inward) => {
                    // A wall that is thinner than a voxel would be lost: where coverage ends behind this voxel, coverage decides.
                    let step: isize =
                        inward.iter().zip(strides).map(|(step, stride)| isize::from(*step) * stride).sum();
                    let behind = completed[(index * side + z).wrapping_add_signed(step)];
                    is_seen = inside >= 0.0 || *field <= 0.0 || behind > 0.0;
                    if is_seen {
                        *field = inside as f32;
                        (lower, upper) = (*field - wide, *field + wide);
                    }
                }
                // A part that is thinner than a voxel may be seen beside its centre.
                Evidence::Free(_) | Evidence::Weak(_)
                    if *field > 0.0 && !seen.sees_through([centre(0, x), centre(1, y), depths[z].z], voxel) => {}
                Evidence::Free(outside) => {
                    *field = field.min(outside as f32);
                    upper = outside as f32 + wide;
                }
                Evidence::Weak(outside) => *field = field.min((outside as f32).max(-NO_RETURN)),
                Evidence::Unknown => {}
            }
            if !is_seen {
                let reach = if is_wall[index * side + z] { WALL_WIDTH } else { COVERAGE_WIDTH } * scale;
                if *field < near {
                    upper = upper.min(if *field > -near { *field + reach } else { -near });
                }
                if *field > -near {
                    lower = if *field < near { *field - reach } else { near };
                }
            }
            boxes.lower.push(lower);
            boxes.upper.push(upper);
        }
    }
    boxes
}

/// Voxels above 0 that belong, along some axis, to a run of at most `longest` voxels.
fn thin_walls(field: &[f32], side: usize, longest: usize) -> Vec<bool> {
    let mut is_thin = vec![false; field.len()];
    for stride in [side * side, side, 1] {
        // All lines of a block at once, voxel by voxel, in the order of memory.
        let mut runs = vec![0; stride];
        for (field, is_thin) in field.chunks_exact(stride * side).zip(is_thin.chunks_exact_mut(stride * side)) {
            // One more than the lines have, so that the last runs end.
            for step in 0..=side {
                for (line, run) in runs.iter_mut().enumerate() {
                    if step < side && field[step * stride + line] > 0.0 {
                        *run += 1;
                        continue;
                    }
                    if *run <= longest {
                        (step - *run..step).for_each(|step| is_thin[step * stride + line] = true);
                    }
                    *run = 0;
                }
            }
        }
    }
    is_thin
}

/// A field between the centres of its cells at the centres of `factor` voxels per cell, in a padded volume; what lies
/// outside of the grid is as empty as can be.
fn refined(field: &CubeField, factor: usize) -> Vec<f32> {
    let n = field.side();
    let mut values = field.values().to_vec();
    let mut shape = [n; 3];
    let side = n * factor + 2 * PADDING;
    // Each voxel between two cells, with the share of the second.
    let between: Vec<(i64, f32)> = (0..side)
        .map(|index| {
            let at = (index as f32 + 0.5 - PADDING as f32) / factor as f32 - 0.5;
            (at.floor() as i64, at - at.floor())
        })
        .collect();
    for axis in [2, 1, 0] {
        let stride: usize = shape[axis + 1..].iter().product();
        let mut finer = Vec::with_capacity(values.len() / n * side);
        for block in values.chunks_exact(stride * n) {
            for (cell, share) in &between {
                let row = |cell: i64| {
                    let index = usize::try_from(cell).ok().filter(|cell| *cell < n)?;
                    Some(&block[index * stride..][..stride])
                };
                let (before, after) = (row(*cell), row(cell + 1));
                let at = |row: Option<&[f32]>, offset: usize| row.map_or(-0.5, |row| row[offset]);
                finer.extend((0..stride).map(|offset| (1.0 - share) * at(before, offset) + share * at(after, offset)));
            }
        }
        values = finer;
        shape[axis] = side;
    }
    values
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn walls_are_runs_of_few_voxels_along_an_axis() {
        let side = 8;
        // A plate two voxels thick, and a block.
        let is_inside = |[x, y, z]: [usize; 3]| (2..4).contains(&x) && y < 6 && z < 8 || x > 4 && y > 3 && z > 3;
        let cells = (0..side * side * side).map(|index| [index / side / side, index / side % side, index % side]);
        let field: Vec<f32> = cells.clone().map(|cell| if is_inside(cell) { 0.2 } else { -0.2 }).collect();
        for (longest, walls) in [(1, 0), (2, 2 * 6 * 8), (3, 2 * 6 * 8 + 3 * 4 * 4)] {
            let found = thin_walls(&field, side, longest);
            assert_eq!(found.iter().filter(|is_thin| **is_thin).count(), walls, "{longest}");
            assert!(cells.clone().zip(&found).all(|(cell, is_thin)| !is_thin || is_inside(cell)));
        }
    }

    #[test]
    fn fields_are_interpolated_between_the_centres_of_cells() {
        // A field that is linear stays so between the outermost centres.
        let mut field = CubeField::filled(4, 0.0);
        let linear = |[x, y, z]: [f32; 3]| 0.1 * x - 0.2 * y + 0.05 * z;
        for cell in field.cells() {
            *field.at_mut(cell) = linear(cell.map(|index| index as f32 + 0.5));
        }
        for factor in 1..=3 {
            let side = 4 * factor + 2 * PADDING;
            let finer = refined(&field, factor);
            assert_eq!(finer.len(), side.pow(3));
            for (index, value) in finer.iter().enumerate() {
                let at = [index / side / side, index / side % side, index % side]
                    .map(|index| (index as f32 + 0.5 - PADDING as f32) / factor as f32);
                if at.iter().all(|value| (0.5..=3.5).contains(value)) {
                    assert!((value - linear(at)).abs() < 1e-5, "{at:?} {value}");
                }
                if at.iter().any(|value| !(-0.5..=4.5).contains(value)) {
                    assert_eq!(*value, -0.5, "{at:?}");
                }
            }
        }
    }
}
