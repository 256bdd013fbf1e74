//! Starts of the bodies of a scene.

use std::f64::consts::TAU;

use nalgebra::{IsometryMatrix3, Quaternion, Rotation3, Translation3, UnitQuaternion, Vector3};

use super::{
    loaded::LoadedObject,
    packing::{Outline, PackedTable},
    settings::Region,
};
use kernel::{geom::RestingPose, seed::Stream};
use sim::Placement;

/// Height above the table from which a body in a resting pose is released [m].
const LIFTED: f64 = 0.002;

/// Room between two bodies on a table, at least [m].
const APART: f64 = 0.005;

/// Positions that are tried for a body in one rotation, at most.
const TRIES: u32 = 200;

/// Largest number of rotations about the vertical that are tried for a body: a long one fits next to others along an
/// edge of the table, within some degrees of four directions.
const ROTATIONS: u32 = 50;

/// Room that a body takes on a table.
#[derive(Clone, Copy, Debug)]
pub(super) struct Footprint {
    low: [f64; 2],
    high: [f64; 2],
}

impl Footprint {
    /// Whether two are so near that their bodies could touch: boxes along the axes, and the circles around them.
    fn meets(&self, other: &Self) -> bool {
        let boxes =
            (0..2).all(|axis| self.low[axis] < other.high[axis] + APART && other.low[axis] < self.high[axis] + APART);
        let radius = |of: &Self| libm::hypot(of.high[0] - of.low[0], of.high[1] - of.low[1]) / 2.0;
        let ([ax, ay], [bx, by]) = (self.middle(), other.middle());
        boxes && libm::hypot(ax - bx, ay - by) < radius(self) + radius(other) + APART
    }

    fn middle(&self) -> [f64; 2] {
        [0, 1].map(|axis| f64::midpoint(self.low[axis], self.high[axis]))
    }

    fn moved(&self, [x, y]: [f64; 2]) -> Self {
        Self { low: [self.low[0] + x, self.low[1] + y], high: [self.high[0] + x, self.high[1] + y] }
    }
}

/// A drop in any rotation, uniform over all.
pub(super) fn dropped(stream: &mut Stream) -> Placement {
    let quaternion = loop {
        let parts = [(); 4].map(|()| stream.normal());
        let quaternion = Quaternion::new(parts[0], parts[1], parts[2], parts[3]);
        if quaternion.norm() > 1e-6 {
            break quaternion;
        }
    };
    let rotation = UnitQuaternion::from_quaternion(quaternion).to_rotation_matrix();
    Placement::Dropped { rotation, shares: [stream.unit(), stream.unit()] }
}

/// A resting pose of a body, drawn by its probability, on a table [m] among the earlier bodies, with the middle of its
/// outline in a region if there is one. While no position is found, it gets a new rotation about the vertical; `None`
/// where that does not help.
pub(super) fn standing(
    object: &LoadedObject,
    size: [f64; 2],
    region: Option<&Region>,
    taken: &mut Vec<Footprint>,
    stream: &mut Stream,
) -> Option<Placement> {
    let poses = &object.resting.poses;
    let mut left = stream.unit() * poses.iter().map(|pose| pose.probability).sum::<f64>();
    let chosen = poses.iter().find(|pose| {
        left -= pose.probability;
        left < 0.0
    });
    let pose = chosen.or(poses.last());
    for _ in 0..ROTATIONS {
        let rotation = resting(pose, stream);
        let [low, high] = bounds(object, &rotation);
        let footprint = Footprint { low: [low.x, low.y], high: [high.x, high.y] };
        // Positions at which the outline is on the table; none along a side that is shorter than the body.
        let ends = [0, 1].map(|axis| [-size[axis] / 2.0 - low[axis], size[axis] / 2.0 - high[axis]]);
        for _ in 0..TRIES {
            let position = match region {
                Some(region) => {
                    let (point, middle) = (region.point(stream), footprint.middle());
                    let position = [0, 1].map(|axis| point[axis] - middle[axis]);
                    let is_beside = |([from, to], at): (&[f64; 2], &f64)| from < to && !(from..=to).contains(&at);
                    if ends.iter().zip(&position).any(is_beside) {
                        continue;
                    }
                    position
                }
                None => {
                    ends.map(|[from, to]| if from < to { stream.uniform(from, to) } else { f64::midpoint(from, to) })
                }
            };
            let here = footprint.moved(position);
            if taken.iter().all(|other| !here.meets(other)) {
                taken.push(here);
                return Some(placed(position, low.z, rotation));
            }
        }
    }
    None
}

