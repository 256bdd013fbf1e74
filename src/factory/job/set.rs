//! Sets: several jobs in one folder, each with a separate dataset.

use std::{collections::BTreeMap, path::Path as FilePath};

use super::{
    JobText, decode, schema,
    spec::{MemberSpec, SetSpec},
};
use crate::{
    product::InputDataset,
    products::{PRODUCTS, factory_of},
};
use form::{Checker, Document, FormErrors, Hints, Path, Requirement, did_you_mean};
use format::{Product, dataset::SetEntry};
use kernel::words::Show;

/// Value of `product` in a set.
pub(super) const SET: &str = "set";

/// A set, as written and checked; its jobs are read when they are due, since one may need what another makes.
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
    /// Name of the member, and of its dataset's folder within that of the set.
    pub name: String,
    /// Job file, with the settings laid over it.
    pub text: JobText,
    /// Product of the job.
    pub product: Product,
    /// Datasets that it reads: names of jobs before it, by the section of its job file that names a dataset.
    pub inputs: BTreeMap<String, String>,
}

impl JobSet {
    /// Whether a job file is a set; its other mistakes are not searched.
    pub fn is_one(text: &JobText) -> bool {
        product_word(text).is_some_and(|word| word == SET)
    }

    /// Reads a set and the texts of its jobs. Overrides of `text` go to every job, those that begin with a job's name and a
    /// colon (`patches:render.colour=false`) to that one alone.
    ///
    /// # Errors
    /// Every mistake of the file; those of its jobs are found when these are read.
    pub fn read(text: &JobText) -> Result<Self, FormErrors> {
        let (document, syntax) = Document::read(&text.label, &text.text, &[]);
        let checker = Checker::new(document.named(decode::NAME), syntax);
        let (spec, mut checker) = checker.decode::<SetSpec>(schema::of_sets(), &SetHints)?;
        let jobs = members(&mut checker, &spec, text);
        checker.finish()?;
        let file_name = FilePath::new(&text.label).file_stem().map(|stem| stem.to_string_lossy().into_owned());
        Ok(Self { name: spec.name.or(file_name).unwrap_or_else(|| SET.to_owned()), jobs })
    }
}

/// The jobs without mistakes.
fn members(checker: &mut Checker, spec: &SetSpec, text: &JobText) -> Vec<SetMember> {
    let mut jobs: Vec<SetMember> = Vec::new();
    let names: Vec<&str> = spec.jobs.iter().map(|job| job.name.as_str()).collect();
    for (index, member) in spec.jobs.iter().enumerate() {
        let path = Path::from("jobs").index(index);
        let name = &member.name;
        if !SetEntry::is_name(name) {
            let report = checker.invalid(path.key("name"), "small letters, digits, - and _", format!("\"{name}\""));
            report.help("it is the folder of the dataset");
        } else if names[..index].contains(&name.as_str()) {
            checker.invalid(path.key("name"), "a name that no other job has", format!("\"{name}\""));
        }
        let overrides =
            member.set.iter().cloned().chain(overrides_of(name, &names, &text.overrides)).collect::<Vec<_>>();
        let file = text.folder.join(&member.job);
        let job = match JobText::open(&file, &overrides) {
            Ok(job) => job,
            Err(error) => {
                checker.not_found(path.key("job"), "job file", format!("{}: {error}", file.shown()));
                continue;
            }
        };
        let Some(product) = product_of(checker, &path, &job) else { continue };
        // A job with a mistake is still in the list.
        let is_wrong = |(index, job): (usize, &MemberSpec)| {
            member.inputs.values().any(|input| *input == job.name) && checker.is_wrong(Path::from("jobs").index(index))
        };
        if !spec.jobs[..index].iter().enumerate().any(is_wrong) {
            check_inputs(checker, &path, member, product, &jobs);
        }
        jobs.push(SetMember { name: name.clone(), text: job, product, inputs: member.inputs.clone() });
    }
    jobs
}

