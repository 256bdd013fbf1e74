//! Parts that all pages share, as input of their templates.

use std::collections::BTreeMap;

use serde::Serialize;

use super::{
    chart::{grouped, percent},
    inspection::InspectionHeader,
    notes::Speed,
    picture::{Picture, body_swatch, data_uri},
};
use kernel::words::{NumberClass, Split, counted, is_note, size_in_words};

/// A dataset in the header of its page.
#[derive(Serialize)]
pub(super) struct DatasetView<'a> {
    name: &'a str,
    headline: &'a str,
    root: String,
    generator: &'a str,
    format: u32,
    job: String,
    /// Count and size of the shards.
    shards: String,
    classes: Vec<ClassView>,
    /// Warnings, shown in colour.
    warnings: Vec<&'a str>,
    /// Notes on valid meshes, folded.
    notes: Vec<&'a str>,
    /// Number of the notes, as text.
    notes_counted: String,
    /// Whether the notes are unfolded: few, on a page about the objects themselves.
    opens_notes: bool,
}

/// Maximum number of notes that a page shows unfolded.
const OPEN_NOTES: usize = 4;

/// The digest of a class of numbers.
#[derive(Serialize)]
struct ClassView {
    name: &'static str,
    /// The first few digits.
    digest: String,
}

impl<'a> DatasetView<'a> {
    pub fn of(header: &'a InspectionHeader) -> Self {
        let classes = header.classes.iter();
        let (notes, warnings): (Vec<&str>, Vec<&str>) =
            header.warnings.iter().map(String::as_str).partition(|warning| is_note(warning));
        let class = |(class, digest): (&NumberClass, &kernel::ids::Digest)| ClassView {
            name: class.name(),
            digest: digest.short().to_string(),
        };
        Self {
            name: &header.name,
            headline: &header.headline,
            root: header.root.to_string(),
            generator: &header.generator,
            format: header.format_version,
            job: header.job.to_string(),
            shards: format!("{} · {}", grouped(header.shards), size_in_words(header.shard_bytes)),
            classes: classes.map(class).collect(),
            opens_notes: header.product.subjects_are_objects && notes.len() <= OPEN_NOTES,
            notes_counted: counted(notes.len() as u64, "note"),
            warnings,
            notes,
        }
    }
}

/// Speed of a run.
#[derive(Serialize)]
pub(super) struct SpeedView {
    samples: String,
    /// Noun of the items that the run made.
    what: &'static str,
    seconds: String,
    threads: u32,
    /// Samples per second.
    rate: String,
    /// Peak memory, if known.
    memory: Option<String>,
}

impl SpeedView {
    /// The speed figures of a run; `None` if it stored none.
    pub fn of(header: &InspectionHeader, what: &'static str) -> Option<Self> {
        let speed: &Speed = header.notes.speed.as_ref()?;
        Some(Self {
            samples: grouped(speed.samples),
            what,
            seconds: format!("{:.1}", speed.seconds),
            threads: speed.threads,
            rate: grouped(speed.rate().round() as u64),
            memory: speed.peak_memory.map(size_in_words),
        })
    }
}

/// Rows of counts with their share of all: word, count and share.
pub(super) fn share_rows(counts: &BTreeMap<String, u64>, all: u64) -> Vec<[String; 3]> {
    let share = |count: u64| percent(count as f64 / all.max(1) as f64);
    counts.iter().map(|(word, count)| [word.clone(), grouped(*count), share(*count)]).collect()
}

/// Rows of the splits: name and count.
pub(super) fn split_rows(splits: &BTreeMap<Split, u64>) -> Vec<[String; 2]> {
    splits.iter().map(|(split, count)| [split.name().to_owned(), grouped(*count)]).collect()
}

/// A picture inside a page.
#[derive(Clone, Serialize)]
pub(super) struct ImageView {
    /// Content as a `data:` address.
    uri: String,
    /// Size on the page [px].
    width: u32,
    height: u32,
}

