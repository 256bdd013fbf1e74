//! Grasps of the bodies of a scene in the cube of its volumes.

use nalgebra::{Matrix3, Point3, Rotation3, UnitQuaternion, Vector3};

use super::settings::VolumeGrasps;
use crate::{
    ProduceError,
    products::picked::{PickedHand, ScenePicks, open_picks},
};
use format::{PickCandidate, SceneImage, VolumeAffordance, VoxelGrasp, dataset::DatasetReader};
use kernel::{
    geom::{Pose, Volume, World},
    ids::{ObjectId, SampleId},
    voxel::VolumeGrid,
};

/// The dataset of picks, and its hand.
pub(super) struct OpenGrasps<'j> {
    job: &'j VolumeGrasps,
    picks: DatasetReader,
    hand: PickedHand,
    /// Contacts whose mean is the centre of a grasp: the pads of a gripper, else those on the links that close.
    contacts: Vec<usize>,
}

impl<'j> OpenGrasps<'j> {
    /// Opens the dataset and reads the hand.
    ///
    /// # Errors
    /// When one of them is gone or another one than when the job was resolved.
    pub fn open(job: &'j VolumeGrasps) -> Result<Self, ProduceError> {
        let picks = open_picks(&job.dataset, &job.picks)?;
        let hand = PickedHand::open(&job.hand)?;
        let contacts = match hand.hand().pads() {
            Some(pads) => pads.to_vec(),
            None => closing_contacts(&hand),
        };
        Ok(Self { job, picks, hand, contacts })
    }

    /// A record without a grasp, of a volume that is to be named.
    pub fn empty(&self, sample: SampleId, grid: VolumeGrid) -> VolumeAffordance {
        let VolumeGrasps { picks, hand, .. } = self.job;
        VolumeAffordance {
            sample,
            grid,
            picks: picks.root,
            trials: picks.trials,
            hand: self.hand.hand().name().to_owned(),
            hand_id: hand.id,
            evaluated: Vec::new(),
            forbidden: [0; 4],
            outside: 0,
            grasps: Vec::new(),
        }
    }

    /// Fills a record with the grasps of a scene, of which this is an image.
    ///
    /// # Errors
    /// When the picks of the scene cannot be read, or are of other bodies.
    pub fn fill(
        &self,
        scene: ObjectId,
        image: &SceneImage,
        volume_from_world: &Pose<Volume, World>,
        affordance: &mut VolumeAffordance,
    ) -> Result<(), ProduceError> {
        let objects: Vec<ObjectId> = image.bodies.iter().map(|body| body.object).collect();
        let picks = ScenePicks::read(&self.picks, scene, &objects)?;
        affordance.evaluated.clone_from(&picks.evaluated);
        affordance.grasps.clear();
        (affordance.forbidden, affordance.outside) = ([0; 4], 0);
        for body in &picks.bodies {
            let candidates = body.candidates.candidates.iter().zip(body.states());
            for (index, (candidate, state)) in (0..).zip(candidates) {
                if let Some(blocked) = candidate.ways.shaped.blocked {
                    affordance.forbidden[usize::from(blocked.by.number()) - 1] += 1;
                    continue;
                }
                let (centre, rotation, width) = self.placed(candidate, volume_from_world);
                if VolumeAffordance::voxel_of(&affordance.grid, &centre).is_none() {
                    affordance.outside += 1;
                    continue;
                }
                let centre = centre.coords.into();
                let grasp = VoxelGrasp { body: body.body, candidate: index, state, centre, rotation, width };
                affordance.grasps.push(grasp);
            }
        }
        Ok(())
    }

    /// Centre, rotation and width of a free grasp.
    fn placed(
        &self,
        candidate: &PickCandidate,
        volume_from_world: &Pose<Volume, World>,
    ) -> (Point3<f64>, [f64; 4], f64) {
        let hand = self.hand.hand();
        let frames = hand.link_frames(&candidate.closed);
        let volume_from_base = *volume_from_world * candidate.world_from_base;
        let points = self.contacts.iter().map(|contact| hand.contact_in_base(*contact, &frames).0.coords);
        let mean = points.sum::<Vector3<f64>>() / self.contacts.len().max(1) as f64;
        let approach = *volume_from_world * self.hand.world_from_approach(candidate);
        let rotation = match hand.pads() {
            // Of a gripper x is where its first pad faces, upright on the approach.
            Some([first, _]) => {
                let facing = hand.contact_in_base(first, &frames).1.into_inner();
                upright(&(volume_from_base.rotation() * facing), approach.rotation())
            }
            None => *approach.rotation(),
        };
        let parts = UnitQuaternion::from_rotation_matrix(&rotation).coords;
        let sign = if parts.w < 0.0 { -1.0 } else { 1.0 };
        let width = hand.width(&frames).unwrap_or_default();
        (
            volume_from_base.point(&Point3::from(mean)),
            [parts.x, parts.y, parts.z, parts.w].map(|part| sign * part),
            width,
        )
    }
}

/// The rotation whose z axis is that of another one, and whose x axis is the nearest to a direction.
fn upright(direction: &Vector3<f64>, rotation: &Rotation3<f64>) -> Rotation3<f64> {
    let z = rotation.matrix().column(2).into_owned();
    let Some(x) = (direction - z * z.dot(direction)).try_normalize(1e-6) else { return *rotation };
    Rotation3::from_matrix_unchecked(Matrix3::from_columns(&[x, z.cross(&x), z]))
}

/// Contacts on links that a closing motor moves.
fn closing_contacts(hand: &PickedHand) -> Vec<usize> {
    let hand = hand.hand();
    let closing = hand.driven().iter().filter(|driven| driven.closing_sign() != 0.0);
    let moved: Vec<Vec<bool>> = closing.map(|driven| hand.links_moved(driven)).collect();
    let is_moved = |link: usize| moved.iter().any(|links| links[link]);
    (0..hand.contacts().len()).filter(|contact| is_moved(hand.contacts()[*contact].link)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn x_is_upright_on_the_approach() {
        let rotation = Rotation3::from_euler_angles(0.4, -0.2, 1.0);
        let z = rotation * Vector3::z();
        let slanted = rotation * Vector3::new(0.0, 1.0, 0.3);
        let found = upright(&slanted, &rotation);
        assert!((found * Vector3::z() - z).norm() < 1e-12);
        assert!((found * Vector3::x() - rotation * Vector3::y()).norm() < 1e-12);
        assert!((found.matrix().determinant() - 1.0).abs() < 1e-12);
        assert_eq!(upright(&z, &rotation), rotation, "along the approach there is no other");
    }
}
