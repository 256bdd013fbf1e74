//! Hands from a description and a table in the same folder.

use std::{
    collections::BTreeMap,
    path::{Path, PathBuf},
    sync::Arc,
};

use mujoco_rs::wrappers::mj_model::{MjtEq, MjtJoint, MjtObjBase};

use crate::{
    convert::{index, isometry},
    description::{
        bodies::{LinkTable, PairRule},
        robot::RobotModel,
    },
    error::{HandError, RobotError},
    ffi::drop_free_joints,
    statements::{Usage, condition_of},
};
use kernel::{description::Format, files};
use robot::{
    collision::{Bodies, Body, Shape},
    grasp::{HandSearch, OwnOverlaps, has_opposition},
    hand::{Coupling, Hand, HandTable, Mount, Skeleton},
    kinematics::{JointTree, TreeJoint},
};

/// A hand's description, compiled by MuJoCo, and its table.
pub struct HandModel {
    pub(crate) robot: RobotModel,
    pub(crate) hand: Arc<Hand>,
}

impl HandModel {
    /// Reads a description, MJCF or URDF, and the table in the same folder: the same name with `.toml`. The table's own
    /// path works, too.
    ///
    /// # Errors
    /// When MuJoCo refuses the one, or the other is wrong or does not fit.
    pub fn open(path: &Path) -> Result<Self, HandError> {
        let description = description_of(path);
        // A hand that floats in its file is fixed here: grasps move the object against it.
        let robot = RobotModel::open_edited(&description, Usage::Hand, drop_free_joints)?;
        let table = HandTable::read(&HandTable::beside(&description))?;
        let hand = table.hand(robot.skeleton()?)?;
        Ok(Self { robot, hand: Arc::new(hand) })
    }

    /// The hand.
    pub fn hand(&self) -> &Arc<Hand> {
        &self.hand
    }

    /// The description.
    pub fn path(&self) -> &Path {
        &self.robot.path
    }

    /// Format of the description.
    pub fn format(&self) -> Format {
        self.robot.format()
    }

    /// Sum of all masses [kg].
    pub fn mass(&self) -> f64 {
        self.robot.model.body_mass().iter().sum()
    }

    /// Bodies of the hand that can collide, carried by the links of its tree of joints, and all pairs of bodies that
    /// move against each other, with the reason why each is checked or not.
    ///
    /// # Errors
    /// When a mesh can't be read, or a geom is a plane, an ellipsoid, a height field or a distance field.
    #[expect(clippy::type_complexity, reason = "a list of pairs")]
    pub fn bodies(&self) -> Result<(Bodies, Vec<([usize; 2], PairRule)>), RobotError> {
        let carried = self.robot.carried_at(self.robot.all_links()?)?;
        Ok((carried.bodies, carried.rules))
    }

    /// Tests whether grasps of true meshes can be searched with it: it has eigengrasps and contacts that may touch, its
    /// touching geoms are simple, and in some posture it does not overlap itself.
    ///
    /// # Errors
    /// When it can't.
    pub fn check_grasping(&self) -> Result<(), HandError> {
        self.search().map(drop)
    }

    /// The hand prepared for a search of grasps, and how often it overlaps itself.
    ///
    /// # Errors
    /// Errors of [`HandModel::check_grasping`].
    pub fn search(&self) -> Result<(HandSearch, OwnOverlaps), HandError> {
        let table = || HandTable::beside(&self.robot.path);
        let missing = match self.hand.eigengrasps() {
            None => Some("eigengrasps, in which its postures are searched: `[eigengrasps]`"),
            Some(_) if self.hand.contacts().len() < 3 => Some("three points that may touch: `[[contacts]]`"),
            Some(_) => None,
        };
        if let Some(what) = missing {
            return Err(HandError::NoGrasps { path: table(), what });
        }
        self.check_solids()?;
        let (bodies, _) = self.bodies()?;
        let search = HandSearch::new(&self.hand, &bodies)
            .map_err(|source| HandError::Unsearchable { path: self.robot.path.clone(), source })?;
        let overlaps = search.own_overlaps();
        if overlaps.clear == 0 {
            let name = |body: usize| bodies.bodies[body].name.clone();
            let pairs = overlaps.pairs.iter().map(|(pair, count)| (pair.map(name), *count)).collect();
            let (path, format) = (self.robot.path.clone(), self.format());
            return Err(HandError::NeverClear { path, format, postures: overlaps.postures, pairs });
        }
        Ok((search, overlaps))
    }

