//! A network's grids as a closed mesh in the camera's frame.

use kernel::geom::{GridPlacement, OccupancyGrid, TriMesh};

use crate::{
    cubes::marching_cubes,
    field::CubeField,
    joined::joined_boxes,
    pieces::drop_small_pieces,
    seen::SeenObject,
    smooth::{PADDING, SmoothingProblem, Solver},
    volume::{Volume, upsampling_factor},
};

/// Probability above which a cell counts as occupied where a model names no other.
pub const OBSTACLE_THRESHOLD: f32 = 0.5;
/// Share of a normalised cell that lies inside at the surface.
const SURFACE_LEVEL: f32 = 0.5;
/// Coverage below which a neighbourhood holds no surface.
const MIN_COVERAGE: f32 = 0.05;
/// Probability of occupancy below which a cell holds no surface.
const MIN_OCCUPANCY: f32 = 0.3;
/// Pieces below this share of a mesh's volume are dropped.
const SMALL_PIECE: f64 = 0.01;
/// Most steps of the solver. Thin walls need 120 to 200, solids of 25 voxels' width all.
const STEPS: u32 = 500;
/// Most voxels per cell along each axis where coverage is joined with what was seen. With a third one a network's meshes
/// are no better, 5.7 mm off either way, and take three times as long. True grids would gain: 1.9 mm, then 1.7.
const MAX_FACTOR_OF_JOINED: usize = 2;
/// Steps of the solver where boxes hold the field from both sides.
const STEPS_OF_BOXES: u32 = 150;

/// A closed, manifold mesh in `CameraCv` [m], wound outward; without triangles where nothing is occupied.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct CompletedMesh {
    /// The mesh.
    pub mesh: TriMesh,
    /// Count of pieces under 1 % of the volume that were dropped.
    pub dropped: usize,
}

/// A mesh made on finer voxels, with what it was made by.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct DetailedMesh {
    /// The mesh.
    pub completed: CompletedMesh,
    /// Voxels per cell along each axis.
    pub factor: usize,
    /// Variables of the quadratic programme.
    pub variables: usize,
}

impl CompletedMesh {
    /// The fast way, for obstacles: marching cubes of occupancy at a threshold.
    ///
    /// A cell that the object touches anywhere counts as occupied, so the mesh is about 0.7 cells outside the object: a margin
    /// for obstacles, but too large for planning grasps.
    ///
    /// # Panics
    /// If the field's side is not the placement's resolution.
    pub fn obstacle(occupancy: &CubeField, placement: &GridPlacement, threshold: f32) -> Self {
        Self::of_field(occupancy, placement, threshold, 0.0_f32.min(threshold))
    }

    /// The surface from coverage, the share of each cell that is solid: divided by its maximum over the 3 x 3 x 3 cells
    /// around, so that walls thinner than a cell stay, and meshed where half is left. On true grids it is unbiased.
    ///
    /// # Panics
    /// If the fields' sides are not the placement's resolution.
    pub fn surface(coverage: &CubeField, occupancy: &CubeField, placement: &GridPlacement) -> Self {
        Self::surface_at(coverage, occupancy, placement, SURFACE_LEVEL)
    }

    /// [`CompletedMesh::surface`] where another share than half is left, as a network may have been fitted to.
    ///
    /// # Panics
    /// If the fields' sides are not the placement's resolution.
    pub fn surface_at(coverage: &CubeField, occupancy: &CubeField, placement: &GridPlacement, level: f32) -> Self {
        let normalised = normalised_coverage(coverage, occupancy);
        Self::of_field(&normalised, placement, level, 0.0)
    }

    /// The detailed way of the thesis (chapter 5.3, algorithm 2): observed points are merged with completed cells, finer
    /// where points are denser, and the border between both kinds of voxels is drawn by the smoothest field of their sign.
    ///
    /// Points are in `CameraCv` [m].
    ///
    /// # Panics
    /// If the grid's resolution is not the placement's.
    pub fn merge_observed(completed: &OccupancyGrid, observed: &[[f32; 3]], placement: &GridPlacement) -> DetailedMesh {
        let factor = upsampling_factor(observed, placement);
        Self::merge_observed_with(completed, observed, placement, factor, Solver::Accelerated { steps: STEPS })
    }

    /// [`CompletedMesh::merge_observed`] with a given factor of upsampling and a given solver.
    ///
    /// # Panics
    /// If the grid's resolution is not the placement's, or the factor is 0.
    pub fn merge_observed_with(
        completed: &OccupancyGrid,
        observed: &[[f32; 3]],
        placement: &GridPlacement,
        factor: usize,
        solver: Solver,
    ) -> DetailedMesh {
        assert_eq!(completed.resolution(), placement.resolution, "the grid matches its placement");
        let mut volume = Volume::upsampled(completed, factor);
        volume.add_points(observed, placement);
        volume.fill_gaps(factor);
        Self::of_problem(&SmoothingProblem::new(&volume), solver, placement, factor)
    }

