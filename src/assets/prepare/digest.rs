//! Digests of a mesh: of its prepared content, and of its triangles in any order.

use crate::repair::weld;
use kernel::{
    geom::TriMesh,
    ids::{Digest, ObjectId},
};

/// The object: BLAKE3 over a domain word, the counts, the positions (f32, little endian) and the faces (u32).
pub fn object(mesh: &TriMesh) -> ObjectId {
    let mut hasher = blake3::Hasher::new();
    hasher.update(b"graspmill prepared mesh 1\0");
    hasher.update(&(mesh.vertices.len() as u64).to_le_bytes());
    hasher.update(&(mesh.triangles.len() as u64).to_le_bytes());
    let mut block = Vec::with_capacity(12 * BLOCK);
    for positions in mesh.vertices.chunks(BLOCK) {
        block.clear();
        block.extend(positions.iter().flatten().flat_map(|coordinate| coordinate.to_le_bytes()));
        hasher.update(&block);
    }
    for faces in mesh.triangles.chunks(BLOCK) {
        block.clear();
        block.extend(faces.iter().flatten().flat_map(|vertex| vertex.to_le_bytes()));
        hasher.update(&block);
    }
    ObjectId(Digest(*hasher.finalize().as_bytes()))
}

/// Rows per block: 48 KiB, past which BLAKE3 gains nothing.
const BLOCK: usize = 4096;

/// The geometry: equal for the same set of triangles (with their winding) in any order, with any first corner and any
/// numbering of the vertices.
///
/// Each triangle is hashed from the hashes of its corners, smallest first, to two 64-bit lanes; the lanes are added up,
/// independent of order, and BLAKE3 digests the sums. Made to recognise copies, not to withstand forgery.
pub(crate) fn geometry(mesh: &TriMesh) -> Digest {
    let corners: Vec<u64> = mesh.vertices.iter().map(|&position| weld::hash(position)).collect();
    let (mut low, mut high) = (0u128, 0u128);
    for face in &mesh.triangles {
        let [a, b, c] = face.map(|vertex| corners[vertex as usize]);
        let [a, b, c] = if a <= b && a <= c {
            [a, b, c]
        } else if b <= c {
            [b, c, a]
        } else {
            [c, a, b]
        };
        let lane = |seed: u64| {
            let hash = mix(a ^ seed);
            let hash = mix(hash.wrapping_add(b));
            mix(hash.wrapping_add(c))
        };
        low += u128::from(lane(0x9e37_79b9_7f4a_7c15));
        high += u128::from(lane(0xd1b5_4a32_d192_ed03));
    }
    Digest::hash_parts([
        b"graspmill geometry 1".as_slice(),
        &(mesh.triangles.len() as u64).to_le_bytes(),
        &low.to_le_bytes(),
        &high.to_le_bytes(),
    ])
}

/// The finaliser of SplitMix64 (Steele, Lea, Flood 2014, "Fast splittable pseudorandom number generators").
#[inline]
fn mix(mut bits: u64) -> u64 {
    bits = (bits ^ bits >> 30).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    bits = (bits ^ bits >> 27).wrapping_mul(0x94d0_49bb_1331_11eb);
    bits ^ bits >> 31
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn geometry_forgets_order_and_numbering_but_not_winding() {
        let vertices = vec![[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
        let mesh = TriMesh { vertices, triangles: vec![[0, 2, 1], [0, 1, 3], [1, 2, 3], [2, 0, 3]] };
        let mut other = mesh.clone();
        other.vertices.reverse();
        other.triangles = vec![[0, 2, 1], [2, 3, 1], [0, 1, 3], [3, 2, 0]];
        let mut flipped = mesh.clone();
        flipped.triangles[0].swap(0, 1);
        assert_eq!(geometry(&mesh), geometry(&other));
        assert_ne!(object(&mesh), object(&other));
        assert_ne!(geometry(&mesh), geometry(&flipped));
    }
}
