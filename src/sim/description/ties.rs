//! Equalities and tendons: statements that tie parts of a description outside the tree of its bodies.

use std::collections::{BTreeMap, BTreeSet};

use kernel::description::{Format, Statement};
use mujoco_rs::wrappers::mj_model::{MjtEq, MjtObjBase, MjtTrn, MjtWrap};

use crate::{
    convert::index,
    description::{bodies::LinkTable, robot::RobotModel},
    error::{RefusedStatement, RobotError},
    statements::{Usage, condition_of},
};

/// The values required by a tie and those of a job may differ by rounding [rad or m].
const SAME: f64 = 1e-9;

/// An equality or a tendon.
struct Tie {
    /// Element of the description.
    element: &'static str,
    /// Names of the tied parts, by the attributes that name them; the first known one finds its statement.
    names: Vec<(&'static str, String)>,
    /// Bodies that it holds to each other.
    bodies: Vec<usize>,
    /// Joints that it ties.
    joints: Vec<usize>,
}

impl RobotModel {
    /// Refuses ties that the joints of a table of links, which move, would break.
    pub(crate) fn check_ties(&self, links: &LinkTable) -> Result<(), RobotError> {
        let moving: BTreeSet<&str> = links.chain.iter().map(|joint| joint.name.as_str()).collect();
        let link_of = |body: &usize| links.of_body[*body].0;
        let moves = |tie: &Tie| {
            let parts: BTreeSet<usize> = tie.bodies.iter().map(link_of).collect();
            parts.len() > 1
                || tie.joints.iter().any(|joint| moving.contains(self.name_of(MjtObjBase::mjOBJ_JOINT, *joint)))
        };
        let ties = self.equalities().into_iter().chain(self.tendons());
        let refused: Vec<RefusedStatement> = ties.filter(moves).map(|tie| self.refused(&tie)).collect();
        if refused.is_empty() { Ok(()) } else { Err(RobotError::Statements { refused }) }
    }

    /// Values of all fixed joints that differ from the description [rad or m]: those given, and those that follow
    /// another such joint by `<equality><joint>`.
    ///
    /// # Errors
    /// When a value is given that its equality contradicts.
    pub(crate) fn still_values(
        &self,
        joints: &[&str],
        fixed: &BTreeMap<String, f64>,
    ) -> Result<BTreeMap<String, f64>, RobotError> {
        let model = &self.model;
        let mut values = fixed.clone();
        let at_rest = |joint: usize| model.qpos0()[index(model.jnt_qposadr()[joint])];
        let name = |joint: usize| self.name_of(MjtObjBase::mjOBJ_JOINT, joint);
        // Followers of followers: as many rounds as there are equalities reach all.
        for _ in 0..model.eq_type().len() {
            for equality in self.active(MjtEq::mjEQ_JOINT) {
                let follower = index(model.eq_obj1id()[equality]);
                let leader = usize::try_from(model.eq_obj2id()[equality]).ok();
                if [Some(follower), leader].into_iter().flatten().any(|joint| joints.contains(&name(joint))) {
                    continue;
                }
                let moved =
                    leader.map_or(0.0, |leader| values.get(name(leader)).map_or(0.0, |value| value - at_rest(leader)));
                let [a, b, c, d, e, ..] = model.eq_data()[equality];
                let value = at_rest(follower) + a + moved * (b + moved * (c + moved * (d + moved * e)));
                match fixed.get(name(follower)) {
                    Some(given) if (given - value).abs() > SAME => {
                        return Err(RobotError::Contradicted {
                            path: self.path.clone(),
                            joint: name(follower).to_owned(),
                            given: *given,
                            leader: leader.map(|leader| name(leader).to_owned()),
                            value,
                        });
                    }
                    Some(_) => {}
                    None if (value - at_rest(follower)).abs() > SAME => {
                        values.insert(name(follower).to_owned(), value);
                    }
                    None => {
                        values.remove(name(follower));
                    }
                }
            }
        }
        Ok(values)
    }

