//! The documents of a release for people: card, datasheet, licences and citation, as input of their templates.

use serde::Serialize;

use super::{
    About, Author,
    licences::{self, AttributionView, CountView, LicenceRow, NoteView},
    material::Release,
    rights,
};
use crate::{
    chart::grouped,
    markup::Markup,
    numbers::{NumberRow, SplitCounts},
    product::ProductPages,
    products::pages_of,
    templates::PageTemplates,
};
use format::{
    Product,
    dataset::{Manifest, layout},
};
use kernel::words::{NumberClass, size_in_words};

/// Templates of the documents.
pub(crate) static TEMPLATES: PageTemplates = PageTemplates::new(&[
    ("release/CITATION.cff", include_str!("../templates/release/CITATION.cff")),
    ("release/DATASHEET.md", include_str!("../templates/release/DATASHEET.md")),
    ("release/LICENCES.md", include_str!("../templates/release/LICENCES.md")),
    ("release/README.md", include_str!("../templates/release/README.md")),
    ("release/citation.bib", include_str!("../templates/release/citation.bib")),
    ("release/front_matter.yaml", include_str!("../templates/release/front_matter.yaml")),
]);

/// Licences for which Hugging Face has its own names, besides Creative Commons licences.
const HUB_LICENCES: [&str; 8] =
    ["apache-2.0", "bsd-2-clause", "bsd-3-clause", "cc0-1.0", "mit", "odbl", "odc-by", "pddl"];

/// Content of the documents.
#[derive(Serialize)]
pub(super) struct Documents<'a> {
    about: AboutView<'a>,
    dataset: DatasetView<'a>,
    product: ProductView,
    numbers: NumbersView<'a>,
    counts: CountsView,
    licences: LicencesView,
    citation: CitationView<'a>,
    /// Files left out; `None` if all are included.
    recipe: Option<RecipeView<'a>>,
    pictures: Vec<PictureView<'a>>,
    legend: &'static str,
    outside: OutsideView<'a>,
    platform: Vec<PlatformRow<'a>>,
    has_report: bool,
    has_preview: bool,
    needs_packages: bool,
    /// Topic of the samples.
    topic: &'a str,
    /// Hugging Face's name of the licence; `None` if it has none.
    hub_licence: Option<Markup>,
    tags: Vec<&'a str>,
    /// Hugging Face's category of size.
    size: Markup,
}

impl<'a> Documents<'a> {
    pub fn of(release: &'a Release) -> Self {
        let (about, manifest) = (release.about, release.manifest);
        let numbers = NumbersView::of(release);
        Self {
            about: AboutView::of(about),
            dataset: DatasetView::of(manifest, &release.numbers.headline),
            product: ProductView::of(pages_of(manifest.product)),
            counts: CountsView::of(manifest, &numbers.splits),
            numbers,
            licences: LicencesView::of(release),
            citation: CitationView::of(about),
            recipe: RecipeView::of(release),
            pictures: release.pictures.iter().map(|(path, caption)| PictureView { path, caption }).collect(),
            legend: pages_of(manifest.product).words.legend,
            outside: OutsideView::of(release),
            platform: manifest.platform.iter().map(|(name, value)| PlatformRow { name, value }).collect(),
            has_report: release.files.contains_key("report.html"),
            has_preview: release.files.contains_key(layout::PREVIEW),
            needs_packages: release.assets.iter().any(|asset| asset.source.starts_with("package ")),
            topic: manifest.topics.first().map(String::as_str).unwrap_or_default(),
            hub_licence: hub_licence(&about.licence).map(Markup),
            tags: tags(about, manifest.product),
            size: Markup(size(manifest.counts.samples).to_owned()),
        }
    }

    /// `README.md`: the dataset's card, with the front matter that Hugging Face reads.
    pub fn card(&self) -> String {
        TEMPLATES.render("release/README.md", self)
    }

    /// `DATASHEET.md`: answers to the questions of Gebru et al., "Datasheets for Datasets" (2021), in their seven sections;
    /// numbers are measured, and other answers come from the authors.
    pub fn datasheet(&self) -> String {
        TEMPLATES.render("release/DATASHEET.md", self)
    }

