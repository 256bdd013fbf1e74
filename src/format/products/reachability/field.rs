//! Labels and signed distances of a whole grid of poses.

use prost::Message;

use super::block::labels;
use crate::codec::{
    RecordError,
    fields::{lengthy, ranged},
    proto, wire,
};
use kernel::{
    geom::{Axis, AxisUnit, FieldMetric, HealPix, InvalidPoseGrid, PoseGrid, PoseLabel},
    ids::{Digest, ObjectId},
};

const MESSAGE: &str = "ReachabilityField";
/// The axes of a grid of six.
const NAMES: [&str; 6] = ["x", "y", "z", "roll", "pitch", "yaw"];
/// The axes of a grid of directions.
const ON_SPHERE: [&str; 5] = ["x", "y", "z", "direction", "roll"];
/// Which side is negative, in words, since two conventions are common.
const SIGN: &str = "negative inside the reachable set";

/// Header of a field: everything except its numbers.
#[derive(Clone, Debug, PartialEq)]
pub struct FieldHeader {
    /// The poses.
    pub grid: PoseGrid,
    /// Metric of the distances.
    pub metric: FieldMetric,
    /// Name of the robot, for people.
    pub robot: String,
    /// Digest of the robot's description.
    pub robot_id: ObjectId,
    /// The planning group, from the base outward.
    pub joints: Vec<String>,
    /// The site that is moved to the poses.
    pub target: String,
    /// The frame that the poses are in.
    pub frame: String,
}

impl FieldHeader {
    /// Name of the profile that measures so.
    pub fn profile(&self) -> &'static str {
        match self.metric {
            FieldMetric::Metres { .. } => "standard",
            FieldMetric::Cells => "thesis",
        }
    }

    /// Unit of the distances.
    pub fn unit(&self) -> &'static str {
        match self.metric {
            FieldMetric::Metres { .. } => "metres",
            FieldMetric::Cells => "cells",
        }
    }

    /// Signed distance of each cell to the border of the reachable set, negative inside, in the order of the grid.
    ///
    /// # Panics
    /// When there is not one label per cell, or the metric does not fit the grid.
    pub fn distances(&self, labels: &[PoseLabel]) -> Vec<f32> {
        let inside: Vec<bool> = labels.iter().map(|label| *label == PoseLabel::Reachable).collect();
        self.metric.signed_distance(&inside, &self.grid)
    }
}

/// The reachable set of a robot over a grid of poses.
#[derive(Clone, Debug, PartialEq)]
pub struct ReachabilityField {
    /// Grid, metric and robot.
    pub header: FieldHeader,
    /// One label per cell, in the order of the grid.
    pub labels: Vec<PoseLabel>,
    /// Signed distance of each cell in the unit of the metric, negative inside; infinite if all labels are equal.
    pub distances: Vec<f32>,
}

impl ReachabilityField {
    /// MCAP topic.
    pub const TOPIC: &str = "/reachability/field";
    /// Full name of the protobuf message.
    pub const SCHEMA: &str = "graspmill.ReachabilityField";

    /// Appends the payload to `out`; equal records give equal bytes.
    pub fn encode(&self, out: &mut Vec<u8>) {
        let FieldHeader { grid, metric, robot, robot_id, joints, target, frame } = &self.header;
        out.reserve(5 * grid.cells() + 1024);
        for axis in grid.axes().iter() {
            wire::axis(out, 1, axis, axis.unit.name());
        }
        wire::bytes(out, 2, robot.as_bytes());
        wire::bytes(out, 3, &robot_id.0.0);
        joints.iter().for_each(|joint| wire::element(out, 4, joint.as_bytes()));
        wire::bytes(out, 5, target.as_bytes());
        wire::bytes(out, 6, frame.as_bytes());
        wire::bytes(out, 7, self.header.profile().as_bytes());
        wire::bytes(out, 8, self.header.unit().as_bytes());
        if let FieldMetric::Metres { rho } = metric {
            wire::double(out, 9, *rho);
        }
        wire::bytes(out, 10, SIGN.as_bytes());
        wire::bytes_of(out, 11, self.labels.iter().map(|label| *label as u8));
        wire::floats(out, 12, &self.distances);
    }

