//! The table under the object of a trial: a plane at the trial's pose, and the points at which it carries a true mesh.
//!
//! A plane touches a mesh at corners of its convex hull and nowhere else, so that these contacts are exact without a
//! search. MuJoCo has room for three contacts of a plane with a mesh, too few for a cup on its rim: the table is three
//! coincident planes, the second and third of which touch only the object.

use mujoco_rs::wrappers::{
    mj_editing::{MjSpec, MjsBody, SpecItem},
    mj_model::{MjModel, MjtGeomBase, MjtObjBase},
};
use nalgebra::{IsometryMatrix3, Point3, Vector3};

use crate::convert::{index, placement, solid};
use kernel::{
    contact::SurfaceContact,
    geom::{Shape, rotation_towards},
};

/// Name of the table's body, and the beginning of its planes' names.
const NAME: &str = "graspmill table";

/// Depth below the hand's base at which the table waits for its trial [m]: nothing reaches it there.
const AWAY: f64 = 1000.0;

/// Kind of contact that the second and the third plane have only with the object.
const OBJECT_ONLY: i32 = 1 << 30;

/// All kinds of contact.
const ANY: i32 = i32::MAX;

/// Contacts of a plane with a mesh for which MuJoCo has room.
const CONTACTS_OF_A_PLANE: usize = 3;

/// Directions along the table, each with one carried point, in addition to the deepest point.
const DIRECTIONS: usize = 8;

/// Planes of the table.
const PLANES: usize = (DIRECTIONS + 1).div_ceil(CONTACTS_OF_A_PLANE);

/// A corner deeper by a tenth of a millimetre is preferred to one that is farther out by a hundred times as much.
const STEEPNESS: f64 = 100.0;

/// Pose of the table, expressed in the hand's base frame, where nothing touches it.
pub(crate) fn away() -> IsometryMatrix3<f64> {
    IsometryMatrix3::translation(0.0, 0.0, -AWAY)
}

/// Adds the table to a description, far below the hand, and lets the geoms of the object's body touch it.
pub(crate) fn add(spec: &mut MjSpec, object: impl FnOnce(&mut MjSpec) -> &mut MjsBody) {
    for geom in object(spec).geom_iter_mut(false) {
        geom.set_contype(geom.contype() | OBJECT_ONLY);
    }
    let body = spec.world_body_mut().add_body();
    body.with_name(NAME).set_mocap(true);
    *body.pos_mut() = away().translation.vector.into();
    for plane in 0..PLANES {
        let geom = body.add_geom();
        geom.with_name(&name_of(plane));
        geom.set_type(MjtGeomBase::mjGEOM_PLANE);
        *geom.size_mut() = [0.0, 0.0, 1.0];
        let [contype, conaffinity] = if plane == 0 { [ANY, ANY] } else { [0, OBJECT_ONLY] };
        geom.set_contype(contype);
        geom.set_conaffinity(conaffinity);
        // Its friction applies to every contact.
        geom.set_priority(2);
        geom.set_condim(3);
        geom.set_margin(0.0);
        geom.set_gap(0.0);
    }
}

fn name_of(plane: usize) -> String {
    format!("{NAME} {plane}")
}

/// The table of a compiled model.
#[derive(Clone, Debug)]
pub(crate) struct Table {
    /// Index of its body.
    pub(crate) body: usize,
    /// Index of the body among those that MuJoCo lets be placed from outside.
    pub(crate) mocap: usize,
    /// Indices of its planes among the geoms.
    pub(crate) planes: [usize; PLANES],
    /// Geoms of the hand that could touch it, with their shapes.
    solids: Vec<(usize, Shape)>,
}

impl Table {
    /// Finds the table in a compiled model; its hand's bodies come before `object_body`.
    pub(crate) fn of(model: &MjModel, object_body: usize) -> Self {
        let body = model.name_to_id(MjtObjBase::mjOBJ_BODY, NAME).expect("the table was added");
        let plane = |plane| model.name_to_id(MjtObjBase::mjOBJ_GEOM, &name_of(plane)).expect("the table was added");
        let of_hand = |geom: &usize| {
            let touches = model.geom_contype()[*geom] != 0 || model.geom_conaffinity()[*geom] != 0;
            touches && index(model.geom_bodyid()[*geom]) < object_body
        };
        let geoms = (0..model.geom_type().len()).filter(of_hand);
        Self {
            body,
            mocap: index(model.body_mocapid()[body]),
            planes: std::array::from_fn(plane),
            solids: geoms
                .filter_map(|geom| Some((geom, solid(model.geom_type()[geom], &model.geom_size()[geom])?)))
                .collect(),
        }
    }

