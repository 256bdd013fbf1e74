//! A hand and a fixed object among fixed things: all hang on the same slides, so that they move as one before the hand.

use std::sync::Arc;

use mujoco_rs::wrappers::{
    mj_editing::{MjSpec, MjsBody, SpecItem},
    mj_model::{MjtGeomBase, MjtObjBase},
};

use crate::{
    convert::quaternion,
    error::HandError,
    hand::{
        model::HandModel,
        sim::{
            GeomOwner, HandSim, Held, Hold, OBJECT, SLIDES, add_object, hand_spec, is_finite, object_body, refused_by,
            servo, slide_stiffness,
        },
    },
    objects::{
        added_geom::drop_defaults,
        thing::{StillShape, StillThing},
        true_mesh::{self, TrueMesh},
    },
};
use kernel::contact::ContactSurface;

/// Half the sides of the box that represents the ground: wider than a hand can reach [m].
const GROUND: [f64; 3] = [3.0, 3.0, 0.5];

/// Mass and moments of inertia of a thing [kg, kg m^2]: negligible compared with the mass that the slides move.
const MASS: f64 = 1e-3;

impl HandSim {
    /// Compiles as [`HandSim::with_mesh`], with fixed things around the object that stop the hand.
    ///
    /// # Errors
    /// When a geom of the hand that can touch is no box, ball, capsule or cylinder, the pose of a thing is not finite, or MuJoCo refuses
    /// the hand.
    pub fn with_mesh_among(
        model: &HandModel,
        object: &Arc<ContactSurface>,
        things: &[StillThing],
    ) -> Result<Self, HandError> {
        model.check_solids()?;
        if let Some(thing) = things.iter().position(|thing| !is_finite(&thing.object_from_thing)) {
            return Err(HandError::Object { reason: format!("the pose of thing {thing} around it is not finite") });
        }
        let refused = refused_by(model);
        let (mut spec, gains) = hand_spec(model)?;
        add_object(&mut spec).map_err(refused)?;
        true_mesh::add_geom(&mut spec, object, object_body);
        for (number, thing) in things.iter().enumerate() {
            add_thing(&mut spec, number, thing);
        }
        let compiled = spec.compile().map_err(refused)?;
        let number = |name: &str| compiled.name_to_id(MjtObjBase::mjOBJ_BODY, name).expect("the body was added");
        let (object_number, first) = (number(OBJECT), things.first().map(|_| number(&name_of(0))));
        let meshes = things.iter().enumerate().filter_map(|(number, thing)| match &thing.shape {
            StillShape::Mesh(surface) => Some(TrueMesh::named(&compiled, &name_of(number), surface)),
            StillShape::Ground => None,
        });
        let held = Held {
            hold: Hold::Slides(SLIDES.map(|name| servo(&compiled, name, slide_stiffness()))),
            true_mesh: Some(TrueMesh::of_model(&compiled, object, Vec::new())),
            neighbours: meshes.collect(),
            table: None,
        };
        let owner = |body: usize| match body {
            body if body == object_number => Some(GeomOwner::Object),
            body => Some(GeomOwner::Scene(body.checked_sub(first?)?)),
        };
        Ok(Self { still: things.to_vec(), ..Self::assembled(model, compiled, &gains, held, owner)? })
    }
}

/// Name of the body, the geom and the mesh of a thing.
fn name_of(number: usize) -> String {
    format!("graspmill thing {number}")
}

/// Hangs a thing on the object.
fn add_thing(spec: &mut MjSpec, number: usize, thing: &StillThing) {
    let name = name_of(number);
    let body = object_body(spec).add_body();
    body.with_name(&name);
    *body.pos_mut() = thing.object_from_thing.translation.vector.into();
    *body.quat_mut() = quaternion(&thing.object_from_thing);
    body.set_mass(MASS);
    *body.inertia_mut() = [MASS; 3];
    body.set_explicitinertial(true);
    match &thing.shape {
        StillShape::Mesh(surface) => {
            true_mesh::add_named_geom(spec, &name, surface, |spec| thing_body(spec, &name));
        }
        StillShape::Ground => {
            let geom = body.add_geom();
            drop_defaults(geom);
            geom.set_type(MjtGeomBase::mjGEOM_BOX);
            *geom.pos_mut() = [0.0, 0.0, -GROUND[2]];
            *geom.size_mut() = GROUND;
        }
    }
}

fn thing_body<'s>(spec: &'s mut MjSpec, name: &str) -> &'s mut MjsBody {
    spec.body_mut(name).expect("the thing was added")
}