    /// The detailed way of profile `standard`: coverage joined with the surface that the camera saw, drawn by the smoothest
    /// field that keeps to both. A cell has one voxel, or two along each axis where points are dense.
    ///
    /// # Panics
    /// If the fields' sides are not the placement's resolution.
    pub fn joined(
        coverage: &CubeField,
        occupancy: &CubeField,
        placement: &GridPlacement,
        level: f32,
        seen: &SeenObject,
    ) -> DetailedMesh {
        let factor = upsampling_factor(seen.points(), placement).min(MAX_FACTOR_OF_JOINED);
        Self::joined_by(coverage, occupancy, placement, level, seen, factor)
    }

    /// [`CompletedMesh::joined`] with a given factor of upsampling.
    ///
    /// # Panics
    /// If the fields' sides are not the placement's resolution, or the factor is 0.
    pub fn joined_by(
        coverage: &CubeField,
        occupancy: &CubeField,
        placement: &GridPlacement,
        level: f32,
        seen: &SeenObject,
        factor: usize,
    ) -> DetailedMesh {
        assert_eq!(coverage.side(), placement.resolution as usize, "the grid matches its placement");
        assert!(factor > 0, "at least one voxel per cell");
        let share = normalised_coverage(coverage, occupancy);
        let boxes = joined_boxes(&share, level, placement, seen, factor);
        let problem = SmoothingProblem::of_boxes(&boxes, coverage.side() * factor + 2 * PADDING);
        Self::of_problem(&problem, Solver::Accelerated { steps: STEPS_OF_BOXES }, placement, factor)
    }

    /// The mesh of a programme's solution, `factor` voxels per cell.
    fn of_problem(
        problem: &SmoothingProblem,
        solver: Solver,
        placement: &GridPlacement,
        factor: usize,
    ) -> DetailedMesh {
        let to_cells = |value: f64| (value - PADDING as f64) / factor as f64;
        let position = |point: [f64; 3]| camera_point(placement, point.map(to_cells));
        let mesh = marching_cubes(&problem.solve(solver), 0.0, -1.0, position);
        DetailedMesh { completed: Self::without_crumbs(mesh), factor, variables: problem.variables().count() }
    }

    fn of_field(field: &CubeField, placement: &GridPlacement, level: f32, outside: f32) -> Self {
        assert_eq!(field.side(), placement.resolution as usize, "the grid matches its placement");
        Self::without_crumbs(marching_cubes(field, level, outside, |point| camera_point(placement, point)))
    }

    fn without_crumbs(mut mesh: TriMesh) -> Self {
        let dropped = drop_small_pieces(&mut mesh, SMALL_PIECE);
        Self { mesh, dropped }
    }
}

/// Coverage divided by its maximum over the 3 x 3 x 3 cells around, 0 where nothing is near.
fn normalised_coverage(coverage: &CubeField, occupancy: &CubeField) -> CubeField {
    assert_eq!(coverage.side(), occupancy.side(), "grids of one sample share their side");
    let maximum = coverage.block_maximum();
    let values = coverage.values().iter().zip(maximum.values()).zip(occupancy.values());
    let share = |((share, maximum), occupancy): ((&f32, &f32), &f32)| {
        if *maximum > MIN_COVERAGE && *occupancy > MIN_OCCUPANCY { share / maximum } else { 0.0 }
    };
    CubeField::from_values(coverage.side(), values.map(share).collect()).expect("one value per cell")
}

/// A point of the grid [cells] in `CameraCv` [m].
fn camera_point(placement: &GridPlacement, point: [f64; 3]) -> [f32; 3] {
    let corner = placement.lower_corner();
    std::array::from_fn(|axis| (corner[axis] + point[axis] * placement.cell_size) as f32)
}

#[cfg(test)]
mod tests {
    use kernel::geom::Intrinsics;
    use proptest::prelude::*;

    use super::*;
    use crate::cubes::tests::assert_closed_and_manifold;

    fn placement(resolution: u32) -> GridPlacement {
        GridPlacement { resolution, centre: [0.1, -0.2, 0.7].into(), cell_size: 0.004 }
    }

