//! A hand's table: TOML beside its MJCF that says what drives the joints and where the hand touches.

use std::{
    collections::BTreeMap,
    fs,
    ops::Range,
    path::{Path, PathBuf},
};

use nalgebra::{IsometryMatrix3, Matrix3, Point3, Rotation3, Translation3, Unit, Vector3};
use serde::Deserialize;
use toml::{
    Spanned,
    de::{DeTable, DeValue},
};

use super::{
    Breakaway, ContactPoint, Coupling, Driven, Eigengrasps, Follower, Hand, HandParts, HandProblem, HandTableError,
    HandTableFault, Mount, Skeleton,
};

/// A table as written: TOML with known keys only, not yet held against its description.
#[derive(Clone, Debug)]
pub struct HandTable {
    file: PathBuf,
    text: String,
    written: Written,
}

#[derive(Clone, Debug, Deserialize)]
struct Written {
    approach: Spanned<WrittenFrame>,
    driven: Vec<WrittenDriven>,
    #[serde(default)]
    contacts: Vec<Spanned<WrittenContact>>,
    width: Option<[Spanned<String>; 2]>,
    eigengrasps: Option<WrittenEigengrasps>,
}

#[derive(Clone, Debug, Deserialize)]
struct WrittenFrame {
    site: Option<Spanned<String>>,
    body: Option<Spanned<String>>,
    position: Option<[f64; 3]>,
    z: Option<[f64; 3]>,
    x: Option<[f64; 3]>,
}

#[derive(Clone, Debug, Deserialize)]
struct WrittenDriven {
    joint: Spanned<String>,
    name: Option<Spanned<String>>,
    opened: Spanned<f64>,
    closed: Option<Spanned<f64>>,
    speed: Spanned<f64>,
    torque: Spanned<f64>,
    breakaway: Option<Spanned<WrittenBreakaway>>,
}

impl WrittenDriven {
    /// Its name: that of its joint where it has none of its own.
    fn name(&self) -> &Spanned<String> {
        self.name.as_ref().unwrap_or(&self.joint)
    }
}

#[derive(Clone, Debug, Deserialize)]
struct WrittenBreakaway {
    joint: Spanned<String>,
    ratio: Spanned<f64>,
    torque: Spanned<f64>,
}

#[derive(Clone, Debug, Deserialize)]
struct WrittenContact {
    site: Option<Spanned<String>>,
    name: Option<Spanned<String>>,
    body: Option<Spanned<String>>,
    position: Option<[f64; 3]>,
    normal: Option<[f64; 3]>,
}

#[derive(Clone, Debug, Deserialize)]
struct WrittenEigengrasps {
    origin: Spanned<Vec<f64>>,
    directions: Vec<Spanned<Vec<f64>>>,
}

/// The keys of each table, by the path to it.
const KEYS: &[(&str, &[&str])] = &[
    ("", &["approach", "driven", "contacts", "width", "eigengrasps"]),
    ("approach", &["site", "body", "position", "z", "x"]),
    ("driven", &["joint", "name", "opened", "closed", "speed", "torque", "breakaway"]),
    ("driven.breakaway", &["joint", "ratio", "torque"]),
    ("contacts", &["site", "name", "body", "position", "normal"]),
    ("eigengrasps", &["origin", "directions"]),
];

/// Closer than this, a value is its joint's limit: the one is written in radians, the other often in degrees.
const AT_LIMIT: f64 = 1e-9;

impl HandTable {
    /// Where the table of a description lies: beside it, with the same name.
    pub fn beside(description: &Path) -> PathBuf {
        description.with_extension("toml")
    }

    /// Reads a table.
    ///
    /// # Errors
    /// When it can't be read, is no TOML, or has a key or value that no table has.
    pub fn read(file: &Path) -> Result<Self, HandTableError> {
        match fs::read_to_string(file) {
            Ok(text) => Self::parse(file, text),
            Err(error) => {
                let problem = HandProblem::Unreadable { message: error.to_string() };
                let faults = vec![HandTableFault { line: 0, column: 0, problem }];
                Err(HandTableError { file: file.to_owned(), faults })
            }
        }
    }

