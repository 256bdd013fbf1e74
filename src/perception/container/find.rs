//! The container of a picture, by its walls.

use nalgebra::{Point3, Vector3};

use super::{
    Container, THICKNESS, Wall,
    coarse::{Facet, facets_of},
    panel::{Panel, panels_of, quantile},
};
use crate::{
    frame::DepthFrame,
    plane::{Plane, fitted},
};

/// Smallest cosine between the vertical and the direction (0, -1, -1), for a camera that is held upright and looks down by up to 90
/// degrees: that of an upright surface is smaller.
const HELD_UPRIGHT: f64 = 0.6;
/// Smallest cosine between the vertical and the normal of a level surface.
const LEVEL: f64 = 0.9;
/// Shortest wall that makes a corner, and shortest further wall [m].
const LENGTHS: [f64; 2] = [0.12, 0.08];
/// Smallest sum of the lengths of two walls that make a corner [m].
const BOTH: f64 = 0.35;
/// Smallest height of the seen part of a wall [m].
const SEEN_HEIGHT: f64 = 0.03;
/// Largest cosine between the normals of two walls that meet, and smallest for parallel ones.
const ANGLES: [f64; 2] = [0.2, 0.97];
/// Largest distance of a wall's end from the wall that it meets [m]; an object may hide the end of one of two walls.
const CORNER: [f64; 2] = [0.06, 0.16];
/// Walls have no facets farther than this behind another [m].
const BEHIND: f64 = 0.02;
/// Largest difference between the rims of two walls [m].
const RIMS: f64 = 0.04;
/// Smallest height of a rim above the floor, and smallest of the camera above the rim [m].
const RIM: f64 = 0.04;
/// Floor beside a wall, up to this far from it [m].
const BESIDE: f64 = 0.12;
/// Step of the heights at which a floor is searched [m], and fewest facets and smallest share of the level facets of a floor.
const FLOOR_STEP: f64 = 0.005;
/// See [`FLOOR_STEP`].
const FLOOR: (usize, f64) = (12, 0.1);
/// Facets up to this far from a level belong to the floor [m].
const FLOOR_REACH: f64 = 0.008;
/// Points up to this far from the floor belong to it [m].
const FLOOR_TOLERANCE: f64 = 0.005;
/// Smallest cosine between the floor's normal before and after it is fitted to all points.
const STEADY: f64 = 0.999;
/// An outer face of a wall lies at most this far from where the walls beside it end [m].
const OUTER: f64 = 0.08;
/// Smallest cosine between the normal of an outer face and those of its facets, also at its edges.
const FACING: f64 = 0.5;
/// Facets farther than this behind the end of a wall lie beyond it [m]: an end is seen up to 2 cm too early.
const FAR: f64 = 0.04;
/// Thinnest wall [m].
const THIN: f64 = 0.004;
/// Heights below and above the walls' seen ends at which their top faces are searched [m]. A camera overhead sees walls at a grazing
/// angle, and not up to the rim.
const TOP_FACE: [f64; 2] = [0.015, 0.05];
/// Thickness of the layer that holds the points of a top face [m], and the smallest share and count of the points in it.
const TOP_LAYER: (f64, f64, usize) = (0.008, 0.6, 100);
/// Smallest distance of opposite walls [m].
const NARROW: f64 = 0.08;

/// The container whose walls the picture shows; `None` if it shows no two that meet. `plane` is the largest plane, if there is one;
/// `is_given` keeps it as the floor.
pub(crate) fn container_of(
    frame: &DepthFrame,
    points: &[(u32, Point3<f64>)],
    plane: Option<&Plane>,
    is_given: bool,
) -> Option<Container> {
    let facets = facets_of(frame);
    let up = vertical(&facets, plane, is_given)?;
    let panels = panels_of(&facets, &up);
    let members = members_of(&panels)?;
    let rim = rim_of(&members);
    let floor = match plane {
        Some(plane) if is_given => *plane,
        _ => floor_of(&facets, &members, &up, rim)?,
    };
    // Heights along the vertical are those above a plane through the camera.
    let rim = rim + floor.offset;
    if rim < RIM || rim > floor.offset - RIM {
        return None;
    }
    let mut walls: Vec<Wall> = members.iter().map(|panel| seen_wall(panel)).collect();
    let view = View { facets: &facets, panels: &panels, members: &members, floor: &floor, rim };
    walls.extend(members.iter().filter_map(|panel| opposite(panel, &view)));
    let mut container = Container { floor, rim, walls };
    if !is_given {
        refine_floor(&mut container, points);
    }
    if let Some(rim) = top_face(&container, points) {
        container.rim = rim;
    }
    Some(container)
}

