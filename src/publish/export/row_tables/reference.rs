//! docs/tables.md compared with the declarations of the tables: the tables of each product, and all columns.

use std::fs;

use super::{
    FORMAT,
    bodies::BodyRow,
    column::{RowColumn, sample_columns},
    grasps, heatmaps, objects, pairs, patches, pick_trials, picks, poses,
    row_table::TableRow,
    scenes::{self, SceneRow},
    series, suction, touch, trials, views, volumes,
};
use format::Product;
use tables::ColumnType;

/// End of the hand-written part of the page.
const MARK: &str = "<!-- From here on printed from the declarations of the tables. -->\n";

/// A table in the page.
struct Table {
    name: &'static str,
    products: Vec<Product>,
    section: String,
}

/// Text of a type in the page.
fn type_in_words<R>(column: &RowColumn<R>) -> String {
    let kind = match column.kind {
        ColumnType::Text => "text",
        ColumnType::Boolean => "bool",
        ColumnType::U32 => "u32",
        ColumnType::U64 => "u64",
        ColumnType::F64 => "f64",
        ColumnType::Bytes | ColumnType::Digest => "bytes",
        ColumnType::F64s => "list of f64",
        ColumnType::Texts => "list of text",
    };
    if column.optional { format!("{kind}, or none") } else { kind.to_owned() }
}

/// The rows of some columns.
fn rows<'c, R: 'c>(columns: impl IntoIterator<Item = &'c RowColumn<R>>) -> String {
    let row =
        |column: &RowColumn<R>| format!("| `{}` | {} | {} |\n", column.name, type_in_words(column), column.meaning);
    let rows: String = columns.into_iter().map(row).collect();
    format!("| column | type | content |\n| --- | --- | --- |\n{rows}")
}

/// A table, with the products whose datasets have it.
fn table<R: TableRow>(products: &[Product]) -> Table {
    let mut columns: Vec<RowColumn<R>> = Vec::new();
    for product in products {
        for column in R::columns(*product) {
            if columns.iter().all(|known| known.name != column.name) {
                columns.push(column);
            }
        }
    }
    let named: Vec<&str> = sample_columns::<SceneRow>().iter().map(|column| column.name).collect();
    let names_sample = columns.iter().take(named.len()).map(|column| column.name).eq(named.iter().copied());
    let own = &columns[if names_sample { named.len() } else { 0 }..];
    let section = format!("## {}.parquet\n\n{}\n\n{}", R::TABLE.name, R::TABLE.meaning, rows(own));
    Table { name: R::TABLE.name, products: products.to_vec(), section }
}

/// Every table, in the order of the page.
fn all_tables() -> Vec<Table> {
    const OF_SCENES: [Product; 4] = [Product::SCENES, Product::VOLUMES, Product::PICKS, Product::SUCTION];
    let of_objects: Vec<Product> = Product::all().filter(|product| *product != Product::REACHABILITY).collect();
    let pairs = [Product::COMPLETION, Product::AMODAL];
    vec![
        table::<objects::ObjectRow>(&of_objects),
        table::<pairs::PairRow>(&pairs),
        table::<touch::ContactRow>(&pairs),
        table::<touch::ApproachRow>(&pairs),
        table::<touch::BlockedRow>(&[Product::AMODAL]),
        table::<grasps::RunRow>(&[Product::GRASPS]),
        table::<grasps::GraspRow>(&[Product::GRASPS]),
        table::<grasps::ContactRow>(&[Product::GRASPS]),
        table::<trials::TrialRow>(&[Product::GRASPS]),
        table::<series::SeriesRow>(&[Product::GRASPS]),
        table::<patches::PatchRow>(&[Product::PATCHES]),
        table::<poses::PositionRow>(&[Product::REACHABILITY]),
        table::<poses::PoseRow>(&[Product::REACHABILITY]),
        table::<scenes::SceneRow>(&[Product::SCENES]),
        table::<BodyRow>(&OF_SCENES),
        table::<scenes::ContactRow>(&[Product::SCENES]),
        table::<scenes::SupportRow>(&[Product::SCENES]),
        table::<views::ViewRow>(&[Product::VIEWS]),
        table::<views::InstanceRow>(&[Product::VIEWS]),
        table::<volumes::VolumeRow>(&[Product::VOLUMES]),
        table::<volumes::FusedRow>(&[Product::VOLUMES]),
        table::<volumes::GraspRow>(&[Product::VOLUMES]),
        table::<picks::PickRow>(&[Product::PICKS]),
        table::<picks::CandidateRow>(&[Product::PICKS]),
        table::<pick_trials::TrialRow>(&[Product::PICKS]),
        table::<pick_trials::TouchRow>(&[Product::PICKS]),
        table::<pick_trials::PressedRow>(&[Product::PICKS]),
        table::<pick_trials::NeighbourRow>(&[Product::PICKS]),
        table::<heatmaps::HeatmapRow>(&[Product::HEATMAPS]),
        table::<heatmaps::MarkRow>(&[Product::HEATMAPS]),
        table::<heatmaps::ForbiddenRow>(&[Product::HEATMAPS]),
        table::<suction::SuctionRow>(&[Product::SUCTION]),
        table::<suction::PoseRow>(&[Product::SUCTION]),
    ]
}