/// Starts of bodies that are packed on a table [m], those with the largest outlines first: each in the resting pose
/// whose up direction is nearest to z of its mesh, at the free position closest to the middle. While no position is
/// free, a body gets a new rotation about the vertical; `Err` with the index of a body for which that does not help.
/// `stream` is the stream of the body with an index.
pub(super) fn packed(
    objects: &[&LoadedObject],
    size: [f64; 2],
    stream: impl Fn(usize) -> Stream,
) -> Result<Vec<Placement>, usize> {
    let poses: Vec<Option<&RestingPose>> = objects.iter().map(|object| upright_pose(object)).collect();
    let size_of = |index: usize| Outline::new(objects[index].corners(), &rotation_of(poses[index])).size();
    let sizes: Vec<f64> = (0..objects.len()).map(size_of).collect();
    let mut order: Vec<usize> = (0..objects.len()).collect();
    order.sort_by(|one, other| sizes[*other].total_cmp(&sizes[*one]));
    let mut table = PackedTable::new(size);
    let mut starts: Vec<(usize, Placement)> = Vec::with_capacity(objects.len());
    for index in order {
        let (object, mut stream) = (objects[index], stream(index));
        let start = (0..ROTATIONS).find_map(|_| {
            let rotation = resting(poses[index], &mut stream);
            let position = table.take(&Outline::new(object.corners(), &rotation))?;
            Some(placed(position, bounds(object, &rotation)[0].z, rotation))
        });
        starts.push((index, start.ok_or(index)?));
    }
    starts.sort_by_key(|(index, _)| *index);
    Ok(starts.into_iter().map(|(_, start)| start).collect())
}

/// The resting pose of an object whose up is nearest to z of its mesh.
fn upright_pose(object: &LoadedObject) -> Option<&RestingPose> {
    object.nearest_resting(&Vector3::z()).map(|(index, _)| &object.resting.poses[index as usize])
}

/// Rotation of a resting pose, and then about the vertical at random.
fn resting(pose: Option<&RestingPose>, stream: &mut Stream) -> Rotation3<f64> {
    Rotation3::from_axis_angle(&Vector3::z_axis(), stream.uniform(0.0, TAU)) * rotation_of(pose)
}

/// Rotation of a resting pose, the object's own where it has none.
fn rotation_of(pose: Option<&RestingPose>) -> Rotation3<f64> {
    pose.map_or_else(Rotation3::identity, |pose| *pose.world_from_object.rotation())
}

/// Lowest and highest coordinates of a rotated body [m].
fn bounds(object: &LoadedObject, rotation: &Rotation3<f64>) -> [Vector3<f64>; 2] {
    let (mut low, mut high) = (Vector3::repeat(f64::INFINITY), Vector3::repeat(f64::NEG_INFINITY));
    for corner in object.corners() {
        let corner = rotation * corner.coords;
        (low, high) = (low.inf(&corner), high.sup(&corner));
    }
    [low, high]
}

/// A body at a position along x and y whose lowest point is just above the table.
fn placed([x, y]: [f64; 2], lowest: f64, rotation: Rotation3<f64>) -> Placement {
    let translation = Translation3::new(x, y, LIFTED - lowest);
    Placement::Placed { world_from_object: IsometryMatrix3::from_parts(translation, rotation) }
}
