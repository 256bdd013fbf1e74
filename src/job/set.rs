//! Sets: several jobs in one folder, each a dataset of its own.

use std::path::Path as FilePath;

use super::{
    check::Checker,
    decode::{self, DecodedAs, did_you_mean},
    document::{Document, NodeValue, Path},
    draft::JobText,
    errors::{JobErrors, Problem},
    spec::set::{MemberSpec, SetSpec},
};
use crate::ids::Product;

/// What `product` says of a set.
pub(super) const SET: &str = "set";

/// A set, as written and checked; its jobs are read when their turn comes, since one may need what another makes.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct JobSet {
    /// Name, for people.
    pub name: String,
    /// The jobs, in the order in which they are made.
    pub jobs: Vec<SetMember>,
}

/// One job of a set.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct SetMember {
    /// Its name, and the folder of its dataset within that of the set.
    pub name: String,
    /// Its job file, with what is laid over it.
    pub text: JobText,
    /// What it makes.
    pub product: Product,
    /// Of a job for patches: the name of the job before it that makes its grasps.
    pub grasps: Option<String>,
}

impl JobSet {
    /// Whether a job file says that it is a set; what is wrong with it otherwise is not looked at.
    pub fn is_one(text: &JobText) -> bool {
        product_word(text).is_some_and(|word| word == SET)
    }

    /// Reads a set and the texts of its jobs. Overrides of `text` go to every job, those that begin with a job's name and a
    /// colon (`patches:render.colour=false`) to that one alone.
    ///
    /// # Errors
    /// Every mistake of the file; those of its jobs are found when these are read.
    pub fn read(text: &JobText) -> Result<Self, JobErrors> {
        let DecodedAs { spec, document, errors, wrong } = decode::decode_set(&text.label, &text.text)?;
        let mut checker = Checker { document: &document, errors, wrong };
        let jobs = members(&mut checker, &spec, text);
        JobErrors::check(checker.errors)?;
        let file_name = FilePath::new(&text.label).file_stem().map(|stem| stem.to_string_lossy().into_owned());
        Ok(Self { name: spec.name.or(file_name).unwrap_or_else(|| SET.to_owned()), jobs })
    }
}

/// The jobs without mistakes.
fn members(checker: &mut Checker<'_>, spec: &SetSpec, text: &JobText) -> Vec<SetMember> {
    let mut jobs: Vec<SetMember> = Vec::new();
    let names: Vec<&str> = spec.jobs.iter().map(|job| job.name.as_str()).collect();
    for (place, member) in spec.jobs.iter().enumerate() {
        let path = Path::of("jobs").index(place);
        let name = &member.name;
        if !is_plain(name) {
            let expected = "small letters, digits, - and _".to_owned();
            let problem = Problem::Senseless { expected, found: format!("\"{name}\"") };
            checker.fail(&path.key("name"), problem, Some("it is the folder of the dataset".to_owned()));
        } else if names[..place].contains(&name.as_str()) {
            let problem = Problem::Senseless {
                expected: "a name that no other job has".to_owned(),
                found: format!("\"{name}\""),
            };
            checker.fail(&path.key("name"), problem, None);
        }
        let overrides =
            member.set.iter().cloned().chain(overrides_of(name, &names, &text.overrides)).collect::<Vec<_>>();
        let file = text.folder.join(&member.job);
        let job = match JobText::open(&file, &overrides) {
            Ok(job) => job,
            Err(error) => {
                let problem =
                    Problem::NotFound { what: "job file".to_owned(), detail: format!("{}: {error}", file.display()) };
                checker.fail(&path.key("job"), problem, None);
                continue;
            }
        };
        let Some(product) = product_of(checker, &path, &job) else { continue };
        grasps(checker, &path, member, product, &jobs);
        jobs.push(SetMember { name: name.clone(), text: job, product, grasps: member.grasps.clone() });
    }
    jobs
}

/// What a job of a set makes; a misspelt product is reported when the job itself is read.
fn product_of(checker: &mut Checker<'_>, path: &Path, job: &JobText) -> Option<Product> {
    match product_word(job) {
        Some(word) if word == SET => {
            let expected = "a job of one product".to_owned();
            let problem = Problem::Senseless { expected, found: format!("{}, a set", job.label) };
            checker.fail(&path.key("job"), problem, Some("name its jobs here instead".to_owned()));
            None
        }
        Some(word) => Some(Product::from_name(&word).unwrap_or(Product::Completion)),
        None => Some(Product::Completion),
    }
}

fn grasps(checker: &mut Checker<'_>, path: &Path, member: &MemberSpec, product: Product, before: &[SetMember]) {
    let Some(wanted) = &member.grasps else { return };
    let path = path.key("grasps");
    if product != Product::Patches {
        let because = format!("a job for {product} takes no grasps");
        checker.fail(&path, Problem::Contradiction { other: "job".to_owned(), because }, None);
        return;
    }
    let known = before.iter().filter(|job| job.product == Product::Grasps).map(|job| job.name.as_str());
    if !known.clone().any(|name| name == wanted) {
        let detail = format!("`{wanted}` among the jobs further up");
        let problem = Problem::NotFound { what: "job for grasps".to_owned(), detail };
        checker.fail(&path, problem, did_you_mean(wanted, known));
    }
}

/// What of the set's overrides goes to the job of this name.
fn overrides_of<'a>(name: &'a str, names: &'a [&str], overrides: &'a [String]) -> impl Iterator<Item = String> + 'a {
    overrides.iter().filter_map(move |setting| {
        // A key of TOML has no colon outside quotes, and no name of a job has quotes.
        match setting.split_once(':').filter(|(job, _)| names.contains(job)) {
            Some((job, setting)) => (job == name).then(|| setting.to_owned()),
            None => Some(setting.clone()),
        }
    })
}

/// Whether a name is safe as a folder on any machine.
fn is_plain(name: &str) -> bool {
    let begins = name.starts_with(|first: char| first.is_ascii_lowercase() || first.is_ascii_digit());
    begins && name.bytes().all(|byte| matches!(byte, b'a'..=b'z' | b'0'..=b'9' | b'-' | b'_'))
}

/// What a job file says under `product`.
fn product_word(text: &JobText) -> Option<String> {
    let (document, _) = Document::read(&text.label, &text.text, &text.overrides);
    match &document.get(&Path::of("product"))?.value {
        NodeValue::Text(word) => Some(word.clone()),
        _ => None,
    }
}