    /// Equalities of a kind that are active.
    fn active(&self, kind: MjtEq) -> impl Iterator<Item = usize> {
        let model = &self.model;
        (0..model.eq_type().len())
            .filter(move |equality| model.eq_type()[*equality] == kind && model.eq_active0()[*equality])
    }

    /// Active equalities, but those of joints in a hand: the table reads these.
    fn equalities(&self) -> Vec<Tie> {
        let model = &self.model;
        let mut found = Vec::new();
        for equality in 0..model.eq_type().len() {
            if !model.eq_active0()[equality] {
                continue;
            }
            let objects = [model.eq_obj1id()[equality], model.eq_obj2id()[equality]];
            let objects: Vec<usize> = objects.into_iter().filter_map(|object| usize::try_from(object).ok()).collect();
            let own = |tie: Tie| Tie {
                names: std::iter::once(("name", self.name_of(MjtObjBase::mjOBJ_EQUALITY, equality).to_owned()))
                    .chain(tie.names)
                    .collect(),
                ..tie
            };
            let named = |kind, attributes: [&'static str; 2]| {
                attributes
                    .into_iter()
                    .zip(&objects)
                    .map(|(attribute, object)| (attribute, self.name_of(kind, *object).to_owned()))
                    .collect()
            };
            let tie = match model.eq_type()[equality] {
                kind @ (MjtEq::mjEQ_CONNECT | MjtEq::mjEQ_WELD) => {
                    let element = if kind == MjtEq::mjEQ_CONNECT { "equality/connect" } else { "equality/weld" };
                    let by_sites = model.eq_objtype()[equality] == MjtObjBase::mjOBJ_SITE;
                    let (kind, attributes) = match by_sites {
                        true => (MjtObjBase::mjOBJ_SITE, ["site1", "site2"]),
                        false => (MjtObjBase::mjOBJ_BODY, ["body1", "body2"]),
                    };
                    let body = |object: &usize| if by_sites { index(model.site_bodyid()[*object]) } else { *object };
                    // One that names a single body holds that to the world.
                    let mut bodies: Vec<usize> = objects.iter().map(body).collect();
                    bodies.extend((bodies.len() == 1).then_some(0));
                    Tie { element, names: named(kind, attributes), bodies, joints: Vec::new() }
                }
                MjtEq::mjEQ_JOINT if self.usage == Usage::Hand => continue,
                MjtEq::mjEQ_JOINT => Tie {
                    element: self.follower_element(),
                    names: named(MjtObjBase::mjOBJ_JOINT, ["joint1", "joint2"]),
                    bodies: Vec::new(),
                    joints: objects,
                },
                MjtEq::mjEQ_TENDON => {
                    let (bodies, joints) = self.tied_by_tendons(&objects);
                    let names = named(MjtObjBase::mjOBJ_TENDON, ["tendon1", "tendon2"]);
                    Tie { element: "equality/tendon", names, bodies, joints }
                }
                // Those of soft bodies are refused with these.
                _ => continue,
            };
            found.push(own(tie));
        }
        found
    }

    /// Tendons that hold the tied parts, not only pull: those with limits; in a hand, where they would load joints in
    /// addition to the servos, all except those that only measure.
    fn tendons(&self) -> Vec<Tie> {
        let model = &self.model;
        let driven: BTreeSet<usize> = (0..model.actuator_trntype().len())
            .filter(|actuator| model.actuator_trntype()[*actuator] == MjtTrn::mjTRN_TENDON)
            .map(|actuator| index(model.actuator_trnid()[actuator][0]))
            .collect();
        let is_loaded = |tendon: usize| {
            let loads = [
                model.tendon_stiffness()[tendon],
                model.tendon_damping()[tendon],
                model.tendon_armature()[tendon],
                model.tendon_frictionloss()[tendon],
            ];
            driven.contains(&tendon) || loads.iter().any(|load| *load != 0.0)
        };
        let holds =
            |tendon: &usize| model.tendon_limited()[*tendon] || (self.usage == Usage::Hand && is_loaded(*tendon));
        let tie = |tendon: usize| {
            let (bodies, joints) = self.tied_by_tendons(&[tendon]);
            let first = model.wrap_type()[index(model.tendon_adr()[tendon])];
            let element = if first == MjtWrap::mjWRAP_JOINT { "tendon/fixed" } else { "tendon/spatial" };
            let names = vec![("name", self.name_of(MjtObjBase::mjOBJ_TENDON, tendon).to_owned())];
            Tie { element, names, bodies, joints }
        };
        (0..model.tendon_limited().len()).filter(holds).map(tie).collect()
    }

