//! Which faces meet at which edge, without hashing and without sorting the whole mesh.

/// No face on the other side: the edge is on a boundary.
pub(crate) const BOUNDARY: u32 = u32::MAX;
/// Three or more faces meet at the edge.
pub(crate) const CROWDED: u32 = u32::MAX - 1;

/// The edges of a mesh. Half-edge `3 * face + k` runs from corner k of the face to corner k + 1.
pub(crate) struct Edges {
    /// Per half-edge: the half-edge of the other face, or [`BOUNDARY`], or [`CROWDED`].
    pub(crate) partner: Vec<u32>,
    /// Distinct edges.
    pub(crate) count: usize,
    /// Edges with one face.
    pub(crate) boundary: usize,
    /// Edges with exactly two faces that run along them in the same direction.
    pub(crate) same_direction: usize,
    /// Half-edges of the edges with three faces or more, one run per edge.
    pub(crate) crowded: Vec<Vec<u32>>,
    /// Faces that share an edge and the third corner with another face: duplicates or opposite twins. With repeats.
    pub(crate) twins: Vec<u32>,
}

impl Edges {
    /// Finds the edges of `faces`, whose corners are all below `vertices` and distinct.
    ///
    /// Half-edges are dealt into one bucket per lower vertex (counting sort), and each bucket, six entries on average,
    /// is ordered by the other vertex and then by half-edge: linear time, and the same result every time.
    pub(crate) fn of(faces: &[[u32; 3]], vertices: usize) -> Self {
        // Counting sort, first pass: half-edges per lower vertex.
        let mut ends = vec![0u32; vertices + 1];
        for face in faces {
            for k in 0..3 {
                ends[face[k].min(face[NEXT[k]]) as usize] += 1;
            }
        }
        // Starts of the buckets.
        let mut total = 0;
        for end in &mut ends {
            total += *end;
            *end = total - *end;
        }
        // Second pass: each half-edge goes to its bucket, with the other vertex in the upper bits.
        let mut entries = vec![0u64; total as usize];
        for (index, face) in faces.iter().enumerate() {
            for k in 0..3 {
                let (from, to) = (face[k], face[NEXT[k]]);
                let end = &mut ends[from.min(to) as usize];
                entries[*end as usize] = u64::from(from.max(to)) << 32 | (3 * index + k) as u64;
                *end += 1;
            }
        }
        let mut edges = Self {
            partner: vec![BOUNDARY; 3 * faces.len()],
            count: 0,
            boundary: 0,
            same_direction: 0,
            crowded: Vec::new(),
            twins: Vec::new(),
        };
        // Half-edges of one edge are consecutive after sorting a bucket.
        let mut start = 0;
        for &end in &ends[..vertices] {
            let bucket = &mut entries[start..end as usize];
            start = end as usize;
            order(bucket);
            for edge in bucket.chunk_by(|a, b| a >> 32 == b >> 32) {
                edges.add(edge, faces);
            }
        }
        edges
    }

    #[inline]
    fn add(&mut self, edge: &[u64], faces: &[[u32; 3]]) {
        self.count += 1;
        match *edge {
            [_] => self.boundary += 1,
            [a, b] => {
                let (a, b) = (a as u32, b as u32);
                self.partner[a as usize] = b;
                self.partner[b as usize] = a;
                self.same_direction += usize::from(from(faces, a) == from(faces, b));
                if apex(faces, a) == apex(faces, b) {
                    self.twins.extend([a / 3, b / 3]);
                }
            }
            _ => {
                let mut halves: Vec<u32> = edge.iter().map(|&entry| entry as u32).collect();
                halves.sort_unstable_by_key(|&half| (apex(faces, half), half));
                for &half in &halves {
                    self.partner[half as usize] = CROWDED;
                }
                for same in halves.chunk_by(|&a, &b| apex(faces, a) == apex(faces, b)).filter(|same| same.len() > 1) {
                    self.twins.extend(same.iter().map(|half| half / 3));
                }
                self.crowded.push(halves);
            }
        }
    }
}

/// The corner after corner k.
pub(crate) const NEXT: [usize; 3] = [1, 2, 0];

