//! A convex polytope that grows point by point, with its facets' neighbours.
//!
//! All facets are simplices. A new point removes the facets that it sees and joins the border of the removed region,
//! ridge by ridge: the plane of a new facet is in the pencil of the two that met at its ridge, so that it is their mean
//! with positive weights and needs no elimination. Rounding stays small over all generations, since a mean of planes
//! below which all points lie has all points below it.

use super::enclose::{CORNERS, Simplex};

/// Offset of a facet that is no more.
const GONE: f64 = f64::NAN;

/// A facet: the points x with normal . x <= offset lie below it. The fields of the visibility test lie in one cache line.
#[derive(Clone, Copy, Debug)]
#[repr(align(64))]
pub(super) struct Facet<const D: usize> {
    pub normal: [f64; D],
    pub offset: f64,
    /// The last point that saw it.
    pass: u32,
    /// Across from each corner.
    neighbours: [u32; D],
    /// Sum of its corners' keys.
    key: u64,
    /// Indices of wrenches.
    pub corners: [u16; D],
}

/// A ridge between a facet that is seen and one that is not, and how high and how low the point lies.
#[derive(Clone, Copy, Debug, Default)]
struct Ridge {
    /// Index in the list of visible facets.
    seen: u32,
    hidden: u32,
    /// Which corner of the seen one lies across.
    slot: u32,
    low: f64,
}

/// Facets and the memory to change them.
#[derive(Clone, Debug)]
pub(super) struct Polytope<const D: usize> {
    pub facets: Vec<Facet<D>>,
    free: Vec<u32>,
    /// Facets that the point sees, and how high it lies above them.
    seen: Vec<(u32, f64)>,
    ridges: Vec<Ridge>,
    /// New facets, a ridge each.
    fresh: Vec<u32>,
    /// Random 64-bit numbers by index of wrench: their sums name sets of corners. Two sets have the same name about
    /// once in 10^12 searches.
    keys: Vec<u64>,
    /// Names of the new facets' facets, and how many of each, with the sum of their indices in `fresh`, by some bits of
    /// the name.
    names: Vec<[u64; D]>,
    buckets: Vec<u32>,
    crowded: Vec<(u64, u32, u32)>,
    pass: u32,
}

impl<const D: usize> Default for Polytope<D> {
    fn default() -> Self {
        Self {
            facets: Vec::new(),
            free: Vec::new(),
            seen: Vec::new(),
            ridges: Vec::new(),
            fresh: Vec::new(),
            keys: Vec::new(),
            names: Vec::new(),
            buckets: Vec::new(),
            crowded: Vec::new(),
            pass: 0,
        }
    }
}

impl<const D: usize> Polytope<D> {
    /// Becomes a simplex of a set of this many wrenches.
    pub fn start(&mut self, simplex: &Simplex<D>, wrenches: usize) {
        debug_assert!(D < CORNERS);
        self.facets.clear();
        self.free.clear();
        while self.keys.len() < wrenches {
            self.keys.push(mix(self.keys.len() as u64));
        }
        for (omitted, row) in simplex.inverse[..=D].iter().enumerate() {
            // Below the facet its corner's barycentric coordinate is positive.
            let size = (0..D).map(|axis| row[axis] * row[axis]).sum::<f64>().sqrt();
            let other = |slot: usize| slot + usize::from(slot >= omitted);
            let corners: [u16; D] = std::array::from_fn(|slot| simplex.corners[other(slot)]);
            self.facets.push(Facet {
                normal: std::array::from_fn(|axis| -row[axis] / size),
                offset: row[D] / size,
                pass: self.pass,
                neighbours: std::array::from_fn(|slot| other(slot) as u32),
                key: corners.iter().fold(0, |sum, corner| self.keys[usize::from(*corner)].wrapping_add(sum)),
                corners,
            });
        }
    }

