//! Contacts of one kind of touch with an object, and the cells of the pair's grid that hold them.

use std::collections::BTreeSet;

use nalgebra::Vector3;
use prost::Message;

use super::{BlockedProbe, HandTouch, TouchContact, VoxelPair};
use crate::{
    Channel, SceneImage,
    codec::{
        RecordError,
        fields::{broken, floats, lengthy, ranged, resolution, triples},
        proto, sample_from_proto, wire,
    },
};
use kernel::{geom::OccupancyGrid, ids::SampleId};

const MESSAGE: &str = "TactileContacts";
/// Distance that a contact may be outside its cell [cells]: positions are kept in single precision.
const CELL_TOLERANCE: f64 = 1e-3;
/// Probes of one kind of touch, at most.
const MAX_PROBES: u32 = 1 << 20;

/// Contacts of one kind of touch with the object of a pair.
///
/// For the hot path keep one and refill it: its lists keep their memory.
#[derive(Clone, Debug, PartialEq)]
pub struct TactileContacts {
    /// Which sample: that of the pair.
    pub sample: SampleId,
    /// Cells along each axis of the pair's grid.
    pub resolution: u32,
    /// Number of probes that were sent out.
    pub probes: u32,
    /// In the order of the probes.
    pub contacts: Vec<TouchContact>,
    /// Starts of the probes that touched nothing and were not stopped, in their order, in `CameraCv` [m]; for a hand, of its palm.
    pub misses: Vec<[f32; 3]>,
    /// Probes that an obstacle stopped, in their order; empty for a single object.
    pub blocked: Vec<BlockedProbe>,
    /// Further measurements of a hand; `None` for rays.
    pub hand: Option<HandTouch>,
}

impl TactileContacts {
    /// No contact, to be filled.
    pub fn none(sample: SampleId) -> Self {
        let (contacts, misses, blocked) = (Vec::new(), Vec::new(), Vec::new());
        Self { sample, resolution: 1, probes: 0, contacts, misses, blocked, hand: None }
    }

    /// Cells that hold a contact, on the pair's grid.
    pub fn tactile(&self) -> OccupancyGrid {
        let mut grid = OccupancyGrid::new(self.resolution);
        self.contacts.iter().filter_map(|contact| contact.cell).for_each(|cell| grid.set(cell));
        grid
    }

    /// Contacts outside the pair's grid.
    pub fn outside(&self) -> u32 {
        self.contacts.iter().filter(|contact| contact.cell.is_none()).count() as u32
    }

    /// Contacts in sight of the camera.
    pub fn visible(&self) -> u32 {
        self.contacts.iter().filter(|contact| contact.visible).count() as u32
    }

    /// Appends the payload to `out`; equal records give equal bytes.
    pub fn encode(&self, out: &mut Vec<u8>) {
        let contacts = &self.contacts;
        let n = self.resolution;
        let number = |cell: Option<[u32; 3]>| cell.map_or(n.pow(3), |[x, y, z]| (x * n + y) * n + z);
        out.reserve(33 * contacts.len() + 12 * self.misses.len() + 128);
        wire::sample(out, 1, &self.sample);
        wire::uint32(out, 2, n);
        wire::uint32(out, 3, self.probes);
        wire::uint32s(out, 4, contacts.iter().map(|contact| contact.probe));
        wire::triples(out, 5, contacts.iter().map(|contact| contact.position));
        wire::triples(out, 6, contacts.iter().map(|contact| contact.normal));
        wire::singles(out, 7, contacts.iter().map(|contact| contact.distance));
        wire::bytes_of(out, 8, contacts.iter().map(|contact| u8::from(contact.visible)));
        wire::uint32s(out, 9, contacts.iter().map(|contact| number(contact.cell)));
        wire::uint32(out, 10, self.outside());
        wire::triples(out, 11, self.misses.iter().copied());
        self.hand.iter().for_each(|hand| hand.encode(out));
        let blocked = self.blocked.iter();
        wire::uint32s(out, 21, blocked.clone().map(|blocked| blocked.probe));
        wire::bytes_of(out, 22, blocked.clone().map(|blocked| blocked.by));
        wire::triples(out, 23, blocked.map(|blocked| blocked.position));
    }