/// Height of the walls' top faces: that of the layer with most of the points behind the inner faces. `None` if they have no such layer.
fn top_face(container: &Container, points: &[(u32, Point3<f64>)]) -> Option<f64> {
    let [below, above] = TOP_FACE;
    let is_behind = |point: &Point3<f64>| {
        let nearest = container.walls.iter().map(|wall| wall.distance(point)).fold(f64::INFINITY, f64::min);
        nearest < -THIN && nearest > -THICKNESS
    };
    let behind = points.iter().map(|(_, point)| point).filter(|point| is_behind(point));
    let height = |point: &Point3<f64>| container.floor.height(point);
    let is_near = |height: &f64| (container.rim - below..container.rim + above).contains(height);
    let mut heights: Vec<f64> = behind.map(height).filter(is_near).collect();
    heights.sort_by(f64::total_cmp);
    let (thickness, share, count) = TOP_LAYER;
    let within = |first: usize| heights[first..].partition_point(|height| *height < heights[first] + thickness);
    // The first of equal layers.
    let best = (0..heights.len()).max_by_key(|first| (within(*first), usize::MAX - first))?;
    let layer = within(best);
    let is_face = layer >= count && layer as f64 >= share * heights.len() as f64;
    is_face.then(|| heights[best + layer / 2])
}

/// Fits the floor to all points on it.
fn refine_floor(container: &mut Container, points: &[(u32, Point3<f64>)]) {
    let is_inside = |point: &&Point3<f64>| container.walls.iter().all(|wall| wall.distance(point) > 0.0);
    let near = points.iter().map(|(_, point)| point).filter(|point| container.floor.height(point).abs() < FLOOR_REACH);
    let inside: Vec<&Point3<f64>> = near.filter(is_inside).collect();
    let on = |floor: &Plane| {
        let floor = *floor;
        inside.iter().copied().filter(move |point| floor.height(point).abs() < FLOOR_TOLERANCE)
    };
    let mut floor = container.floor;
    for _ in 0..2 {
        floor = fitted(on(&floor), &floor.foot()).filter(|new| new.normal.dot(&floor.normal) > STEADY).unwrap_or(floor);
    }
    floor.points = on(&floor).count();
    container.floor = floor;
}

/// Unit vector against gravity: the normal of the largest plane, or if that is upright, of the largest level one.
fn vertical(facets: &[Facet], plane: Option<&Plane>, is_given: bool) -> Option<Vector3<f64>> {
    let held = Vector3::new(0.0, -1.0, -1.0).normalize();
    let largest = plane.map(|plane| plane.normal);
    if let Some(normal) = largest.filter(|normal| is_given || normal.dot(&held) > HELD_UPRIGHT) {
        return Some(normal);
    }
    let level: Vec<Facet> = facets.iter().filter(|facet| facet.normal.dot(&held) > HELD_UPRIGHT).copied().collect();
    // The direction that most facets share, then their mean.
    let count = 64.min(level.len());
    let near = |normal: &Vector3<f64>| {
        let normal = *normal;
        level.iter().filter(move |facet| facet.normal.dot(&normal) > 0.99)
    };
    let seeds = (0..count).map(|index| level[index * level.len() / count].normal);
    let best = seeds.max_by_key(|normal| near(normal).count())?;
    near(&best).map(|facet| facet.normal).sum::<Vector3<f64>>().try_normalize(1e-9)
}