    /// Facets that are there.
    pub fn alive(&self) -> impl Iterator<Item = (u32, &Facet<D>)> {
        (0..).zip(&self.facets).filter(|(_, facet)| !facet.offset.is_nan())
    }

    /// Takes in a wrench that lies above a facet; calls `made` for each new facet and returns how many there are.
    pub fn add(&mut self, index: u16, point: &[f64; D], below: u32, mut made: impl FnMut(u32, &Facet<D>)) -> usize {
        self.mark_seen(point, below);
        self.raise(index);
        self.join();
        self.fresh.iter().for_each(|fresh| made(*fresh, &self.facets[*fresh as usize]));
        self.fresh.len()
    }

    /// Finds the facets that a point sees, from one of them on, and the ridges around them. Candidates are always
    /// written, and counted only if they qualify: these branches are unpredictable.
    fn mark_seen(&mut self, point: &[f64; D], below: u32) {
        self.pass = self.pass.wrapping_add(1);
        let first = &mut self.facets[below as usize];
        first.pass = self.pass;
        self.seen.clear();
        self.seen.push((below, height(first, point)));
        self.ridges.clear();
        let mut at = 0;
        while at < self.seen.len() {
            let neighbours = self.facets[self.seen[at].0 as usize].neighbours;
            let (mut count, mut ridges) = (self.seen.len(), self.ridges.len());
            self.seen.resize(count + D, (0, 0.0));
            self.ridges.resize(ridges + D, Ridge::default());
            // Visible neighbours join the list once, the others give a ridge.
            for (slot, neighbour) in neighbours.into_iter().enumerate() {
                let facet = &mut self.facets[neighbour as usize];
                let height = height(facet, point);
                let visible = height > 0.0;
                self.seen[count] = (neighbour, height);
                count += usize::from(visible & (facet.pass != self.pass));
                facet.pass = if visible { self.pass } else { facet.pass };
                self.ridges[ridges] = Ridge { seen: at as u32, hidden: neighbour, slot: slot as u32, low: -height };
                ridges += usize::from(!visible);
            }
            self.seen.truncate(count);
            self.ridges.truncate(ridges);
            at += 1;
        }
    }

    /// Makes a facet on each ridge.
    fn raise(&mut self, index: u16) {
        self.fresh.clear();
        let key = self.keys[usize::from(index)];
        let free = &mut self.free;
        for ridge in &self.ridges {
            let (seen, high) = self.seen[ridge.seen as usize];
            let slot = ridge.slot as usize;
            let (upper, hidden) = (&self.facets[seen as usize], &self.facets[ridge.hidden as usize]);
            // Plane of the new facet: the mean of the two at the ridge, weighted so that it passes through the point.
            let mut facet = between(upper, high, hidden, ridge.low);
            facet.key = upper.key.wrapping_sub(self.keys[usize::from(upper.corners[slot])]).wrapping_add(key);
            facet.corners[slot] = index;
            facet.neighbours[slot] = ridge.hidden;
            // Reuse the slot of a removed facet, and correct the neighbour's link to it.
            let fresh = free.pop().unwrap_or(self.facets.len() as u32);
            self.facets[ridge.hidden as usize].neighbours.iter_mut().for_each(|back| {
                *back = if *back == seen { fresh } else { *back };
            });
            if fresh as usize == self.facets.len() {
                self.facets.push(facet);
            } else {
                self.facets[fresh as usize] = facet;
            }
            self.fresh.push(fresh);
        }
        // Remove the visible facets.
        for (seen, _) in &self.seen {
            self.facets[*seen as usize].offset = GONE;
            free.push(*seen);
        }
    }