    /// A table out of text; `file` is its name in messages.
    ///
    /// # Errors
    /// As [`HandTable::read`].
    pub fn parse(file: &Path, text: String) -> Result<Self, HandTableError> {
        let wrong = |text: &str, mistakes: Vec<(Range<usize>, HandProblem)>| {
            let faults = mistakes.into_iter().map(|(range, problem)| fault(text, &range, problem)).collect();
            HandTableError { file: file.to_owned(), faults }
        };
        let syntax = |error: &toml::de::Error| {
            let message = error.message().trim_end().replace('\n', ", ");
            vec![(error.span().unwrap_or(0..0), HandProblem::Syntax { message })]
        };
        let mut unknown = Vec::new();
        match DeTable::parse(&text) {
            Ok(table) => unknown_keys(table.get_ref(), "", &mut unknown),
            Err(error) => return Err(wrong(&text, syntax(&error))),
        }
        if !unknown.is_empty() {
            unknown.sort_by_key(|(range, _)| range.start);
            return Err(wrong(&text, unknown));
        }
        match toml::from_str(&text) {
            Ok(written) => Ok(Self { file: file.to_owned(), text, written }),
            Err(error) => Err(wrong(&text, syntax(&error))),
        }
    }

    /// The hand that table and description make.
    ///
    /// # Errors
    /// Every mistake, when the two do not fit.
    pub fn hand(&self, skeleton: Skeleton) -> Result<Hand, HandTableError> {
        let mut reading = Reading { skeleton: &skeleton, mistakes: Vec::new() };
        let driven = reading.driven(&self.written.driven);
        let approach = reading.approach(&self.written.approach);
        let contacts = reading.contacts(&self.written.contacts);
        let width = self.written.width.as_ref().map(|names| reading.width(names, &self.written.contacts));
        let names: Vec<String> = self.written.driven.iter().map(|one| one.name().get_ref().clone()).collect();
        let eigengrasps = self.written.eigengrasps.as_ref().map(|written| reading.eigengrasps(written, &names));
        let mut mistakes = reading.mistakes;
        if mistakes.is_empty() {
            let Skeleton { name, tree, links, .. } = skeleton;
            let width = width.flatten();
            Ok(Hand::new(HandParts { name, tree, links, driven, approach, contacts, width, eigengrasps }))
        } else {
            mistakes.sort_by_key(|(range, _)| range.start);
            let faults = mistakes.into_iter().map(|(range, problem)| fault(&self.text, &range, problem)).collect();
            Err(HandTableError { file: self.file.clone(), faults })
        }
    }
}

/// Keys that no table has, at any depth.
fn unknown_keys(table: &DeTable<'_>, path: &str, unknown: &mut Vec<(Range<usize>, HandProblem)>) {
    let Some((_, known)) = KEYS.iter().find(|(place, _)| *place == path) else { return };
    for (key, value) in table {
        let name = key.get_ref().as_ref();
        if !known.contains(&name) {
            let known = known.iter().map(|&key| key.to_owned()).collect();
            unknown.push((key.span(), HandProblem::UnknownKey { found: name.to_owned(), known }));
        }
        let below = if path.is_empty() { name.to_owned() } else { format!("{path}.{name}") };
        match value.get_ref() {
            DeValue::Table(inner) => unknown_keys(inner, &below, unknown),
            DeValue::Array(elements) => {
                for element in elements.iter() {
                    if let DeValue::Table(inner) = element.get_ref() {
                        unknown_keys(inner, &below, unknown);
                    }
                }
            }
            _ => {}
        }
    }
}

