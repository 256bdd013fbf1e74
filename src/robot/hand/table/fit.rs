//! A table compared with its description: every name is there, every value within its range, every joint moved.

use std::collections::BTreeMap;

use nalgebra::{IsometryMatrix3, Matrix3, Point3, Rotation3, Translation3, Unit, Vector3};

use super::spec::{BreakawaySpec, ContactSpec, DrivenSpec, EigengraspsSpec, FrameSpec, HandTableSpec};
use crate::{
    hand::{Breakaway, ContactPoint, Coupling, Driven, Eigengrasps, Follower, Hand, HandParts, Mount, Skeleton},
    kinematics::JointKind,
};
use form::{Bounds, Checker, Finding, FormErrors, FormProblem, Path, did_you_mean};

/// Closer than this, a value is its joint's limit: the one is written in radians, the other often in degrees.
const AT_LIMIT: f64 = 1e-9;

/// Load at which a stopped joint gives way if its table does not state it, per load that stops it.
const HOLDING: f64 = 1.25;

/// The hand that a table and its description make.
///
/// # Errors
/// Every mistake.
pub(super) fn hand(spec: &HandTableSpec, checker: Checker, skeleton: Skeleton) -> Result<Hand, FormErrors> {
    let mut fit = Fit { skeleton: &skeleton, checker };
    let driven = fit.driven(&spec.driven);
    let approach = fit.approach(&spec.approach);
    let contacts = fit.contacts(&spec.contacts);
    let width = spec.width.as_ref().and_then(|names| fit.width(names, &spec.contacts));
    let eigengrasps = spec.eigengrasps.as_ref().map(|eigengrasps| fit.eigengrasps(eigengrasps, &spec.driven, &driven));
    fit.checker.finish()?;
    let Skeleton { name, tree, links, .. } = skeleton;
    Ok(Hand::new(HandParts { name, tree, links, driven, approach, contacts, width, eigengrasps }))
}

struct Fit<'a> {
    skeleton: &'a Skeleton,
    checker: Checker,
}

