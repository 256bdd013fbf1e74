//! Rows of a heatmap of a scene as they are on disk.

use nalgebra::Point3;

use super::{
    heatmap::SceneHeatmap,
    rows::{ForbiddenGrasp, PatchSquare, ProjectedPoint, SeenGrasp},
};
use crate::codec::{
    RecordError,
    fields::{floats, lengthy, pose, ranged},
    proto, wire,
};
use crate::products::{
    patches::{depths, flags, is_visible, window_side},
    picks::{PickObstacle, PickState},
};

/// Name of the message.
pub(super) const MESSAGE: &str = "SceneHeatmap";

/// Tolerance of a projection against the stored one, of 1 px and of the projection.
const PIXEL_TOLERANCE: f64 = 1e-6;

/// A pixel on disk: NaN without one.
fn stored(pixel: Option<[f64; 2]>) -> [f64; 2] {
    pixel.unwrap_or([f64::NAN; 2])
}

/// Appends the grasps with their points and patches.
pub(super) fn encode_grasps(grasps: &[SeenGrasp], out: &mut Vec<u8>) {
    let points = || grasps.iter().flat_map(|grasp| &grasp.points);
    wire::uint32s(out, 16, grasps.iter().map(|grasp| grasp.body));
    wire::uint32s(out, 17, grasps.iter().map(|grasp| grasp.candidate));
    wire::uint32s(out, 18, grasps.iter().map(|grasp| grasp.run));
    wire::uint32s(out, 19, grasps.iter().map(|grasp| grasp.rank));
    wire::uint32s(out, 20, grasps.iter().map(|grasp| grasp.direction));
    wire::uint32s(out, 21, grasps.iter().map(|grasp| grasp.type_index));
    wire::bytes_of(out, 22, grasps.iter().map(|grasp| grasp.state as u8));
    wire::singles(out, 23, grasps.iter().map(|grasp| grasp.value));
    wire::doubles_of(out, 24, grasps.iter().flat_map(|grasp| grasp.world_from_base.to_rows()));
    wire::doubles_of(out, 25, points().flat_map(|point| point.point));
    wire::doubles_of(out, 26, points().flat_map(|point| stored(point.pixel)));
    wire::floats_one_nan(out, 27, &points().map(|point| point.surface).collect::<Vec<_>>());
    let visible: Vec<u8> = points().map(|point| u8::from(point.visible)).collect();
    wire::bytes(out, 28, &visible);
    let with_patches: Vec<u32> =
        (0..).zip(grasps).filter(|(_, grasp)| !grasp.patches.is_empty()).map(|(index, _)| index).collect();
    wire::uint32s(out, 29, with_patches.into_iter());
    let squares: Vec<&PatchSquare> = grasps.iter().flat_map(|grasp| &grasp.patches).collect();
    let corners: Vec<u32> = squares.iter().flat_map(|square| square.corner).collect();
    wire::uint32s(out, 30, corners.into_iter());
    let in_metres: Vec<&PatchSquare> = squares.into_iter().filter(|square| square.window > 0).collect();
    wire::uint32s(out, 31, in_metres.iter().map(|square| square.window));
    let corners: Vec<u32> = in_metres.iter().flat_map(|square| square.window_corner).collect();
    wire::uint32s(out, 32, corners.into_iter());
}

/// Appends the grasps that are not free.
pub(super) fn encode_forbidden(forbidden: &[ForbiddenGrasp], out: &mut Vec<u8>) {
    wire::uint32s(out, 33, forbidden.iter().map(|grasp| grasp.body));
    wire::uint32s(out, 34, forbidden.iter().map(|grasp| grasp.candidate));
    wire::bytes_of(out, 35, forbidden.iter().map(|grasp| grasp.obstacle));
    wire::doubles_of(out, 36, forbidden.iter().flat_map(|grasp| stored(grasp.pixel)));
}

