//! Verification of a dataset against its manifest: which shard, chunk and sample differs, and how to repair it.

mod report;
mod shards;
mod tables;

pub use report::{Problem, VerifyLevel, VerifyOptions, VerifyProgress, VerifyReport};

use report::whole;
use shards::{Context, check_shards};
use tables::{AssetRows, RowChecks};

use super::finish::root_parts;
use crate::{
    Channel,
    extras::{FileContext, files_of_product},
    storage::{
        DatasetError, DatasetReader, Ledger, Manifest,
        error::REWRITE,
        layout::{ASSETS, MANIFEST, SPLITS},
        reader::read_splits,
        roots::{ClassChannels, Leaf, Roots},
        subjects::{Subjects, asset_names, asset_tree, object_of},
    },
};
use kernel::{
    files::Folder,
    ids::{Digest, ObjectId},
    words::NumberClass,
};

/// Checks a finished dataset; damage is in the report, not an error. Memory: one chunk per thread, 64 bytes per sample and
/// class.
///
/// # Errors
/// When there is no readable manifest, or the operating system refuses to list the folder.
pub fn verify(
    folder: &Folder,
    options: VerifyOptions<'_>,
    mut progress: impl FnMut(&VerifyProgress),
) -> Result<VerifyReport, DatasetError> {
    let manifest = Manifest::read(folder)?;
    let mut problems = tables::check_files(folder, &manifest);
    tables::check_mark(folder, &manifest, &mut problems);
    let assets = tables::read_assets(folder);
    if let Err(what) = &assets {
        problems.push(whole(ASSETS, what.clone(), REWRITE));
    }
    let subjects = assets
        .as_ref()
        .ok()
        .and_then(|rows| asset_names(folder.path(), rows.objects.iter().chain(&rows.subjects)).ok());
    let mut notes = Vec::new();
    tables::check_foreign(folder, &manifest, &mut problems, &mut notes)?;
    tables::check_preview(folder, &mut notes);
    let splits = manifest.product.has_splits.then(|| read_splits(folder)).transpose().unwrap_or_else(|error| {
        problems.push(whole(SPLITS, error.to_string(), REWRITE));
        None
    });
    if let (Some(splits), Ok(assets)) = (&splits, &assets) {
        tables::check_splits(splits, assets, &manifest, &mut problems, &mut notes);
    }

    // Shards are checked on all threads; their ledgers are compared with the tables in order.
    let context = Context { folder, manifest: &manifest, options };
    let of_shards = manifest.shards.len() as u32;
    let mut checked = VerifyProgress { of_shards, ..VerifyProgress::default() };
    let shards = check_shards(&context, |shard| {
        checked.shards += 1;
        checked.samples += shard.samples;
        checked.bytes += shard.bytes;
        progress(&checked);
    });
    let mut leaves = subjects.as_ref().map(|_| Vec::with_capacity(manifest.foreseen()));
    let (mut payloads, mut intact_shards) = (0, 0);
    let mut rows = subjects
        .as_ref()
        .map(|subjects| RowChecks::open(folder, &manifest, (subjects, splits.as_ref()), options.index, &mut problems));
    for shard in shards {
        if let Some(rows) = &mut rows {
            rows.shard(shard.ledger.as_ref());
        }
        payloads += shard.payloads;
        intact_shards += u32::from(shard.problems.is_empty());
        problems.extend(shard.problems);
        leaves = match (leaves, shard.ledger, &subjects) {
            (Some(leaves), Some(ledger), Some(subjects)) => {
                let more = with_leaves_of(leaves, &ledger, &manifest, subjects);
                if more.is_none() {
                    let what = format!("shard {} has samples of subjects that it does not list", ledger.shard.0);
                    problems.push(whole(ASSETS, what, REWRITE));
                }
                more
            }
            _ => None,
        };
    }
    if let (Some(rows), Ok(assets)) = (rows, &assets) {
        problems.extend(rows.finish(assets));
    }

    // Files that only this product has, and the roots over everything.
    let shards_intact = intact_shards == of_shards;
    check_extra_files(&context, assets.as_ref().ok(), shards_intact, &mut problems);
    let calculated = match (leaves, &subjects, &assets, root_parts(folder, manifest.product)) {
        (Some(leaves), Some(subjects), Ok(assets), Ok(files)) => {
            check_root(&manifest, leaves, subjects, assets, &files, &mut problems)
        }
        _ => None,
    };
    if calculated.is_none() && problems.is_empty() {
        let what = "its root cannot be calculated: a table lists a subject twice, or lacks the subject of a sample";
        problems.push(whole(ASSETS, what.to_owned(), REWRITE));
    }
    let product = manifest.product;
    Ok(VerifyReport { product, saved: manifest.root, calculated, checked, payloads, intact_shards, problems, notes })
}

