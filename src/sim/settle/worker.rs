//! Settling, one scene after another.

use std::collections::BTreeMap;

use nalgebra::{IsometryMatrix3, Rotation3, Translation3, UnitQuaternion, Vector3};

use super::{
    BodyPatch, Container, Fault, Placement, SceneBody, SceneCollider, SceneTouch, SettleSettings, SettledBody,
    SettledScene, Vessel, Walls, collider::SceneLoan, model::SceneModel, settings::DropRoom, walls::StandingWalls,
};
use crate::{
    convert::{index, isometry, quaternion},
    unstable::instability,
};
use kernel::{
    contact::{BodyScratch, PairTracker, crosses, plane_contacts},
    geom::SimdLevel,
    words::{MAX_DEPTHS, MAX_DRIFT},
};

/// Time between two looks at the speeds [s].
const LOOK_EVERY: f64 = 0.05;

/// Room between a dropped body and the walls, at least [m].
const FROM_WALL: f64 = 0.002;

/// A body below this has left the container for good [m].
const LOST_BELOW: f64 = -0.5;

/// Times that bodies which the check moves may settle on, at most.
const MORE_RESTS: u32 = 3;

/// Distance at which bodies wait for their release, one beside the other [m].
const PARKED: f64 = 50.0;

/// Working memory of one thread; its models are its own.
pub struct SettleWorker {
    container: Container,
    walls: Option<Walls>,
    settings: SettleSettings,
    level: SimdLevel,
    /// A model per count of bodies.
    models: BTreeMap<usize, SceneModel>,
    /// The worker with shorter steps, for bodies that end up in one another.
    finer: Option<Box<SettleWorker>>,
}

/// A scene that is being settled.
struct Run<'w> {
    model: &'w mut SceneModel,
    collider: Option<SceneCollider>,
    bodies: &'w [SceneBody],
    container: &'w Container,
    settings: &'w SettleSettings,
    /// Bodies that take part; the others wait for their release, or have left the container.
    present: Vec<bool>,
    /// Walls that stand around the bodies.
    walls: Option<StandingWalls>,
    /// Steps so far.
    steps: u32,
}

impl SettleWorker {
    /// A worker for scenes in one container.
    pub fn new(container: Container, settings: SettleSettings, level: SimdLevel) -> Self {
        let finer = (settings.finer > 1).then(|| {
            let timestep = settings.timestep / f64::from(settings.finer);
            Box::new(Self::new(container.clone(), SettleSettings { timestep, finer: 1, ..settings }, level))
        });
        Self { container, walls: None, settings, level, models: BTreeMap::new(), finer }
    }

    /// The worker with walls between which bodies are dropped. Once the bodies rest, or do not within the cap, the walls are
    /// lifted away, and the bodies settle again.
    #[must_use]
    pub fn with_walls(self, walls: Walls) -> Self {
        let finer = self.finer.map(|finer| Box::new(finer.with_walls(walls.clone())));
        Self { walls: Some(walls), finer, ..self }
    }

    /// Settles bodies from their placements, in the order in which they are let go; those before the scene leave no trace.
    /// `min`: how many have to stay in the container.
    ///
    /// Thin walls can pass one another between two steps. Bodies that end up in one another settle once more from the same
    /// placements, in shorter steps, and then on in those of the settings, in which contacts give way more; the check from the
    /// stored poses always has the steps of the settings. Bodies that stand by every rule of speed may fall all the same: where
    /// the check moves one, they settle on from where it leads.
    ///
    /// # Panics
    /// When there are not as many placements as bodies, or there is no body.
    pub fn settle(&mut self, bodies: &[SceneBody], placements: &[Placement], min: usize) -> SettledScene {
        assert_eq!(bodies.len(), placements.len(), "one placement per body");
        let mut scene = SettledScene::default();
        let rested = self.rest(bodies, placements, min, &mut scene);
        self.conclude(rested, bodies, min, &mut scene);
        if let (Some(Fault::Crossed { .. } | Fault::TooDeep { .. }), Some(finer)) = (&scene.fault, &mut self.finer) {
            scene = SettledScene::default();
            let rested = finer.rest(bodies, placements, min, &mut scene);
            let rested = rested.and_then(|()| self.settle_on(bodies, min, &mut scene, 0.0));
            self.conclude(rested, bodies, min, &mut scene);
        }
        scene
    }