    /// Reads and checks a payload.
    ///
    /// # Errors
    /// When lengths do not fit each other, a number is out of range or not finite, a normal is not of unit length, the pose
    /// of a hand is not a rigid motion, or an approach that missed or became unstable has a contact.
    pub fn decode(payload: &[u8]) -> Result<Self, RecordError> {
        // The fields up to 11 are those of TactileContacts, the ones up to 20 those of HandContacts.
        let mut touch = proto::ClutterContacts::decode(payload).map_err(broken(MESSAGE))?;
        let sample = sample_from_proto(MESSAGE, touch.sample.take())?;
        let n = resolution(MESSAGE, touch.resolution)?;
        let probes = touch.probes;
        ranged(MESSAGE, "probes", f64::from(probes), (1..=MAX_PROBES).contains(&probes), "1 to 1048576")?;
        let positions = triples(MESSAGE, "positions", &touch.positions)?;
        let normals = triples(MESSAGE, "normals", &touch.normals)?;
        let distances = floats(MESSAGE, "distances", &touch.distances, 1)?;
        for (field, found) in [
            ("probe", touch.probe.len()),
            ("normals", normals.len()),
            ("distances", distances.len()),
            ("visible", touch.visible.len()),
            ("cells", touch.cells.len()),
        ] {
            lengthy(MESSAGE, field, positions.len(), found)?;
        }
        let mut contacts = Vec::with_capacity(positions.len());
        for (index, position) in positions.into_iter().enumerate() {
            let (probe, number) = (touch.probe[index], touch.cells[index]);
            let before = index.checked_sub(1).map(|before| touch.probe[before]);
            let ascends = probe < probes && before.is_none_or(|before| before <= probe);
            ranged(MESSAGE, "probe", f64::from(probe), ascends, "below the count of probes, and ascend")?;
            let length = Vector3::from(normals[index].map(f64::from)).norm();
            ranged(MESSAGE, "normals", length, (length - 1.0).abs() < 1e-5, "of unit length")?;
            let distance = distances[index];
            ranged(MESSAGE, "distances", f64::from(distance), distance >= 0.0, "0 or positive")?;
            let visible = touch.visible[index];
            ranged(MESSAGE, "visible", f64::from(visible), visible < 2, "0 or 1")?;
            ranged(MESSAGE, "cells", f64::from(number), number <= n.pow(3), "a cell, or their count for none")?;
            contacts.push(TouchContact {
                probe,
                position,
                normal: normals[index],
                distance,
                visible: visible == 1,
                cell: (number < n.pow(3)).then(|| [number / n / n, number / n % n, number % n]),
            });
        }
        let blocked = blocked_probes(&touch, &sample)?;
        let hand = HandTouch::decode(&touch, probes, &contacts, &blocked)?;
        let touching: BTreeSet<u32> = contacts.iter().map(|contact| contact.probe).collect();
        // A ray ends once; a hand can touch with one finger and be stopped at another.
        let both = blocked.iter().find(|blocked| hand.is_none() && touching.contains(&blocked.probe));
        let value = both.map_or(0.0, |blocked| f64::from(blocked.probe));
        ranged(MESSAGE, "blocked_probe", value, both.is_none(), "a ray without a contact")?;
        let misses = triples(MESSAGE, "misses", &touch.misses)?;
        let stopped = blocked.iter().map(|blocked| blocked.probe).chain(touching).collect::<BTreeSet<u32>>().len();
        lengthy(MESSAGE, "misses", probes as usize - stopped, misses.len())?;
        let read = Self { sample, resolution: n, probes, contacts, misses, blocked, hand };
        if read.outside() != touch.outside {
            let (stated, counted) = (touch.outside, read.outside());
            return Err(RecordError::Count { message: MESSAGE, field: "outside", stated, counted });
        }
        Ok(read)
    }