    /// Bodies that tendons run along, and joints that they move.
    fn tied_by_tendons(&self, tendons: &[usize]) -> (Vec<usize>, Vec<usize>) {
        let model = &self.model;
        let (mut bodies, mut joints) = (Vec::new(), Vec::new());
        for tendon in tendons {
            let first = index(model.tendon_adr()[*tendon]);
            for wrap in first..first + index(model.tendon_num()[*tendon]) {
                let Ok(object) = usize::try_from(model.wrap_objid()[wrap]) else { continue };
                match model.wrap_type()[wrap] {
                    MjtWrap::mjWRAP_JOINT => joints.push(object),
                    MjtWrap::mjWRAP_SITE => bodies.push(index(model.site_bodyid()[object])),
                    MjtWrap::mjWRAP_SPHERE | MjtWrap::mjWRAP_CYLINDER => {
                        bodies.push(index(model.geom_bodyid()[object]));
                    }
                    _ => {}
                }
            }
        }
        (bodies, joints)
    }

    /// The refusal of a tie, with the position of its statement.
    fn refused(&self, tie: &Tie) -> RefusedStatement {
        let (when, remedy) = condition_of(tie.element, None, self.usage);
        let is_it = |statement: &&Statement| {
            let mut known = tie.names.iter().filter(|(_, name)| !name.is_empty());
            statement.is(tie.element) && known.all(|(attribute, name)| statement.get(attribute) == Some(name))
        };
        let follower = tie.names.iter().find(|(attribute, _)| *attribute == "joint1").map(|(_, name)| name.as_str());
        let statement = match follower {
            Some(joint) => self.follower_statement(joint),
            None => self.text.statements.iter().find(is_it),
        };
        match statement {
            Some(statement) => RefusedStatement::when(statement, when, remedy),
            // One that was copied under another name.
            None => {
                let element = tie.element.split_once('/').map_or(tie.element, |(_, element)| element);
                RefusedStatement::without_place(&self.path, element, &tie.names, when, remedy)
            }
        }
    }

    /// The element by which a joint follows another.
    fn follower_element(&self) -> &'static str {
        match self.text.format {
            Format::Mjcf => "equality/joint",
            Format::Urdf => "joint/mimic",
        }
    }

    /// The statement by which a joint follows another.
    fn follower_statement(&self, joint: &str) -> Option<&Statement> {
        let statements = &self.text.statements;
        statements.iter().filter(|statement| statement.is(self.follower_element())).find(|statement| {
            let follower = match self.text.format {
                Format::Mjcf => statement.get("joint1"),
                // A URDF states it in the joint that follows.
                Format::Urdf => statement.parent.and_then(|parent| statements[parent].get("name")),
            };
            follower == Some(joint)
        })
    }

    /// File and line of the statement by which a joint follows another, or only the file if it is written differently.
    pub(crate) fn follower_place(&self, joint: &str) -> String {
        self.follower_statement(joint)
            .map_or_else(|| self.path.display().to_string(), |statement| statement.place.to_string())
    }

    pub(crate) fn name_of(&self, kind: MjtObjBase, id: usize) -> &str {
        self.model.id_to_name(kind, id).unwrap_or_default()
    }
}