    /// Reads and checks a payload.
    ///
    /// # Errors
    /// When the axes do not form a grid, a length or range does not hold, a name is unknown, or a distance has another sign
    /// than its label.
    pub fn decode(payload: &[u8]) -> Result<Self, RecordError> {
        let field = proto::ReachabilityField::decode(payload)
            .map_err(|error| RecordError::Protobuf { message: MESSAGE, problem: error.to_string() })?;
        let grid = grid(&field.axes)?;
        let metric = metric(&field)?;
        if !metric.fits(&grid) {
            named("profile", &field.profile, &["standard"])?;
        }
        named("sign", &field.sign, &[SIGN])?;
        lengthy(MESSAGE, "robot_digest", 32, field.robot_digest.len())?;
        let robot_id = ObjectId(Digest(field.robot_digest.as_slice().try_into().unwrap_or_default()));
        if field.joints.is_empty() {
            return Err(RecordError::Missing { message: MESSAGE, field: "joints" });
        }
        lengthy(MESSAGE, "labels", grid.cells(), field.labels.len())?;
        lengthy(MESSAGE, "distances", 4 * grid.cells(), field.distances.len())?;
        let labels = labels(MESSAGE, &field.labels)?;
        let distances: Vec<f32> =
            field.distances.as_chunks::<4>().0.iter().map(|bytes| f32::from_le_bytes(*bytes)).collect();
        for (label, distance) in labels.iter().zip(&distances) {
            let inside = *label == PoseLabel::Reachable;
            let holds = if inside { *distance < 0.0 } else { *distance > 0.0 };
            let allowed =
                if inside { "below 0 at a reachable cell" } else { "above 0 at a cell that is not reachable" };
            ranged(MESSAGE, "distances", f64::from(*distance), holds, allowed)?;
        }
        let proto::ReachabilityField { robot, joints, target, frame, .. } = field;
        Ok(Self { header: FieldHeader { grid, metric, robot, robot_id, joints, target, frame }, labels, distances })
    }
}

fn grid(axes: &[proto::FieldAxis]) -> Result<PoseGrid, RecordError> {
    let invalid = |problem: InvalidPoseGrid| RecordError::Grid { message: MESSAGE, problem };
    let axis = |k: usize, name: &'static str| {
        let proto::FieldAxis { name: found, unit, first, step, count, periodic } = &axes[k];
        let expected = match name {
            "x" | "y" | "z" => AxisUnit::Metre,
            "direction" => AxisUnit::HealPix,
            _ => AxisUnit::Radian,
        };
        named("axes.name", found, &[name])?;
        named("axes.unit", unit, &[expected.name()])?;
        let (count, periodic) = (*count as usize, *periodic);
        Ok(Axis { name, unit: expected, first: *first, step: *step, count, periodic })
    };
    if axes.len() == ON_SPHERE.len() {
        let [x, y, z, direction, roll] = std::array::from_fn(|k| axis(k, ON_SPHERE[k]));
        let (position_axes, direction, roll) = ([x?, y?, z?], direction?, roll?);
        let count = direction.count;
        let allowed = "12 n^2 directions in ring order, n from 1 to 16";
        let other = RecordError::Range { message: MESSAGE, field: "axes.count", value: count as f64, allowed };
        let directions = HealPix::of_count(count).ok_or(other)?;
        let grid = PoseGrid::on_sphere(position_axes, directions, roll.count).map_err(invalid)?;
        // Directions count from 0 by 1, rolls all round from -pi: nothing else is such a grid.
        let same = grid.axes()[3..] == [direction, roll] && position_axes.iter().all(|axis| !axis.periodic);
        ranged(
            MESSAGE,
            "axes.first",
            roll.first,
            same,
            "that of directions counted from 0 and rolls all round from -pi",
        )?;
        return Ok(grid);
    }
    lengthy(MESSAGE, "axes", NAMES.len(), axes.len())?;
    let [x, y, z, roll, pitch, yaw] = std::array::from_fn(|k| axis(k, NAMES[k]));
    PoseGrid::new([x?, y?, z?, roll?, pitch?, yaw?]).map_err(invalid)
}

fn metric(field: &proto::ReachabilityField) -> Result<FieldMetric, RecordError> {
    let rho = field.radian_weight;
    match named("profile", &field.profile, &["standard", "thesis"])? {
        "standard" => {
            named("unit", &field.unit, &["metres"])?;
            ranged(MESSAGE, "radian_weight", rho, rho > 0.0 && rho.is_finite(), "positive and finite")?;
            Ok(FieldMetric::Metres { rho })
        }
        _ => {
            named("unit", &field.unit, &["cells"])?;
            ranged(MESSAGE, "radian_weight", rho, rho == 0.0, "0 where cells are counted")?;
            Ok(FieldMetric::Cells)
        }
    }
}

/// `Err` unless the text is one of these.
fn named<'a>(field: &'static str, found: &str, known: &[&'a str]) -> Result<&'a str, RecordError> {
    known.iter().copied().find(|name| *name == found).ok_or_else(|| RecordError::Name {
        message: MESSAGE,
        field,
        found: found.to_owned(),
        expected: known.join(" or "),
    })
}
