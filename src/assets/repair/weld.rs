//! Merging equal positions: an open-addressing table over the bits of the coordinates.

const EMPTY: u32 = u32::MAX;

/// Hands out one index per distinct position, in order of first appearance (so never in order of the table).
pub(crate) struct Welder {
    positions: Vec<[f32; 3]>,
    slots: Vec<u32>,
    shift: u32,
}

impl Welder {
    /// A welder for about `expected` distinct positions; it grows when there are more.
    pub(crate) fn new(expected: usize) -> Self {
        let size = (2 * expected).next_power_of_two().max(64);
        Self {
            positions: Vec::with_capacity(expected),
            slots: vec![EMPTY; size],
            shift: u64::BITS - size.trailing_zeros(),
        }
    }

    /// The index of `position`; -0 counts as 0, everything else is compared bit by bit.
    #[inline]
    pub(crate) fn index(&mut self, position: [f32; 3]) -> u32 {
        let position = position.map(|coordinate| coordinate + 0.0);
        let mask = self.slots.len() - 1;
        let mut slot = (hash(position) >> self.shift) as usize;
        loop {
            let found = self.slots[slot];
            if found == EMPTY {
                break;
            }
            if self.positions[found as usize].map(f32::to_bits) == position.map(f32::to_bits) {
                return found;
            }
            slot = (slot + 1) & mask;
        }
        let index = self.positions.len() as u32;
        self.positions.push(position);
        self.slots[slot] = index;
        if 2 * self.positions.len() > self.slots.len() {
            self.grow();
        }
        index
    }

    /// The distinct positions, in order of first appearance.
    pub(crate) fn into_positions(self) -> Vec<[f32; 3]> {
        self.positions
    }

    #[cold]
    fn grow(&mut self) {
        let size = 4 * self.slots.len();
        self.slots = vec![EMPTY; size];
        self.shift = u64::BITS - size.trailing_zeros();
        for (index, &position) in self.positions.iter().enumerate() {
            let mut slot = (hash(position) >> self.shift) as usize;
            while self.slots[slot] != EMPTY {
                slot = (slot + 1) & (size - 1);
            }
            self.slots[slot] = index as u32;
        }
    }
}

/// 64 well-mixed bits of a position (the multipliers are odd numbers with no pattern: SplitMix64's and the golden ratio).
#[inline]
pub(crate) fn hash(position: [f32; 3]) -> u64 {
    let [x, y, z] = position.map(|coordinate| u64::from(coordinate.to_bits()));
    let mut hash = (x | y << 32).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    hash ^= hash >> 32;
    hash = hash.wrapping_add(z.wrapping_mul(0x9e37_79b9_7f4a_7c15)).wrapping_mul(0x94d0_49bb_1331_11eb);
    hash ^ hash >> 29
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn equal_positions_share_an_index_and_minus_zero_is_zero() {
        let mut welder = Welder::new(1);
        assert_eq!(welder.index([0.0, 1.0, 2.0]), 0);
        assert_eq!(welder.index([0.0, 1.0, 2.0f32.next_up()]), 1);
        assert_eq!(welder.index([-0.0, 1.0, 2.0]), 0);
        assert_eq!(welder.into_positions().len(), 2);
    }

    #[test]
    fn growing_keeps_every_index() {
        let grid = |i: u32| [(i % 50) as f32, (i / 50 % 50) as f32, (i / 2500) as f32];
        let mut welder = Welder::new(0);
        for pass in 0..2 {
            for i in 0..10_000 {
                assert_eq!(welder.index(grid(i)), i, "pass {pass}");
            }
        }
    }
}