    /// Depth of the hand's lowest point below a table [m], 0 where all is above; geoms as MuJoCo has placed them, by position
    /// [m] and rotation in rows.
    pub(crate) fn depth_of_hand(
        &self,
        base_from_table: &IsometryMatrix3<f64>,
        positions: &[[f64; 3]],
        rotations: &[[f64; 9]],
    ) -> f64 {
        let up = base_from_table.rotation * Vector3::z();
        let height = up.dot(&base_from_table.translation.vector);
        let depth = |(geom, shape): &(usize, Shape)| {
            let base_from_shape = placement(&positions[*geom], &rotations[*geom]);
            let down = base_from_shape.rotation.inverse() * -up;
            height - up.dot(&base_from_shape.translation.vector) + shape.reach_along(&down)
        };
        self.solids.iter().map(depth).fold(0.0, f64::max)
    }
}

/// Working memory of one thread that finds where the table carries a mesh.
pub(crate) struct TableContacts {
    /// Corners of the mesh's convex hull, in `Object` [m].
    corners: Vec<Point3<f64>>,
    /// MuJoCo's numbers of the table's planes.
    planes: [i32; PLANES],
    /// Unit vectors along the table.
    directions: [[f64; 2]; DIRECTIONS],
    /// The table for which contacts were found last.
    asked: Option<IsometryMatrix3<f64>>,
    /// Heights over the table [m] and indices of the corners that are near it.
    near: Vec<(f64, usize)>,
    /// Heights and indices of the near corners that the table carries.
    carried: Vec<(f64, usize)>,
}

impl TableContacts {
    pub(crate) fn new(table: &Table, corners: &[Point3<f64>]) -> Self {
        let direction = |index: usize| {
            let (sine, cosine) = libm::sincos(std::f64::consts::TAU * index as f64 / DIRECTIONS as f64);
            [cosine, sine]
        };
        Self {
            corners: corners.to_vec(),
            planes: table.planes.map(|plane| plane as i32),
            directions: std::array::from_fn(direction),
            asked: None,
            near: Vec::new(),
            carried: Vec::new(),
        }
    }

    /// Index of a geom of the model among the table's planes.
    pub(crate) fn plane(&self, geom: i32) -> Option<usize> {
        self.planes.iter().position(|plane| *plane == geom)
    }

    /// Contacts of one of the table's planes with the mesh where it is lower than `margin` over the table [m]: together the
    /// planes carry its deepest corner, and the outermost one in each of eight directions.
    pub(crate) fn contacts(
        &mut self,
        plane: usize,
        object_from_table: &IsometryMatrix3<f64>,
        margin: f64,
        out: &mut Vec<SurfaceContact>,
    ) {
        let up = object_from_table.rotation * Vector3::z_axis();
        if self.asked != Some(*object_from_table) {
            self.choose(&up, up.dot(&object_from_table.translation.vector), margin);
            self.asked = Some(*object_from_table);
        }
        let mine = self.carried.iter().skip(CONTACTS_OF_A_PLANE * plane).take(CONTACTS_OF_A_PLANE);
        out.extend(mine.map(|(height, corner)| SurfaceContact {
            point: self.corners[*corner] - up.into_inner() * *height,
            normal: -up,
            distance: *height,
        }));
    }

    /// Chooses the corners carried by a table whose points are at `offset` along `up` [m].
    fn choose(&mut self, up: &Vector3<f64>, offset: f64, margin: f64) {
        let Self { corners, directions, near, carried, .. } = self;
        carried.clear();
        near.clear();
        let heights = corners.iter().map(|corner| up.dot(&corner.coords) - offset).zip(0..);
        near.extend(heights.filter(|(height, _)| *height < margin));
        let Some(deepest) = near.iter().min_by(|one, other| one.0.total_cmp(&other.0)) else { return };
        carried.push(*deepest);
        let axes = rotation_towards(up, 0.0);
        for [along_x, along_y] in directions {
            let along = axes.column(0) * *along_x + axes.column(1) * *along_y;
            let reach = |(height, corner): &(f64, usize)| along.dot(&corners[*corner].coords) - STEEPNESS * height;
            let farthest = near.iter().max_by(|one, other| reach(one).total_cmp(&reach(other)));
            carried.extend(farthest.filter(|farthest| !carried.contains(farthest)));
        }
    }
}
