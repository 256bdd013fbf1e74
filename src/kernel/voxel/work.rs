//! Lists of triangles that need an exact test, sixteen at a time.

/// A list of triangles by their vertices, filled up to whole vectors with vertex 0.
#[derive(Default)]
pub(super) struct Work {
    pub(super) corners: [Vec<u32>; 3],
    pub(super) count: usize,
}

impl Work {
    /// Ends the list; entries after it may name vertices of another mesh.
    pub(super) fn finish(&mut self, count: usize) {
        self.count = count;
        self.corners.iter_mut().for_each(|corner| corner[count..count + 16].fill(0));
    }
}

/// Sixteen entries of a list.
#[inline(always)]
pub(super) fn chunk_at(list: &mut [u32], start: usize) -> &mut [u32; 16] {
    (&mut list[start..start + 16]).try_into().expect("sixteen")
}

/// Bits of the lanes that hold one of the `left` entries still to come.
#[inline(always)]
pub(super) fn tail_mask(left: usize) -> u32 {
    if left < 16 { (1 << left) - 1 } else { 0xffff }
}
