//! A small finished dataset of shapes known in closed form, for tests of what reads datasets.
//!
//! Depth comes from marching rays through the shape's inside test, grids from that depth and that test: none of it comes
//! from the program's own kernels.

use std::path::Path;

use graspmill::{
    files::Folder,
    format::{
        Channel, Cloud, Depth, DepthCoding, Product, Visibility, VoxelPair,
        dataset::{DatasetHeader, Manifest, RunMark, ShardHeader, ShardWriter, begin_run, finish_dataset},
    },
    geom::{CameraCv, DepthCrop, GridPlacement, Intrinsics, Object, OccupancyGrid, Pose, rotation_from_rpy},
    ids::{Digest, ItemId, JobDigest, ObjectId, SampleId, SampleIndex, ShardId},
    tables::ParquetIndex,
    words::{NumberClass, ObjectSplit, Split, SplitTable},
};
use nalgebra::{Point3, Vector3};

type Inside = fn(f64, f64, f64) -> bool;

/// Shapes about the origin, metres, at most 0.1 m from it.
const SHAPES: [(&str, Inside); 6] = [
    ("ball", |x, y, z| x * x + y * y + z * z < 0.05 * 0.05),
    ("brick with a name that needs <care> & \"quotes\"", |x, y, z| x.abs() < 0.06 && y.abs() < 0.035 && z.abs() < 0.02),
    ("mug", |x, y, z| {
        let r = x.hypot(y);
        let wall = r < 0.04 && r > 0.034 && z.abs() < 0.05;
        let floor = r < 0.04 && z < -0.043 && z > -0.05;
        let handle = ((x - 0.042).hypot(z) - 0.026).hypot(y) < 0.006 && x > 0.036;
        wall || floor || handle
    }),
    ("Ölflasche", |x, y, z| {
        x.hypot(y) < if z < 0.03 { 0.032 } else { 0.032 - (z - 0.03).min(0.025) * 0.8 } && z.abs() < 0.09
    }),
    ("ring", |x, y, z| (x.hypot(y) - 0.05).hypot(z) < 0.015),
    ("wand", |x, y, z| x.hypot(y) < 0.006 && z.abs() < 0.09),
];

/// A dataset of these shapes.
#[derive(Clone, Copy, Debug)]
pub struct Shelf {
    /// Views of each shape.
    pub views: u32,
    /// Whether depth and cloud are stored in addition to pair and visibility.
    pub with_depth: bool,
}

/// The content of a written dataset, for comparison.
pub struct ShelfContent {
    pub manifest: Manifest,
    pub kept: Vec<(SampleIndex, VoxelPair, Cloud)>,
}

impl Shelf {
    /// Fills `folder` with a finished dataset.
    pub fn write(&self, folder: &Path) -> ShelfContent {
        let job = JobDigest(Digest::hash(b"shelf"));
        let samples = u64::from(self.views) * SHAPES.len() as u64;
        let shards = SHAPES.len() as u32;
        begin_run(&Folder::at(folder), &RunMark::new(Product::COMPLETION, job, samples, shards, self.views)).unwrap();
        let mut channels = vec![Channel::PAIR, Channel::VISIBILITY];
        if self.with_depth {
            channels.extend([Channel::DEPTH, Channel::CLOUD]);
        }
        let mut kept = Vec::new();
        for (shard, (name, inside)) in (0..).zip(SHAPES) {
            let first = u64::from(shard) * u64::from(self.views);
            let samples = first..first + u64::from(self.views);
            let header = ShardHeader {
                product: Product::COMPLETION,
                job,
                shard: ShardId(shard),
                shards,
                samples: samples.clone(),
                channels: channels.clone(),
            };
            let mut writer = ShardWriter::create(&Folder::at(folder.join("shards")), &header).unwrap();
            for (view, index) in (0..).zip(samples) {
                let id = SampleId::of_object(object(name), ItemId(view));
                let (pair, free, depth, cloud) = sample(id, inside);
                let (index, facts) = (SampleIndex(index), pair.facts());
                if pair.partial_cells < 100 {
                    writer.reject(index, &id, facts, "few_partial_cells", "fewer than 100").unwrap();
                    continue;
                }
                for channel in &channels {
                    let mut payload = Vec::new();
                    match *channel {
                        Channel::PAIR => pair.encode(&mut payload),
                        Channel::VISIBILITY => Visibility::encode_parts(&id, &free, &mut payload),
                        Channel::DEPTH => depth.encode(&mut payload),
                        _ => cloud.encode(&mut payload),
                    }
                    writer.write(index, &id, *channel, &payload).unwrap();
                }
                writer.keep(index, &id, facts).unwrap();
                kept.push((index, pair, cloud));
            }
            writer.finish().unwrap();
        }
        ShelfContent { manifest: finish_dataset(&Folder::at(folder), &self.header(job), &ParquetIndex).unwrap(), kept }
    }