/// The grasps of a record whose head is complete.
pub(super) fn grasps_of(head: &SceneHeatmap, raw: &proto::SceneHeatmap) -> Result<Vec<SeenGrasp>, RecordError> {
    let (count, points) = (raw.bodies.len(), head.names.len());
    for (field, expected, found) in [
        ("candidates", count, raw.candidates.len()),
        ("runs", count, raw.runs.len()),
        ("ranks", count, raw.ranks.len()),
        ("directions", count, raw.directions.len()),
        ("type_indices", count, raw.type_indices.len()),
        ("states", count, raw.states.len()),
        ("values", 4 * count, raw.values.len()),
        ("world_from_base", 12 * count, raw.world_from_base.len()),
        ("points", 3 * points * count, raw.points.len()),
        ("pixels", 2 * points * count, raw.pixels.len()),
        ("surfaces", 4 * points * count, raw.surfaces.len()),
        ("visible", points * count, raw.visible.len()),
    ] {
        lengthy(MESSAGE, field, expected, found)?;
    }
    let states = PickState::all_of(MESSAGE, "states", &raw.states)?;
    let values = floats(MESSAGE, "values", &raw.values, 1)?;
    let all_points = points_of(head, raw)?;
    let mut grasps: Vec<SeenGrasp> = Vec::with_capacity(count);
    for (index, (state, value)) in states.into_iter().zip(values).enumerate() {
        let (body, candidate, type_index) = (raw.bodies[index], raw.candidates[index], raw.type_indices[index]);
        check_key(
            head,
            ["bodies", "candidates"],
            [body, candidate],
            grasps.last().map(|last| [last.body, last.candidate]),
        )?;
        let known = (type_index as usize) < head.count_types();
        ranged(MESSAGE, "type_indices", f64::from(type_index), known, "an index into types")?;
        ranged(MESSAGE, "values", f64::from(value), value == head.label.value(state), "the label of the state")?;
        grasps.push(SeenGrasp {
            body,
            candidate,
            run: raw.runs[index],
            rank: raw.ranks[index],
            direction: raw.directions[index],
            type_index,
            state,
            value,
            world_from_base: pose(MESSAGE, "world_from_base", &raw.world_from_base[12 * index..][..12])?,
            points: all_points[points * index..][..points].to_vec(),
            patches: Vec::new(),
        });
    }
    take_patches(head, raw, &mut grasps)?;
    Ok(grasps)
}