    /// Makes new facets neighbours of each other where they share all corners but one: each such set of corners, the new
    /// point among them, comes twice. Where a bucket holds two indices, one is their sum less the other; the few that share a
    /// bucket are sorted.
    fn join(&mut self) {
        const ONE: u32 = 1 << 24;
        assert!(self.fresh.len() < 1 << 23, "places are 23 bits");
        // Hash table of ridges: each bucket has a count in its upper byte and a sum of indices below.
        let room = (32 * self.fresh.len()).next_power_of_two();
        if self.buckets.len() < room {
            self.buckets.resize(room, 0);
        }
        let (shift, mask) = (64 - room.trailing_zeros(), room - 1);
        let (buckets, keys) = (&mut self.buckets[..room], &self.keys);
        self.names.clear();
        for (index, (fresh, ridge)) in self.fresh.iter().zip(&self.ridges).enumerate() {
            let facet = &self.facets[*fresh as usize];
            let names: [u64; D] =
                std::array::from_fn(|slot| facet.key.wrapping_sub(keys[usize::from(facet.corners[slot])]));
            for (slot, name) in names.iter().enumerate() {
                let bucket = &mut buckets[(name >> shift) as usize & mask];
                let new = bucket.wrapping_add(ONE + index as u32);
                *bucket = if slot as u32 == ridge.slot { *bucket } else { new };
            }
            self.names.push(names);
        }
        // Link the two facets of each ridge; ridges of shared buckets are collected.
        self.crowded.clear();
        for (index, ((fresh, names), ridge)) in self.fresh.iter().zip(&self.names).zip(&self.ridges).enumerate() {
            let mut neighbours = [ridge.hidden; D];
            for (slot, name) in names.iter().enumerate() {
                let bucket = buckets[(name >> shift) as usize & mask];
                let pair = bucket >> 24 == 2;
                let other = ((bucket & (ONE - 1)) as usize).wrapping_sub(index);
                neighbours[slot] = self.fresh.get(other).copied().unwrap_or_default();
                if !pair && slot as u32 != ridge.slot {
                    self.crowded.push((*name, *fresh, slot as u32));
                }
            }
            neighbours[ridge.slot as usize] = ridge.hidden;
            self.facets[*fresh as usize].neighbours = neighbours;
        }
        // Clear the used buckets for the next point.
        for name in self.names.iter().flatten() {
            buckets[(name >> shift) as usize & mask] = 0;
        }
        // Link the ridges of shared buckets by sorting.
        self.crowded.sort_unstable();
        for pair in self.crowded.chunks_exact(2) {
            let [(_, one, slot), (_, other, other_slot)] = [pair[0], pair[1]];
            self.facets[one as usize].neighbours[slot as usize] = other;
            self.facets[other as usize].neighbours[other_slot as usize] = one;
        }
    }
}

/// A random number by index (SplitMix64, Steele et al. 2014).
fn mix(index: u64) -> u64 {
    let mut bits = (index + 1).wrapping_mul(0x9e37_79b9_7f4a_7c15);
    bits = (bits ^ (bits >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    bits = (bits ^ (bits >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    bits ^ (bits >> 31)
}

/// Height of a point above a facet.
#[inline]
pub(super) fn height<const D: usize>(facet: &Facet<D>, point: &[f64; D]) -> f64 {
    (0..D).fold(-facet.offset, |sum, axis| sum + facet.normal[axis] * point[axis])
}

/// The facet through a point and the ridge between a facet that the point sees, how high above it, and one that it does not,
/// how low below it; its point, its neighbours and its key are still to come.
#[inline]
fn between<const D: usize>(seen: &Facet<D>, high: f64, hidden: &Facet<D>, low: f64) -> Facet<D> {
    let mut normal: [f64; D] = std::array::from_fn(|axis| high * hidden.normal[axis] + low * seen.normal[axis]);
    let inverse = 1.0 / (0..D).fold(0.0, |sum, axis| sum + normal[axis] * normal[axis]).sqrt();
    normal.iter_mut().for_each(|value| *value *= inverse);
    Facet {
        normal,
        offset: (high * hidden.offset + low * seen.offset) * inverse,
        pass: seen.pass,
        neighbours: [0; D],
        key: 0,
        corners: seen.corners,
    }
}