impl ImageView {
    /// A picture, shown `width` x `height` pixels large.
    pub fn of(picture: &Picture, width: u32, height: u32) -> Self {
        Self { uri: picture.to_data_uri(), width, height }
    }

    /// A PNG file of this width and height.
    pub fn of_png(png: &[u8], [width, height]: [u32; 2]) -> Self {
        Self { uri: data_uri(png), width, height }
    }
}

/// A body of a scene in the legend of its pictures.
#[derive(Clone, Serialize)]
pub(super) struct BodyView {
    number: u32,
    /// Colour in instance maps, in CSS notation.
    colour: String,
    name: String,
    /// Facts about it.
    words: String,
}

impl BodyView {
    /// A body by its number, from 1.
    pub fn new(number: u32, name: impl Into<String>, words: String) -> Self {
        // Instance maps have at most 252 bodies.
        let colour = body_swatch(u8::try_from(number).unwrap_or(u8::MAX)).hex();
        Self { number, colour, name: name.into(), words }
    }
}

/// A picture of a card, with its name.
#[derive(Clone, Serialize)]
pub(super) struct PanelView {
    pub image: ImageView,
    name: &'static str,
    hint: String,
}

impl PanelView {
    /// A square picture, shown `side` pixels large.
    pub fn square(picture: &Picture, side: u32, name: &'static str, hint: impl Into<String>) -> Self {
        Self { image: ImageView::of(picture, side, side), name, hint: hint.into() }
    }
}

/// A card of a page in the strip at the top.
pub(super) struct StripCard {
    /// Caption of its pictures.
    pub caption: String,
    /// Pictures of the card, the most informative first.
    pub pictures: Vec<ImageView>,
}

/// A small picture at the top of a page, which links to its card.
#[derive(Serialize)]
pub(super) struct StripPicture {
    image: ImageView,
    caption: String,
    /// Number of the card on the page, from 1.
    card: usize,
}

impl StripPicture {
    /// Maximum number of pictures in a strip.
    pub const MAX: usize = 6;

    /// The strip of a page with these cards, by their numbers from 1: the first picture of cards at even steps; with few cards,
    /// followed by their second pictures, and so on.
    pub fn strip(cards: &[(usize, StripCard)]) -> Vec<Self> {
        let shown = cards.len().min(Self::MAX);
        let even: Vec<&(usize, StripCard)> = (0..shown).map(|step| &cards[step * cards.len() / shown]).collect();
        let rounds = even.iter().map(|(_, card)| card.pictures.len()).max().unwrap_or(0);
        let all = (0..rounds).flat_map(|round| {
            even.iter().filter_map(move |(number, StripCard { caption, pictures })| {
                Some(Self { image: pictures.get(round)?.clone(), caption: caption.clone(), card: *number })
            })
        });
        all.take(Self::MAX).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Numbers of the cards in a strip, for cards with these numbers of pictures.
    fn cards_in_strip(cards: usize, pictures: usize) -> Vec<usize> {
        let image = ImageView::of(&Picture::filled(1, 1, [0; 4]), 1, 1);
        let card = |number| (number, StripCard { caption: String::new(), pictures: vec![image.clone(); pictures] });
        let cards: Vec<(usize, StripCard)> = (1..=cards).map(card).collect();
        StripPicture::strip(&cards).iter().map(|picture| picture.card).collect()
    }

    #[test]
    fn a_strip_shows_different_cards_first() {
        assert_eq!(cards_in_strip(16, 2), [1, 3, 6, 9, 11, 14]);
        assert_eq!(cards_in_strip(4, 4), [1, 2, 3, 4, 1, 2]);
        assert_eq!(cards_in_strip(2, 1), [1, 2]);
        assert_eq!((cards_in_strip(0, 1), cards_in_strip(3, 0)), (vec![], vec![]));
    }
}