    /// The true grids of a ball [cells], coverage by 8^3 points per cell.
    fn ball(n: usize, middle: [f64; 3], radius: f64) -> (CubeField, CubeField) {
        let (mut coverage, mut occupancy) = (CubeField::filled(n, 0.0), CubeField::filled(n, 0.0));
        for cell in coverage.cells() {
            let points = (0..512).filter(|point| {
                let offset = [point / 64, point / 8 % 8, point % 8].map(|part| (f64::from(part) + 0.5) / 8.0);
                let squares = (0..3).map(|axis| (cell[axis] as f64 + offset[axis] - middle[axis]).powi(2));
                squares.sum::<f64>() < radius * radius
            });
            *coverage.at_mut(cell) = points.count() as f32 / 512.0;
            *occupancy.at_mut(cell) = f32::from(coverage.at(cell) > 0.0);
        }
        (coverage, occupancy)
    }

    #[test]
    fn coverage_finds_the_surface_and_occupancy_lies_outside_of_it() {
        let (middle, radius) = ([20.0, 19.6, 18.3], 11.3);
        let (coverage, occupancy) = ball(40, middle, radius);
        let placement = placement(40);
        let offsets = |mesh: &TriMesh| {
            assert_closed_and_manifold(mesh);
            let distance = |vertex: &[f32; 3]| {
                let point = placement.coordinates_of(vertex.map(f64::from));
                (0..3).map(|axis| (point[axis] - middle[axis]).powi(2)).sum::<f64>().sqrt() - radius
            };
            mesh.vertices.iter().map(distance).sum::<f64>() / mesh.vertices.len() as f64
        };
        let surface = offsets(&CompletedMesh::surface(&coverage, &occupancy, &placement).mesh);
        let obstacle = offsets(&CompletedMesh::obstacle(&occupancy, &placement, OBSTACLE_THRESHOLD).mesh);
        assert!(surface.abs() < 0.05, "{surface} cells");
        assert!((0.4..0.9).contains(&obstacle), "{obstacle} cells");
    }

    #[test]
    fn the_detailed_way_smooths_the_steps_of_a_ball() {
        let n = 40;
        let (middle, radius) = ([20.0, 19.6, 18.3], 11.3);
        let (coverage, _) = ball(n, middle, radius);
        let mut grid = OccupancyGrid::new(n as u32);
        coverage
            .cells()
            .filter(|cell| coverage.at(*cell) > 0.5)
            .for_each(|cell| grid.set(cell.map(|index| index as u32)));
        let placement = placement(n as u32);
        let spread = |mesh: &TriMesh| {
            assert_closed_and_manifold(mesh);
            let distances: Vec<f64> = mesh
                .vertices
                .iter()
                .map(|vertex| {
                    let point = placement.coordinates_of(vertex.map(f64::from));
                    (0..3).map(|axis| (point[axis] - middle[axis]).powi(2)).sum::<f64>().sqrt() - radius
                })
                .collect();
            (distances.iter().map(|value| value * value).sum::<f64>() / distances.len() as f64).sqrt()
        };
        let values = coverage.cells().map(|cell| f32::from(coverage.at(cell) > 0.5)).collect();
        let binary = CubeField::from_values(n, values).expect("a cube");
        let fast = spread(&CompletedMesh::obstacle(&binary, &placement, 0.5).mesh);
        for factor in 1..=2 {
            let detailed =
                CompletedMesh::merge_observed_with(&grid, &[], &placement, factor, Solver::Accelerated { steps: 200 });
            assert!(detailed.variables > 1000 && detailed.factor == factor);
            assert!(
                spread(&detailed.completed.mesh) < 0.7 * fast,
                "{factor}: {} {fast}",
                spread(&detailed.completed.mesh)
            );
        }
    }

    /// A ball [cells] as a camera sees it, before a wall: its depths, or the depths of another ball.
    fn seen_ball(placement: &GridPlacement, middle: [f64; 3], radius: f64) -> SeenObject {
        let camera = Intrinsics { width: 120, height: 120, fx: 400.0, fy: 400.0, cx: 60.0, cy: 60.0, near: 0.1 };
        let corner = placement.lower_corner();
        let centre: [f64; 3] = std::array::from_fn(|axis| corner[axis] + middle[axis] * placement.cell_size);
        let radius = radius * placement.cell_size;
        let depth_at = |pixel: u32| -> Option<f32> {
            let ray = camera.unproject(f64::from(pixel % 120) + 0.5, f64::from(pixel / 120) + 0.5, 1.0);
            // |t ray - centre| = radius.
            let a: f64 = (0..3).map(|axis| ray[axis] * ray[axis]).sum();
            let b: f64 = (0..3).map(|axis| ray[axis] * centre[axis]).sum();
            let c = (0..3).map(|axis| centre[axis] * centre[axis]).sum::<f64>() - radius * radius;
            let root = b * b - a * c;
            (root > 0.0).then(|| ((b - root.sqrt()) / a) as f32)
        };
        let depths: Vec<Option<f32>> = (0..120 * 120).map(depth_at).collect();
        let object: Vec<u32> = (0..120 * 120).filter(|pixel| depths[*pixel as usize].is_some()).collect();
        let depths: Vec<f32> = depths.into_iter().map(|depth| depth.unwrap_or(3.0)).collect();
        SeenObject::new(&camera, &depths, &object, &[])
    }