/// Inner faces of a container's walls: the two that make a corner and have the most facets, and all that fit to both.
fn members_of(panels: &[Panel]) -> Option<Vec<&Panel>> {
    let tall: Vec<&Panel> = panels.iter().filter(|panel| panel.heights[1] - panel.heights[0] > SEEN_HEIGHT).collect();
    let long = || tall.iter().filter(|panel| panel.length() > LENGTHS[0]);
    let pairs = long().flat_map(|a| long().map(move |b| [*a, *b]));
    let corners = pairs.filter(|[a, b]| a.facets.len() >= b.facets.len() && is_corner(a, b));
    let pair = corners.max_by_key(|[a, b]| a.facets.len() + b.facets.len())?;
    let mut members = pair.to_vec();
    for panel in tall.into_iter().filter(|panel| panel.length() > LENGTHS[1]) {
        let fits = members.iter().all(|member| !std::ptr::eq(*member, panel) && fits(panel, member));
        if fits && members.iter().any(|member| is_end_near(panel, member, CORNER[0])) {
            members.push(panel);
        }
    }
    Some(members)
}

/// Whether two panels are walls that meet in a concave corner.
fn is_corner(a: &Panel, b: &Panel) -> bool {
    a.length() + b.length() > BOTH
        && a.plane.normal.dot(&b.plane.normal).abs() < ANGLES[0]
        && fits(a, b)
        && is_end_near(a, b, CORNER[1])
        && is_end_near(b, a, CORNER[1])
        && (is_end_near(a, b, CORNER[0]) || is_end_near(b, a, CORNER[0]))
}

/// Whether two panels can be inner faces of one container: perpendicular or opposite, each in front of the other, of one height.
fn fits(a: &Panel, b: &Panel) -> bool {
    let cosine = a.plane.normal.dot(&b.plane.normal);
    let is_level = a.is_top_cut || b.is_top_cut || (a.heights[1] - b.heights[1]).abs() < RIMS;
    (cosine.abs() < ANGLES[0] || cosine < -ANGLES[1])
        && is_level
        && a.nearest_to(&b.plane, 0.05) > -BEHIND
        && b.nearest_to(&a.plane, 0.05) > -BEHIND
}

/// Whether a panel ends as near as this to another [m].
fn is_end_near(panel: &Panel, other: &Panel, reach: f64) -> bool {
    panel.nearest_to(&other.plane, 0.03) < reach
}

/// Coordinate of the rim along the vertical [m].
fn rim_of(members: &[&Panel]) -> f64 {
    let whole: Vec<f64> = members.iter().filter(|panel| !panel.is_top_cut).map(|panel| panel.heights[1]).collect();
    let all = || members.iter().map(|panel| panel.heights[1]);
    if whole.is_empty() { all().fold(f64::NEG_INFINITY, f64::max) } else { quantile(whole, 0.5) }
}

/// The floor: the lowest level surface beside the walls, or a level plane at the walls' lower ends.
fn floor_of(facets: &[Facet], members: &[&Panel], up: &Vector3<f64>, rim: f64) -> Option<Plane> {
    let height = |facet: &Facet| up.dot(&facet.point.coords);
    let is_inside = |facet: &&Facet| members.iter().all(|panel| panel.plane.height(&facet.point) > 0.01);
    let is_level = |facet: &&Facet| facet.normal.dot(up) > LEVEL && height(facet) < rim - RIM;
    let is_beside = |facet: &&Facet| {
        members.iter().any(|panel| {
            let at = panel.along.dot(&facet.point.coords);
            panel.plane.height(&facet.point) < BESIDE && panel.ends[0] < at && at < panel.ends[1]
        })
    };
    let inside: Vec<&Facet> = facets.iter().filter(is_level).filter(is_inside).collect();
    let mut beside: Vec<f64> = inside.iter().copied().filter(|facet| is_beside(facet)).map(height).collect();
    beside.sort_by(f64::total_cmp);
    // The lowest height above which three steps have enough facets.
    let least = FLOOR.0.max((FLOOR.1 * beside.len() as f64) as usize);
    let count_at = |at: usize| beside[at..].partition_point(|height| *height < beside[at] + 3.0 * FLOOR_STEP);
    let level = (0..beside.len()).map(|at| (at, count_at(at))).find(|(_, count)| *count >= least);
    let Some((at, count)) = level else {
        let lowest = members.iter().map(|panel| panel.heights[0]).fold(f64::INFINITY, f64::min);
        return Plane::through(*up, &(up * lowest));
    };
    let level = beside[at + count / 2];
    let mut floor = Plane::through(*up, &(up * level))?;
    for _ in 0..2 {
        let near = inside.iter().filter(|facet| floor.height(&facet.point).abs() < FLOOR_REACH);
        floor = fitted(near.map(|facet| &facet.point), &floor.foot())?;
    }
    (floor.normal.dot(up) > LEVEL).then_some(floor)
}