/// The product of a job of a set; a misspelt one is reported when the job itself is read.
fn product_of(checker: &mut Checker, path: &Path, job: &JobText) -> Option<Product> {
    match product_word(job) {
        Some(word) if word == SET => {
            let found = format!("{}, a set", job.label);
            checker.invalid(path.key("job"), "a job of one product", found).help("name its jobs here instead");
            None
        }
        Some(word) => Some(Product::from_name(&word).unwrap_or(PRODUCTS[0].product)),
        None => Some(PRODUCTS[0].product),
    }
}

/// Checks that each input of a job is one that its product reads, and the name of a job further up that makes such a dataset.
fn check_inputs(checker: &mut Checker, path: &Path, member: &MemberSpec, product: Product, before: &[SetMember]) {
    let path = path.key("inputs");
    let known = factory_of(product).inputs;
    for (section, wanted) in &member.inputs {
        let path = path.key(section);
        let Some(InputDataset { product: made, .. }) = known.iter().find(|input| input.section == section) else {
            let because = format!("a job of product {product} reads no dataset in its section `{section}`");
            checker
                .contradiction(path, "job", because)
                .help_if(did_you_mean(section, known.iter().map(|input| input.section)));
            continue;
        };
        let names = before.iter().filter(|job| job.product == *made).map(|job| job.name.as_str());
        if !names.clone().any(|name| name == wanted) {
            let detail = format!("`{wanted}` among the jobs further up");
            checker.not_found(path, format!("job for {made}"), detail).help_if(did_you_mean(wanted, names));
        }
    }
}

/// Hints for the keys of a set.
struct SetHints;

impl Hints for SetHints {
    fn missing(&self, _: &Path) -> Option<(Requirement, String)> {
        None
    }

    /// Reports where the name of an input belongs.
    fn unknown_key(&self, _: &Path, key: &str) -> Option<String> {
        let mut inputs = PRODUCTS.iter().flat_map(|factory| factory.inputs);
        inputs.any(|input| input.section == key).then(|| format!("write `inputs = {{ {key} = \"NAME\" }}`"))
    }
}

/// Overrides of the set that go to the job of this name.
fn overrides_of<'a>(name: &'a str, names: &'a [&str], overrides: &'a [String]) -> impl Iterator<Item = String> + 'a {
    overrides.iter().filter_map(move |setting| {
        // A key of TOML has no colon outside quotes, and no name of a job has quotes.
        match setting.split_once(':').filter(|(job, _)| names.contains(job)) {
            Some((job, setting)) => (job == name).then(|| setting.to_owned()),
            None => Some(setting.clone()),
        }
    })
}

/// The value of `product` in a job file.
fn product_word(text: &JobText) -> Option<String> {
    let (document, _) = Document::read(&text.label, &text.text, &text.overrides);
    document.text("product").map(str::to_owned)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn mistakes(text: &str) -> Vec<String> {
        let text = JobText {
            label: "set.toml".to_owned(),
            folder: concat!(env!("CARGO_MANIFEST_DIR"), "/../../jobs").into(),
            text: format!("product = \"set\"\n{text}"),
            overrides: Vec::new(),
        };
        let errors = JobSet::read(&text).expect_err("mistakes");
        errors.list().iter().map(|error| format!("{} {}", error.key, error.problem.code())).collect()
    }

    const PATCHES: &str =
        "[[jobs]]\nname = \"patches\"\njob = \"ycb-patches.toml\"\ninputs = { grasps = \"grasps\" }\n";

    #[test]
    fn a_wrong_entry_hides_no_other_and_moves_no_index() {
        assert_eq!(
            mistakes(&format!("[[jobs]]\nname = \"a\"\n{PATCHES}")),
            ["jobs[0].job missing", "jobs[1].inputs.grasps not_found"]
        );
    }

    #[test]
    fn a_job_with_a_mistake_is_not_said_to_be_missing() {
        let grasps = "[[jobs]]\nname = \"grasps\"\njob = 3\n";
        assert_eq!(mistakes(&format!("{grasps}{PATCHES}")), ["jobs[0].job wrong_type"]);
    }
}
