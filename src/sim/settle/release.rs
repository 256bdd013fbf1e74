//! Bodies are let go: one after another above what already rests there, or at a given pose.

use nalgebra::{IsometryMatrix3, Rotation3, Translation3, Vector3};

use super::{Placement, SettleSettings, outcome::Fault, run::Run, walls::StandingWalls};
use crate::objects::container::DropRoom;

/// Room between a dropped body and the walls, at least [m].
const FROM_WALL: f64 = 0.002;

impl Run<'_> {
    /// Releases the bodies; returns the time of each release [s].
    pub(super) fn fall(&mut self, placements: &[Placement]) -> Result<Vec<f64>, Fault> {
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

    /// Drops bodies again that left the container, one after the other, each at a share of the distance from the middle at
    /// which it was dropped before; notes the times of these releases [s]. Bodies that were put down stay away. Returns
    /// whether there was one to drop.
    pub(super) fn put_back(
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

    /// Pose from which a body is dropped: within the floor if it fits, its lowest point above all bodies already there.
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
}