/// Checks number and order of a row.
fn check_key(
    head: &SceneHeatmap,
    [bodies, candidates]: [&'static str; 2],
    [body, candidate]: [u32; 2],
    last: Option<[u32; 2]>,
) -> Result<(), RecordError> {
    let is_known = (body as usize).checked_sub(1).and_then(|index| head.evaluated.get(index)) == Some(&true);
    ranged(MESSAGE, bodies, f64::from(body), is_known, "a body of the scene whose grasps were evaluated")?;
    let is_next = last.is_none_or(|last| last < [body, candidate]);
    ranged(MESSAGE, candidates, f64::from(candidate), is_next, "sorted by body and candidate, none twice")
}

/// A projection on disk, compared with what it should be where that is known.
fn pixel_of(
    field: &'static str,
    pair: &[f64],
    expected: Option<Option<[f64; 2]>>,
) -> Result<Option<[f64; 2]>, RecordError> {
    let pixel = [pair[0], pair[1]];
    let none = pixel.iter().all(|value| value.is_nan());
    let wild = pixel.iter().find(|value| !value.is_finite()).filter(|_| !none);
    ranged(MESSAGE, field, wild.copied().unwrap_or_default(), wild.is_none(), "finite, or twice NaN")?;
    let pixel = (!none).then_some(pixel);
    if let Some(expected) = expected {
        let is_near = |one: f64, other: f64| (one - other).abs() <= PIXEL_TOLERANCE * (1.0 + other.abs());
        let fits = match (pixel, expected) {
            (Some(one), Some(other)) => is_near(one[0], other[0]) && is_near(one[1], other[1]),
            (one, other) => one == other,
        };
        ranged(MESSAGE, field, pair[0], fits, "the projections of points")?;
    }
    Ok(pixel)
}

fn points_of(head: &SceneHeatmap, raw: &proto::SceneHeatmap) -> Result<Vec<ProjectedPoint>, RecordError> {
    let wild = raw.points.iter().find(|value| !value.is_finite());
    ranged(MESSAGE, "points", wild.copied().unwrap_or_default(), wild.is_none(), "finite")?;
    let surfaces = depths(MESSAGE, "surfaces", &raw.surfaces)?;
    let visible = flags(MESSAGE, "visible", &raw.visible)?;
    let camera_from_world = head.world_from_camera.inverse();
    let mut points = Vec::with_capacity(surfaces.len());
    for (index, (at, pair)) in raw.points.chunks_exact(3).zip(raw.pixels.chunks_exact(2)).enumerate() {
        let point = Point3::new(at[0], at[1], at[2]);
        let expected = ProjectedPoint::new(point, &head.camera, &camera_from_world, |_| surfaces[index]);
        let pixel = pixel_of("pixels", pair, Some(expected.pixel))?;
        let (surface, own) = (surfaces[index], visible[index]);
        let found = ProjectedPoint { point: point.coords.into(), pixel, surface, visible: own };
        let fits = surface.is_nan() || found.is_in(&head.camera);
        ranged(MESSAGE, "surfaces", f64::from(surface), fits, "NaN outside the image")?;
        let depth = camera_from_world.point(&point).z;
        let says = own == (found.is_in(&head.camera) && is_visible(depth, surface));
        ranged(MESSAGE, "visible", f64::from(u8::from(own)), says, "the visibility that follows from the depths")?;
        points.push(found);
    }
    Ok(points)
}

/// Assigns the patches to their grasps.
fn take_patches(head: &SceneHeatmap, raw: &proto::SceneHeatmap, grasps: &mut [SeenGrasp]) -> Result<(), RecordError> {
    let (count, points) = (raw.patches.len(), head.names.len());
    lengthy(MESSAGE, "corners", 2 * points * count, raw.corners.len())?;
    let in_metres = if head.size.is_some() { points * count } else { 0 };
    lengthy(MESSAGE, "windows", in_metres, raw.windows.len())?;
    lengthy(MESSAGE, "window_corners", 2 * in_metres, raw.window_corners.len())?;
    let camera_from_world = head.world_from_camera.inverse();
    for (number, index) in raw.patches.iter().enumerate() {
        let fits = (*index as usize) < grasps.len() && (number == 0 || raw.patches[number - 1] < *index);
        ranged(MESSAGE, "patches", f64::from(*index), fits, "indices of grasps, ascending")?;
        let grasp = &mut grasps[*index as usize];
        for (point, first) in grasp.points.iter().zip(points * number..) {
            let corner = [raw.corners[2 * first], raw.corners[2 * first + 1]];
            check_square(head, "corners", point, corner, head.side)?;
            let mut square = PatchSquare { corner, window: 0, window_corner: [0; 2] };
            if let Some(size) = head.size {
                square.window = raw.windows[first];
                square.window_corner = [raw.window_corners[2 * first], raw.window_corners[2 * first + 1]];
                let depth = camera_from_world.point(&point.point.into()).z;
                let covers = square.window == window_side(size, head.camera.fx, depth);
                ranged(MESSAGE, "windows", f64::from(square.window), covers, "the size at the depth of the point")?;
                check_square(head, "window_corners", point, square.window_corner, square.window)?;
            }
            grasp.patches.push(square);
        }
    }
    Ok(())
}

/// Checks that a square is around a point, inside the image.
fn check_square(
    head: &SceneHeatmap,
    field: &'static str,
    point: &ProjectedPoint,
    corner: [u32; 2],
    side: u32,
) -> Result<(), RecordError> {
    let pixel = point.pixel.unwrap_or([f64::NAN; 2]);
    for (axis, max) in [head.camera.width, head.camera.height].into_iter().enumerate() {
        let middle = f64::from(corner[axis]) + f64::from(side) / 2.0;
        let is_around = (middle - pixel[axis]).abs() <= 0.5 + PIXEL_TOLERANCE;
        ranged(MESSAGE, field, f64::from(corner[axis]), is_around, "around the pixel of its point")?;
        let inside = corner[axis].checked_add(side).is_some_and(|end| end <= max);
        ranged(MESSAGE, field, f64::from(corner[axis]), inside, "inside the image")?;
    }
    Ok(())
}

/// The grasps that are not free, of a record whose head is complete.
pub(super) fn forbidden_of(head: &SceneHeatmap, raw: &proto::SceneHeatmap) -> Result<Vec<ForbiddenGrasp>, RecordError> {
    let count = raw.forbidden_bodies.len();
    lengthy(MESSAGE, "forbidden_candidates", count, raw.forbidden_candidates.len())?;
    lengthy(MESSAGE, "obstacles", count, raw.obstacles.len())?;
    lengthy(MESSAGE, "forbidden_pixels", 2 * count, raw.forbidden_pixels.len())?;
    let mut forbidden: Vec<ForbiddenGrasp> = Vec::with_capacity(count);
    for (index, obstacle) in raw.obstacles.iter().enumerate() {
        let (body, candidate) = (raw.forbidden_bodies[index], raw.forbidden_candidates[index]);
        let fields = ["forbidden_bodies", "forbidden_candidates"];
        check_key(head, fields, [body, candidate], forbidden.last().map(|last| [last.body, last.candidate]))?;
        let is_grasp = head.grasps.binary_search_by_key(&[body, candidate], |grasp| [grasp.body, grasp.candidate]);
        let both = f64::from(candidate);
        ranged(MESSAGE, "forbidden_candidates", both, is_grasp.is_err(), "a candidate that is not free")?;
        let known = (1..=PickObstacle::NAMES.len()).contains(&usize::from(*obstacle));
        ranged(MESSAGE, "obstacles", f64::from(*obstacle), known, "1 to 4")?;
        let pixel = pixel_of("forbidden_pixels", &raw.forbidden_pixels[2 * index..][..2], None)?;
        forbidden.push(ForbiddenGrasp { body, candidate, obstacle: *obstacle, pixel });
    }
    Ok(forbidden)
}
