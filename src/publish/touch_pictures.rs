//! Pictures of touch, from behind: touched cells with the observed ones, and contacts on the whole solid.

use crate::picture::{Colour, Picture, VoxelPainter};
use format::{Channel, TactileContacts, TouchedPair};

/// Pictures of the touch of a sample, each with a caption.
pub(crate) struct TouchPictures {
    /// Touched cells over the observed ones.
    pub cells: Picture,
    /// Caption of the touched cells.
    pub cells_hint: String,
    /// The whole solid, a dot at each contact and at each probe that something else stopped.
    pub points: Picture,
    /// Caption of the contacts.
    pub points_hint: String,
}

impl TouchPictures {
    /// Draws the touch of a sample by a painter that looks from behind.
    pub fn of(touched: &TouchedPair, behind: &VoxelPainter) -> Self {
        let TouchedPair { pair, touch, tactile, .. } = touched;
        let mut kinds = Vec::new();
        for (channel, TactileContacts { contacts, .. }) in touch {
            let DotMeaning { colour_name: colour, word, .. } = dot_meaning(*channel);
            kinds.push(format!("{} {word} ({colour})", contacts.len()));
        }
        let count: usize = touch.iter().map(|(_, contacts)| contacts.contacts.len()).sum();
        // A single kind needs no name of its colour.
        let counts = if kinds.len() == 1 { format!("{count} contacts") } else { kinds.join(", ") };
        let blocked: usize = touch.iter().map(|(_, contacts)| contacts.blocked.len()).sum();
        let blocked = if blocked > 0 { format!(", {blocked} stopped by something else (grey)") } else { String::new() };
        Self {
            cells: behind.draw_touched(&pair.partial, None, tactile).with_few_colours(),
            cells_hint: format!("green: {} touched cells", tactile.count()),
            points: touch_points(touched, behind).with_few_colours(),
            points_hint: format!("{counts} on the solid{blocked}"),
        }
    }
}

/// The whole solid from behind, a dot at each contact and at each probe that something else stopped.
pub(crate) fn touch_points(touched: &TouchedPair, behind: &VoxelPainter) -> Picture {
    let pair = &touched.pair;
    let mut points = behind.draw(Some(&pair.partial), Some(&pair.complete));
    let (lower, cell) = (pair.grid.lower_corner(), pair.grid.cell_size);
    let point = |position: [f32; 3]| std::array::from_fn(|axis| (f64::from(position[axis]) - lower[axis]) / cell);
    for (channel, TactileContacts { contacts, blocked, .. }) in &touched.touch {
        behind.dot(&mut points, Colour::OTHERS, blocked.iter().map(|blocked| point(blocked.position)));
        behind.dot(&mut points, dot_meaning(*channel).colour, contacts.iter().map(|contact| point(contact.position)));
    }
    points
}

/// Dots of one kind of touch.
struct DotMeaning {
    colour: Colour,
    colour_name: &'static str,
    /// Text about the origin of the contacts.
    word: &'static str,
}

fn dot_meaning(channel: Channel) -> DotMeaning {
    let (colour, colour_name, word) = match channel {
        Channel::TOUCH_EXPLORATION | Channel::AMODAL_TOUCH_EXPLORATION => {
            (Colour::EXPLORED, "light blue", "by exploration")
        }
        Channel::TOUCH_GRASP => (Colour::HELD, "red", "by the grasp"),
        _ => (Colour::TOUCHED, "green", "by rays"),
    };
    DotMeaning { colour, colour_name, word }
}
