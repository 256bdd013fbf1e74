//! Facts of touch by kind, over several samples of a dataset.

use std::{collections::BTreeMap, fmt};

use serde::{Deserialize, Serialize};

use crate::{
    chart::{grouped, percent},
    numbers::NumberRow,
    tally::Spread,
};
use format::{
    ApproachEnd, Channel, TactileContacts, TouchedPair,
    dataset::{DatasetError, DatasetReader, Selection},
};
use kernel::ids::SampleIndex;

/// Facts of touch, over several stored samples.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct TouchFacts {
    /// Samples evaluated, spread evenly over the dataset: all, or [`TouchFacts::MAX`].
    pub samples: u64,
    /// One row per stored kind, in the order of their channels.
    pub kinds: Vec<TouchKind>,
    /// Cells with a contact of any kind.
    pub cells: u64,
    /// Touched cells that are also observed.
    pub cells_in_partial: u64,
}

/// One kind of touch.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct TouchKind {
    /// Name of the channel.
    pub channel: String,
    /// Rays, or approaches of a hand.
    pub probes: u64,
    /// Contacts of all samples.
    pub contacts: u64,
    /// Contacts visible to the camera.
    pub visible: u64,
    /// Contacts outside the grid.
    pub outside: u64,
    /// Probes that something else stopped; `None` for single objects.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub blocked: Option<u64>,
    /// Forces and gaps at a hand's contacts; `None` without a hand.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub hand: Option<HandFacts>,
}

/// Forces and gaps at a hand's contacts.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct HandFacts {
    /// The hand's name.
    pub hand: String,
    /// Forces of the contacts, along their normals [N].
    pub force: Spread,
    /// Gaps between mesh and links at the contacts [m], negative where a link presses in.
    pub gap: Spread,
    /// Approaches by their end.
    pub ends: BTreeMap<String, u64>,
}

/// Sums of one kind of touch during the pass.
#[derive(Default)]
struct KindSums {
    facts: TouchKind,
    forces: Vec<f64>,
    gaps: Vec<f64>,
}

impl KindSums {
    fn of_channel(channel: Channel) -> Self {
        let blocked = channel.is_touch_in_clutter().then_some(0);
        Self { facts: TouchKind { blocked, ..TouchKind::default() }, ..Self::default() }
    }

    fn add(&mut self, touch: &TactileContacts) {
        let Self { facts, forces, gaps } = self;
        facts.probes += u64::from(touch.probes);
        facts.contacts += touch.contacts.len() as u64;
        facts.visible += u64::from(touch.visible());
        facts.outside += u64::from(touch.outside());
        if let Some(blocked) = &mut facts.blocked {
            *blocked += touch.blocked.len() as u64;
        }
        let Some(hand) = &touch.hand else { return };
        forces.extend(hand.contacts.iter().map(|contact| f64::from(contact.force)));
        gaps.extend(hand.contacts.iter().map(|contact| f64::from(contact.gap)));
        // Nothing blocks the probes of a single object.
        let ends = ApproachEnd::ALL.into_iter().filter(|end| *end != ApproachEnd::Blocked || facts.blocked.is_some());
        let none = ends.map(|end| (end.name().to_owned(), 0)).collect();
        let of_hand = facts.hand.get_or_insert_with(|| HandFacts { ends: none, ..HandFacts::default() });
        of_hand.hand.clone_from(&hand.hand);
        for approach in &hand.approaches {
            *of_hand.ends.entry(approach.end.name().to_owned()).or_default() += 1;
        }
    }

    fn facts(self, channel: Channel) -> TouchKind {
        let Self { facts, forces, gaps } = self;
        let hand = facts.hand.map(|hand| HandFacts { force: Spread::of(forces), gap: Spread::of(gaps), ..hand });
        TouchKind { channel: channel.name().to_owned(), hand, ..facts }
    }
}

impl TouchFacts {
    /// Maximum number of evaluated samples, which must be read and decoded.
    pub const MAX: u64 = 2000;