    /// Whether the middles of its pads can be placed on pairs of points.
    ///
    /// # Errors
    /// When they do not slide towards each other by one motor.
    pub fn check_gripper(&self) -> Result<(), HandError> {
        let no_gripper = || HandError::NoGripper { path: HandTable::beside(&self.robot.path) };
        self.hand.closing_line().map(|_| ()).ok_or_else(no_gripper)
    }

    /// Whether two contacts face each other in some posture: between them a hand that is no gripper takes pairs of points.
    ///
    /// # Errors
    /// When none do.
    pub fn check_opposition(&self) -> Result<(), HandError> {
        let path = || HandTable::beside(&self.robot.path);
        if has_opposition(&self.hand) { Ok(()) } else { Err(HandError::NoOpposition { path: path() }) }
    }

    /// Largest number of geoms on one body of the description.
    pub(crate) fn max_geoms_per_body(&self) -> usize {
        self.robot.model.body_geomnum().iter().max().map_or(0, |count| index(*count))
    }

    /// Whether all that can touch is a box, a ball, a capsule or a cylinder, and touches objects: only these touch true meshes.
    ///
    /// # Errors
    /// When something else can.
    pub fn check_solids(&self) -> Result<(), HandError> {
        let (bodies, _) = self.bodies()?;
        let mesh = |body: &&Body| body.geometries.iter().any(|part| matches!(part.shape, Shape::Mesh(_)));
        if let Some(body) = bodies.bodies.iter().find(mesh) {
            return Err(HandError::Geom { path: self.robot.path.clone(), body: body.name.clone() });
        }
        let model = &self.robot.model;
        // Objects have contype 1 and conaffinity 1.
        let misses = |geom: &usize| {
            let kinds = model.geom_contype()[*geom] | model.geom_conaffinity()[*geom];
            kinds != 0 && kinds & 1 == 0
        };
        match (0..model.geom_type().len()).find(misses) {
            Some(geom) => {
                let (when, remedy) = condition_of("body/geom", Some("conaffinity"), Usage::Hand);
                let body = self.robot.body_name(index(model.geom_bodyid()[geom]));
                Err(HandError::MissesObjects { path: self.robot.path.clone(), body, when, remedy })
            }
            None => Ok(()),
        }
    }
}

/// The description for a path: that of a table is in the same folder, in MJCF or else in URDF.
fn description_of(path: &Path) -> PathBuf {
    if path.extension().is_none_or(|extension| extension != "toml") {
        return path.to_owned();
    }
    let [mjcf, urdf] = ["xml", "urdf"].map(|ending| path.with_extension(ending));
    if files::is_present(&urdf) && !files::is_present(&mjcf) { urdf } else { mjcf }
}

impl RobotModel {
    /// Joints, couplings and named frames of a hand.
    ///
    /// # Errors
    /// When a joint has no name or is a ball or free joint, or a coupling is not linear.
    pub(crate) fn skeleton(&self) -> Result<Skeleton, HandError> {
        let model = &self.model;
        let table = self.all_links()?;
        self.check_ties(&table)?;
        let couplings = self.couplings(&table)?;
        let mount = |body: i32, body_from_frame| {
            let (link, link_from_body) = table.of_body[index(body)];
            Mount { link, link_from_frame: link_from_body * body_from_frame }
        };
        let named = |kind, count: usize| {
            (0..count)
                .filter_map(move |id| Some((id, model.id_to_name(kind, id)?)))
                .filter(|(_, name)| !name.is_empty())
        };
        let sites: BTreeMap<String, Mount> = named(MjtObjBase::mjOBJ_SITE, model.site_bodyid().len())
            .map(|(site, name)| {
                let body_from_site = isometry(&model.site_pos()[site], &model.site_quat()[site]);
                (name.to_owned(), mount(model.site_bodyid()[site], body_from_site))
            })
            .collect();
        let bodies = named(MjtObjBase::mjOBJ_BODY, model.body_parentid().len())
            .map(|(body, name)| (name.to_owned(), mount(body as i32, nalgebra::IsometryMatrix3::identity())))
            .collect();
        // The first of several bodies welded together; the world itself if nothing is fixed to it.
        let first = |link: usize| (1..table.of_body.len()).find(|body| table.of_body[*body].0 == link).unwrap_or(0);
        let links = (0..=table.chain.len()).map(|link| self.body_name(first(link))).collect();
        let joints = table.chain.into_iter().zip(table.carried_by);
        let joints = joints.map(|(joint, carried_by)| TreeJoint { joint, carried_by }).collect();
        let tree = JointTree::new(joints).map_err(|source| RobotError::Group { path: self.path.clone(), source })?;
        Ok(Skeleton { name: self.name.clone(), tree, links, couplings, sites, bodies })
    }