fn fault(text: &str, range: &Range<usize>, problem: HandProblem) -> HandTableFault {
    // An empty range at the start stands for the table as a whole.
    if range.end == 0 {
        return HandTableFault { line: 0, column: 0, problem };
    }
    let before = &text[..range.start.min(text.len())];
    let line = before.matches('\n').count() + 1;
    let column = before.rsplit('\n').next().unwrap_or_default().chars().count() + 1;
    HandTableFault { line, column, problem }
}

/// A table being held against its description.
struct Reading<'a> {
    skeleton: &'a Skeleton,
    mistakes: Vec<(Range<usize>, HandProblem)>,
}

impl Reading<'_> {
    fn report(&mut self, range: Range<usize>, problem: HandProblem) {
        self.mistakes.push((range, problem));
    }

    fn joint_name(&self, joint: usize) -> String {
        self.skeleton.tree.joints()[joint].joint.name.clone()
    }

    /// The place of a joint.
    fn joint(&mut self, name: &Spanned<String>) -> Option<usize> {
        let found = self.skeleton.tree.joint_named(name.get_ref());
        if found.is_none() {
            let present = (0..self.skeleton.tree.len()).map(|joint| self.joint_name(joint)).collect();
            let problem = HandProblem::NoSuch { kind: "joint", found: name.get_ref().clone(), present };
            self.report(name.span(), problem);
        }
        found
    }

    fn positive(&mut self, key: &'static str, number: &Spanned<f64>) -> f64 {
        let value = *number.get_ref();
        if !(value > 0.0 && value.is_finite()) {
            self.report(number.span(), HandProblem::NotPositive { key, value });
        }
        value
    }

    /// The driven joints that could be read; what moves each joint.
    fn driven(&mut self, written: &[WrittenDriven]) -> Vec<Driven> {
        let mut moved = vec![false; self.skeleton.tree.len()];
        let mut driven: Vec<Driven> = Vec::new();
        for one in written {
            let Some(joint) = self.joint(&one.joint) else { continue };
            let name = one.name();
            let twice = if driven.iter().any(|known| known.joint == joint) {
                Some(("driven joint", &one.joint))
            } else {
                driven.iter().any(|known| known.name == *name.get_ref()).then_some(("driven name", name))
            };
            if let Some((kind, name)) = twice {
                self.report(name.span(), HandProblem::Twice { kind, name: name.get_ref().clone() });
                continue;
            }
            if let Some(coupling) = self.skeleton.couplings.iter().find(|coupling| coupling.joint == joint) {
                let (joint, follows) = (self.joint_name(joint), self.joint_name(coupling.follows));
                self.report(one.joint.span(), HandProblem::Follows { joint, follows });
                continue;
            }
            if let Some(read) = self.one_driven(one, joint, name.get_ref()) {
                moved[joint] = true;
                read.followers.iter().for_each(|follower| moved[follower.joint] = true);
                driven.push(read);
            }
        }
        if self.mistakes.is_empty() {
            for joint in (0..moved.len()).filter(|joint| !moved[*joint]) {
                self.report(0..0, HandProblem::NotMoved { joint: self.joint_name(joint) });
            }
        }
        driven
    }

    fn one_driven(&mut self, one: &WrittenDriven, joint: usize, name: &str) -> Option<Driven> {
        let limits_of = |joint: usize| self.skeleton.tree.joints()[joint].joint.limits;
        let Some(limits) = limits_of(joint) else {
            self.report(one.joint.span(), HandProblem::NoRange { joint: self.joint_name(joint) });
            return None;
        };
        let following = self.skeleton.couplings.iter().filter(|coupling| coupling.follows == joint);
        let follower = |&Coupling { joint, ratio, offset, .. }: &Coupling| {
            let limits =
                limits_of(joint).map_or([f64::NEG_INFINITY, f64::INFINITY], |limits| [limits.low, limits.high]);
            Follower { joint, ratio, offset, limits }
        };
        let mut driven = Driven {
            name: name.to_owned(),
            joint,
            limits: [limits.low, limits.high],
            followers: following.map(follower).collect(),
            opened: *one.opened.get_ref(),
            closed: one.closed.as_ref().map(|closed| *closed.get_ref()),
            speed: self.positive("speed", &one.speed),
            torque: self.positive("torque", &one.torque),
            breakaway: None,
        };
        driven.opened = self.within(&driven, "opened", &one.opened);
        driven.closed = one.closed.as_ref().map(|closed| self.within(&driven, "closed", closed));
        driven.breakaway = one.breakaway.as_ref().and_then(|written| self.breakaway(&driven, written));
        Some(driven)
    }

    /// A value of a driven joint at which what follows it is within its limits, too.
    fn within(&mut self, driven: &Driven, key: &'static str, number: &Spanned<f64>) -> f64 {
        let (value, [low, high]) = (*number.get_ref(), driven.range());
        if !(low - AT_LIMIT..=high + AT_LIMIT).contains(&value) {
            let joint = self.joint_name(driven.joint);
            self.report(number.span(), HandProblem::Outside { key, value, joint, low, high });
        }
        value.max(low).min(high)
    }

    fn breakaway(&mut self, driven: &Driven, written: &Spanned<WrittenBreakaway>) -> Option<Breakaway> {
        let WrittenBreakaway { joint: name, ratio, torque } = written.get_ref();
        let torque = self.positive("torque", torque);
        let joint = self.joint(name)?;
        let follower = driven.followers.iter().position(|follower| follower.joint == joint);
        let Some(follower) = follower else {
            let followers = driven.followers.iter().map(|follower| self.joint_name(follower.joint)).collect();
            let (joint, driven) = (self.joint_name(joint), self.joint_name(driven.joint));
            self.report(name.span(), HandProblem::NotAFollower { joint, driven, followers });
            return None;
        };
        let value = *ratio.get_ref();
        if value == 0.0 || !value.is_finite() {
            self.report(ratio.span(), HandProblem::NotANumber { key: "ratio", value });
        }
        if driven.closing_sign() == 0.0 {
            self.report(written.span(), HandProblem::NeedsClosed);
        }
        Some(Breakaway { follower, ratio: value, torque })
    }

    fn mount(&mut self, kind: &'static str, name: &Spanned<String>) -> Option<Mount> {
        let frames: &BTreeMap<String, Mount> =
            if kind == "site" { &self.skeleton.sites } else { &self.skeleton.bodies };
        let found = frames.get(name.get_ref()).copied();
        if found.is_none() {
            let present = frames.keys().cloned().collect();
            self.report(name.span(), HandProblem::NoSuch { kind, found: name.get_ref().clone(), present });
        }
        found
    }

    fn direction(&mut self, key: &'static str, range: Range<usize>, value: [f64; 3]) -> Unit<Vector3<f64>> {
        let vector = Vector3::from(value);
        let length = vector.norm();
        if !(length > 1e-9 && length.is_finite()) {
            self.report(range, HandProblem::NoDirection { key, value });
            return Vector3::z_axis();
        }
        // One that was written with unit length keeps its digits.
        Unit::new_unchecked(if (length - 1.0).abs() < 1e-15 { vector } else { vector / length })
    }

    fn approach(&mut self, written: &Spanned<WrittenFrame>) -> Mount {
        let nowhere = Mount { link: 0, link_from_frame: IsometryMatrix3::identity() };
        match written.get_ref() {
            WrittenFrame { site: Some(site), body: None, position: None, z: None, x: None } => {
                self.mount("site", site).unwrap_or(nowhere)
            }
            WrittenFrame { site: None, body: Some(body), position: Some(position), z: Some(z), x: Some(across) } => {
                let forward = self.direction("z", written.span(), *z);
                let across_of = Vector3::from(*across) - forward.into_inner() * forward.dot(&Vector3::from(*across));
                let right = self.direction("x", written.span(), across_of.into());
                let columns = [right.into_inner(), forward.cross(&right), forward.into_inner()];
                let turn = Rotation3::from_matrix_unchecked(Matrix3::from_columns(&columns));
                let body_from_frame = IsometryMatrix3::from_parts(Translation3::from(*position), turn);
                let body = self.mount("body", body).unwrap_or(nowhere);
                Mount { link_from_frame: body.link_from_frame * body_from_frame, ..body }
            }
            _ => {
                self.report(written.span(), HandProblem::Form { one: "site", other: "body, position, z and x" });
                nowhere
            }
        }
    }

    fn contacts(&mut self, written: &[Spanned<WrittenContact>]) -> Vec<ContactPoint> {
        let mut contacts: Vec<ContactPoint> = Vec::new();
        for one in written {
            let Some((name, contact)) = self.contact(one) else { continue };
            if contacts.iter().any(|known| known.name == contact.name) {
                self.report(name, HandProblem::Twice { kind: "contact", name: contact.name });
            } else {
                contacts.push(contact);
            }
        }
        contacts
    }

    /// A contact, and where its name stands.
    fn contact(&mut self, written: &Spanned<WrittenContact>) -> Option<(Range<usize>, ContactPoint)> {
        match written.get_ref() {
            WrittenContact { site: Some(site), name, body: None, position: None, normal: None } => {
                let Mount { link, link_from_frame } = self.mount("site", site)?;
                let name = name.as_ref().unwrap_or(site);
                let point = Point3::from(link_from_frame.translation.vector);
                let normal = link_from_frame.rotation * Vector3::z_axis();
                Some((name.span(), ContactPoint { name: name.get_ref().clone(), link, point, normal }))
            }
            WrittenContact {
                site: None,
                name: Some(name),
                body: Some(body),
                position: Some(position),
                normal: Some(normal),
            } => {
                let normal = self.direction("normal", written.span(), *normal);
                let Mount { link, link_from_frame } = self.mount("body", body)?;
                let (point, normal) = (link_from_frame * Point3::from(*position), link_from_frame.rotation * normal);
                Some((name.span(), ContactPoint { name: name.get_ref().clone(), link, point, normal }))
            }
            _ => {
                let other = "name, body, position and normal";
                self.report(written.span(), HandProblem::Form { one: "site (and a name, if you like)", other });
                None
            }
        }
    }

    /// The pads whose distance is the width; names are looked up among those written, so that a contact with a mistake of
    /// its own is not missed again here.
    fn width(&mut self, names: &[Spanned<String>; 2], contacts: &[Spanned<WrittenContact>]) -> Option<[usize; 2]> {
        let name_of = |contact: &Spanned<WrittenContact>| {
            let WrittenContact { site, name, .. } = contact.get_ref();
            name.as_ref().or(site.as_ref()).map(|name| name.get_ref().clone())
        };
        let present: Vec<String> = contacts.iter().filter_map(name_of).collect();
        let mut places = [0; 2];
        for (place, name) in places.iter_mut().zip(names) {
            let Some(found) = present.iter().position(|known| known == name.get_ref()) else {
                let problem = HandProblem::NoSuch { kind: "contact", found: name.get_ref().clone(), present };
                self.report(name.span(), problem);
                return None;
            };
            *place = found;
        }
        Some(places)
    }

    fn eigengrasps(&mut self, written: &WrittenEigengrasps, driven: &[String]) -> Eigengrasps {
        for list in written.directions.iter().chain([&written.origin]) {
            let values = list.get_ref();
            if values.len() != driven.len() {
                let problem =
                    HandProblem::Length { expected: driven.len(), found: values.len(), driven: driven.to_vec() };
                self.report(list.span(), problem);
            } else if let Some(value) = values.iter().find(|value| !value.is_finite()) {
                self.report(list.span(), HandProblem::NotANumber { key: "eigengrasps", value: *value });
            }
        }
        let directions = written.directions.iter().map(|list| list.get_ref().clone()).collect();
        Eigengrasps { origin: written.origin.get_ref().clone(), directions }
    }
}
