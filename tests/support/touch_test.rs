//! Which bodies touch, shape by shape: without shortcuts, for a robot's check and as a second opinion.

use nalgebra::IsometryMatrix3;

use super::Bodies;
use crate::kinematics::PlanningGroup;
use kernel::geom::{NoSurface, TouchShape};

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

    /// In how many of the configurations (values of the group's joints) each pair touches.
    ///
    /// # Panics
    /// When a pose, or the length of a configuration, does not fit.
    pub fn count(
        &self,
        group: &PlanningGroup,
        pairs: &[[usize; 2]],
        configurations: impl IntoIterator<Item = Vec<f64>>,
    ) -> Vec<u64> {
        let mut frames = vec![IsometryMatrix3::identity(); group.len()];
        let mut counts = vec![0; pairs.len()];
        for q in configurations {
            group.link_frames(&q, &mut frames);
            for (count, pair) in counts.iter_mut().zip(pairs) {
                *count += u64::from(self.touches(*pair, &frames));
            }
        }
        counts
    }
}
