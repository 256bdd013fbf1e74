//! A job for scenes, checked.

use std::f64::consts::TAU;

use format::{SceneContainer, SceneMode};
use kernel::{
    ids::{Digest, ObjectId},
    seed::Stream,
    words::Split,
};
use sim::SettleSettings;

use super::{import::Import, vessel::VesselFile};
use crate::sections::JobObjects;

/// Objects and settings of a job for scenes.
#[derive(Clone, Debug, PartialEq)]
pub struct SceneJob {
    /// The objects and their split.
    pub objects: JobObjects,
    /// Everything else.
    pub settings: SceneSettings,
}

/// Settings of scenes.
#[derive(Clone, Debug, PartialEq)]
pub struct SceneSettings {
    /// Way in which bodies come to a scene.
    pub mode: SceneMode,
    /// Container.
    pub container: SceneContainer,
    /// File that the container is out of, of a mesh.
    pub(super) vessel: Option<VesselFile>,
    /// Arrangements of others, of [`SceneMode::Imported`]: `scenes` are then their count.
    pub import: Option<Import>,
    /// Walls between which the bodies of a pile are dropped.
    pub walls: Option<PileWalls>,
    /// Region of the table in which the middles of bodies are put, of [`SceneMode::Table`]; `None`: anywhere.
    pub region: Option<Region>,
    /// The fewest and the most bodies of a scene.
    pub count: [u32; 2],
    /// Whether a scene may have an object twice.
    pub repeats: bool,
    /// Scenes per split, in the order of [`Split::ALL`].
    pub scenes: [u32; 4],
    /// The lowest and the highest friction of a body.
    pub friction: [f64; 2],
    /// Rules of settling.
    pub settle: SettleSettings,
}

/// A region of a table, in the frame of its middle.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Region {
    /// From the first to the second along x and y [m].
    Rectangle([[f64; 2]; 2]),
    /// Between two distances from a point [m].
    Ring {
        /// The point, x and y [m].
        around: [f64; 2],
        /// The lesser and the greater distance [m].
        radius: [f64; 2],
    },
}

impl Region {
    /// A point of the region, uniform over its area.
    pub(super) fn point(&self, stream: &mut Stream) -> [f64; 2] {
        match *self {
            Self::Rectangle(sides) => sides.map(|[from, to]| from + (to - from) * stream.unit()),
            Self::Ring { around, radius: [inner, outer] } => {
                let squared = inner * inner + (outer * outer - inner * inner) * stream.unit();
                let (radius, angle) = (squared.sqrt(), TAU * stream.unit());
                [around[0] + radius * libm::cos(angle), around[1] + radius * libm::sin(angle)]
            }
        }
    }

    /// Whether part of it is on a table of these sides [m].
    pub(super) fn meets(&self, size: [f64; 2]) -> bool {
        match *self {
            Self::Rectangle(sides) => {
                sides.into_iter().zip(size).all(|([from, to], side)| from < side / 2.0 && to > -side / 2.0)
            }
            Self::Ring { around: [x, y], radius: [inner, outer] } => {
                // Distances of the nearest and the farthest point of the table.
                let beyond = |position: f64, side: f64| (position.abs() - side / 2.0).max(0.0);
                let across = |position: f64, side: f64| position.abs() + side / 2.0;
                libm::hypot(beyond(x, size[0]), beyond(y, size[1])) < outer
                    && libm::hypot(across(x, size[0]), across(y, size[1])) > inner
            }
        }
    }

    /// The numbers that tell it from others, its kind first.
    fn numbers(&self) -> [f64; 5] {
        match *self {
            Self::Rectangle([[x0, x1], [y0, y1]]) => [0.0, x0, x1, y0, y1],
            Self::Ring { around: [x, y], radius: [inner, outer] } => [1.0, x, y, inner, outer],
        }
    }
}

/// Four walls around the middle of a table, which are lifted away from what was dropped between them.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PileWalls {
    /// Sides of the square between them [m].
    pub side: f64,
    /// Height of the walls [m].
    pub height: f64,
    /// [m/s].
    pub lift_speed: f64,
}

impl PileWalls {
    /// The room inside along x, y and z [m].
    pub fn inner(&self) -> [f64; 3] {
        [self.side, self.side, self.height]
    }
}