    #[test]
    fn what_was_seen_lies_where_it_was_seen() {
        // The network's ball is two cells too large; the camera saw the true one.
        let placement = GridPlacement { resolution: 40, centre: [0.0, 0.0, 0.7].into(), cell_size: 0.002 };
        let (middle, radius) = ([20.0, 19.6, 18.3], 11.3);
        let (coverage, occupancy) = ball(40, middle, radius + 2.0);
        let seen = seen_ball(&placement, middle, radius);
        assert!(seen.points().len() > 400, "{}", seen.points().len());
        for factor in 1..=2 {
            let detailed = CompletedMesh::joined_by(&coverage, &occupancy, &placement, 0.5, &seen, factor);
            let mesh = &detailed.completed.mesh;
            assert_closed_and_manifold(mesh);
            let offsets = |is_front: bool| {
                let points = mesh.vertices.iter().map(|vertex| placement.coordinates_of(vertex.map(f64::from)));
                // Well inside the silhouette, from the camera's side or from behind.
                let points = points.filter(|point| {
                    let across = (point[0] - middle[0]).powi(2) + (point[1] - middle[1]).powi(2);
                    across.sqrt() < 0.6 * radius && (point[2] < middle[2]) == is_front
                });
                let offsets: Vec<f64> = points
                    .map(|point| (0..3).map(|axis| (point[axis] - middle[axis]).powi(2)).sum::<f64>().sqrt() - radius)
                    .collect();
                assert!(offsets.len() > 100);
                offsets.iter().sum::<f64>() / offsets.len() as f64
            };
            let (front, back) = (offsets(true), offsets(false));
            assert!(front.abs() < 0.15, "factor {factor}: {front} cells");
            assert!((back - 2.0).abs() < 0.3, "factor {factor}: {back} cells");
            // Beside the silhouette half a pixel and half a voxel are left of what the network adds.
            let widest = mesh.vertices.iter().map(|vertex| {
                let point = placement.coordinates_of(vertex.map(f64::from));
                ((point[0] - middle[0]).powi(2) + (point[1] - middle[1]).powi(2)).sqrt()
            });
            let widest = widest.fold(0.0, f64::max);
            assert!(widest < radius + 1.4, "factor {factor}: {widest} cells");
        }
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(48))]

        #[test]
        fn every_way_gives_closed_manifold_meshes(
            n in 2_u32..8,
            factor in 1_usize..4,
            density in 0.0..1.0_f32,
            noise in prop::collection::vec(0.0..1.0_f32, 512),
            points in prop::collection::vec(prop::array::uniform3(0.0..8.0_f64), 0..40),
        ) {
            let placement = placement(n);
            let occupancy = CubeField::from_values(n as usize, noise[..n.pow(3) as usize].to_vec()).expect("a cube");
            let mut grid = OccupancyGrid::new(n);
            let occupied = occupancy.cells().filter(|cell| occupancy.at(*cell) < density);
            occupied.for_each(|cell| grid.set(cell.map(|index| index as u32)));
            let points: Vec<[f32; 3]> = points.iter().map(|point| camera_point(&placement, *point)).collect();
            let detailed = CompletedMesh::merge_observed_with(&grid, &points, &placement, factor, Solver::Accelerated { steps: 20 });
            // A picture of noise: each pixel sees a depth in the grid, something far behind, or nothing.
            let camera = Intrinsics { width: 8, height: 8, fx: 60.0, fy: 60.0, cx: -4.0, cy: 20.0, near: 0.1 };
            let depth: Vec<f32> = noise[..64]
                .iter()
                .zip(&noise[64..])
                .map(|(kind, depth)| if *kind < 0.2 { f32::NAN } else if *kind < 0.4 { 3.0 } else { 0.68 + 0.04 * depth })
                .collect();
            let object: Vec<u32> = (0..64).filter(|pixel| depth[*pixel as usize] < 2.0).collect();
            let seen = SeenObject::new(&camera, &depth, &object, &[5]);
            let joined = CompletedMesh::joined_by(&occupancy, &occupancy, &placement, 0.2 + 0.6 * density, &seen, factor);
            let meshes = [
                joined.completed,
                CompletedMesh::obstacle(&occupancy, &placement, 1.0 - density),
                CompletedMesh::surface(&occupancy, &occupancy, &placement),
                detailed.completed,
            ];
            for completed in meshes {
                assert_closed_and_manifold(&completed.mesh);
                prop_assert!(completed.mesh.triangles.is_empty() || completed.mesh.signed_volume() > 0.0);
            }
        }
    }
}