    /// `LICENCES.md`: one row per asset.
    pub fn licences(&self) -> String {
        TEMPLATES.render("release/LICENCES.md", self)
    }

    /// `CITATION.cff`, version 1.2.0 of the format.
    pub fn citation(&self) -> String {
        TEMPLATES.render("release/CITATION.cff", self)
    }

    /// A BibTeX entry.
    pub fn bibtex(&self) -> String {
        TEMPLATES.render("release/citation.bib", self).trim_end().to_owned()
    }
}

/// Texts of the release's authors.
#[derive(Serialize)]
struct AboutView<'a> {
    title: &'a str,
    version: &'a str,
    date: &'a str,
    description: &'a str,
    licence: &'a str,
    /// All authors, with names in natural order.
    authors: String,
    url: Option<&'a str>,
    doi: Option<&'a str>,
    /// URLs of the release.
    addresses: Option<String>,
    keywords: &'a [String],
    funding: Option<&'a str>,
    contact: Option<&'a str>,
    maintenance: Option<&'a str>,
    intended_uses: &'a [String],
    out_of_scope_uses: &'a [String],
}

impl<'a> AboutView<'a> {
    fn of(about: &'a About) -> Self {
        let addresses = [about.url.clone(), about.doi.as_ref().map(|doi| format!("https://doi.org/{doi}"))];
        let addresses: Vec<String> = addresses.into_iter().flatten().collect();
        Self {
            title: &about.title,
            version: &about.version,
            date: &about.date,
            description: about.description.trim(),
            licence: &about.licence,
            authors: about.spoken_authors(),
            url: about.url.as_deref(),
            doi: about.doi.as_deref(),
            addresses: (!addresses.is_empty()).then(|| addresses.join(", ")),
            keywords: &about.keywords,
            funding: about.funding.as_deref(),
            contact: about.contact.as_deref(),
            maintenance: about.maintenance.as_deref(),
            intended_uses: &about.intended_uses,
            out_of_scope_uses: &about.out_of_scope_uses,
        }
    }
}

/// Sentences about the product.
#[derive(Serialize)]
struct ProductView {
    labels: &'static str,
    acquisition: &'static str,
    /// Further ways to read a dataset; `None` without any.
    reading: Option<&'static str>,
    /// Recommended number of samples to regenerate.
    regenerated: u32,
    /// Hugging Face's categories of tasks.
    tasks: Vec<Markup>,
}

impl ProductView {
    fn of(pages: &ProductPages) -> Self {
        let words = &pages.words;
        Self {
            labels: words.labels,
            acquisition: words.acquisition,
            reading: (!words.reading.is_empty()).then_some(words.reading),
            regenerated: words.regenerated,
            tasks: words.tasks.iter().map(|task| Markup((*task).to_owned())).collect(),
        }
    }
}

/// The dataset of the release.
#[derive(Serialize)]
struct DatasetView<'a> {
    /// Headline.
    headline: &'a str,
    root: String,
    job: String,
    generator: &'a str,
    format: u32,
    warnings: &'a [String],
}

impl<'a> DatasetView<'a> {
    fn of(manifest: &'a Manifest, headline: &'a str) -> Self {
        Self {
            headline,
            root: manifest.root.to_string(),
            job: manifest.job.to_string(),
            generator: &manifest.generator,
            format: manifest.format_version,
            warnings: &manifest.warnings,
        }
    }
}

/// The measured numbers.
#[derive(Serialize)]
struct NumbersView<'a> {
    lead: &'static str,
    /// Name of the job.
    job: &'a str,
    /// Noun phrase of a sample, also capitalised.
    sample: &'static str,
    capital_sample: String,
    /// Plural noun of the samples.
    samples: &'static str,
    channels: String,
    rows: &'a [NumberRow],
    spreads: Vec<Vec<String>>,
    splits: Vec<SplitRow>,
    counts_objects: bool,
    leaks: &'a [String],
}

/// One split.
#[derive(Serialize)]
struct SplitRow {
    name: &'static str,
    samples: String,
    objects: Option<String>,
}