fn seen_wall(panel: &Panel) -> Wall {
    Wall { normal: panel.plane.normal, offset: panel.plane.offset, is_seen: true }
}

/// The wall opposite to a panel that no other panel is. Its outer face looks to the same side as the panel, in front of it; the walls
/// beside the panel end at it. `None` if neither is certain.
fn opposite(panel: &Panel, view: &View<'_>) -> Option<Wall> {
    let normal = &panel.plane.normal;
    let is_member = |other: &Panel| view.members.iter().any(|member| std::ptr::eq(*member, other));
    if view.members.iter().any(|other| other.plane.normal.dot(normal) < -ANGLES[1]) {
        return None;
    }
    let beside = view.members.iter().filter(|other| other.plane.normal.dot(normal).abs() < ANGLES[0]);
    let end = beside.filter_map(|other| view.end_of(other, panel)).fold(f64::NEG_INFINITY, f64::max);
    let is_face = |other: &&Panel| {
        other.plane.normal.dot(normal) > ANGLES[1]
            && !is_member(other)
            && (other.heights[1] + view.floor.offset - view.rim).abs() < RIMS
            && other.length() > 0.5 * panel.length()
    };
    // The farthest face: sides of objects lie nearer.
    let faces = view.panels.iter().filter(is_face).map(|other| other.nearest_to(&panel.plane, 0.5));
    let outer = faces.filter(|distance| *distance > NARROW).reduce(f64::max).unwrap_or(f64::INFINITY);
    let inner = if (outer - end).abs() < OUTER {
        end.min(outer - THIN)
    } else if outer.is_finite() && !view.has_objects_beyond(panel, outer) {
        outer - THIN
    } else if end > NARROW && !view.has_objects_beyond(panel, end) {
        end
    } else {
        return None;
    };
    let point = panel.plane.foot().coords + normal * inner;
    Some(Wall { normal: -normal, offset: normal.dot(&point), is_seen: false })
}

/// A picture with the walls found so far.
struct View<'a> {
    facets: &'a [Facet],
    panels: &'a [Panel],
    members: &'a [&'a Panel],
    floor: &'a Plane,
    /// Height of the rim above the floor [m].
    rim: f64,
}

impl View<'_> {
    /// Distance from a panel at which a wall beside it ends, near the rim [m]; `None` if the picture's border may cut the wall.
    fn end_of(&self, wall: &Panel, panel: &Panel) -> Option<f64> {
        let is_high = |facet: &&Facet| self.floor.height(&facet.point) > 0.6 * self.rim;
        let high: Vec<&Facet> = wall.facets.iter().filter(is_high).collect();
        let end = quantile(high.iter().map(|facet| panel.plane.height(&facet.point)).collect(), 0.98);
        let last: Vec<&Facet> =
            high.into_iter().filter(|facet| panel.plane.height(&facet.point) > end - 0.03).collect();
        let cut = last.iter().filter(|facet| facet.is_at_border).count();
        (4 * cut <= last.len()).then_some(end)
    }

    /// Whether facets that are no outer face lie between floor and rim, farther than this from a panel.
    fn has_objects_beyond(&self, panel: &Panel, end: f64) -> bool {
        let is_beyond = |facet: &&Facet| {
            let (height, distance) = (self.floor.height(&facet.point), panel.plane.height(&facet.point));
            let is_outer = distance < end + OUTER && facet.normal.dot(&panel.plane.normal) > FACING;
            distance > end + FAR
                && (0.02..self.rim - 0.03).contains(&height)
                && !is_outer
                && self.members.iter().all(|member| member.plane.height(&facet.point) > BEHIND)
        };
        self.facets.iter().filter(is_beyond).count() > FLOOR.0
    }
}
