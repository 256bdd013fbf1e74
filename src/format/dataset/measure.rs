//! Measurement behind the chunk size. `cargo test --release --lib measure -- --ignored --nocapture`

use std::{fs, path::Path};

use nalgebra::{Point3, Vector3};

use crate::{
    Channel, Product, Visibility, VoxelPair,
    storage::{ShardHeader, ShardWriter, shard_file::ShardFile},
};
use kernel::{
    files::Folder,
    geom::{GridPlacement, Intrinsics, OccupancyGrid, Pose, rotation_from_rpy},
    ids::{Digest, ItemId, JobDigest, ObjectId, SampleId, SampleIndex, ShardId},
};

const SIDE: u32 = 40;

/// Processor time of this thread [s]: other work on the machine does not count.
struct Clock(f64);

impl Clock {
    fn start() -> Self {
        Self(Self::now())
    }

    fn now() -> f64 {
        let text = fs::read_to_string("/proc/thread-self/schedstat").unwrap();
        text.split(' ').next().unwrap().parse::<f64>().unwrap() * 1e-9
    }

    fn seconds(&self) -> f64 {
        Self::now() - self.0
    }
}

/// Points over the triangles of a binary STL, about one per millimetre.
fn surface(path: &Path) -> Vec<Point3<f64>> {
    let bytes = fs::read(path).unwrap();
    let mut points = Vec::new();
    for face in bytes[84..].chunks_exact(50) {
        let number = |index: usize| f32::from_le_bytes(std::array::from_fn(|byte| face[12 + 4 * index + byte]));
        let corner =
            |index: usize| Point3::from(std::array::from_fn::<f64, 3, _>(|axis| number(3 * index + axis).into()));
        let (a, b, c) = (corner(0), corner(1), corner(2));
        let steps = ((b - a).norm().max((c - a).norm()) / 0.001).ceil().clamp(1.0, 200.0) as u32;
        for i in 0..=steps {
            for j in 0..=steps - i {
                let share = |step: u32| f64::from(step) / f64::from(steps);
                points.push(a + (b - a) * share(i) + (c - a) * share(j));
            }
        }
    }
    points
}

/// A pair as a camera along +z would make it: nearest point per pixel, solid filled from first to last surface.
fn pair(points: &[Point3<f64>], sample: SampleId, view: u32) -> (VoxelPair, OccupancyGrid) {
    let angle = |k: u32, n: u32| f64::from(k) / f64::from(n) * std::f64::consts::TAU;
    let rotation = rotation_from_rpy(angle(view % 11, 11), angle(view / 11 % 6, 12) - 1.3, angle(view / 66, 11));
    let seen: Vec<_> = points.iter().map(|point| rotation * point + Vector3::new(0.0, 0.0, 1.0)).collect();
    let (f, mut nearest) = (554.0, std::collections::BTreeMap::new());
    for point in &seen {
        let pixel = ((point.x / point.z * f).floor() as i32, (point.y / point.z * f).floor() as i32);
        let depth: &mut Point3<f64> = nearest.entry(pixel).or_insert(*point);
        if point.z < depth.z {
            *depth = *point;
        }
    }
    let bound = |pick: fn(f64, f64) -> f64, start: f64| {
        Point3::from(std::array::from_fn::<f64, 3, _>(|axis| nearest.values().map(|p| p[axis]).fold(start, pick)))
    };
    let (low, high) = (bound(f64::min, f64::MAX), bound(f64::max, f64::MIN));
    let grid =
        GridPlacement { resolution: SIDE, centre: low + (high - low) / 2.0, cell_size: (high - low).max() / 32.0 };
    let cell = |point: &Point3<f64>| {
        let cell = (point - grid.lower_corner()) / grid.cell_size;
        let cell = [cell.x.floor(), cell.y.floor(), cell.z.floor()];
        cell.iter().all(|c| (0.0..f64::from(SIDE)).contains(c)).then(|| cell.map(|c| c as u32))
    };
    let (mut partial, mut complete) = (OccupancyGrid::new(SIDE), OccupancyGrid::new(SIDE));
    nearest.values().filter_map(cell).for_each(|cell| partial.set(cell));
    seen.iter().filter_map(cell).for_each(|cell| complete.set(cell));
    let mut free = OccupancyGrid::new(SIDE);
    for x in 0..SIDE {
        for y in 0..SIDE {
            let at = |z: &u32| complete.get([x, y, *z]);
            if let (Some(first), Some(last)) = ((0..SIDE).find(at), (0..SIDE).rev().find(at)) {
                (first..last).for_each(|z| complete.set([x, y, z]));
            }
            let first = (0..SIDE).find(|z| partial.get([x, y, *z])).unwrap_or(SIDE);
            (0..first).for_each(|z| free.set([x, y, z]));
        }
    }
    let world_from_camera = Pose::new(rotation_from_rpy(-1.5, 0.0, -1.5), Vector3::new(0.0, 0.0, 0.5));
    let camera_from_object = Pose::new(rotation, Vector3::new(0.0, 0.0, 1.0));
    let pair = VoxelPair {
        sample,
        camera: Intrinsics::from_horizontal_fov(640, 480, 1.047, 0.1).unwrap(),
        camera_from_object,
        world_from_object: world_from_camera * camera_from_object,
        world_from_camera,
        partial_cells: partial.count(),
        complete_cells: complete.count(),
        both_cells: partial.count_both(&complete),
        solid_share: 0.98765,
        grid,
        partial,
        complete,
    };
    (pair, free)
}

