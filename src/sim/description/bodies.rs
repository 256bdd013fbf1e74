//! Bodies of a robot that can collide, out of MJCF and URDF.

use std::{
    collections::{BTreeMap, BTreeSet},
    sync::Arc,
};

use mujoco_rs::{
    mujoco_c::mjtDisableBit,
    wrappers::mj_model::{MjtGeomBase, MjtObjBase},
};
use nalgebra::{IsometryMatrix3, Point3, Rotation3, Translation3};

use crate::{
    convert::{index, isometry, solid},
    description::robot::RobotModel,
    error::RobotError,
    statements::{Usage, condition_of},
};
use assets::read_triangles;
use kernel::geom::{Shape, Triangles};
use robot::{
    collision::{Bodies, Body, Geometry},
    kinematics::Joint,
};

/// The bodies of a robot seen from a planning group, and which geoms each is made of.
pub(crate) struct Carried {
    pub(crate) bodies: Bodies,
    /// All pairs of bodies that move against each other, and why they are checked or not.
    pub(crate) rules: Vec<([usize; 2], PairRule)>,
    /// The group's joints, from the world outward.
    pub(crate) chain: Vec<Joint>,
    /// Index in `bodies` of each geom of the model; `None` for geoms that are only drawn.
    pub(crate) body_of_geom: Vec<Option<usize>>,
}

/// Bodies of a robot that can collide, and its rest.
#[derive(Clone, Debug, PartialEq)]
pub struct Collidable {
    /// The bodies.
    pub bodies: Bodies,
    /// All pairs of bodies that move against each other, as indices in the list of bodies, and why each is checked or not.
    pub rules: Vec<([usize; 2], PairRule)>,
    /// Values of the group's joints at rest [rad or m].
    pub rest: Vec<f64>,
}

/// Links and the bodies that they carry, for some joints of a description.
pub(crate) struct LinkTable {
    /// Link that carries each body of the model (0 is fixed, link k is moved by the k-th joint), and the body's frame
    /// expressed in the link's.
    pub(crate) of_body: Vec<(usize, IsometryMatrix3<f64>)>,
    /// The joints, each after the one that carries it.
    pub(crate) chain: Vec<Joint>,
    /// Link that carries each joint.
    pub(crate) carried_by: Vec<usize>,
}

/// Why a pair of bodies that move against each other is checked, or not.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum PairRule {
    /// The pair is checked.
    Checked,
    /// Parent and child.
    Adjacent,
    /// The description excludes it.
    Excluded,
    /// Their `contype` and `conaffinity` do not fit.
    Masked,
}

/// A part of a body whose geoms may touch the same geoms.
#[derive(PartialEq)]
struct Part {
    body: usize,
    contype: i32,
    conaffinity: i32,
}

impl RobotModel {
    /// Bodies that can collide, for the planning group of these joints; joints named in `fixed` [rad or m], and all
    /// others, are fixed: at the given value, else at the value of the description.
    ///
    /// Contains every geom whose `contype` or `conaffinity` is not 0, meshes with the triangles of their files (MuJoCo
    /// itself collides convex hulls of them). The pairs are those that MuJoCo checks: no two bodies of one link, no two
    /// that are welded together, no parent with its child (unless that parent is fixed in the world), none that
    /// `<contact><exclude>` names or whose `contype` and `conaffinity` don't fit. A body whose geoms differ in these is
    /// listed once for each sort.
    ///
    /// # Errors
    /// When a name is not there, the joints are no chain, a mesh can't be read, or a geom is a plane, an ellipsoid, a
    /// height field or a distance field.
    pub fn bodies(&self, joints: &[&str], fixed: &BTreeMap<String, f64>) -> Result<Bodies, RobotError> {
        self.carried(joints, fixed).map(|carried| carried.bodies)
    }

    /// Everything of [`RobotModel::bodies`] that a collision test needs, for one reading of the meshes.
    ///
    /// # Errors
    /// Errors of [`RobotModel::bodies`].
    pub fn collidable(&self, joints: &[&str], fixed: &BTreeMap<String, f64>) -> Result<Collidable, RobotError> {
        let carried = self.carried(joints, fixed)?;
        let rest = self.rest_of(&carried)?;
        let Carried { bodies, rules, .. } = carried;
        Ok(Collidable { bodies, rules, rest })
    }

    pub(crate) fn carried(&self, joints: &[&str], fixed: &BTreeMap<String, f64>) -> Result<Carried, RobotError> {
        for name in joints.iter().copied().chain(fixed.keys().map(String::as_str)) {
            self.joint(name)?;
        }
        let links = self.link_table(joints, &self.still_values(joints, fixed)?)?;
        self.check_ties(&links)?;
        if let Some(branch) = (1..links.chain.len()).find(|joint| links.carried_by[*joint] != *joint) {
            let [joint, before] = [branch, branch - 1].map(|joint| links.chain[joint].name.clone());
            return Err(RobotError::Branches { path: self.path.clone(), joint, before });
        }
        self.carried_at(links)
    }

