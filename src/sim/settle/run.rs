//! A scene that is being settled: its bodies, the steps, and the wait until all rest.

use nalgebra::{IsometryMatrix3, Vector3};

use super::{
    SettleSettings,
    model::SceneModel,
    outcome::{Fault, SettleOutcome},
    walls::StandingWalls,
};
use crate::{
    convert::{isometry, quaternion},
    objects::{
        collider::{SceneCollider, SceneLoan},
        container::Container,
        scene_body::SimBody,
    },
    physics::instability,
};

/// Time between two looks at the speeds [s].
pub(super) const LOOK_EVERY: f64 = 0.05;

/// A body below this has left the container for good [m].
const LOST_BELOW: f64 = -0.5;

/// Distance at which bodies wait for their release, next to each other [m].
const PARKED: f64 = 50.0;

/// A scene that is being settled.
pub(super) struct Run<'w> {
    pub(super) model: &'w mut SceneModel,
    pub(super) collider: Option<SceneCollider>,
    pub(super) bodies: &'w [SimBody],
    pub(super) container: &'w Container,
    pub(super) settings: &'w SettleSettings,
    /// Bodies that take part; the others wait for their release, or have left the container.
    pub(super) present: Vec<bool>,
    /// Walls around the bodies.
    pub(super) walls: Option<StandingWalls>,
    /// Steps so far.
    pub(super) steps: u32,
}

impl Run<'_> {
    /// Steps until the first `count` bodies rest, which is when no speed is above the bound for a while: `None`, or the largest
    /// speed [m/s] at the end of the time.
    pub(super) fn wait(&mut self, count: usize, scene: &mut SettleOutcome) -> Result<Option<f64>, Fault> {
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
    pub(super) fn lift_walls(&mut self, speed: f64, count: usize) -> Result<(), Fault> {
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

    /// The first `count` bodies, those that are in the container and those that left it.
    pub(super) fn kept_and_gone(&self, count: usize) -> [Vec<usize>; 2] {
        let stays = |index: &usize| {
            self.present[*index] && self.container.contains(&(self.pose(*index) * self.bodies[*index].solid.centre))
        };
        let (kept, gone) = (0..count).partition(stays);
        [kept, gone]
    }

    /// Steps for a time [s], and takes bodies that fall for ever out of the scene.
    pub(super) fn step_for(&mut self, time: f64) -> Result<(), Fault> {
        for _ in 0..(time / self.settings.timestep).round().max(1.0) as u32 {
            self.step()?;
            self.steps += 1;
        }
        self.give_up_lost();
        Ok(())
    }

    /// One step without the bodies that are not present.
    pub(super) fn step(&mut self) -> Result<(), Fault> {
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
    pub(super) fn carry_walls(&mut self) {
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
    pub(super) fn give_up_lost(&mut self) {
        for index in 0..self.bodies.len() {
            let is_lost = self.pose(index).translation.z < LOST_BELOW;
            self.present[index] &= !is_lost;
        }
    }

    /// Puts a body far away, at rest.
    pub(super) fn park(&mut self, index: usize) {
        let aside = PARKED + 2.0 * index as f64;
        self.put(index, &IsometryMatrix3::translation(aside, PARKED, PARKED));
    }

    /// Puts a body somewhere, at rest.
    pub(super) fn put(&mut self, index: usize, pose: &IsometryMatrix3<f64>) {
        let [address, dof] = self.model.addresses[index];
        let qpos = self.model.data.qpos_mut();
        qpos[address..address + 3].copy_from_slice(pose.translation.vector.as_slice());
        qpos[address + 3..address + 7].copy_from_slice(&quaternion(pose));
        self.model.data.qvel_mut()[dof..dof + 6].fill(0.0);
    }

    /// Pose of a body.
    pub(super) fn pose(&self, index: usize) -> IsometryMatrix3<f64> {
        let [address, _] = self.model.addresses[index];
        let values = &self.model.data.qpos()[address..address + 7];
        isometry(&[values[0], values[1], values[2]], &[values[3], values[4], values[5], values[6]])
    }

    /// Speed of the centre of mass, and the angular speed at half the body's diagonal [m/s].
    pub(super) fn speed(&self, index: usize) -> f64 {
        let [_, dof] = self.model.addresses[index];
        let velocity = &self.model.data.qvel()[dof..dof + 6];
        let linear = Vector3::from_column_slice(&velocity[..3]);
        // MuJoCo has angular velocities in the body's own frame.
        let angular = Vector3::from_column_slice(&velocity[3..]);
        let SimBody { body, solid, .. } = &self.bodies[index];
        let at_centre = linear + self.pose(index).rotation * angular.cross(&solid.centre.coords);
        at_centre.norm() + body.radius() * angular.norm()
    }

    /// Height of a body's highest point [m].
    pub(super) fn top(&self, index: usize) -> f64 {
        let pose = self.pose(index);
        let heights = self.bodies[index].body.corners().iter().map(|corner| (pose * corner).z);
        heights.fold(f64::NEG_INFINITY, f64::max)
    }

    /// Puts the bodies at rest at these poses, as if nothing had been before.
    pub(super) fn seat(&mut self, poses: &[IsometryMatrix3<f64>]) {
        self.model.data.reset();
        if let Some(collider) = &mut self.collider {
            collider.forget();
        }
        poses.iter().enumerate().for_each(|(index, pose)| self.put(index, pose));
    }
}