#[test]
#[ignore = "a measurement: prints rates and sizes by chunk size"]
fn chunk_sizes() {
    let mut samples = Vec::new();
    for name in ["025_mug", "035_power_drill", "011_banana", "030_fork", "003_cracker_box", "059_chain"] {
        let points = surface(Path::new(&format!(
            concat!(env!("CARGO_MANIFEST_DIR"), "/../../.deps/ycb/{name}.stl"),
            name = name
        )));
        let object = ObjectId(Digest::hash(name.as_bytes()));
        for view in 0..242 {
            samples.push(pair(&points, SampleId::of_object(object, ItemId(3 * view)), 3 * view));
        }
    }
    let count = samples.len() as u64;
    let mut payload = Vec::new();
    let start = Clock::start();
    for _ in 0..20 {
        for (pair, _) in &samples {
            payload.clear();
            pair.encode(&mut payload);
            std::hint::black_box(&payload);
        }
    }
    println!("encode {:.2} us, {} bytes", start.seconds() * 1e6 / 20.0 / count as f64, payload.len());
    let start = Clock::start();
    for _ in 0..5 * count {
        std::hint::black_box(VoxelPair::decode(std::hint::black_box(&payload)).unwrap());
    }
    println!("decode {:.2} us", start.seconds() * 1e6 / 5.0 / count as f64);
    let start = Clock::start();
    for _ in 0..5 * count {
        std::hint::black_box(Digest::hash(std::hint::black_box(&payload)));
    }
    println!("digest {:.2} us", start.seconds() * 1e6 / 5.0 / count as f64);
    let start = Clock::start();
    for _ in 0..5 * count {
        std::hint::black_box(crc32fast::hash(std::hint::black_box(&payload)));
    }
    println!("crc {:.2} us", start.seconds() * 1e6 / 5.0 / count as f64);
    for channels in [vec![Channel::PAIR], vec![Channel::PAIR, Channel::VISIBILITY]] {
        for (chunk, level) in [(64, 1), (64, 2), (64, 3), (64, 4), (128, 1), (128, 3), (256, 3)] {
            measure(&samples, &channels, chunk << 10, level);
        }
    }
}

fn measure(samples: &[(VoxelPair, OccupancyGrid)], channels: &[Channel], chunk: usize, level: u32) {
    let (folder, count) = (tempfile::tempdir().unwrap(), samples.len() as u64);
    let header = ShardHeader {
        product: Product::COMPLETION,
        job: JobDigest(Digest::hash(b"job")),
        shard: ShardId(0),
        shards: 1,
        samples: 0..count,
        channels: channels.to_vec(),
    };
    let (mut writing, mut written) = (f64::MAX, None);
    for _ in 0..3 {
        let start = Clock::start();
        let mut writer = ShardWriter::create_packed(&Folder::at(folder.path()), &header, chunk, level).unwrap();
        let mut payload = Vec::new();
        for (index, (pair, free)) in (0..).map(SampleIndex).zip(samples) {
            payload.clear();
            pair.encode(&mut payload);
            writer.write(index, &pair.sample, Channel::PAIR, &payload).unwrap();
            if channels.contains(&Channel::VISIBILITY) {
                payload.clear();
                Visibility::encode_parts(&pair.sample, free, &mut payload);
                writer.write(index, &pair.sample, Channel::VISIBILITY, &payload).unwrap();
            }
            writer.keep(index, &pair.sample, pair.facts()).unwrap();
        }
        written = Some(writer.finish().unwrap());
        writing = writing.min(start.seconds());
    }
    let written = written.unwrap();
    let file = ShardFile::open(&Folder::at(folder.path()), &written.file_name()).unwrap();
    let random = |step: u64| (0..count).map(move |k| SampleIndex(k * step % count));
    let (mut at_random, mut in_order) = (f64::MAX, f64::MAX);
    for _ in 0..3 {
        let start = Clock::start();
        for index in random(1009) {
            std::hint::black_box(file.read_chunk(file.chunk_of(index).unwrap()).unwrap());
        }
        at_random = at_random.min(start.seconds());
        let start = Clock::start();
        for chunk in 0..file.chunks.len() {
            std::hint::black_box(file.read_chunk(chunk).unwrap());
        }
        in_order = in_order.min(start.seconds());
    }
    let rate = |seconds: f64| count as f64 / seconds;
    println!(
        "{} channels, {:4} KiB, zstd {level}: {:6.0} bytes a sample, written {:6.0}/s, read in order {:6.0}/s, at random {:6.0}/s",
        channels.len(),
        chunk >> 10,
        written.bytes as f64 / count as f64,
        rate(writing),
        rate(in_order),
        rate(at_random)
    );
}
