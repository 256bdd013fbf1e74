//! Tests whether a hand can perform the simulation of a job: it is compiled as the job would compile it, with a small
//! box.

use std::sync::{Arc, OnceLock};

use kernel::{
    contact::ContactSurface,
    geom::{MassProperties, TriMesh},
    voxel::InsideTest,
};
use nalgebra::{Matrix3, Point3};

use crate::{
    error::HandError,
    hand::{model::HandModel, sim::HandSim},
    trial::TrialSim,
};

/// Half the sides of the box [m].
const HALF: f32 = 0.02;

impl HandModel {
    /// Whether it can touch true meshes.
    ///
    /// # Errors
    /// Errors of [`HandSim::with_mesh`].
    pub fn check_touching(&self) -> Result<(), HandError> {
        HandSim::with_mesh(self, small_box()).map(drop)
    }

    /// Whether grasps of it can be tried in physics.
    ///
    /// # Errors
    /// Errors of [`TrialSim::on_table`].
    pub fn check_trials(&self) -> Result<(), HandError> {
        TrialSim::on_table(self, small_box(), &mass_of_small_box()).map(drop)
    }
}

/// Volume and moments of inertia of the box, in closed form.
pub(crate) fn mass_of_small_box() -> MassProperties {
    let side = f64::from(2.0 * HALF);
    MassProperties {
        volume: side.powi(3),
        centre: Point3::origin(),
        inertia: Matrix3::identity() * (side * side / 6.0),
    }
}

pub(crate) fn small_box() -> &'static Arc<ContactSurface> {
    static BOX: OnceLock<Arc<ContactSurface>> = OnceLock::new();
    BOX.get_or_init(|| {
        let corner = |index: usize| [0, 1, 2].map(|axis| if index >> axis & 1 == 1 { HALF } else { -HALF });
        let sides = [[0, 4, 6, 2], [1, 3, 7, 5], [0, 1, 5, 4], [2, 6, 7, 3], [0, 2, 3, 1], [4, 5, 7, 6]];
        let triangles = sides.iter().flat_map(|[a, b, c, d]| [[*a, *b, *c], [*a, *c, *d]]).collect();
        let mesh = TriMesh { vertices: (0..8).map(corner).collect(), triangles };
        Arc::new(ContactSurface::new(&mesh, InsideTest::Crossings).expect("a box has a surface"))
    })
}
