//! Bit-packed occupancy grids.

use nalgebra::Point3;

/// Where a sample's grid lies in `CameraCv`: the spec's placement from the box of the partial cloud (thesis ch. 5.3).
///
/// Cell of point p = floor((p - centre) / cell_size + anchor), per axis, where the anchor is (0.5, 0.5, 0.45) of the
/// resolution: (20, 20, 18) of 40, off-centre in z so that the unseen back has more room.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct GridPlacement {
    /// Cells along each axis, 1 to 128.
    pub resolution: u32,
    /// Centre of the partial cloud's box, in `CameraCv` [m].
    pub centre: Point3<f64>,
    /// Side of a cell [m]: the longest side of that box over 0.8 of the resolution.
    pub cell_size: f64,
}

impl GridPlacement {
    /// Share of the grid that the longest side of the partial cloud's box fills.
    pub const FILL: f64 = 0.8;

    /// Grid coordinates of `centre` [cells].
    pub fn anchor(&self) -> [f64; 3] {
        let n = f64::from(self.resolution);
        [0.5 * n, 0.5 * n, 0.45 * n]
    }

    /// Grid coordinates of a point in `CameraCv` [m]: cell (x, y, z) reaches from (x, y, z) to one more along each axis.
    pub fn coordinates_of(&self, point: [f64; 3]) -> [f64; 3] {
        let anchor = self.anchor();
        std::array::from_fn(|axis| (point[axis] - self.centre[axis]) / self.cell_size + anchor[axis])
    }

    /// The grid's lower corner, in `CameraCv` [m].
    pub fn lower_corner(&self) -> Point3<f64> {
        let anchor = self.anchor();
        Point3::from(std::array::from_fn::<f64, 3, _>(|axis| self.centre[axis] - anchor[axis] * self.cell_size))
    }
}

/// A cubic occupancy grid, one bit per cell.
///
/// Shape (resolution, resolution, resolution) indexed (x, y, z), C order: cell (x, y, z) is bit
/// `(x * resolution + y) * resolution + z`, least significant bit of each byte first
/// (`numpy.unpackbits(..., bitorder="little")`).
#[derive(Clone, Debug, PartialEq, Eq, Default)]
pub struct OccupancyGrid {
    resolution: u32,
    bits: Vec<u8>,
}

impl OccupancyGrid {
    /// An empty grid.
    pub fn new(resolution: u32) -> Self {
        Self { resolution, bits: vec![0; Self::bytes_for(resolution)] }
    }

    /// Bytes of a packed grid: resolution^3 bits, rounded up.
    pub fn bytes_for(resolution: u32) -> usize {
        (resolution as usize).pow(3).div_ceil(8)
    }

    /// From packed bytes; `None` when their count does not fit the resolution.
    pub fn from_bytes(resolution: u32, bits: Vec<u8>) -> Option<Self> {
        (bits.len() == Self::bytes_for(resolution)).then_some(Self { resolution, bits })
    }

    /// Cells along each axis.
    pub fn resolution(&self) -> u32 {
        self.resolution
    }

    /// The packed bits.
    pub fn bytes(&self) -> &[u8] {
        &self.bits
    }

    /// The packed bits, for kernels that fill them.
    pub fn bytes_mut(&mut self) -> &mut [u8] {
        &mut self.bits
    }

    /// Makes the grid empty with this resolution, keeping its memory.
    pub fn reset(&mut self, resolution: u32) {
        self.resolution = resolution;
        self.bits.clear();
        self.bits.resize(Self::bytes_for(resolution), 0);
    }

    fn byte_and_mask(&self, [x, y, z]: [u32; 3]) -> (usize, u8) {
        debug_assert!(x < self.resolution && y < self.resolution && z < self.resolution);
        let n = self.resolution as usize;
        let bit = (x as usize * n + y as usize) * n + z as usize;
        (bit / 8, 1 << (bit % 8))
    }

    /// Whether cell (x, y, z) is occupied.
    pub fn get(&self, cell: [u32; 3]) -> bool {
        let (byte, mask) = self.byte_and_mask(cell);
        self.bits[byte] & mask != 0
    }