    /// Every hinge and slide, and which link carries which body.
    pub(crate) fn all_links(&self) -> Result<LinkTable, RobotError> {
        let count = self.model.jnt_type().len();
        let names: Vec<&str> = (0..count).map(|joint| self.joint_name(joint)).collect();
        for (joint, name) in names.iter().enumerate() {
            let kind = match self.model.jnt_type()[joint] {
                MjtJoint::mjJNT_BALL => "ball",
                MjtJoint::mjJNT_FREE => "free",
                _ if name.is_empty() => {
                    let body = self.body_name(index(self.model.jnt_bodyid()[joint]));
                    return Err(RobotError::Unnamed { path: self.path.clone(), body });
                }
                _ => continue,
            };
            return Err(RobotError::Kind { path: self.path.clone(), joint: (*name).to_owned(), kind });
        }
        self.link_table(&names, &BTreeMap::new())
    }

    fn joint_name(&self, joint: usize) -> &str {
        self.model.id_to_name(MjtObjBase::mjOBJ_JOINT, joint).unwrap_or_default()
    }

    /// Error of the coupling by which a joint follows.
    fn coupling_error(&self, joint: usize, reason: &'static str) -> HandError {
        let joint = self.joint_name(joint).to_owned();
        HandError::Coupling { place: self.follower_place(&joint), joint, reason }
    }

    /// Couplings of `<equality><joint>`. MuJoCo's polynomial is about the joints' reference values.
    fn couplings(&self, links: &LinkTable) -> Result<Vec<Coupling>, HandError> {
        let model = &self.model;
        let mut found: Vec<Coupling> = Vec::new();
        for (equality, kind) in model.eq_type().iter().enumerate() {
            if *kind != MjtEq::mjEQ_JOINT || !model.eq_active0()[equality] {
                continue;
            }
            let joint = index(model.eq_obj1id()[equality]);
            let refused = |reason| self.coupling_error(joint, reason);
            let Ok(follows) = usize::try_from(model.eq_obj2id()[equality]) else {
                return Err(refused("is held at a value; take the joint out instead"));
            };
            let [constant, ratio, curve @ ..] = model.eq_data()[equality];
            if curve[..3].iter().any(|term| *term != 0.0) {
                return Err(refused("follows by a curve; only polycoef=\"OFFSET RATIO 0 0 0\" is read"));
            }
            if found.iter().any(|known| known.joint == joint) {
                return Err(refused("follows two joints"));
            }
            let at_rest = |joint: usize| model.qpos0()[index(model.jnt_qposadr()[joint])];
            let offset = at_rest(joint) + constant - ratio * at_rest(follows);
            found.push(Coupling { joint, follows, ratio, offset });
        }
        if let Some(chained) = found.iter().find(|one| found.iter().any(|other| other.joint == one.follows)) {
            let reason = "follows a joint that itself follows one; couple both to the one that is driven";
            return Err(self.coupling_error(chained.joint, reason));
        }
        // From MuJoCo's numbers of joints to indices in the tree.
        let index = |joint: usize| {
            links.chain.iter().position(|known| known.name == self.joint_name(joint)).expect("every joint is there")
        };
        Ok(found
            .into_iter()
            .map(|coupling| Coupling { joint: index(coupling.joint), follows: index(coupling.follows), ..coupling })
            .collect())
    }
}