impl<'a> NumbersView<'a> {
    fn of(release: &'a Release) -> Self {
        let (manifest, numbers) = (release.manifest, release.numbers);
        let words = &pages_of(manifest.product).words;
        let split = |SplitCounts { split, samples, objects }: &SplitCounts| SplitRow {
            name: split.name(),
            samples: grouped(*samples),
            objects: objects.map(grouped),
        };
        let channels: Vec<&str> = manifest.channels().into_iter().map(|channel| channel.name()).collect();
        Self {
            lead: words.lead,
            job: &numbers.job_name,
            sample: words.sample,
            capital_sample: capital(words.sample),
            samples: manifest.product.samples.many,
            channels: channels.join(", "),
            rows: &numbers.rows,
            spreads: numbers.spreads.iter().cloned().map(crate::tally::SpreadRow::into_cells).collect(),
            splits: numbers.splits.iter().map(split).collect(),
            counts_objects: numbers.splits.iter().any(|row| row.objects.is_some()),
            leaks: &numbers.leaks,
        }
    }
}

fn capital(text: &str) -> String {
    let mut letters = text.chars();
    letters.next().map(|first| first.to_uppercase().chain(letters).collect()).unwrap_or_default()
}

/// Counts of the manifest, for the datasheet.
#[derive(Serialize)]
struct CountsView {
    planned: String,
    kept: String,
    bytes: String,
    rejected: String,
    /// Rejects by reason; `None` if none was rejected.
    reasons: Option<String>,
    /// Stored samples by split; `None` without splits.
    splits: Option<String>,
    classes: String,
    /// Whether all numbers are of class `exact`.
    is_exact: bool,
    /// Meshes that could not be used; `None` if all could.
    refused: Option<String>,
}

impl CountsView {
    fn of(manifest: &Manifest, splits: &[SplitRow]) -> Self {
        let counts = &manifest.counts;
        let reasons: Vec<String> =
            counts.rejected.iter().map(|(reason, count)| format!("{} ({reason})", grouped(*count))).collect();
        let splits: Vec<String> = splits.iter().map(|row| format!("{} {}", row.name, row.samples)).collect();
        let classes: Vec<&str> = manifest.classes.keys().map(|class| class.name()).collect();
        Self {
            planned: grouped(counts.samples),
            kept: grouped(counts.kept),
            bytes: size_in_words(manifest.shards.iter().map(|shard| shard.bytes).sum()),
            rejected: grouped(counts.rejected.values().sum()),
            reasons: (!reasons.is_empty()).then(|| reasons.join(", ")),
            splits: (!splits.is_empty()).then(|| splits.join(", ")),
            classes: classes.join(" and "),
            is_exact: manifest.classes.keys().all(|class| *class == NumberClass::Exact),
            refused: (counts.refused_meshes > 0).then(|| grouped(counts.refused_meshes)),
        }
    }
}

/// Assets and their licences.
#[derive(Serialize)]
struct LicencesView {
    rows: Vec<LicenceRow>,
    counts: Vec<CountView>,
    attributions: Vec<AttributionView>,
    notes: Vec<NoteView>,
}

impl LicencesView {
    fn of(release: &Release) -> Self {
        Self {
            rows: release.assets.iter().map(LicenceRow::of).collect(),
            counts: licences::counts(release.assets),
            attributions: licences::attributions(release.assets),
            notes: licences::notes(release),
        }
    }
}

/// Parts of a citation.
#[derive(Serialize)]
struct CitationView<'a> {
    /// Key of the BibTeX entry: letters and digits.
    key: String,
    year: &'a str,
    authors: Vec<AuthorView<'a>>,
    /// The licence, if there is only one.
    licence: Option<&'static str>,
    /// Licences to choose from; empty if two apply at once.
    licences: Vec<&'static str>,
}

/// An author.
#[derive(Serialize)]
struct AuthorView<'a> {
    is_person: bool,
    name: &'a str,
    family: &'a str,
    given: &'a str,
    orcid: Option<&'a str>,
    affiliation: Option<&'a str>,
}