    /// Marks cell (x, y, z) as occupied.
    pub fn set(&mut self, cell: [u32; 3]) {
        let (byte, mask) = self.byte_and_mask(cell);
        self.bits[byte] |= mask;
    }

    /// Number of occupied cells.
    pub fn count(&self) -> u32 {
        let (words, rest) = self.bits.as_chunks::<8>();
        let words: u32 = words.iter().map(|word| u64::from_le_bytes(*word).count_ones()).sum();
        words + rest.iter().map(|byte| byte.count_ones()).sum::<u32>()
    }

    /// Number of cells occupied in both grids of the same resolution.
    pub fn count_both(&self, other: &Self) -> u32 {
        let ((words, rest), (others, other_rest)) = (self.bits.as_chunks::<8>(), other.bits.as_chunks::<8>());
        let both = |(a, b): (&[u8; 8], &[u8; 8])| (u64::from_le_bytes(*a) & u64::from_le_bytes(*b)).count_ones();
        let words: u32 = words.iter().zip(others).map(both).sum();
        words + rest.iter().zip(other_rest).map(|(a, b)| (a & b).count_ones()).sum::<u32>()
    }

    /// Cells occupied in either of two grids of the same resolution.
    ///
    /// # Panics
    /// If the resolutions differ.
    pub fn either(&self, other: &Self) -> Self {
        assert_eq!(self.resolution, other.resolution, "grids of one sample share their resolution");
        let bits = self.bits.iter().zip(&other.bits).map(|(a, b)| a | b).collect();
        Self { resolution: self.resolution, bits }
    }

    /// The occupied cells in C order.
    pub fn cells(&self) -> impl Iterator<Item = [u32; 3]> + '_ {
        let n = self.resolution;
        (0..n.pow(3))
            .filter(|bit| self.bits[*bit as usize / 8] >> (bit % 8) & 1 != 0)
            .map(move |bit| [bit / n / n, bit / n % n, bit % n])
    }
}

/// The solid object as fine cells in its own frame, fixed 256 cells per side.
///
/// Cubic cells of side `pitch`; the lower corner of cell (0, 0, 0) is `origin`, the lower corner of the mesh's box, and
/// the longest side of the box spans all 256 cells (binvox's convention). Cell (x, y, z) is bit `z % 64` of word
/// `(x * 256 + y) * 4 + z / 64`.
#[derive(Clone, Debug, PartialEq)]
pub struct SolidGrid {
    /// Lower corner, in `Object` [m].
    pub origin: Point3<f64>,
    /// Side of a cell [m].
    pub pitch: f64,
    /// 256 * 256 * 4 words.
    pub words: Vec<u64>,
}

impl SolidGrid {
    /// Cells along each axis.
    pub const SIDE: usize = 256;

    /// An empty grid over a box whose lower corner and longest side [m] are given.
    pub fn new(origin: Point3<f64>, longest_side: f64) -> Self {
        Self {
            origin,
            pitch: longest_side / Self::SIDE as f64,
            words: vec![0; Self::SIDE * Self::SIDE * Self::SIDE / 64],
        }
    }

    /// Whether cell (x, y, z) is solid.
    pub fn get(&self, x: usize, y: usize, z: usize) -> bool {
        self.words[(x * Self::SIDE + y) * 4 + z / 64] >> (z % 64) & 1 != 0
    }

    /// Centre of cell (x, y, z), in `Object` [m].
    pub fn centre(&self, x: usize, y: usize, z: usize) -> Point3<f64> {
        self.origin + nalgebra::Vector3::new(x as f64 + 0.5, y as f64 + 0.5, z as f64 + 0.5) * self.pitch
    }

    /// Number of solid cells.
    pub fn count(&self) -> u64 {
        self.words.iter().map(|word| u64::from(word.count_ones())).sum()
    }

    /// Volume of the solid cells [m^3].
    pub fn volume(&self) -> f64 {
        self.count() as f64 * self.pitch.powi(3)
    }
}