/// The vertex where a half-edge starts.
#[inline]
pub(crate) fn from(faces: &[[u32; 3]], half: u32) -> u32 {
    faces[half as usize / 3][half as usize % 3]
}

/// The vertex where a half-edge ends.
#[inline]
pub(crate) fn to(faces: &[[u32; 3]], half: u32) -> u32 {
    faces[half as usize / 3][NEXT[half as usize % 3]]
}

/// The corner of the face that is not on the half-edge.
#[inline]
pub(crate) fn apex(faces: &[[u32; 3]], half: u32) -> u32 {
    faces[half as usize / 3][NEXT[NEXT[half as usize % 3]]]
}

/// Sorts a bucket. Nearly all are a handful of entries in no order, where a network of minima and maxima, which never
/// branches, beats everything that does.
#[inline]
fn order(bucket: &mut [u64]) {
    let count = bucket.len();
    if count > 8 {
        return bucket.sort_unstable();
    }
    let mut lanes = [u64::MAX; 8];
    lanes[..count].copy_from_slice(bucket);
    let l = &mut lanes;
    exchange::<0, 2>(l);
    exchange::<1, 3>(l);
    exchange::<4, 6>(l);
    exchange::<5, 7>(l);
    exchange::<0, 4>(l);
    exchange::<1, 5>(l);
    exchange::<2, 6>(l);
    exchange::<3, 7>(l);
    exchange::<0, 1>(l);
    exchange::<2, 3>(l);
    exchange::<4, 5>(l);
    exchange::<6, 7>(l);
    exchange::<2, 4>(l);
    exchange::<3, 5>(l);
    exchange::<1, 4>(l);
    exchange::<3, 6>(l);
    exchange::<1, 2>(l);
    exchange::<3, 4>(l);
    exchange::<5, 6>(l);
    bucket.copy_from_slice(&lanes[..count]);
}

/// One of the nineteen comparators that sort eight entries (Knuth, The Art of Computer Programming 3, section 5.3.4).
#[inline(always)]
fn exchange<const A: usize, const B: usize>(lanes: &mut [u64; 8]) {
    (lanes[A], lanes[B]) = (lanes[A].min(lanes[B]), lanes[A].max(lanes[B]));
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_tetrahedron_has_six_edges_of_two_opposite_faces() {
        let edges = Edges::of(&[[0, 2, 1], [0, 1, 3], [1, 2, 3], [2, 0, 3]], 4);
        assert_eq!((edges.count, edges.boundary, edges.same_direction, edges.twins.len()), (6, 0, 0, 0));
        assert!(edges.partner.iter().enumerate().all(|(half, &other)| edges.partner[other as usize] as usize == half));
    }

    #[test]
    fn boundaries_twins_and_crowded_edges_are_told_apart() {
        let fan = Edges::of(&[[0, 1, 2], [0, 1, 3], [1, 0, 4]], 5);
        assert_eq!((fan.count, fan.boundary, fan.crowded.len(), fan.twins.len()), (7, 6, 1, 0));
        assert_eq!(Edges::of(&[[0, 1, 2], [2, 1, 0]], 3).twins, [0, 1, 0, 1, 0, 1]);
        assert_eq!(Edges::of(&[[0, 1, 2], [0, 1, 3]], 4).same_direction, 1);
    }

    #[test]
    fn the_network_sorts_every_pattern_of_zeros_and_ones() {
        // The zero-one principle: a network that sorts these sorts everything.
        for count in 0..=8 {
            for pattern in 0..1u32 << count {
                let mut bucket: Vec<u64> = (0..count).map(|bit| u64::from(pattern >> bit & 1)).collect();
                order(&mut bucket);
                assert!(bucket.is_sorted(), "{pattern:b}");
            }
        }
    }

    #[test]
    fn a_vertex_with_many_faces_is_not_slow_and_not_wrong() {
        let rim = 50_000;
        let faces: Vec<[u32; 3]> = (0..rim).map(|i| [0, 1 + i, 1 + (i + 1) % rim]).collect();
        let edges = Edges::of(&faces, rim as usize + 1);
        assert_eq!((edges.count, edges.boundary), (2 * rim as usize, rim as usize));
    }
}