/// The part of the page after its mark.
fn printed() -> String {
    let tables = all_tables();
    let mut text = "\n## Tables of each product\n\n| product | tables |\n| --- | --- |\n".to_owned();
    for product in Product::all() {
        let of_product = tables.iter().filter(|table| table.products.contains(&product));
        let names: Vec<String> = of_product.map(|table| format!("`{}`", table.name)).collect();
        text.push_str(&format!("| {product} | {} |\n", names.join(", ")));
    }
    let sample = rows(&sample_columns::<SceneRow>());
    text.push_str(&format!("\n## Columns of every table but objects.parquet\n\n{sample}"));
    tables.iter().for_each(|table| text.push_str(&format!("\n{}", table.section)));
    text
}

#[test]
fn the_page_lists_every_table_and_column() {
    let page = concat!(env!("CARGO_MANIFEST_DIR"), "/../../docs/tables.md");
    let text = fs::read_to_string(page).expect("the page");
    let (intro, found) = text.split_once(MARK).expect("the page has its mark");
    let expected = printed();
    if found != expected {
        let fresh = std::env::temp_dir().join("tables.md");
        fs::write(&fresh, format!("{intro}{MARK}{expected}")).expect("the scratch file is written");
        panic!("docs/tables.md is out of date: copy {} over it", fresh.display());
    }
}

#[test]
fn every_product_has_tables_whose_columns_have_names_of_their_own() {
    for product in Product::all() {
        assert!(FORMAT.form(product).is_some(), "{product} has no tables");
        assert!(all_tables().iter().any(|table| table.products.contains(&product)), "{product} has no table");
    }
    for table in all_tables() {
        let mut names: Vec<&str> =
            table.section.lines().filter_map(|line| line.strip_prefix("| `")?.split('`').next()).collect();
        let count = names.len();
        names.sort_unstable();
        names.dedup();
        assert_eq!(names.len(), count, "{}: a column is listed twice", table.name);
    }
}

#[test]
fn every_fact_of_a_product_has_a_column() {
    fn names<R: TableRow>(product: Product) -> Vec<&'static str> {
        R::columns(product).iter().map(|column| column.name).collect()
    }
    for product in Product::all() {
        let columns = match product {
            Product::COMPLETION | Product::AMODAL => names::<pairs::PairRow>(product),
            Product::GRASPS => names::<grasps::RunRow>(product),
            Product::PATCHES => names::<patches::PatchRow>(product),
            Product::REACHABILITY => names::<poses::PositionRow>(product),
            Product::SCENES => names::<scenes::SceneRow>(product),
            Product::VIEWS => names::<views::ViewRow>(product),
            Product::VOLUMES => names::<volumes::VolumeRow>(product),
            Product::PICKS => names::<picks::PickRow>(product),
            Product::SUCTION => names::<suction::SuctionRow>(product),
            _ => names::<heatmaps::HeatmapRow>(product),
        };
        for fact in product.facts {
            assert!(columns.contains(&fact.name), "{product}: no column of {}", fact.name);
        }
    }
}
