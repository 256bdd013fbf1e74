//! Outlines of objects: how sure they are, and where objects touch others, the support plane or a container.

use std::collections::BTreeMap;

use crate::{
    clusters::Cluster,
    frame::DepthFrame,
    labels::{CONTAINER_LABEL, PLANE_LABEL},
    plane::Plane,
};

/// Pixels without a return that an outline is followed across.
const HOLE: u32 = 3;
/// Two objects touch each other at heights whose shares of their own heights differ by less than this: neither is below the other.
const LEVEL: f64 = 0.25;
/// Shorter borders are no contact [px].
const SHORTEST: usize = 3;

/// Something that an object leans on.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Support {
    /// Another object, by its index.
    Object(usize),
    /// The support plane.
    Ground,
    /// A wall or the rim of the container.
    Container,
}

/// An object's outline in the picture.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Outline {
    /// Share of the outline at which the picture shows that the object ends, from 0 to 1: at the support plane, at the container, or
    /// in front of something farther away. Not confirmed are borders with objects that touch it, parts that something nearer
    /// hides, and the picture's border. Parts beside pixels without a return do not count. It is no probability.
    pub confidence: f64,
    /// Things that it leans on, with the length of the border that both share in the picture [m].
    pub leans_on: BTreeMap<Support, f64>,
}

/// Counts of an outline's pixel sides.
#[derive(Clone, Copy, Default)]
struct Sides {
    confirmed: usize,
    open: usize,
}

/// The border that one object shares with something.
#[derive(Clone, Copy, Default)]
struct Border {
    sides: usize,
    /// Sum of the pixels' sides [m].
    length: f64,
    /// Sum of the heights of its own points along the border [m].
    height: f64,
}

/// The outline of each cluster. `container` are the pixels of a container; points up to `gap` apart touch [m], and points up to
/// `reach` above the plane belong to it [m].
pub(crate) fn outlines_of(
    frame: &DepthFrame,
    clusters: &[Cluster],
    container: &[u32],
    plane: Option<&Plane>,
    [gap, reach]: [f64; 2],
) -> Vec<Outline> {
    let owners = owners_of(frame, clusters, container, plane, reach);
    let height = |pixel: u32| plane.map_or(-frame.point(pixel).y, |plane| plane.height(&frame.point(pixel)));
    let mut sides = vec![Sides::default(); clusters.len()];
    let mut borders: BTreeMap<(usize, Support), Border> = BTreeMap::new();
    for (index, cluster) in clusters.iter().enumerate() {
        let label = index as u16 + 1;
        for pixel in &cluster.pixels {
            for step in [[-1, 0], [1, 0], [0, -1], [0, 1]] {
                match beside(frame, *pixel, step) {
                    Beside::Edge => sides[index].open += 1,
                    Beside::Nothing => {}
                    Beside::Pixel(other) => {
                        let owner = owners[other as usize];
                        if owner == label {
                            continue;
                        }
                        let apart = (frame.point(other) - frame.point(*pixel)).norm();
                        let support = match owner {
                            CONTAINER_LABEL => Some(Support::Container),
                            PLANE_LABEL => Some(Support::Ground),
                            0 => None,
                            label => Some(Support::Object(usize::from(label) - 1)),
                        };
                        // A strip of `reach` between an object and the plane belongs to the plane.
                        let limit = if support == Some(Support::Ground) { gap + reach } else { gap };
                        let is_touching = apart <= limit;
                        let is_behind = frame.depth[other as usize] > frame.depth[*pixel as usize];
                        let is_object = matches!(support, Some(Support::Object(_)));
                        let is_confirmed = if is_touching { !is_object && support.is_some() } else { is_behind };
                        let counts = &mut sides[index];
                        *(if is_confirmed { &mut counts.confirmed } else { &mut counts.open }) += 1;
                        if let Some(support) = support.filter(|_| is_touching) {
                            let border = borders.entry((index, support)).or_default();
                            border.sides += 1;
                            border.length += frame.footprint(*pixel);
                            border.height += height(*pixel);
                        }
                    }
                }
            }
        }
    }
    let ranges: Vec<[f64; 2]> = clusters
        .iter()
        .map(|cluster| {
            let heights = cluster.pixels.iter().map(|pixel| height(*pixel));
            heights.fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], at| [low.min(at), high.max(at)])
        })
        .collect();
    // Height of a border as a share of an object's height.
    let share = |index: usize, border: &Border| {
        let [low, high] = ranges[index];
        (border.height / border.sides as f64 - low) / (high - low).max(1e-3)
    };
    let mut outlines: Vec<Outline> = sides.iter().map(Outline::with_sides).collect();
    for ((index, support), border) in borders.iter().filter(|(_, border)| border.sides >= SHORTEST) {
        // An object below carries this one: it is touched higher up.
        let is_below = match support {
            Support::Object(other) => borders
                .get(&(*other, Support::Object(*index)))
                .is_some_and(|theirs| share(*index, border) < share(*other, theirs) + LEVEL),
            Support::Ground | Support::Container => true,
        };
        if is_below {
            outlines[*index].leans_on.insert(*support, border.length);
        }
    }
    outlines
}

impl Outline {
    fn with_sides(sides: &Sides) -> Self {
        let Sides { confirmed, open } = *sides;
        let confidence = confirmed as f64 / (confirmed + open).max(1) as f64;
        Self { confidence, leans_on: BTreeMap::new() }
    }
}