impl Fit<'_> {
    fn joint_name(&self, joint: usize) -> &str {
        &self.skeleton.tree.joints()[joint].joint.name
    }

    /// Reports a name that is not among those present.
    fn not_found(&mut self, path: &Path, kind: &str, found: &str, present: &[&str]) {
        let list = if present.is_empty() { "none with a name".to_owned() } else { present.join(", ") };
        let report = self.checker.not_found(path, kind, format!("`{found}`; the hand has {list}"));
        report.help_if(did_you_mean(found, present.iter().copied()));
    }

    /// The index of a joint.
    fn joint(&mut self, path: &Path, name: &str) -> Option<usize> {
        let found = self.skeleton.tree.joint_named(name);
        if found.is_none() {
            let skeleton = self.skeleton;
            let names: Vec<&str> = skeleton.tree.joints().iter().map(|joint| joint.joint.name.as_str()).collect();
            self.not_found(path, "joint", name, &names);
        }
        found
    }

    /// The driven joints without mistakes.
    fn driven(&mut self, specs: &[DrivenSpec]) -> Vec<Driven> {
        let mut driven: Vec<Driven> = Vec::new();
        for (index, spec) in specs.iter().enumerate() {
            let path = Path::from("driven").index(index);
            let Some(joint) = self.joint(&path.key("joint"), &spec.joint) else { continue };
            // One motor per joint, with its own name, and only where nothing else moves the joint.
            let (key, name) = spec.name();
            if driven.iter().any(|known| known.joint == joint) {
                let found = format!("`{}` a second time", spec.joint);
                self.checker.invalid(path.key("joint"), "a joint that no other motor drives", found);
            } else if driven.iter().any(|known| known.name == name) {
                self.checker.invalid(
                    path.key(key),
                    "a name that no other motor has",
                    format!("`{name}` a second time"),
                );
            } else if let Some(coupling) = self.skeleton.couplings.iter().find(|coupling| coupling.joint == joint) {
                let follows = self.joint_name(coupling.follows).to_owned();
                let found = format!("`{}`, which follows `{follows}` by <equality><joint>", spec.joint);
                let report = self.checker.invalid(path.key("joint"), "a joint that follows no other", found);
                report.help(format!("drive `{follows}`"));
            } else {
                driven.extend(self.one_driven(&path, spec, joint));
            }
        }
        // A mistake of a motor may be why a joint has none.
        if !self.checker.is_wrong("driven") {
            let moved = |joint: &usize| {
                let mut all = driven
                    .iter()
                    .flat_map(|one| one.followers.iter().map(|follower| follower.joint).chain([one.joint]));
                all.any(|known| known == *joint)
            };
            let still = (0..self.skeleton.tree.len()).filter(|joint| !moved(joint));
            let still: Vec<String> = still.map(|joint| format!("`{}`", self.joint_name(joint))).collect();
            if !still.is_empty() {
                let expected = format!("a motor for each joint that follows none: nothing moves {}", still.join(", "));
                let report = self.checker.missing("driven", expected);
                report.help("give it a [[driven]], or couple it by <equality><joint> (<mimic> in a URDF)");
            }
        }
        driven
    }

    fn one_driven(&mut self, path: &Path, spec: &DrivenSpec, joint: usize) -> Option<Driven> {
        let limits_of = |joint: usize| self.skeleton.tree.joints()[joint].joint.limits;
        let Some(limits) = limits_of(joint) else {
            let found = format!("`{}`, which rotates without limits", spec.joint);
            let report = self.checker.invalid(path.key("joint"), "a joint with a range", found);
            report.help("give it range=\"LOW HIGH\" (<limit> in a URDF)");
            return None;
        };
        let following = self.skeleton.couplings.iter().filter(|coupling| coupling.follows == joint);
        let follower = |&Coupling { joint, ratio, offset, .. }: &Coupling| {
            let limits =
                limits_of(joint).map_or([f64::NEG_INFINITY, f64::INFINITY], |limits| [limits.low, limits.high]);
            Follower { joint, ratio, offset, limits }
        };
        let mut driven = Driven {
            name: spec.name().1.to_owned(),
            joint,
            limits: [limits.low, limits.high],
            followers: following.map(follower).collect(),
            opened: spec.opened,
            closed: spec.closed,
            speed: spec.speed,
            torque: spec.torque,
            holding_torque: self.holding_torque(path, spec.torque, spec.holding_torque),
            breakaway: None,
        };
        driven.opened = self.within(&path.key("opened"), &driven, spec.opened);
        driven.closed = spec.closed.map(|closed| self.within(&path.key("closed"), &driven, closed));
        driven.breakaway = spec.breakaway.as_ref().and_then(|spec| self.breakaway(path, spec, &driven));
        Some(driven)
    }

    /// A value of a driven joint at which what follows it is within its limits, too.
    fn within(&mut self, path: &Path, driven: &Driven, value: f64) -> f64 {
        let [low, high] = driven.range();
        if !(low - AT_LIMIT..=high + AT_LIMIT).contains(&value) {
            let is_slide = self.skeleton.tree.joints()[driven.joint].joint.kind == JointKind::Prismatic;
            let unit = Some(if is_slide { "m" } else { "rad" }.to_owned());
            let expected = Bounds { min: Some(low), max: Some(high), unit, ..Bounds::default() }.into();
            let help = format!("the range of joint `{}` and of what follows it", self.joint_name(driven.joint));
            self.checker.fail(path, FormProblem::OutOfRange { expected, found: Finding::Float(value) }).help(help);
        }
        value.max(low).min(high)
    }

    /// The clutch of a driven joint; `path` leads to the joint.
    fn breakaway(&mut self, path: &Path, spec: &BreakawaySpec, driven: &Driven) -> Option<Breakaway> {
        let below = path.key("breakaway");
        if spec.ratio == 0.0 {
            self.checker.invalid(below.key("ratio"), "a number other than 0", "0");
        }
        if driven.closing_sign() == 0.0 {
            let found = driven.closed.map_or("none".to_owned(), |closed| closed.to_string());
            let report = self.checker.invalid(path.key("closed"), "a value other than `opened`", found);
            report.help("a breakaway needs to know which way the hand closes");
        }
        let joint = self.joint(&below.key("joint"), &spec.joint)?;
        let follower = driven.followers.iter().position(|follower| follower.joint == joint);
        if follower.is_none() {
            let followers: Vec<&str> =
                driven.followers.iter().map(|follower| self.joint_name(follower.joint)).collect();
            let expected = format!("a joint that follows `{}`", self.joint_name(driven.joint));
            let help = match followers.as_slice() {
                [] => "none does; take `breakaway` out".to_owned(),
                names => format!("those that do: {}", names.join(", ")),
            };
            self.checker.invalid(below.key("joint"), expected, format!("`{}`", spec.joint)).help(help);
        }
        let holding_torque = self.holding_torque(&below, spec.torque, spec.holding_torque);
        Some(Breakaway { follower: follower?, ratio: spec.ratio, torque: spec.torque, holding_torque })
    }

    /// Load at which a stopped joint gives way; `path` leads to the table of its keys.
    fn holding_torque(&mut self, path: &Path, torque: f64, wanted: Option<f64>) -> f64 {
        let Some(wanted) = wanted else { return HOLDING * torque };
        if wanted < torque {
            let report = self.checker.invalid(path.key("holding_torque"), "at least `torque`", wanted.to_string());
            report.help(format!("a joint that gives way below {torque} is never stopped by that load"));
        }
        wanted
    }

    /// The frame with this name.
    fn mount(&mut self, path: &Path, kind: &str, name: &str) -> Option<Mount> {
        let skeleton = self.skeleton;
        let frames: &BTreeMap<String, Mount> = if kind == "site" { &skeleton.sites } else { &skeleton.bodies };
        let found = frames.get(name).copied();
        if found.is_none() {
            let names: Vec<&str> = frames.keys().map(String::as_str).collect();
            self.not_found(&path.key(kind), kind, name, &names);
        }
        found
    }

    fn direction(&mut self, path: &Path, expected: &str, value: [f64; 3], along: Vector3<f64>) -> Unit<Vector3<f64>> {
        let length = along.norm();
        if !(length > 1e-9 && length.is_finite()) {
            self.checker.invalid(path, expected, format!("{value:?}"));
            return Vector3::z_axis();
        }
        // One that was written with unit length keeps its digits.
        Unit::new_unchecked(if (length - 1.0).abs() < 1e-15 { along } else { along / length })
    }

    /// Reports a table that gives a contact point in neither form, or in both.
    fn wrong_form(&mut self, path: &Path, forms: &str) {
        let found = self.checker.document().finding(path).unwrap_or(Finding::Table(Vec::new()));
        self.checker.fail(path, FormProblem::WrongType { expected: forms.into(), found });
    }

    fn approach(&mut self, spec: &FrameSpec) -> Mount {
        let nowhere = Mount { link: 0, link_from_frame: IsometryMatrix3::identity() };
        let path = Path::from("approach");
        match spec {
            FrameSpec { site: Some(site), body: None, position: None, z: None, x: None } => {
                self.mount(&path, "site", site).unwrap_or(nowhere)
            }
            FrameSpec { site: None, body: Some(body), position: Some(position), z: Some(z), x: Some(x) } => {
                let forward = self.direction(&path.key("z"), "a direction", *z, Vector3::from(*z));
                // Gram and Schmidt: only the part of x perpendicular to z.
                let across = Vector3::from(*x) - forward.into_inner() * forward.dot(&Vector3::from(*x));
                let right = self.direction(&path.key("x"), "a direction that is not along `z`", *x, across);
                let columns = [right.into_inner(), forward.cross(&right), forward.into_inner()];
                let rotation = Rotation3::from_matrix_unchecked(Matrix3::from_columns(&columns));
                let body_from_frame = IsometryMatrix3::from_parts(Translation3::from(*position), rotation);
                let body = self.mount(&path, "body", body).unwrap_or(nowhere);
                Mount { link_from_frame: body.link_from_frame * body_from_frame, ..body }
            }
            _ => {
                self.wrong_form(&path, "`site`, or `body`, `position`, `z` and `x`");
                nowhere
            }
        }
    }

    fn contacts(&mut self, specs: &[ContactSpec]) -> Vec<ContactPoint> {
        let mut contacts: Vec<ContactPoint> = Vec::new();
        for (index, spec) in specs.iter().enumerate() {
            let path = Path::from("contacts").index(index);
            let Some(contact) = self.contact(&path, spec) else { continue };
            if contacts.iter().any(|known| known.name == contact.name) {
                let key = spec.name().map_or("name", |(key, _)| key);
                let found = format!("`{}` a second time", contact.name);
                self.checker.invalid(path.key(key), "a name that no other contact has", found);
            } else {
                contacts.push(contact);
            }
        }
        contacts
    }

    fn contact(&mut self, path: &Path, spec: &ContactSpec) -> Option<ContactPoint> {
        match spec {
            ContactSpec { site: Some(site), name, body: None, position: None, normal: None } => {
                let Mount { link, link_from_frame } = self.mount(path, "site", site)?;
                let point = Point3::from(link_from_frame.translation.vector);
                let normal = link_from_frame.rotation * Vector3::z_axis();
                Some(ContactPoint { name: name.as_ref().unwrap_or(site).clone(), link, point, normal })
            }
            ContactSpec {
                site: None,
                name: Some(name),
                body: Some(body),
                position: Some(position),
                normal: Some(normal),
            } => {
                let normal = self.direction(&path.key("normal"), "a direction", *normal, Vector3::from(*normal));
                let Mount { link, link_from_frame } = self.mount(path, "body", body)?;
                let (point, normal) = (link_from_frame * Point3::from(*position), link_from_frame.rotation * normal);
                Some(ContactPoint { name: name.clone(), link, point, normal })
            }
            _ => {
                self.wrong_form(path, "`site` (and a `name`, if you like), or `name`, `body`, `position` and `normal`");
                None
            }
        }
    }

    /// The pads whose distance is the width; names are searched among those written, so that a contact with another
    /// mistake is not also reported as missing.
    fn width(&mut self, names: &[String; 2], contacts: &[ContactSpec]) -> Option<[usize; 2]> {
        let present: Vec<&str> = contacts.iter().filter_map(|contact| contact.name().map(|(_, name)| name)).collect();
        let found = names.each_ref().map(|name| present.iter().position(|known| known == name));
        for (index, name) in names.iter().enumerate().filter(|(index, _)| found[*index].is_none()) {
            self.not_found(&Path::from("width").index(index), "contact", name, &present);
        }
        Some([found[0]?, found[1]?])
    }

    /// Eigengrasps, each list as long as there are motors, their origin within the ranges of the joints. `read` are the motors without
    /// mistakes.
    fn eigengrasps(&mut self, spec: &EigengraspsSpec, driven: &[DrivenSpec], read: &[Driven]) -> Eigengrasps {
        let path = Path::from("eigengrasps");
        let directions = spec.directions.iter().enumerate();
        let directions = directions.map(|(index, list)| (path.key("directions").index(index), list));
        let wrong = |list: &[f64]| !driven.is_empty() && list.len() != driven.len();
        for (path, list) in directions.chain([(path.key("origin"), &spec.origin)]).filter(|(_, list)| wrong(list)) {
            let names: Vec<&str> = driven.iter().map(|one| one.name().1).collect();
            let expected = format!("{} values, one per driven joint: {}", driven.len(), names.join(", "));
            self.checker.invalid(path, expected, list.len().to_string());
        }
        // A motor with a mistake has no range yet.
        if read.len() == driven.len() && spec.origin.len() == driven.len() {
            for (index, (motor, value)) in read.iter().zip(&spec.origin).enumerate() {
                self.within(&path.key("origin").index(index), motor, *value);
            }
        }
        for (index, _) in spec.directions.iter().enumerate().filter(|(_, list)| list.iter().all(|step| *step == 0.0)) {
            let path = path.key("directions").index(index);
            self.checker.invalid(path, "a direction that moves a joint", "zeros alone");
        }
        Eigengrasps { origin: spec.origin.clone(), directions: spec.directions.clone() }
    }
}