impl<'a> CitationView<'a> {
    fn of(about: &'a About) -> Self {
        let year = &about.date[..4];
        let key: String = about.title.chars().filter(char::is_ascii_alphanumeric).take(24).collect();
        let licences = if rights::is_choice(&about.licence) { rights::names(&about.licence) } else { Vec::new() };
        Self {
            key: format!("{key}{year}"),
            year,
            authors: about.authors.iter().map(AuthorView::of).collect(),
            licence: if let [licence] = licences.as_slice() { Some(licence) } else { None },
            licences,
        }
    }
}

impl<'a> AuthorView<'a> {
    fn of(author: &'a Author) -> Self {
        let (family, given) = author.person().unwrap_or_default();
        Self {
            is_person: author.person().is_some(),
            name: &author.name,
            family,
            given,
            orcid: author.orcid.as_deref(),
            affiliation: author.affiliation.as_deref(),
        }
    }
}

/// Files left out.
#[derive(Serialize)]
struct RecipeView<'a> {
    files: String,
    bytes: String,
    assets: Vec<LeftOutAsset<'a>>,
}

/// An asset that may not be shipped.
#[derive(Serialize)]
struct LeftOutAsset<'a> {
    name: &'a str,
    because: &'a str,
}

impl<'a> RecipeView<'a> {
    fn of(release: &'a Release) -> Option<Self> {
        let bytes: u64 = release.left_out.iter().map(|file| file.bytes).sum();
        let assets = release.assets.iter().filter(|asset| !asset.is_free());
        (!release.left_out.is_empty()).then(|| Self {
            files: grouped(release.left_out.len() as u64),
            bytes: size_in_words(bytes),
            assets: assets.map(|asset| LeftOutAsset { name: &asset.name, because: asset.because() }).collect(),
        })
    }
}

/// A picture file.
#[derive(Serialize)]
struct PictureView<'a> {
    path: &'a str,
    caption: &'a str,
}

/// Paths of the job that lead out of the folder.
#[derive(Serialize)]
struct OutsideView<'a> {
    paths: Vec<OutsidePath<'a>>,
    /// A key whose path can be replaced.
    setting: Option<&'a str>,
}

/// A key of the job with its first path.
#[derive(Serialize)]
struct OutsidePath<'a> {
    key: &'a str,
    path: &'a str,
    /// Count of further paths; `None` without any.
    more: Option<usize>,
}

impl<'a> OutsideView<'a> {
    fn of(release: &'a Release) -> Self {
        let path = |(key, (path, more)): (&'a String, &'a (String, usize))| OutsidePath {
            key,
            path,
            more: Some(*more).filter(|more| *more > 0),
        };
        Self {
            paths: release.outside.iter().map(path).collect(),
            setting: release.outside.keys().find(|key| !key.starts_with("objects")).map(String::as_str),
        }
    }
}

/// A property of the platform that numbers depend on.
#[derive(Serialize)]
struct PlatformRow<'a> {
    name: &'a str,
    value: &'a str,
}

/// The site has its own names for a few licences, and none for expressions of several.
fn hub_licence(licence: &str) -> Option<String> {
    let lower = licence.to_lowercase();
    let is_creative_commons = lower.starts_with("cc-by") && rights::names(licence).len() == 1;
    (HUB_LICENCES.contains(&lower.as_str()) || is_creative_commons).then_some(lower)
}

fn tags(about: &About, product: Product) -> Vec<&str> {
    let mut tags = vec!["graspmill", "grasping", "simulation", "croissant", "mcap", product.name];
    let more: Vec<&str> = about.keywords.iter().map(String::as_str).filter(|word| !tags.contains(word)).collect();
    tags.extend(more);
    tags
}

fn size(samples: u64) -> &'static str {
    match samples {
        0..1_000 => "n<1K",
        1_000..10_000 => "1K<n<10K",
        10_000..100_000 => "10K<n<100K",
        100_000..1_000_000 => "100K<n<1M",
        1_000_000..10_000_000 => "1M<n<10M",
        10_000_000..100_000_000 => "10M<n<100M",
        _ => "100M<n<1B",
    }
}