/// Label of each pixel of the picture without distortion.
fn owners_of(
    frame: &DepthFrame,
    clusters: &[Cluster],
    container: &[u32],
    plane: Option<&Plane>,
    reach: f64,
) -> Vec<u16> {
    let mut owners = vec![0; frame.depth.len()];
    if let Some(plane) = plane {
        for pixel in frame.returns().filter(|pixel| plane.height(&frame.point(*pixel)).abs() <= reach) {
            owners[pixel as usize] = PLANE_LABEL;
        }
    }
    container.iter().for_each(|pixel| owners[*pixel as usize] = CONTAINER_LABEL);
    for (label, cluster) in (1..CONTAINER_LABEL).zip(clusters) {
        cluster.pixels.iter().for_each(|pixel| owners[*pixel as usize] = label);
    }
    owners
}

/// Neighbour of a pixel in a direction.
enum Beside {
    /// The picture ends.
    Edge,
    /// No return within reach.
    Nothing,
    Pixel(u32),
}

/// The next pixel with a return in a direction.
fn beside(frame: &DepthFrame, pixel: u32, [columns, rows]: [i64; 2]) -> Beside {
    let (column, row) = frame.column_and_row(pixel);
    let (width, height) = (i64::from(frame.camera.width), i64::from(frame.camera.height));
    for step in 1..=i64::from(HOLE) + 1 {
        let (column, row) = (i64::from(column) + step * columns, i64::from(row) + step * rows);
        if !(0..width).contains(&column) || !(0..height).contains(&row) {
            return Beside::Edge;
        }
        let other = (row * width + column) as u32;
        if !frame.depth[other as usize].is_nan() {
            return Beside::Pixel(other);
        }
    }
    Beside::Nothing
}

#[cfg(test)]
mod tests {
    use kernel::geom::Intrinsics;

    use super::*;

    /// A camera straight above a table at 1 m, one pixel per 5 mm on it; objects are rectangles of pixels with a height [m].
    fn scene(boxes: &[([u32; 4], f64)]) -> (DepthFrame, Vec<Cluster>, Plane) {
        let camera = Intrinsics { width: 60, height: 60, fx: 200.0, fy: 200.0, cx: 30.0, cy: 30.0, near: 0.01 };
        let mut depth = vec![1.0_f32; 3600];
        let mut clusters = Vec::new();
        for ([left, top, right, bottom], height) in boxes {
            let rows = *top..*bottom;
            let pixels: Vec<u32> = rows.flat_map(|row| (*left..*right).map(move |column| row * 60 + column)).collect();
            pixels.iter().for_each(|pixel| depth[*pixel as usize] = (1.0 - height) as f32);
            clusters.push(pixels);
        }
        let frame = DepthFrame::new(camera, depth);
        let clusters = clusters.into_iter().map(|pixels| Cluster::of_pixels(&frame, pixels)).collect();
        (frame, clusters, Plane::from_numbers([0.0, 0.0, -1.0, 1.0]).expect("a plane"))
    }

    #[test]
    fn an_object_alone_has_a_sure_outline() {
        let (frame, clusters, plane) = scene(&[([20, 20, 30, 30], 0.012), ([0, 40, 10, 50], 0.2)]);
        let found = outlines_of(&frame, &clusters, &[], Some(&plane), [0.012, 0.008]);
        // 40 sides of 5 mm less what perspective takes.
        assert_eq!(found[0].confidence, 1.0);
        let length = found[0].leans_on[&Support::Ground];
        assert!((length - 40.0 * 0.988 / 200.0).abs() < 1e-6, "{length}");
        // A quarter of the second one is at the picture's border, and the rest is high above the table.
        assert_eq!((found[1].confidence, found[1].leans_on.len()), (0.75, 0));
    }

    #[test]
    fn borders_between_objects_and_hidden_ones_are_not_sure() {
        let (frame, clusters, plane) = scene(&[([20, 20, 30, 30], 0.050), ([30, 20, 40, 30], 0.054)]);
        let found = outlines_of(&frame, &clusters, &[], Some(&plane), [0.012, 0.008]);
        for (index, outline) in found.iter().enumerate() {
            assert_eq!(outline.confidence, 0.75);
            assert_eq!(outline.leans_on.keys().collect::<Vec<_>>(), [&Support::Object(1 - index)]);
            assert!((outline.leans_on[&Support::Object(1 - index)] - 0.0475).abs() < 0.001, "{outline:?}");
        }
        // The higher one hides a side of the lower one.
        let (frame, clusters, plane) = scene(&[([20, 20, 30, 30], 0.05), ([30, 20, 40, 30], 0.2)]);
        let found = outlines_of(&frame, &clusters, &[], Some(&plane), [0.012, 0.008]);
        assert_eq!([0, 1].map(|index| found[index].confidence), [0.75, 1.0]);
        assert!(found.iter().all(|outline| outline.leans_on.is_empty()));
    }

    #[test]
    fn a_container_carries_what_touches_it() {
        let (frame, clusters, plane) = scene(&[([20, 20, 30, 30], 0.05), ([30, 20, 32, 30], 0.05)]);
        let wall = clusters[1].pixels.clone();
        let found = outlines_of(&frame, &clusters[..1], &wall, Some(&plane), [0.012, 0.008]);
        assert_eq!(found[0].confidence, 1.0);
        assert_eq!(found[0].leans_on.keys().collect::<Vec<_>>(), [&Support::Container]);
    }
}
