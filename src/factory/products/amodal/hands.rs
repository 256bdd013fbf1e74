//! A hand among the bodies of a scene, all of which are fixed while it explores one.

use std::sync::Arc;

use nalgebra::{IsometryMatrix3, Translation3};

use super::{image::ViewImage, scene::LoadedScene};
use crate::{
    ProduceError,
    products::{
        pair::touch::{HandOnObject, StillAround, TouchingHand},
        surroundings::settled_container,
    },
    sections::JobHand,
};
use format::{SceneContainer, SceneImage};
use kernel::contact::ContactSurface;
use sim::{Container, StillShape, Vessel};

/// A job's hand with the bodies of one scene; the memory of one thread.
pub(super) struct SceneHands {
    hand: TouchingHand,
    /// The hand with each body of the scene, made when the body is first touched.
    bodies: Vec<Option<HandOnObject>>,
    /// The container that was met last, and its true mesh where it has one.
    container: Option<(SceneContainer, Option<Arc<ContactSurface>>)>,
}

impl SceneHands {
    /// Reads the hand.
    ///
    /// # Errors
    /// When it cannot be read.
    pub fn new(hand: &JobHand) -> Result<Self, ProduceError> {
        Ok(Self { hand: TouchingHand::new(hand)?, bodies: Vec::new(), container: None })
    }

    /// Begins another scene.
    pub fn forget(&mut self) {
        self.bodies.clear();
    }

    /// The hand with a body of the scene, by its number from 1.
    ///
    /// # Errors
    /// When the container has no surface, or the hand cannot touch true meshes.
    pub fn with_body(
        &mut self,
        number: u8,
        image: &ViewImage,
        scene: &LoadedScene<'_>,
    ) -> Result<&mut HandOnObject, ProduceError> {
        let index = usize::from(number) - 1;
        self.bodies.resize_with(scene.bodies.len(), || None);
        if self.bodies[index].is_none() {
            let around = self.around(number, image, scene)?;
            let surface = scene.bodies[index].contact.as_ref().expect("a job with a hand prepares true meshes");
            self.bodies[index] = Some(self.hand.among(surface, around)?);
        }
        Ok(self.bodies[index].as_mut().expect("it was made"))
    }

    /// Everything but one body.
    fn around(
        &mut self,
        number: u8,
        image: &ViewImage,
        LoadedScene { bodies, still }: &LoadedScene<'_>,
    ) -> Result<StillAround, ProduceError> {
        let pose = |number: u8| *image.record.bodies[usize::from(number) - 1].world_from_object.isometry();
        let object_from_scene = pose(number).inverse();
        let mut around = StillAround::in_scene(&object_from_scene);
        for (other, object) in (1..).zip(bodies).filter(|(other, _)| *other != number) {
            let surface = object.contact.as_ref().expect("a job with a hand prepares true meshes");
            around.add(other, StillShape::Mesh(Arc::clone(surface)), object_from_scene * pose(other));
        }
        if let Some(walls) = self.walls(&image.record.container)? {
            around.add(SceneImage::CONTAINER, StillShape::Mesh(walls), object_from_scene);
        }
        let table = IsometryMatrix3::from(Translation3::new(0.0, 0.0, still.table_z));
        around.add(SceneImage::TABLE, StillShape::Ground, object_from_scene * table);
        Ok(around)
    }

    /// The true mesh of a container; `None` of a plane.
    fn walls(&mut self, container: &SceneContainer) -> Result<Option<Arc<ContactSurface>>, ProduceError> {
        if let Some((_, walls)) = self.container.as_ref().filter(|(known, _)| known == container) {
            return Ok(walls.clone());
        }
        let walls = match settled_container(container)? {
            Container::Plane { .. } => None,
            Container::Bin(Vessel { body, .. }) => Some(Arc::clone(body.surface())),
        };
        self.container = Some((container.clone(), walls.clone()));
        Ok(walls)
    }
}
