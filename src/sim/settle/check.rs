//! The check of bodies at rest: overlaps, contacts, and motion when they are stepped again.

use nalgebra::{IsometryMatrix3, UnitQuaternion, Vector3};

use super::{
    SettleSettings,
    outcome::{Fault, SceneTouch, SettleOutcome, SettledBody},
    run::Run,
    worker::SettleWorker,
};
use crate::{
    convert::index,
    objects::{
        collider::SceneLoan,
        container::{Container, Vessel},
        scene_body::SimBody,
    },
};
use kernel::{
    contact::{BodyScratch, PairTracker, crosses, plane_contacts},
    words::{MAX_DEPTHS, MAX_DRIFT},
};

impl SettleWorker {
    /// Examines bodies at rest in poses of unknown origin: what overlaps, what touches, and what moves when the bodies
    /// are stepped from there. Only unstable numbers are a fault.
    ///
    /// # Panics
    /// When there are not as many poses as bodies, or there is no body.
    pub fn examine(&mut self, bodies: &[SimBody], poses: &[IsometryMatrix3<f64>]) -> SettleOutcome {
        assert_eq!(bodies.len(), poses.len(), "one pose per body");
        let mut scene = SettleOutcome::default();
        let body = |(index, pose): (usize, &IsometryMatrix3<f64>)| SettledBody::at(index, *pose, 0.0);
        scene.bodies = poses.iter().enumerate().map(body).collect();
        for Overlap { pair, depth, crossed } in self.overlaps(bodies, poses) {
            let deepest = &mut scene.depths[kind_of(pair)];
            *deepest = deepest.max(depth);
            scene.crossed += u32::from(crossed);
        }
        scene.fault = self.step_again(bodies, &mut scene).err();
        scene
    }

    /// Refuses a scene whose bodies overlap, or move when they are stepped again.
    pub(super) fn check(&mut self, bodies: &[SimBody], scene: &mut SettleOutcome) -> Result<(), Fault> {
        // Depths and crossings of the true meshes.
        let kept: Vec<SimBody> = scene.bodies.iter().map(|settled| bodies[settled.index].clone()).collect();
        self.check_overlaps(&kept, scene)?;
        // From the stored poses, from rest: nothing moves.
        self.step_again(&kept, scene)?;
        let bodies = || scene.bodies.iter();
        let farthest = bodies().max_by(|one, other| one.drift.total_cmp(&other.drift));
        let turned = bodies().max_by(|one, other| one.turn.total_cmp(&other.turn));
        for SettledBody { index, drift, turn, .. } in [farthest, turned].into_iter().flatten() {
            if !(*drift <= MAX_DRIFT[0] && *turn <= MAX_DRIFT[1]) {
                return Err(Fault::Moved { body: *index, drift: *drift, turn: *turn });
            }
        }
        Ok(())
    }

    /// Contacts of the bodies at the poses of the scene, and their motions when they are stepped from there, from rest.
    fn step_again(&mut self, bodies: &[SimBody], scene: &mut SettleOutcome) -> Result<(), Fault> {
        let poses: Vec<IsometryMatrix3<f64>> = scene.bodies.iter().map(|body| body.world_from_object).collect();
        let mut run = self.run(bodies);
        scene.touches = run.touches(&poses);
        let drifts = run.stepped_again(&poses)?;
        for (body, [drift, turn]) in scene.bodies.iter_mut().zip(&drifts) {
            (body.drift, body.turn) = (*drift, *turn);
        }
        Ok(())
    }

    /// Refuses overlaps that are too deep, and edges that go through walls.
    fn check_overlaps(&self, bodies: &[SimBody], scene: &mut SettleOutcome) -> Result<(), Fault> {
        let poses: Vec<IsometryMatrix3<f64>> = scene.bodies.iter().map(|body| body.world_from_object).collect();
        for Overlap { pair, depth, crossed } in self.overlaps(bodies, &poses) {
            let kind = kind_of(pair);
            scene.depths[kind] = scene.depths[kind].max(depth);
            let pair = pair.map(|body| body.map(|body| scene.bodies[body].index));
            if depth > MAX_DEPTHS[kind] {
                return Err(Fault::TooDeep { pair, depth });
            }
            if crossed {
                return Err(Fault::Crossed { pair });
            }
        }
        Ok(())
    }