    /// Reads the samples of a dataset; `None` if no touch is stored.
    pub(crate) fn of(reader: &DatasetReader) -> Result<Option<Self>, DatasetError> {
        let channels = reader.manifest().channels().into_iter().filter(|channel| channel.is_touch());
        let mut sums: BTreeMap<Channel, KindSums> =
            channels.map(|channel| (channel, KindSums::of_channel(channel))).collect();
        if sums.is_empty() {
            return Ok(None);
        }
        let kept: Vec<SampleIndex> = reader.indices(Selection::default()).collect();
        let count = kept.len().min(Self::MAX as usize);
        let mut facts = Self::default();
        for index in 0..count {
            let sample = reader.sample(kept[index * kept.len() / count])?;
            if let Some(touched) = sample.map_or(Ok(None), |sample| sample.touched())? {
                facts.add(&touched);
                for (channel, touch) in &touched.touch {
                    sums.entry(*channel).or_default().add(touch);
                }
            }
        }
        facts.kinds = sums.into_iter().map(|(channel, sums)| sums.facts(channel)).collect();
        Ok(Some(facts))
    }

    fn add(&mut self, touched: &TouchedPair) {
        self.samples += 1;
        self.cells += u64::from(touched.tactile.count());
        self.cells_in_partial += u64::from(touched.tactile.count_both(&touched.pair.partial));
    }

    /// Contacts of all kinds.
    pub fn contacts(&self) -> u64 {
        self.kinds.iter().map(|kind| kind.contacts).sum()
    }

    /// Contacts per sample of each kind.
    pub(crate) fn number_rows(&self) -> impl Iterator<Item = NumberRow> {
        self.kinds.iter().map(|kind| {
            let what = format!("contacts per sample, {}", kind.channel.replace('_', " "));
            NumberRow::new(what, format!("{:.1}", Self::share(kind.contacts, self.samples)))
        })
    }

    /// A count as a share of another; 0 of nothing.
    pub fn share(count: u64, of: u64) -> f64 {
        if of > 0 { count as f64 / of as f64 } else { 0.0 }
    }
}

impl fmt::Display for TouchFacts {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { samples, kinds, cells, cells_in_partial } = self;
        let each = |count: u64| Self::share(count, *samples);
        let share = |count: u64, of: u64| percent(Self::share(count, of));
        writeln!(f, "\ntouch, over {} samples", grouped(*samples))?;
        for TouchKind { channel, probes, contacts, visible, outside, blocked, hand } in kinds {
            let by = hand.as_ref().map_or_else(String::new, |hand| format!(" by {}", hand.hand));
            let word = if hand.is_some() { "approaches" } else { "probes" };
            write!(f, "  {channel}{by}: {:.1} contacts of {:.1} {word} per sample", each(*contacts), each(*probes))?;
            match hand {
                Some(_) => writeln!(f, ", {:.1} per approach", Self::share(*contacts, *probes))?,
                None => writeln!(f)?,
            }
            if let Some(blocked) = blocked {
                writeln!(f, "    {:.1} per sample stopped by something other than the body", each(*blocked))?;
            }
            let hidden = contacts - visible;
            write!(f, "    {} of the contacts visible to the camera,  ", share(*visible, *contacts))?;
            writeln!(f, "{} hidden, {} outside the grid", share(hidden, *contacts), share(*outside, *contacts))?;
            hand.iter().try_for_each(|hand| hand.write(f))?;
        }
        write!(
            f,
            "  {:.1} touched cells per sample, {} of them also observed",
            each(*cells),
            share(*cells_in_partial, *cells)
        )
    }
}

impl HandFacts {
    fn write(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { hand: _, force, gap, ends } = self;
        let millimetres = [gap.median, gap.min, gap.max].map(|gap| format!("{:.3}", 1e3 * gap));
        let [median, deepest, widest] = &millimetres;
        write!(f, "    forces: median {:.2} N, maximum {:.2} N;  ", force.median, force.max)?;
        writeln!(f, "gaps: median {median} mm, from {deepest} to {widest}")?;
        // In the order of their numbers, not of their names.
        let ended = ApproachEnd::ALL.into_iter().filter_map(|end| {
            let none = (end != ApproachEnd::Blocked).then_some(0);
            let count = ends.get(end.name()).copied().or(none)?;
            Some(format!("{} {}", grouped(count), end.name().replace('_', " ")))
        });
        writeln!(f, "    approaches: {}", ended.collect::<Vec<String>>().join(", "))
    }
}