    /// Checks bodies that rest, and lets them settle on while the check moves one of them.
    fn conclude(&mut self, rested: Result<(), Fault>, bodies: &[SceneBody], min: usize, scene: &mut SettledScene) {
        let mut checked = rested.and_then(|()| self.check(bodies, scene));
        for _ in 0..MORE_RESTS {
            if !matches!(checked, Err(Fault::Moved { .. })) {
                break;
            }
            let recheck = self.settings.recheck;
            checked = self.settle_on(bodies, min, scene, recheck).and_then(|()| self.check(bodies, scene));
        }
        scene.fault = checked.err();
    }

    /// Steps the bodies of a scene from its poses for a time [s], and on until they rest.
    fn settle_on(
        &mut self,
        bodies: &[SceneBody],
        min: usize,
        scene: &mut SettledScene,
        time: f64,
    ) -> Result<(), Fault> {
        let stood = std::mem::take(&mut scene.bodies);
        let (rest_time, steps) = (scene.rest_time, scene.steps);
        let poses: Vec<IsometryMatrix3<f64>> = stood.iter().map(|body| body.world_from_object).collect();
        let standing: Vec<SceneBody> = stood.iter().map(|body| bodies[body.index].clone()).collect();
        let mut run = self.run(&standing);
        run.seat(&poses);
        run.step_for(time)?;
        let speed = run.wait(standing.len(), scene)?;
        (scene.rest_time, scene.steps) = (rest_time + time + scene.rest_time, steps + scene.steps);
        if let Some(speed) = speed {
            return Err(Fault::NeverRested { speed });
        }
        let [kept, gone] = run.kept_and_gone(standing.len());
        let settled = |at: &usize| SettledBody::at(stood[*at].index, run.pose(*at), stood[*at].released_at);
        scene.depths = [0.0; 2];
        scene.keep(kept.iter().map(settled).collect(), gone.into_iter().map(|at| stood[at].index), min)
    }