    /// Overlaps of each body with the container and then with every body before it.
    fn overlaps<'b>(
        &'b self,
        bodies: &'b [SimBody],
        poses: &'b [IsometryMatrix3<f64>],
    ) -> impl Iterator<Item = Overlap> + 'b {
        let (mut scratch, mut found) = (BodyScratch::default(), Vec::new());
        let before = |high: usize| std::iter::once(None).chain((0..high).map(Some)).map(move |low| (low, high));
        (0..bodies.len()).flat_map(before).map(move |(low, high)| {
            let body = bodies[high].body.as_ref();
            let other = match (low, &self.container) {
                (Some(low), _) => Some((bodies[low].body.as_ref(), poses[low].inv_mul(&poses[high]))),
                (None, Container::Bin(Vessel { body, .. })) => Some((body.as_ref(), poses[high])),
                (None, Container::Plane { .. }) => None,
            };
            match &other {
                Some((other, placed)) => {
                    PairTracker::default().contacts([other, body], placed, &mut scratch, &mut found);
                }
                None => plane_contacts(body, &poses[high], &mut found),
            }
            let depth = found.first().map_or(0.0, |contact| -contact.distance);
            let pair = [low, Some(high)];
            let allowed = MAX_DEPTHS[kind_of(pair)];
            let crossed = other.is_some_and(|(other, placed)| crosses([other, body], &placed, allowed, self.level));
            Overlap { pair, depth, crossed }
        })
    }
}

/// Overlap of two bodies, or of a body and the container.
struct Overlap {
    /// Positions of the bodies; `None` for the container, which comes first.
    pair: [Option<usize>; 2],
    /// Largest depth [m], 0 where they do not overlap.
    depth: f64,
    /// Whether an edge of one goes through a wall of the other.
    crossed: bool,
}

/// Index of the bounds for a pair: 0 for two bodies, 1 for a body and the container.
fn kind_of(pair: [Option<usize>; 2]) -> usize {
    usize::from(pair[0].is_none())
}

impl Run<'_> {
    /// The contacts at these poses, and their forces.
    fn touches(&mut self, poses: &[IsometryMatrix3<f64>]) -> Vec<SceneTouch> {
        self.seat(poses);
        let loan = SceneLoan::new(&mut self.collider);
        self.model.data.forward();
        drop(loan);
        let data = &self.model.data;
        let mut touches = Vec::new();
        for (number, contact) in data.contact().iter().enumerate() {
            // Geom 0 is the container, and every body has one.
            let [one, other] = contact.geom.map(index);
            let axes = nalgebra::Matrix3::from_row_slice(&contact.frame);
            // Force and torque about the contact's point of the first geom on the second, in the contact's frame.
            let wrench = data.contact_force(number);
            let [force, torque] = [0, 3].map(|first| axes.transpose() * Vector3::from_row_slice(&wrench[first..][..3]));
            let normal = Vector3::from_column_slice(&contact.frame[..3]);
            let sign = if one < other { 1.0 } else { -1.0 };
            touches.push(SceneTouch {
                pair: [one.min(other), one.max(other)].map(|geom| geom.checked_sub(1)),
                point: contact.pos.into(),
                normal: normal * sign,
                distance: contact.dist,
                force: force * sign,
                torque: torque * sign,
            });
        }
        touches
    }

    /// Steps from these poses: motion of each centre of mass [m], and rotation [rad].
    fn stepped_again(&mut self, poses: &[IsometryMatrix3<f64>]) -> Result<Vec<[f64; 2]>, Fault> {
        self.seat(poses);
        let SettleSettings { recheck, timestep, .. } = *self.settings;
        for _ in 0..(recheck / timestep).round() as u32 {
            self.step()?;
        }
        let drift = |(index, from): (usize, &IsometryMatrix3<f64>)| {
            let (to, centre) = (self.pose(index), self.bodies[index].solid.centre);
            let turn = UnitQuaternion::from_rotation_matrix(&(to.rotation * from.rotation.inverse())).angle();
            [(to * centre - from * centre).norm(), turn]
        };
        Ok(poses.iter().enumerate().map(drift).collect())
    }
}