impl SceneSettings {
    /// Whether the bodies are in a container, and not on a table.
    pub fn is_contained(&self) -> bool {
        !matches!(self.container, SceneContainer::Plane { .. })
    }

    /// Sides of the floor that bodies come to [m].
    pub fn floor(&self) -> [f64; 2] {
        self.walls.map_or_else(|| self.container.floor(), |walls| [walls.side; 2])
    }

    /// The settings with arrangements of others: as many scenes of their split.
    #[must_use]
    pub fn with_import(self, import: Import) -> Self {
        let count = import.scenes.len() as u32;
        let scenes = Split::ALL.map(|split| if split == import.split { count } else { 0 });
        Self { scenes, import: Some(import), ..self }
    }

    /// Row of the container in the table of assets, of a mesh.
    pub fn container_rows(&self) -> Vec<serde_json::Value> {
        match &self.container {
            SceneContainer::Mesh { shape, .. } => {
                vec![serde_json::json!({ "object": shape.digest(), "name": "container" })]
            }
            SceneContainer::Plane { .. } | SceneContainer::Bin { .. } => Vec::new(),
        }
    }

    /// The splits that have scenes, with their counts, in the order of the plan.
    pub fn splits(&self) -> impl Iterator<Item = (Split, u32)> + '_ {
        Split::ALL.into_iter().zip(self.scenes).filter(|(_, count)| *count > 0)
    }

    /// Subject of the scenes of a split: a digest of container, walls, region, mode and split.
    pub fn subject(&self, split: Split) -> ObjectId {
        let walls = self.walls.map(|walls| walls.inner());
        let region = self.region.map(|region| region.numbers());
        let more = walls.into_iter().flatten().chain(region.into_iter().flatten());
        let sizes = self.container.identity().into_iter().chain(more.flat_map(f64::to_le_bytes));
        let sizes: Vec<u8> = sizes.collect();
        let words = [self.mode.name(), self.container.name(), split.name()];
        ObjectId(Digest::hash_parts(
            std::iter::once(b"scenes 1".as_slice())
                .chain(words.iter().map(|word| word.as_bytes()))
                .chain([sizes.as_slice()]),
        ))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn points_fill_a_region_evenly() {
        let mut stream = Stream::of_job(1, b"", "region");
        let ring = Region::Ring { around: [1.0, -2.0], radius: [0.3, 0.5] };
        let rectangle = Region::Rectangle([[-1.0, -0.5], [0.0, 2.0]]);
        let (mut inner, count) = (0, 4000);
        for _ in 0..count {
            let [x, y] = ring.point(&mut stream);
            let distance = (x - 1.0).hypot(y + 2.0);
            assert!((0.3..=0.5).contains(&distance), "{distance}");
            inner += u32::from(distance < 0.4);
            let [x, y] = rectangle.point(&mut stream);
            assert!((-1.0..=-0.5).contains(&x) && (0.0..=2.0).contains(&y), "{x}, {y}");
        }
        // By area (0.4^2 - 0.3^2) / (0.5^2 - 0.3^2) of the points are in the inner half of the ring: five standard
        // deviations.
        let (share, expected) = (f64::from(inner) / f64::from(count), 0.07 / 0.16);
        assert!((share - expected).abs() < 5.0 * (expected * (1.0 - expected) / f64::from(count)).sqrt(), "{share}");
    }

    #[test]
    fn a_region_meets_a_table_where_they_share_a_point() {
        let ring = |x: f64, radius| Region::Ring { around: [x, 0.0], radius }.meets([1.0, 0.6]);
        assert!(ring(0.0, [0.0, 0.1]) && ring(0.8, [0.2, 0.4]) && ring(0.8, [1.2, 1.4]));
        // Short of the table, beyond its farthest corner, around it.
        assert!(!ring(0.8, [0.1, 0.3]) && !ring(0.8, [1.4, 1.6]) && !ring(0.0, [0.6, 0.7]));
        let rectangle = |x, y| Region::Rectangle([x, y]).meets([1.0, 0.6]);
        assert!(
            rectangle([0.4, 0.9], [-0.1, 0.1])
                && !rectangle([0.5, 0.9], [-0.1, 0.1])
                && !rectangle([0.0, 0.1], [0.3, 0.4])
        );
    }
}
