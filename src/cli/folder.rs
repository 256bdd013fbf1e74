//! Folders that hold one dataset, or a set of them.

use format::{
    Product,
    dataset::{Manifest, SetTable},
};
use publish::export::FORMATS;
use runtime::{ReachabilityMap, completion::completable_products};

use super::exit::{Exit, Failure};
use kernel::{files::Folder, words::Show};

/// Commands that accept finished datasets of every product.
const OF_ALL: [&str; 7] = ["inspect", "report", "verify", "diff", "digest", "release", "status"];

/// Refuses the folder of a set where a command requires one dataset.
pub fn refuse_set(folder: &Folder) -> Result<(), Failure> {
    let Some(table) = SetTable::read(folder)? else { return Ok(()) };
    let names: Vec<&str> = table.jobs.iter().map(|job| job.name.as_str()).collect();
    let message =
        format!("{} is a set of datasets; give one of its datasets: {}", folder.path().shown(), names.join(", "));
    Err(Failure::message(Exit::BadSpec, message))
}

/// Refuses a finished dataset of a product that a command does not support.
pub fn refuse_other_products(folder: &Folder, verb: &str, takes: &[Product]) -> Result<(), Failure> {
    let found = Manifest::read(folder)?.product;
    if takes.contains(&found) {
        return Ok(());
    }
    let takes: Vec<&str> = takes.iter().map(|product| product.name).collect();
    let message = format!(
        "{} is a dataset of {found}, but `{verb}` requires a dataset of {}; for {found} use {}",
        folder.path().shown(),
        takes.join(" and "),
        verbs_of(found).join(", ")
    );
    Err(Failure::message(Exit::BadSpec, message))
}

/// Commands that accept finished datasets of a product.
fn verbs_of(product: Product) -> Vec<String> {
    let mut verbs = OF_ALL.map(str::to_owned).to_vec();
    if completable_products().contains(&product) {
        verbs.extend(["complete", "evaluate completion"].map(str::to_owned));
    }
    if product == ReachabilityMap::PRODUCT {
        verbs.push("query reach".to_owned());
    }
    let formats = FORMATS.iter().filter(|format| format.form(product).is_some());
    let formats: Vec<&str> = formats.map(|format| format.name).collect();
    if !formats.is_empty() {
        verbs.push(format!("export --to {}", formats.join("|")));
    }
    verbs
}
