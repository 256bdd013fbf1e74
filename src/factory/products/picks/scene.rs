//! A scene that grasps are evaluated in.

use std::sync::Arc;

use super::loaded::LoadedObject;
use format::{CONTAINER, Scene, SceneContainer};
use robot::grasp::{OpenBox, SceneObstacle, Surroundings};
use sim::{ClutterScene, Container, SimBody, TrialConditions, Vessel};

/// A settled scene with its objects.
pub(super) struct LoadedScene {
    /// Index in the job.
    pub index: usize,
    /// The scene as its dataset has it.
    pub record: Scene,
    /// Objects of the bodies, in order.
    pub objects: Vec<Arc<LoadedObject>>,
    /// Things that a hand can touch.
    pub surroundings: Surroundings,
    /// Scene in which trials are made.
    pub clutter: ClutterScene,
}

impl LoadedScene {
    /// A scene of these objects in its container, in which bodies roll with a friction [m].
    pub fn new(
        index: usize,
        record: Scene,
        objects: Vec<Arc<LoadedObject>>,
        container: &Container,
        rolling: f64,
    ) -> Self {
        let poses = record.bodies.iter().map(|body| *body.world_from_object.isometry());
        let poses: Vec<_> = poses.collect();
        let obstacle = |(object, pose): (&Arc<LoadedObject>, &_)| SceneObstacle {
            surface: Arc::clone(object.body.surface()),
            scene_from_obstacle: *pose,
        };
        let walls = match container {
            Container::Plane { .. } => None,
            Container::Bin(Vessel { body, .. }) => Some(SceneObstacle {
                surface: Arc::clone(body.surface()),
                scene_from_obstacle: nalgebra::IsometryMatrix3::identity(),
            }),
        };
        let ground = record.container.table_z();
        let surroundings =
            Surroundings { container: walls, ground, objects: objects.iter().zip(&poses).map(obstacle).collect() };
        let bodies = record.bodies.iter().zip(&objects).map(|(body, object)| SimBody {
            body: Arc::clone(&object.body),
            solid: object.solid,
            mass: body.mass,
            friction: body.friction,
        });
        let clutter = ClutterScene {
            container: container.clone(),
            bodies: bodies.collect(),
            scene_from_objects: poses,
            rolling,
            torsion: TrialConditions::TORSION,
        };
        Self { index, record, objects, surroundings, clutter }
    }

    /// The container where it is an open box.
    pub fn open_box(&self) -> Option<OpenBox> {
        match self.record.container {
            SceneContainer::Bin { inner, wall, .. } => {
                Some(OpenBox { scene_from_box: self.record.container.world_from_container(), inner, wall })
            }
            SceneContainer::Plane { .. } | SceneContainer::Mesh { .. } => None,
        }
    }

    /// Height below which no fingertip can be among the bodies [m]: the floor of an upright bin, else the plane below everything.
    pub fn floor(&self) -> f64 {
        match self.record.container {
            SceneContainer::Bin { tilt_deg: 0.0, .. } => 0.0,
            _ => self.surroundings.ground,
        }
    }

    /// Whether each body touches another one, or touches a body that does, in addition to the one itself.
    pub fn two_contacts_away(&self, body: usize) -> Vec<bool> {
        let pairs: Vec<[u32; 2]> = self.record.contacts.iter().map(|contact| contact.pair).collect();
        reached(&pairs, self.record.bodies.len(), body)
    }
}

/// Bodies that are reached from one by two contacts at most; contacts with the container lead nowhere.
fn reached(pairs: &[[u32; 2]], bodies: usize, from: usize) -> Vec<bool> {
    let mut reached = vec![false; bodies];
    reached[from] = true;
    for _ in 0..2 {
        let before = reached.clone();
        for pair in pairs.iter().filter(|pair| pair[0] != CONTAINER) {
            let [first, second] = pair.map(|number| number as usize - 1);
            reached[first] |= before[second];
            reached[second] |= before[first];
        }
    }
    reached[from] = false;
    reached
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn two_contacts_reach_the_neighbours_of_neighbours_and_not_through_the_container() {
        // A chain of 2, 1, 3 and 5; 4 is separate, and all but 1 rest on the container.
        let pairs = [[1, 2], [0, 2], [0, 3], [1, 3], [3, 5], [0, 4], [0, 5], [3, 5]];
        assert_eq!(reached(&pairs, 5, 1), [true, false, true, false, false]);
        assert_eq!(reached(&pairs, 5, 0), [false, true, true, false, true]);
        assert_eq!(reached(&pairs, 5, 3), [false; 5]);
    }
}
