//! Reads a dataset of completion pairs: its manifest, its splits, its samples in random order, and one sample by its id.
//!
//! From the root of the repository:
//!
//! ```text
//! cargo run --release --example read                          # makes a small dataset first
//! cargo run --release --example read -- datasets/quickstart
//! ```

#![expect(clippy::print_stdout, reason = "an example prints what it reads")]

mod support;

use std::{collections::BTreeMap, env, error::Error};

use graspmill::read::{DatasetReader, Folder, Selection, Split, VoxelPair};

/// Pairs of four built-in shapes, 6 views of each.
const JOB: &str = r#"
objects = [{ built_in = ["bottle-01", "bowl-01", "can-01", "cup-01"] }]
views = { even = 6 }
split = { validation_objects = 1, test_objects = 1 }
"#;

fn main() -> Result<(), Box<dyn Error>> {
    let folder = match env::args_os().nth(1) {
        Some(folder) => Folder::at(folder),
        None => {
            let folder = support::fresh_folder("read")?;
            support::make_dataset(JOB, &folder)?;
            folder
        }
    };

    let reader = DatasetReader::open(&folder)?;
    let manifest = reader.manifest();
    let (kept, product) = (manifest.counts.kept, manifest.product);
    println!(
        "{}: {kept} {}, {product}, root {}",
        folder.path().display(),
        product.samples.for_count(kept),
        manifest.root
    );
    for split in Split::ALL {
        println!("{:>10}: {} samples", split.name(), reader.indices(Selection::from_split(split)).count());
    }

    // Samples know their object by its digest; the asset table has the names.
    let assets = reader.assets()?;
    let names: BTreeMap<_, _> = assets.objects.iter().map(|row| (row.object, row.name.as_str())).collect();

    // An epoch in random order: every sample once. The seed fixes the order.
    for sample in reader.shuffled(Selection::from_split(Split::Training), 1).take(5) {
        let sample = sample?;
        let pair = sample.read::<VoxelPair>()?;
        println!(
            "{}, view {}: the camera saw {} of {} cells, each {:.1} mm wide",
            names[&sample.id.subject],
            sample.id.item,
            pair.both_cells,
            pair.complete_cells,
            1000.0 * pair.grid.cell_size
        );
    }

    // The id of a sample is the same in every dataset that has it.
    let index = reader.indices(Selection::default()).next().ok_or("the dataset is empty")?;
    let id = reader.id(index).ok_or("a sample has an id")?;
    let sample = reader.sample_of(&id)?.ok_or("the sample is kept")?;
    println!("{id} is sample {} here", sample.index);
    Ok(())
}