/// Checks the files that only the dataset's product has.
fn check_extra_files(
    context: &Context<'_>,
    assets: Option<&AssetRows>,
    shards_intact: bool,
    problems: &mut Vec<Problem>,
) {
    let Context { folder, manifest, options } = context;
    if manifest.product.files.is_empty() {
        return;
    }
    let ids = |rows: &[serde_json::Value]| rows.iter().filter_map(object_of).collect::<Vec<ObjectId>>();
    let reader = DatasetReader::open(folder).ok();
    let file_context = FileContext {
        folder,
        manifest,
        reader: reader.as_ref(),
        objects: &assets.map_or_else(Vec::new, |rows| ids(&rows.objects)),
        hands: &assets.map_or_else(Vec::new, |rows| ids(&rows.hands)),
        shards_intact,
        full: options.level == VerifyLevel::Full,
    };
    for file in files_of_product(manifest.product) {
        problems.extend((file.check)(&file_context).into_iter().map(|what| whole(file.name, what, REWRITE)));
    }
}

/// The roots from the ledgers' rows, compared with the manifest's; `None` if a sample is listed twice.
fn check_root(
    manifest: &Manifest,
    leaves: Vec<Leaf>,
    subjects: &Subjects,
    assets: &AssetRows,
    files: &[(&str, Digest)],
    problems: &mut Vec<Problem>,
) -> Option<Digest> {
    match Roots::new(leaves, &classes_of(&manifest.channels(), manifest), subjects) {
        Ok(roots) => {
            let AssetRows { objects, subjects, hands, containers, .. } = assets;
            let assets = asset_tree(objects.iter().chain(subjects).chain(hands).chain(containers));
            let root = roots.dataset(&assets, files, &manifest.job);
            compare_roots(manifest, &roots, &root, problems);
            Some(root)
        }
        Err(error) => {
            problems.push(whole(MANIFEST, error.to_string(), REWRITE));
            None
        }
    }
}

/// The class of each of a ledger's channels, from the manifest.
fn classes_of(channels: &[Channel], manifest: &Manifest) -> ClassChannels {
    let main = manifest.class_of(manifest.product.leading()).unwrap_or(NumberClass::Exact);
    ClassChannels::new(channels, main, |channel| manifest.class_of(channel).unwrap_or(main))
}

/// Takes the rows of a ledger; `None` when the subject of one is unknown.
fn with_leaves_of(
    mut leaves: Vec<Leaf>,
    ledger: &Ledger,
    manifest: &Manifest,
    subjects: &Subjects,
) -> Option<Vec<Leaf>> {
    let channels = classes_of(&ledger.channels, manifest);
    for row in &ledger.rows {
        let (rank, _, _) = subjects.get(&row.sample.subject)?;
        leaves.extend(Leaf::of_row(*rank, row, &channels));
    }
    Some(leaves)
}

/// The root over all, and that of each class.
fn compare_roots(manifest: &Manifest, roots: &Roots, root: &Digest, problems: &mut Vec<Problem>) {
    let mut compare = |what: &str, saved: &Digest, calculated: Option<&Digest>| {
        if calculated != Some(saved) {
            let calculated = calculated.map_or_else(|| "none".to_owned(), Digest::short);
            let what = format!("{what}: saved {}, calculated {calculated}", saved.short());
            problems.push(whole(MANIFEST, what, REWRITE));
        }
    };
    compare("root digest", &manifest.root, Some(root));
    for (class, saved) in &manifest.classes {
        compare(&format!("digest of class {}", class.name()), saved, roots.classes.get(class));
    }
}