    /// The bodies that links carry; links may branch.
    pub(crate) fn carried_at(&self, links: LinkTable) -> Result<Carried, RobotError> {
        let model = &self.model;
        let LinkTable { of_body: links, chain, .. } = links;
        let mut meshes = BTreeMap::new();
        let (mut parts, mut bodies) = (Vec::<Part>::new(), Vec::<Body>::new());
        let mut body_of_geom = vec![None; model.geom_type().len()];
        for (geom, body_of_geom) in body_of_geom.iter_mut().enumerate() {
            let (contype, conaffinity) = (model.geom_contype()[geom], model.geom_conaffinity()[geom]);
            if contype == 0 && conaffinity == 0 {
                continue;
            }
            let part = Part { body: index(model.geom_bodyid()[geom]), contype, conaffinity };
            let (link, link_from_body) = &links[part.body];
            let (shape, body_from_shape) = self.shape(geom, &mut meshes)?;
            let geometry = Geometry { shape, link_from_shape: link_from_body * body_from_shape };
            let index = parts.iter().position(|known| *known == part);
            if let Some(index) = index {
                bodies[index].geometries.push(geometry);
            } else {
                let mut name = self.body_name(part.body);
                if parts.iter().any(|known| known.body == part.body) {
                    name = format!("{name} (contype {contype}, conaffinity {conaffinity})");
                }
                bodies.push(Body { name, link: *link, geometries: vec![geometry] });
                parts.push(part);
            }
            *body_of_geom = Some(index.unwrap_or(bodies.len() - 1));
        }
        let rules = self.pair_rules(&parts, &bodies);
        let pairs = rules.iter().filter(|(_, rule)| *rule == PairRule::Checked).map(|(pair, _)| *pair).collect();
        Ok(Carried { bodies: Bodies { bodies, pairs }, rules, chain, body_of_geom })
    }

    /// Link that carries each body, and the body's frame expressed in the link's; and the joints named, with what
    /// carries each. Joints may branch.
    pub(crate) fn link_table(&self, joints: &[&str], fixed: &BTreeMap<String, f64>) -> Result<LinkTable, RobotError> {
        let model = &self.model;
        let mut found =
            LinkTable { of_body: vec![(0, IsometryMatrix3::identity())], chain: Vec::new(), carried_by: Vec::new() };
        // Parents come before their children.
        for body in 1..model.body_parentid().len() {
            let (mut link, mut frame) = found.of_body[index(model.body_parentid()[body])];
            self.pass_through(body, joints, fixed, &mut frame, &mut found.chain)?;
            while found.carried_by.len() < found.chain.len() {
                found.carried_by.push(link);
                link = found.carried_by.len();
            }
            found.of_body.push((link, frame));
        }
        Ok(found)
    }

    /// MuJoCo's own rules ("Computation", "Collision detection: selection").
    fn pair_rules(&self, parts: &[Part], bodies: &[Body]) -> Vec<([usize; 2], PairRule)> {
        let model = &self.model;
        let weld = |body: usize| index(model.body_weldid()[body]);
        let weld_parent = |weld_of: usize| weld(index(model.body_parentid()[weld_of]));
        let filter_parent = model.opt().disableflags & mjtDisableBit::mjDSBL_FILTERPARENT as i32 == 0;
        let excluded: BTreeSet<[usize; 2]> = model
            .exclude_signature()
            .iter()
            .map(|signature| {
                let [a, b] = [index(signature >> 16), index(signature & 0xffff)];
                [a.min(b), a.max(b)]
            })
            .collect();
        // The filters: welded together, masks, parent and child, excluded.
        let mut pairs = Vec::new();
        for (i, one) in parts.iter().enumerate() {
            for (j, two) in parts.iter().enumerate().skip(i + 1) {
                let (weld_one, weld_two) = (weld(one.body), weld(two.body));
                if bodies[i].link == bodies[j].link || weld_one == weld_two {
                    continue;
                }
                let family = weld_one != 0
                    && weld_two != 0
                    && (weld_one == weld_parent(weld_two) || weld_two == weld_parent(weld_one));
                let meet = one.contype & two.conaffinity != 0 || two.contype & one.conaffinity != 0;
                let rule = if !meet {
                    PairRule::Masked
                } else if family && filter_parent {
                    PairRule::Adjacent
                } else if excluded.contains(&[one.body.min(two.body), one.body.max(two.body)]) {
                    PairRule::Excluded
                } else {
                    PairRule::Checked
                };
                pairs.push(([i, j], rule));
            }
        }
        pairs
    }

