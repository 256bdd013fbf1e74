//! Resting poses of an object, as its row of the asset table lists them.

use serde_json::{Map, Value, json};

use crate::{codec::fields::pose, storage::AssetRow};
use kernel::geom::{RestingPose, RestingPoses};

/// Key of the poses, and of the count of further ones.
const KEYS: [&str; 2] = ["resting", "resting_left_out"];

/// A row with invalid resting poses.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error(
    "the resting poses of {name} are invalid: they must be rigid motions with falling probabilities, at most 1 in all, and heights above 0"
)]
pub struct InvalidResting {
    /// Name of the object.
    pub name: String,
}

impl AssetRow {
    /// Stable poses of the object on a table, the most likely first; `None` when the row lists none.
    ///
    /// # Errors
    /// When the row lists something else under their key.
    pub fn resting(&self) -> Result<Option<RestingPoses>, InvalidResting> {
        let Some(listed) = self.facts.get(KEYS[0]) else { return Ok(None) };
        let read = || {
            let poses: Vec<RestingPose> = listed.as_array()?.iter().map(pose_from_json).collect::<Option<_>>()?;
            let left_out = u32::try_from(self.facts.get(KEYS[1])?.as_u64()?).ok()?;
            let falls = poses.windows(2).all(|pair| pair[0].probability >= pair[1].probability);
            let sum: f64 = poses.iter().map(|pose| pose.probability).sum();
            (falls && sum < 1.0 + 1e-9).then_some(RestingPoses { poses, left_out })
        };
        read().map(Some).ok_or_else(|| InvalidResting { name: self.name.clone() })
    }
}

/// Adds the resting poses of an object to its row.
pub fn add_resting(row: &mut Map<String, Value>, RestingPoses { poses, left_out }: &RestingPoses) {
    let row_of = |pose: &RestingPose| {
        json!({
            "world_from_object": pose.world_from_object.to_rows(),
            "probability": pose.probability,
            "height": pose.height,
        })
    };
    row.insert(KEYS[0].to_owned(), poses.iter().map(row_of).collect());
    row.insert(KEYS[1].to_owned(), (*left_out).into());
}

fn pose_from_json(value: &Value) -> Option<RestingPose> {
    let rows: Vec<f64> =
        value.get("world_from_object")?.as_array()?.iter().map(Value::as_f64).collect::<Option<_>>()?;
    let world_from_object = pose("AssetRow", "resting.world_from_object", &rows).ok()?;
    let probability = value.get("probability")?.as_f64().filter(|probability| *probability > 0.0)?;
    let height = value.get("height")?.as_f64().filter(|height| *height > 0.0)?;
    Some(RestingPose { world_from_object, probability, height })
}

#[cfg(test)]
mod tests {
    use nalgebra::{Rotation3, Vector3};

    use super::*;
    use kernel::{
        geom::Pose,
        ids::{Digest, ObjectId},
    };

    #[test]
    fn poses_come_back_from_a_row() {
        let pose = Pose::new(Rotation3::from_euler_angles(0.1, 0.2, 0.3), Vector3::new(0.0, 0.1, 0.2));
        let likely = RestingPose { world_from_object: pose, probability: 0.5, height: 0.1 };
        let rare = RestingPose { probability: 0.3, ..likely.clone() };
        let resting = RestingPoses { poses: vec![likely, rare], left_out: 2 };
        let mut facts = Map::new();
        add_resting(&mut facts, &resting);
        let row = AssetRow { object: ObjectId(Digest([1; 32])), name: "mug".to_owned(), facts };
        assert_eq!(row.resting(), Ok(Some(resting)));
        let lies: [fn(&mut Value); 5] = [
            |poses| poses[0]["height"] = json!(0.0),
            // Less likely than the next pose.
            |poses| poses[0]["probability"] = json!(0.2),
            // More than 1 in all.
            |poses| poses[0]["probability"] = json!(0.8),
            |poses| poses[1]["world_from_object"][0] = json!(2.0),
            |poses| *poses = json!({}),
        ];
        for (number, lie) in lies.into_iter().enumerate() {
            let mut wrong = row.clone();
            lie(&mut wrong.facts["resting"]);
            assert_eq!(wrong.resting(), Err(InvalidResting { name: "mug".to_owned() }), "lie {number}");
        }
        let listless = AssetRow { facts: Map::new(), ..row };
        assert_eq!(listless.resting(), Ok(None));
    }
}