    /// Reads and checks a payload of a channel of touch: only channels of hands have a hand's measurements.
    ///
    /// # Errors
    /// Errors of [`TactileContacts::decode`].
    pub fn decode_of(channel: Channel, payload: &[u8]) -> Result<Self, RecordError> {
        let read = Self::decode(payload)?;
        match &read.hand {
            None if channel.is_touch_by_hand() => Err(RecordError::Missing { message: "HandContacts", field: "ends" }),
            Some(hand) if !channel.is_touch_by_hand() => {
                let (expected, found) = (0, hand.approaches.len());
                Err(RecordError::Length { message: MESSAGE, field: "ends", expected, found })
            }
            _ if !read.blocked.is_empty() && !channel.is_touch_in_clutter() => {
                let (expected, found) = (0, read.blocked.len());
                Err(RecordError::Length { message: MESSAGE, field: "blocked_probe", expected, found })
            }
            _ => Ok(read),
        }
    }

    /// Compares the contacts with the pair of their sample: each must be in the cell that it names, and a contact without a cell
    /// must be outside the grid, or in a cell with an index of 0, which the `thesis` quirk drops.
    ///
    /// # Errors
    /// When a contact is elsewhere, or the two records have different grids.
    pub fn check_beside(&self, pair: &VoxelPair) -> Result<(), RecordError> {
        let grid = &pair.grid;
        let (n, found) = (grid.resolution, self.resolution);
        ranged(MESSAGE, "resolution", f64::from(found), found == n, "that of the pair")?;
        for (index, contact) in self.contacts.iter().enumerate() {
            let at = grid.coordinates_of(contact.position.map(f64::from));
            let fits = match contact.cell {
                Some(cell) => at.iter().zip(cell).all(|(at, index)| {
                    let within = at - f64::from(index);
                    (-CELL_TOLERANCE..=1.0 + CELL_TOLERANCE).contains(&within)
                }),
                None => at.iter().any(|at| *at < 1.0 + CELL_TOLERANCE || *at > f64::from(n) - CELL_TOLERANCE),
            };
            ranged(MESSAGE, "cells", index as f64, fits, "rows of contacts that are in the cell they name")?;
        }
        Ok(())
    }
}

/// Reads and checks the rows of probes that an obstacle stopped.
fn blocked_probes(touch: &proto::ClutterContacts, sample: &SampleId) -> Result<Vec<BlockedProbe>, RecordError> {
    let proto::ClutterContacts { probes, blocked_probe, blocked_by, blocked_positions, .. } = touch;
    let positions = triples(MESSAGE, "blocked_positions", blocked_positions)?;
    for (field, found) in [("blocked_by", blocked_by.len()), ("blocked_positions", positions.len())] {
        lengthy(MESSAGE, field, blocked_probe.len(), found)?;
    }
    let mut before = 0;
    let mut blocked = Vec::with_capacity(positions.len());
    for ((probe, by), position) in blocked_probe.iter().copied().zip(blocked_by.iter().copied()).zip(positions) {
        let ascends = (before..*probes).contains(&probe);
        ranged(MESSAGE, "blocked_probe", f64::from(probe), ascends, "below the count of probes, and ascend")?;
        before = probe;
        let is_body = (1..=SceneImage::MAX_BODIES).contains(&usize::from(by)) && u32::from(by) != sample.instance;
        let is_thing = is_body || by == SceneImage::CONTAINER || by == SceneImage::TABLE;
        ranged(MESSAGE, "blocked_by", f64::from(by), is_thing, "another body, 254 the container or 255 the table")?;
        blocked.push(BlockedProbe { probe, by, position });
    }
    Ok(blocked)
}