    /// A geom's shape, and the shape's frame expressed in its body's.
    fn shape(
        &self,
        geom: usize,
        meshes: &mut BTreeMap<usize, Arc<Triangles>>,
    ) -> Result<(Shape, IsometryMatrix3<f64>), RobotError> {
        let model = &self.model;
        let body_from_geom = isometry(&model.geom_pos()[geom], &model.geom_quat()[geom]);
        if let Some(shape) = solid(model.geom_type()[geom], &model.geom_size()[geom]) {
            return Ok((shape, as_written(body_from_geom)));
        }
        match model.geom_type()[geom] {
            MjtGeomBase::mjGEOM_MESH => {
                let mesh = index(model.geom_dataid()[geom]);
                let triangles = if let Some(known) = meshes.get(&mesh) {
                    Arc::clone(known)
                } else {
                    let read = Arc::new(self.triangles(geom, mesh)?);
                    meshes.insert(mesh, Arc::clone(&read));
                    read
                };
                // MuJoCo moves a mesh to its centre and rotates it to its axes, and the geom back.
                let file_from_geom = isometry(&model.mesh_pos()[mesh], &model.mesh_quat()[mesh]);
                Ok((Shape::Mesh(triangles), as_written(body_from_geom * file_from_geom.inverse())))
            }
            kind => {
                let kind = match kind {
                    MjtGeomBase::mjGEOM_PLANE => "a plane",
                    MjtGeomBase::mjGEOM_ELLIPSOID => "an ellipsoid",
                    MjtGeomBase::mjGEOM_HFIELD => "a height field",
                    MjtGeomBase::mjGEOM_SDF => "a distance field",
                    _ => "of a kind that is not read",
                };
                let (_, remedy) = condition_of("body/geom", Some("type"), self.usage);
                let body = self.body_name(index(model.geom_bodyid()[geom]));
                Err(RobotError::Geom { path: self.path.clone(), geom: self.geom_name(geom), body, kind, remedy })
            }
        }
    }

    /// A mesh's triangles, in its file's frame, after `refpos`, `refquat` and `scale`.
    fn triangles(&self, geom: usize, mesh: usize) -> Result<Triangles, RobotError> {
        let source = &self.meshes[mesh];
        let Some(file) = &source.file else {
            let mesh = self.model.id_to_name(MjtObjBase::mjOBJ_MESH, mesh).unwrap_or_default().to_owned();
            // A hand's meshes are refused wherever they could touch something, in a file or not.
            let usage = if self.usage == Usage::Hand { Usage::Robot } else { self.usage };
            let (_, remedy) = condition_of("asset/mesh", Some("vertex"), usage);
            let (path, geom) = (self.path.clone(), self.geom_name(geom));
            return Err(RobotError::MeshInline { path, geom, mesh, remedy });
        };
        let mut triangles = read_triangles(file).map_err(|source| RobotError::Mesh {
            path: self.path.clone(),
            geom: self.geom_name(geom),
            source: Box::new(source),
        })?;
        let reference_from_file = source.file_from_reference.inverse();
        let [x, y, z] = source.scale;
        for corner in &mut triangles.corners {
            let point = reference_from_file * *corner;
            *corner = Point3::new(x * point.x, y * point.y, z * point.z);
        }
        if x * y * z < 0.0 {
            triangles.triangles.iter_mut().for_each(|triangle| triangle.swap(1, 2));
        }
        Ok(triangles)
    }

    /// A body's name, or its number where it has none.
    pub(crate) fn body_name(&self, body: usize) -> String {
        match self.model.id_to_name(MjtObjBase::mjOBJ_BODY, body) {
            Some(name) if !name.is_empty() => name.to_owned(),
            _ => format!("body {body}"),
        }
    }

    /// A geom's name in quotes, or its number where it has none.
    fn geom_name(&self, geom: usize) -> String {
        match self.model.id_to_name(MjtObjBase::mjOBJ_GEOM, geom) {
            Some(name) if !name.is_empty() => format!("{name:?}"),
            _ => format!("{geom}, which has no name,"),
        }
    }
}

/// A placement without the rounding that MuJoCo has added: positions to a tenth of a picometre, and entries of the
/// rotation that are nearly -1, 0 or 1 made exact. MuJoCo's rounding depends on the machine's mathematics library; the
/// map of a robot must not.
fn as_written(placed: IsometryMatrix3<f64>) -> IsometryMatrix3<f64> {
    let position = placed.translation.vector.map(|metres| (metres * 1e13).round() / 1e13);
    let rotation =
        placed.rotation.matrix().map(|entry| if (entry - entry.round()).abs() < 1e-14 { entry.round() } else { entry });
    // -0 becomes 0.
    IsometryMatrix3::from_parts(
        Translation3::from(position.add_scalar(0.0)),
        Rotation3::from_matrix_unchecked(rotation.add_scalar(0.0)),
    )
}
