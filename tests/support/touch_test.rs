//! Which bodies touch, shape by shape and by parry alone, for which a mesh is its surface: a second opinion on collision checks.

use nalgebra::IsometryMatrix3;

use graspmill::{
    collision::Bodies,
    geom::{NoSurface, TouchShape},
};

/// The shapes of [`Bodies`] with their search trees.
pub struct TouchTest {
    bodies: Vec<Carried>,
}

/// A body's link, and its shapes with their frames expressed in the link's frame.
type Carried = (usize, Vec<(TouchShape, IsometryMatrix3<f64>)>);

impl TouchTest {
    /// Builds the search trees.
    ///
    /// # Errors
    /// When a mesh has no triangles.
    pub fn new(bodies: &Bodies) -> Result<Self, NoSurface> {
        let built = bodies.bodies.iter().map(|body| {
            let shapes = body
                .geometries
                .iter()
                .map(|geometry| Ok((TouchShape::new(&geometry.shape)?, geometry.link_from_shape)));
            Ok((body.link, shapes.collect::<Result<_, _>>()?))
        });
        Ok(Self { bodies: built.collect::<Result<_, _>>()? })
    }

    /// Whether two bodies (indices in [`Bodies::bodies`]) touch, with the links at these frames: `frames[k - 1]` is the world
    /// pose of link k's, as `PlanningGroup::link_frames` has it.
    ///
    /// # Panics
    /// When a pose or a link is out of range.
    pub fn touches(&self, pair: [usize; 2], frames: &[IsometryMatrix3<f64>]) -> bool {
        let [first, second] = pair.map(|index| &self.bodies[index]);
        let world_from_link = |link: usize| if link == 0 { IsometryMatrix3::identity() } else { frames[link - 1] };
        let (first_link, second_link) = (world_from_link(first.0), world_from_link(second.0));
        first.1.iter().any(|(one, link_from_one)| {
            let second_from_first = first_link * link_from_one;
            second
                .1
                .iter()
                .any(|(two, link_from_two)| one.touches(&second_from_first, two, &(second_link * link_from_two)))
        })
    }
}