    fn header(&self, job: JobDigest) -> DatasetHeader {
        let sides =
            [Split::Training, Split::Training, Split::Training, Split::Validation, Split::Test, Split::Training];
        let mut objects: Vec<_> = (SHAPES.iter().zip(sides))
            .map(|((name, _), split)| ObjectSplit {
                object: object(name),
                split,
                holdout_items: if split == Split::Training { (0..self.views / 4).collect() } else { vec![] },
                subset: None,
            })
            .collect();
        objects.sort_by_key(|row| row.object);
        let asset = |(name, _): &(&str, Inside)| {
            serde_json::json!({
                "name": name, "object": object(name), "geometry": Digest::hash(name.as_bytes()),
                "triangles": 2048 + name.len(), "extents": [0.08, 0.08, 0.1], "watertight": *name != "ring", "bodies": 1,
                "repairs": if *name == "ring" { serde_json::json!([{"repair": "duplicate_faces", "count": 4}]) } else { serde_json::json!([]) },
                "warnings": if *name == "wand" { serde_json::json!(["cells are smaller than a pixel at 1 m"]) } else { serde_json::json!([]) },
                "licence": "CC0-1.0",
            })
        };
        DatasetHeader {
            product: Product::COMPLETION,
            generator: "graspmill test".to_owned(),
            job,
            job_text: "name = \"shelf\"\nseed = 1\n".to_owned(),
            class: NumberClass::Exact,
            channel_classes: Default::default(),
            platform: Default::default(),
            assets: SHAPES.iter().map(asset).collect(),
            subjects: vec![],
            hands: vec![],
            containers: Vec::new(),
            refused: vec![serde_json::json!({
                "file": "broken.stl", "reason": "truncated", "problem": "84 bytes of 50 084", "place": null,
                "remedy": "copy the file again"
            })],
            splits: Some(SplitTable { training_subsets: vec![], objects }),
            warnings: vec![],
        }
    }
}

fn object(name: &str) -> ObjectId {
    ObjectId(Digest::hash(name.as_bytes()))
}

fn sample(id: SampleId, inside: Inside) -> (VoxelPair, OccupancyGrid, Depth, Cloud) {
    let view = f64::from(id.item.0);
    let rotation = rotation_from_rpy(0.4 + 0.9 * view, 0.5 - 0.35 * view, 0.7 * view);
    let camera_from_object: Pose<CameraCv, Object> = Pose::new(rotation, Vector3::new(0.0, 0.0, 1.0));
    let object_from_camera = camera_from_object.inverse();
    let solid = |point: &Point3<f64>| {
        let p = object_from_camera.point(point);
        inside(p.x, p.y, p.z)
    };
    let camera = Intrinsics::from_horizontal_fov(640, 480, 1.047, 0.1).unwrap();
    let crop = march(&camera, &solid);
    let points: Vec<[f32; 3]> = (crop.top..crop.top + crop.height)
        .flat_map(|row| (crop.left..crop.left + crop.width).map(move |column| (column, row)))
        .filter(|(column, row)| !crop.at(*column, *row).is_nan())
        .map(|(column, row)| {
            let p = camera.unproject(f64::from(column) + 0.5, f64::from(row) + 0.5, f64::from(crop.at(column, row)));
            [p.x as f32, p.y as f32, p.z as f32]
        })
        .collect();
    let grid = placement(&points);
    let n = grid.resolution;
    let [mut partial, mut complete, mut free] = [0; 3].map(|_| OccupancyGrid::new(n));
    let anchor = grid.anchor();
    for point in &points {
        let cell = std::array::from_fn(|axis| {
            ((f64::from(point[axis]) - grid.centre[axis]) / grid.cell_size + anchor[axis]).floor() as u32
        });
        partial.set(cell);
        complete.set(cell);
    }
    let lower = grid.lower_corner();
    for cell in (0..n * n * n).map(|i| [i / n / n, i / n % n, i % n]) {
        let centre = Point3::from(std::array::from_fn::<f64, 3, _>(|axis| {
            lower[axis] + (f64::from(cell[axis]) + 0.5) * grid.cell_size
        }));
        if solid(&centre) {
            complete.set(cell);
        }
        let (u, v) = camera.project(&centre);
        let depth = crop.at(u as u32, v as u32);
        if !partial.get(cell) && (depth.is_nan() || centre.z < f64::from(depth) - grid.cell_size) {
            free.set(cell);
        }
    }
    let pair = VoxelPair {
        sample: id,
        grid,
        camera,
        camera_from_object,
        world_from_object: Pose::new(*camera_from_object.rotation(), *camera_from_object.translation()),
        world_from_camera: Pose::identity(),
        partial_cells: partial.count(),
        complete_cells: complete.count(),
        both_cells: partial.count_both(&complete),
        partial,
        complete,
        solid_share: if id.item.0.is_multiple_of(5) { 0.972 } else { 1.0 },
    };
    (pair, free, Depth { sample: id, crop, coding: DepthCoding::F32 }, Cloud { sample: id, points })
}

/// Depth where rays first meet the shape, in steps of a millimetre along z.
fn march(camera: &Intrinsics, solid: &impl Fn(&Point3<f64>) -> bool) -> DepthCrop {
    let (left, top, width, height) = (260, 180, 120, 120);
    let pixel = |row: u32, column: u32| {
        (0..200)
            .map(|step| 0.9 + f64::from(step) * 1e-3)
            .find(|z| solid(&camera.unproject(f64::from(left + column) + 0.5, f64::from(top + row) + 0.5, *z)))
            .map_or(f32::NAN, |z| z as f32)
    };
    let depth = (0..height).flat_map(|row| (0..width).map(move |column| (row, column))).map(|(r, c)| pixel(r, c));
    let depth = depth.collect();
    DepthCrop { left, top, width, height, depth }
}

/// The spec's placement: the box of the seen points.
fn placement(points: &[[f32; 3]]) -> GridPlacement {
    let (mut lower, mut upper) = ([f64::INFINITY; 3], [f64::NEG_INFINITY; 3]);
    for point in points {
        for axis in 0..3 {
            lower[axis] = lower[axis].min(f64::from(point[axis]));
            upper[axis] = upper[axis].max(f64::from(point[axis]));
        }
    }
    let sides: [f64; 3] = std::array::from_fn(|axis| upper[axis] - lower[axis]);
    GridPlacement {
        resolution: 40,
        centre: Point3::from(std::array::from_fn::<f64, 3, _>(|axis| (lower[axis] + upper[axis]) / 2.0)),
        cell_size: sides.into_iter().fold(0.0, f64::max) / 32.0,
    }
}