    /// Examines bodies at rest in poses of which nothing is known: what overlaps, what touches, and what moves when the bodies
    /// are stepped from there. Nothing is a fault but numbers that blow up.
    ///
    /// # Panics
    /// When there are not as many poses as bodies, or there is no body.
    pub fn examine(&mut self, bodies: &[SceneBody], poses: &[IsometryMatrix3<f64>]) -> SettledScene {
        assert_eq!(bodies.len(), poses.len(), "one pose per body");
        let mut scene = SettledScene::default();
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

    fn run<'w>(&'w mut self, bodies: &'w [SceneBody]) -> Run<'w> {
        let Self { container, settings, models, .. } = self;
        let model = models.entry(bodies.len()).or_insert_with(|| SceneModel::new(container, settings, bodies.len()));
        let patches: Vec<BodyPatch> = bodies.iter().map(|body| BodyPatch::new(body, settings.rolling)).collect();
        model.set_bodies(&patches);
        model.data.reset();
        let surfaces = bodies.iter().map(|body| std::sync::Arc::clone(&body.body)).collect();
        let collider = Some(SceneCollider::new(0, container.clone(), surfaces));
        let present = vec![true; bodies.len()];
        Run { model, collider, bodies, container, settings, present, walls: None, steps: 0 }
    }

    /// Lets the bodies fall until they rest; the scene then has those that stay.
    fn rest(
        &mut self,
        bodies: &[SceneBody],
        placements: &[Placement],
        min: usize,
        scene: &mut SettledScene,
    ) -> Result<(), Fault> {
        // Walls are the last of the bodies.
        let walls = self.walls.clone();
        let all: Vec<SceneBody> = bodies.iter().chain(walls.as_ref().map(|walls| &walls.body)).cloned().collect();
        let mut run = self.run(&all);
        run.walls = walls.as_ref().map(|walls| walls.standing(bodies.len()));
        let mut released = run.fall(placements)?;
        let mut speed = run.wait(bodies.len(), scene)?;
        if let Some(walls) = &walls {
            run.lift_walls(walls.lift_speed, bodies.len())?;
            speed = run.wait(bodies.len(), scene)?;
        }
        // Bodies that left the container are none of the scene's.
        let [mut kept, mut gone] = run.kept_and_gone(bodies.len());
        for time in 0..run.settings.put_back {
            let is_over = speed.is_some() || kept.len() >= min.max(1);
            if is_over || !run.put_back(&gone, placements, 0.5_f64.powi(time as i32 + 1), &mut released)? {
                break;
            }
            speed = run.wait(bodies.len(), scene)?;
            [kept, gone] = run.kept_and_gone(bodies.len());
        }
        if let Some(speed) = speed {
            return Err(Fault::NeverRested { speed });
        }
        let settled = |index: &usize| SettledBody::at(*index, run.pose(*index), released[*index]);
        scene.keep(kept.iter().map(settled).collect(), gone, min)
    }

    /// Refuses a scene whose bodies are in one another, or move when they are stepped again.
    fn check(&mut self, bodies: &[SceneBody], scene: &mut SettledScene) -> Result<(), Fault> {
        // Depths and crossings of the true meshes.
        let kept: Vec<SceneBody> = scene.bodies.iter().map(|settled| bodies[settled.index].clone()).collect();
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
    fn step_again(&mut self, bodies: &[SceneBody], scene: &mut SettledScene) -> Result<(), Fault> {
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
    fn check_overlaps(&self, bodies: &[SceneBody], scene: &mut SettledScene) -> Result<(), Fault> {
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
        bodies: &'b [SceneBody],
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
    /// Lets the bodies go: the time of each release [s].
    fn fall(&mut self, placements: &[Placement]) -> Result<Vec<f64>, Fault> {
        let SettleSettings { timestep, release_every, .. } = *self.settings;
        let mut released: Vec<f64> = Vec::new();
        for (index, placement) in placements.iter().enumerate() {
            match placement {
                Placement::Placed { world_from_object } => self.put(index, world_from_object),
                Placement::Dropped { .. } => self.present[index] = false,
            }
        }
        let dropped = placements.iter().any(|placement| matches!(placement, Placement::Dropped { .. }));
        for (index, placement) in placements.iter().enumerate() {
            if let Placement::Dropped { rotation, shares } = placement {
                let pose = self.drop_pose(index, rotation, *shares);
                self.put(index, &pose);
                self.present[index] = true;
            }
            released.push(f64::from(self.steps) * timestep);
            if dropped && index + 1 < placements.len() {
                self.step_for(release_every)?;
            }
        }
        Ok(released)
    }

    /// The first `count` bodies, those that are in the container and those that left it.
    fn kept_and_gone(&self, count: usize) -> [Vec<usize>; 2] {
        let stays = |index: &usize| {
            self.present[*index] && self.container.contains(&(self.pose(*index) * self.bodies[*index].solid.centre))
        };
        let (kept, gone) = (0..count).partition(stays);
        [kept, gone]
    }

    /// Drops bodies again that left the container, one after the other, each at a share of the distance from the middle at
    /// which it was dropped before; notes the times of these releases [s]. Bodies that were put down stay away. Returns
    /// whether there was one to drop.
    fn put_back(
        &mut self,
        gone: &[usize],
        placements: &[Placement],
        share_of_way: f64,
        released: &mut [f64],
    ) -> Result<bool, Fault> {
        let mut dropped = false;
        gone.iter().for_each(|index| self.present[*index] = false);
        for (position, index) in gone.iter().enumerate() {
            let Placement::Dropped { rotation, shares } = &placements[*index] else { continue };
            dropped = true;
            let pose = self.drop_pose(*index, rotation, shares.map(|share| 0.5 + (share - 0.5) * share_of_way));
            self.put(*index, &pose);
            self.present[*index] = true;
            released[*index] = f64::from(self.steps) * self.settings.timestep;
            if position + 1 < gone.len() {
                self.step_for(self.settings.release_every)?;
            }
        }
        Ok(dropped)
    }

    /// Steps until the first `count` bodies rest, which is when no speed is above the bound for a while: `None`, or the largest
    /// speed [m/s] at the end of the time.
    fn wait(&mut self, count: usize, scene: &mut SettledScene) -> Result<Option<f64>, Fault> {
        let SettleSettings { timestep, rest_speed, rest_time, cap, .. } = *self.settings;
        let looks = (rest_time / LOOK_EVERY).round().max(1.0) as u32;
        let (last_release, mut still) = (self.steps, 0);
        loop {
            self.step_for(LOOK_EVERY)?;
            let present = (0..count).filter(|index| self.present[*index]);
            let speed = present.map(|index| self.speed(index)).fold(0.0, f64::max);
            still = if speed < rest_speed { still + 1 } else { 0 };
            scene.top_speed = speed;
            scene.rest_time = f64::from(self.steps - last_release) * timestep;
            scene.steps = self.steps;
            if still >= looks {
                return Ok(None);
            }
            if scene.rest_time >= cap {
                return Ok(Some(speed));
            }
        }
    }

    /// Lifts the walls away from the first `count` bodies, at a speed [m/s], and takes them out of the scene.
    fn lift_walls(&mut self, speed: f64, count: usize) -> Result<(), Fault> {
        if let Some(walls) = &mut self.walls {
            walls.speed = speed;
        }
        while let Some(walls) = self.walls {
            self.step_for(LOOK_EVERY)?;
            let present = (0..count).filter(|index| self.present[*index]);
            let top = present.map(|index| self.top(index)).fold(0.0, f64::max);
            if self.walls.is_some_and(|walls| walls.are_away(top)) {
                self.present[walls.index] = false;
                self.walls = None;
            }
        }
        Ok(())
    }

    /// Steps for a time [s], and takes bodies that fall for ever out of the scene.
    fn step_for(&mut self, time: f64) -> Result<(), Fault> {
        for _ in 0..(time / self.settings.timestep).round().max(1.0) as u32 {
            self.step()?;
            self.steps += 1;
        }
        self.give_up_lost();
        Ok(())
    }

    /// One step, of which the bodies that are not present know nothing.
    fn step(&mut self) -> Result<(), Fault> {
        for index in 0..self.bodies.len() {
            if !self.present[index] {
                self.park(index);
            }
        }
        self.carry_walls();
        let loan = SceneLoan::new(&mut self.collider);
        self.model.data.step();
        drop(loan);
        match instability(&self.model.data) {
            Some(kind) => Err(Fault::Unstable(kind)),
            None => Ok(()),
        }
    }

    /// Gives the walls their height and speed, and the force that carries them.
    fn carry_walls(&mut self) {
        let Some(StandingWalls { index, foot, speed, .. }) = self.walls else { return };
        self.put(index, &IsometryMatrix3::translation(0.0, 0.0, foot));
        let [_, dof] = self.model.addresses[index];
        self.model.data.qvel_mut()[dof + 2] = speed;
        self.model.data.qfrc_applied_mut()[dof + 2] = StandingWalls::LIFT;
        if let Some(walls) = &mut self.walls {
            walls.foot += speed * self.settings.timestep;
        }
    }

    /// Takes bodies that fall for ever out of the scene.
    fn give_up_lost(&mut self) {
        for index in 0..self.bodies.len() {
            let is_lost = self.pose(index).translation.z < LOST_BELOW;
            self.present[index] &= !is_lost;
        }
    }

    /// Puts a body far away, at rest.
    fn park(&mut self, index: usize) {
        let aside = PARKED + 2.0 * index as f64;
        self.put(index, &IsometryMatrix3::translation(aside, PARKED, PARKED));
    }

    /// Puts a body somewhere, at rest.
    fn put(&mut self, index: usize, pose: &IsometryMatrix3<f64>) {
        let [address, dof] = self.model.addresses[index];
        let qpos = self.model.data.qpos_mut();
        qpos[address..address + 3].copy_from_slice(pose.translation.vector.as_slice());
        qpos[address + 3..address + 7].copy_from_slice(&quaternion(pose));
        self.model.data.qvel_mut()[dof..dof + 6].fill(0.0);
    }

    /// Pose of a body.
    fn pose(&self, index: usize) -> IsometryMatrix3<f64> {
        let [address, _] = self.model.addresses[index];
        let values = &self.model.data.qpos()[address..address + 7];
        isometry(&[values[0], values[1], values[2]], &[values[3], values[4], values[5], values[6]])
    }

    /// Speed of the centre of mass, and the angular speed at half the body's diagonal [m/s].
    fn speed(&self, index: usize) -> f64 {
        let [_, dof] = self.model.addresses[index];
        let velocity = &self.model.data.qvel()[dof..dof + 6];
        let linear = Vector3::from_column_slice(&velocity[..3]);
        // MuJoCo has angular velocities in the body's own frame.
        let angular = Vector3::from_column_slice(&velocity[3..]);
        let SceneBody { body, solid, .. } = &self.bodies[index];
        let at_centre = linear + self.pose(index).rotation * angular.cross(&solid.centre.coords);
        at_centre.norm() + body.radius() * angular.norm()
    }

    /// Pose from which a body is dropped: within the floor where it fits, its lowest point above all that lies there.
    fn drop_pose(&self, index: usize, rotation: &Rotation3<f64>, shares: [f64; 2]) -> IsometryMatrix3<f64> {
        let (mut low, mut high) = (Vector3::repeat(f64::INFINITY), Vector3::repeat(f64::NEG_INFINITY));
        for corner in self.bodies[index].body.corners() {
            let corner = rotation * corner.coords;
            (low, high) = (low.inf(&corner), high.sup(&corner));
        }
        let DropRoom { sides, mouth, floor, rim } = self.room();
        // A position within some sides, and whether the body fits between them.
        let within = |sides: [[f64; 2]; 2]| {
            let (mut position, mut fits) = (Vector3::zeros(), true);
            for (axis, ([start, end], share)) in sides.into_iter().zip(shares).enumerate() {
                let [from, to] = [start + FROM_WALL - low[axis], end - FROM_WALL - high[axis]];
                fits &= from <= to;
                position[axis] = if from <= to { from + (to - from) * share } else { f64::midpoint(from, to) };
            }
            (position, fits)
        };
        let (mut position, fits) = within(sides);
        if !fits {
            (position, _) = within(mouth);
        }
        let is_there = |other: &usize| *other != index && self.present[*other] && !self.is_wall(*other);
        let top = (0..self.bodies.len()).filter(is_there).map(|other| self.top(other)).fold(0.0, f64::max);
        let floor = if fits { floor } else { rim };
        position.z = top.max(floor) + self.settings.release_height - low.z;
        IsometryMatrix3::from_parts(Translation3::from(position), *rotation)
    }

    /// Whether a body is the walls around the others.
    fn is_wall(&self, index: usize) -> bool {
        self.walls.is_some_and(|walls| walls.index == index)
    }

    /// Room that bodies are dropped into.
    fn room(&self) -> DropRoom {
        match self.walls {
            Some(StandingWalls { inner: [x, y, z], .. }) => DropRoom::upright([x, y], z),
            None => self.container.drop_room(),
        }
    }

    /// Height of a body's highest point [m].
    fn top(&self, index: usize) -> f64 {
        let pose = self.pose(index);
        let heights = self.bodies[index].body.corners().iter().map(|corner| (pose * corner).z);
        heights.fold(f64::NEG_INFINITY, f64::max)
    }

    /// Puts the bodies at rest at these poses, as if nothing had been before.
    fn seat(&mut self, poses: &[IsometryMatrix3<f64>]) {
        self.model.data.reset();
        if let Some(collider) = &mut self.collider {
            collider.forget();
        }
        poses.iter().enumerate().for_each(|(index, pose)| self.put(index, pose));
    }

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

#[cfg(test)]
mod tests {
    use std::{path::Path, sync::Arc, time::Instant};

    use super::*;
    use assets::{MeshSource, built_in_source, list_folder, object::PreparedObject};
    use kernel::{
        contact::{ContactBody, Sampled},
        geom::TriMesh,
        seed::Stream,
        voxel::InsideTest,
    };

    const SETTINGS: SettleSettings = SettleSettings {
        timestep: 0.002,
        rolling: 0.002,
        release_every: 0.3,
        release_height: 0.03,
        rest_speed: 0.002,
        rest_time: 0.25,
        cap: 4.0,
        recheck: 2.0,
        finer: 1,
        put_back: 0,
    };

    fn bin() -> Container {
        let inner = [0.4, 0.3, 0.2];
        let mesh = TriMesh::open_box(inner, 0.02);
        let surface = kernel::contact::ContactSurface::new(&mesh, InsideTest::WindingNumber).expect("a surface");
        let body = Arc::new(ContactBody::new(&mesh, Arc::new(surface), Sampled::Edges));
        Container::Bin(Vessel::open_box(body, inner, 0.02, IsometryMatrix3::identity()))
    }

    fn scene_body(source: &MeshSource) -> SceneBody {
        let object = PreparedObject::prepare(source).expect("a sound mesh");
        let surface = Arc::clone(object.contact_surface().expect("a surface"));
        let body = Arc::new(ContactBody::new(object.mesh(), surface, Sampled::Everywhere));
        let solid = *object.mass().expect("a solid");
        SceneBody { body, solid, mass: (400.0 * solid.volume).clamp(0.02, 2.0), friction: 0.5 }
    }

    fn scans(count: usize) -> Vec<SceneBody> {
        let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../.deps/ycb");
        let files = list_folder(&folder).unwrap_or_else(|error| panic!("{error}; `make setup` fetches the scans"));
        let small = |path: &&std::path::PathBuf| !path.to_string_lossy().contains("chain");
        let some = files.iter().filter(small).step_by(3).take(count);
        some.map(|path| scene_body(&MeshSource::of_file("scan", path))).collect()
    }

    fn random_drop(stream: &mut Stream) -> Placement {
        let rotation = UnitQuaternion::from_quaternion(nalgebra::Quaternion::new(
            stream.normal(),
            stream.normal(),
            stream.normal(),
            stream.normal(),
        ));
        Placement::Dropped { rotation: rotation.to_rotation_matrix(), shares: [stream.unit(), stream.unit()] }
    }

    #[test]
    fn a_can_lies_on_a_plane_where_it_weighs_what_the_plane_carries() {
        let can = scene_body(&built_in_source("can-01"));
        let weight = can.mass * crate::hand_sim::GRAVITY;
        let mut worker = SettleWorker::new(Container::Plane { size: [1.0, 1.0] }, SETTINGS, SimdLevel::Scalar);
        let placed = Placement::Placed { world_from_object: IsometryMatrix3::translation(0.1, 0.0, 0.2) };
        let scene = worker.settle(&[can], &[placed], 1);
        assert_eq!(scene.fault, None, "{scene:?}");
        assert!(scene.depths[1] < 2e-4 && scene.drift()[0] < 1e-3, "{scene:?}");
        let carried: f64 = scene.touches.iter().map(|touch| touch.force.z).sum();
        assert!((carried / weight - 1.0).abs() < 0.1, "{carried} of {weight} N");
        assert!(scene.touches.iter().all(|touch| touch.pair == [None, Some(0)] && touch.normal.z > 0.999));
        assert!(scene.touches.len() >= 3, "{:?}", scene.touches);
    }

    fn walled(lift_speed: f64) -> Walls {
        let inner = [0.2, 0.2, 0.3];
        let mesh = TriMesh::walls(inner, 0.02);
        let surface = kernel::contact::ContactSurface::new(&mesh, InsideTest::WindingNumber).expect("a surface");
        Walls::new(Arc::new(ContactBody::new(&mesh, Arc::new(surface), Sampled::Edges)), inner, lift_speed)
    }

    /// Walls hold bodies together until they are lifted; what stays has no contact with them, and the same bits twice.
    #[test]
    fn a_pile_falls_apart_when_its_walls_are_lifted() {
        let bodies = ["box-01", "can-01", "box-02", "cup-01"].map(|name| scene_body(&built_in_source(name)));
        let mut stream = Stream::of_job(4, b"", "drops");
        let drops = [(); 4].map(|()| random_drop(&mut stream));
        let plane = || SettleWorker::new(Container::Plane { size: [2.0, 2.0] }, SETTINGS, SimdLevel::Scalar);
        let mut worker = plane().with_walls(walled(0.2));
        let pile = worker.settle(&bodies, &drops, 4);
        assert_eq!(pile.fault, None, "{pile:?}");
        assert_eq!(worker.settle(&bodies, &drops, 4), pile);
        // The walls stood for as long as the last body fell and rested, and rose by more than their height.
        let lifted = 0.3 / 0.2;
        assert!(f64::from(pile.steps) * SETTINGS.timestep > 3.0 * SETTINGS.release_every + lifted, "{}", pile.steps);
        let bodies_of = |touch: &SceneTouch| touch.pair.iter().flatten().copied().max();
        assert!(pile.touches.iter().filter_map(bodies_of).all(|body| body < 4));
        // Without walls the same drops fall elsewhere: the room that they are dropped into is wider.
        let spread = |scene: &SettledScene| {
            let of = |body: &SettledBody| body.world_from_object.translation.vector.xy().norm();
            scene.bodies.iter().map(of).fold(0.0, f64::max)
        };
        let heap = plane().settle(&bodies, &drops, 4);
        assert!(spread(&pile) < 0.5 * spread(&heap), "{} {}", spread(&pile), spread(&heap));
    }

    #[test]
    fn nothing_moves_walls_and_bodies_stay_between_them() {
        let bodies = ["box-01", "can-01"].map(|name| scene_body(&built_in_source(name)));
        let walls = walled(0.2);
        let all = [bodies[0].clone(), bodies[1].clone(), walls.body.clone()];
        let mut worker = SettleWorker::new(Container::Plane { size: [1.0, 1.0] }, SETTINGS, SimdLevel::Scalar);
        let mut run = worker.run(&all);
        run.walls = Some(walls.standing(2));
        let mut stream = Stream::of_job(5, b"", "drops");
        run.fall(&[(); 2].map(|()| random_drop(&mut stream))).expect("a stable scene");
        for _ in 0..20 {
            run.step_for(LOOK_EVERY).expect("a stable scene");
            let foot = run.walls.expect("walls").foot;
            let moved = run.pose(2).translation.vector - Vector3::z() * foot;
            assert!(moved.norm() < 1e-5, "{moved:?}");
            for (index, body) in bodies.iter().enumerate() {
                let centre = run.pose(index) * body.solid.centre;
                assert!(centre.x.abs().max(centre.y.abs()) < walls.inner[0] / 2.0, "{centre}");
            }
        }
    }

    #[test]
    fn the_same_scene_twice_has_equal_bits_whatever_came_before() {
        let bodies = ["mug-01", "box-01", "can-01"].map(|name| scene_body(&built_in_source(name)));
        let drops = |seed: u64| {
            let mut stream = Stream::of_job(seed, b"", "drops");
            [(); 3].map(|()| random_drop(&mut stream))
        };
        let mut worker = SettleWorker::new(bin(), SETTINGS, SimdLevel::Scalar);
        let first = worker.settle(&bodies, &drops(1), 3);
        let other = worker.settle(&bodies, &drops(2), 3);
        assert_ne!(first, other);
        assert_eq!(worker.settle(&bodies, &drops(1), 3), first);
        let mut fresh = SettleWorker::new(bin(), SETTINGS, SimdLevel::Scalar);
        assert_eq!(fresh.settle(&bodies, &drops(1), 3), first);
        assert_eq!(first.fault, None, "{first:?}");
    }

    /// A patched model moves as one that was compiled for its bodies.
    #[test]
    fn a_patched_model_equals_a_compiled_one() {
        let bodies = ["mug-01", "box-01", "cup-01"].map(|name| scene_body(&built_in_source(name)));
        let container = bin();
        let patches = bodies.each_ref().map(|body| BodyPatch::new(body, SETTINGS.rolling));
        let mut models = [
            SceneModel::new(&container, &SETTINGS, patches.len()),
            SceneModel::of_patches(&container, &SETTINGS, &patches),
        ];
        models[0].set_bodies(&patches);
        let mut stream = Stream::of_job(3, b"", "states");
        let mut touched = 0;
        for state in 0..1000 {
            let poses: Vec<f64> = (0..3)
                .flat_map(|_| {
                    let at = [stream.uniform(-0.1, 0.1), stream.uniform(-0.1, 0.1), stream.uniform(0.02, 0.15)];
                    let turn = [(); 4].map(|()| stream.normal());
                    at.into_iter().chain(turn)
                })
                .collect();
            let found = models.each_mut().map(|model| {
                let surfaces = bodies.iter().map(|body| Arc::clone(&body.body)).collect();
                let mut collider = Some(SceneCollider::new(0, container.clone(), surfaces));
                model.data.reset();
                model.data.qpos_mut().copy_from_slice(&poses);
                let loan = SceneLoan::new(&mut collider);
                model.data.forward();
                drop(loan);
                let contacts = model.data.contact().iter();
                let contacts: Vec<_> = contacts.map(|each| (each.geom, each.dist, each.pos, each.friction)).collect();
                (contacts, model.data.qacc().to_vec())
            });
            let [(one, moved), (other, as_compiled)] = &found;
            assert_eq!(one, other, "state {state}");
            touched += one.len();
            let size = as_compiled.iter().fold(1.0, |size: f64, value| size.max(value.abs()));
            for (a, b) in moved.iter().zip(as_compiled) {
                assert!((a - b).abs() < 1e-6 * size, "state {state}: {a} {b}");
            }
        }
        assert!(touched > 1000, "{touched}");
    }

    /// Two boxes that overlap by 5 mm, of which one hovers, and another that hovers: all is kept and measured.
    #[test]
    fn poses_of_others_are_examined_as_they_are() {
        let cube = scene_body(&built_in_source("box-01"));
        let bounds = *cube.body.surface().bounds();
        let (sides, ground) = (bounds.max - bounds.min, -bounds.min.z);
        let at = |x: f64, z: f64| IsometryMatrix3::translation(x, z, ground + z);
        let bodies = [cube.clone(), cube.clone(), cube];
        let poses = [at(0.0, 0.0), at(sides.x - 5e-3, 0.01), at(0.5, 0.02)];
        let mut worker = SettleWorker::new(Container::Plane { size: [2.0, 2.0] }, SETTINGS, SimdLevel::Scalar);
        let scene = worker.examine(&bodies, &poses);
        assert_eq!(scene.fault, None, "{scene:?}");
        assert!((scene.depths[0] - 5e-3).abs() < 1e-4 && scene.depths[1] < 1e-6, "{:?}", scene.depths);
        assert_eq!((scene.bodies.len(), scene.gone.len(), scene.steps, scene.crossed), (3, 0, 0, 0));
        // No wall is passed as a whole. The two are pushed apart, the other falls.
        let drifts: Vec<f64> = scene.bodies.iter().map(|body| body.drift).collect();
        assert!(drifts[0] > 1e-3 && drifts[1] > 1e-3 && (drifts[2] - 0.02).abs() < 1e-3, "{drifts:?}");
        assert!(scene.bodies.iter().zip(&poses).all(|(body, pose)| body.world_from_object == *pose));
        assert_eq!(worker.examine(&bodies, &poses), scene);
    }

    /// Cups that pass one another in steps of 2 ms settle in shorter ones, in which contacts give way less; what is stored is at
    /// rest in steps of 2 ms.
    #[test]
    fn forces_and_torques_balance_where_bodies_settled_in_shorter_steps() {
        let bodies =
            ["cup-01", "bowl-01", "mug-01", "cup-02", "bowl-01"].map(|name| scene_body(&built_in_source(name)));
        let mut stream = Stream::of_job(163, b"", "drops");
        let drops = [(); 5].map(|()| random_drop(&mut stream));
        let settled = |finer: u32| {
            let settings = SettleSettings { finer, ..SETTINGS };
            SettleWorker::new(bin(), settings, SimdLevel::Scalar).settle(&bodies, &drops, 5)
        };
        let fault = settled(1).fault;
        assert!(matches!(fault, Some(Fault::Crossed { .. } | Fault::TooDeep { .. })), "{fault:?}");
        let scene = settled(4);
        assert_eq!(scene.fault, None, "{scene:?}");
        let [mut forces, mut torques] = [[Vector3::zeros(); 5]; 2];
        let centres: Vec<_> = (scene.bodies.iter())
            .map(|settled| settled.world_from_object * bodies[settled.index].solid.centre)
            .collect();
        for SceneTouch { pair: [first, second], point, force, torque, .. } in &scene.touches {
            for (body, sign) in [(first, -1.0), (second, 1.0)] {
                if let Some(body) = *body {
                    forces[body] += force * sign;
                    torques[body] += ((point - centres[body]).cross(force) + torque) * sign;
                }
            }
        }
        for (settled, (force, torque)) in scene.bodies.iter().zip(forces.into_iter().zip(torques)) {
            let body = &bodies[settled.index];
            let weight = Vector3::z() * body.mass * crate::hand_sim::GRAVITY;
            assert!((force - weight).norm() < 0.005 * weight.norm(), "{force:?} {weight:?}");
            let half_length = body.body.surface().bounds().longest_side() / 2.0;
            assert!(torque.norm() < 0.01 * weight.norm() * half_length, "{torque:?} {weight:?} {half_length}");
        }
    }

    /// Bins of scans, settled as jobs do it where they say nothing else: nearly all are kept (docs/jobs/scenes.md), and what a
    /// step costs.
    #[test]
    #[ignore = "slow: make test-all"]
    fn bins_of_scans_settle() {
        let all = scans(26);
        for (count, scenes, floor) in [(5, 20, 19), (10, 20, 18), (20, 6, 4)] {
            let settings = SettleSettings { finer: 4, put_back: 2, ..SETTINGS };
            let mut worker = SettleWorker::new(bin(), settings, SimdLevel::Scalar);
            let (mut kept, mut steps, began) = (0, 0_u64, Instant::now());
            for number in 0..scenes {
                let mut stream = Stream::of_job(number, b"", "bins");
                let mut bodies = all.clone();
                stream.shuffle(&mut bodies);
                bodies.truncate(count);
                let drops: Vec<Placement> = (0..count).map(|_| random_drop(&mut stream)).collect();
                let scene = worker.settle(&bodies, &drops, count);
                kept += u32::from(scene.fault.is_none());
                steps += u64::from(scene.steps) + 1000;
                println!(
                    "{count} bodies, scene {number}: {:?}, {} steps, depths {:?} mm, drift {:?} mm",
                    scene.fault,
                    scene.steps,
                    scene.depths.map(|depth| 1e3 * depth),
                    1e3 * scene.drift()[0]
                );
            }
            let seconds = began.elapsed().as_secs_f64();
            println!(
                "{count} bodies: {kept} of {scenes} kept, {:.2} s a scene, {:.0} us a step",
                seconds / scenes as f64,
                1e6 * seconds / steps as f64
            );
            assert!(kept >= floor, "{count} bodies: {kept} of {scenes}");
        }
    }
}
