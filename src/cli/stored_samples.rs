//! Stored samples as input of a network.

use std::cell::OnceCell;

use super::{
    exit::{Exit, Failure},
    folder::{refuse_other_products, refuse_set},
};
use format::{
    Clutter, Coverage, Depth, Occlusion, PixelMask, Visibility, VoxelPair,
    dataset::{DatasetReader, Sample, Selection},
};
use kernel::{
    files::Folder,
    geom::{DepthCrop, Intrinsics, OccupancyGrid},
    ids::{ObjectId, SampleIndex},
    words::{Show, Split},
};
use nalgebra::Vector3;
use perception::{DepthFrame, without_outliers};
use runtime::completion::{CompletionModel, InputName, Inputs, Prediction, SupportPlane, completable_products};
use surface::{CubeField, SeenObject};

/// A sample with all inputs of networks, and the truth.
pub struct StoredSample {
    pub name: String,
    /// The object that is completed.
    pub object: ObjectId,
    pub pair: VoxelPair,
    /// Cells that the camera sees through, and those of the table or of a bin's floor.
    pub free: Option<OccupancyGrid>,
    /// Plane z = 0 of the world below a body of a scene; `None` for an isolated object.
    pub support: Option<SupportPlane>,
    pub touch: Option<OccupancyGrid>,
    /// Solid share of each cell, if stored.
    pub coverage: Option<CubeField>,
    /// Depths of the object, if stored.
    depth: Option<DepthCrop>,
    /// Pixels that see something in front of the object.
    occluder: Option<PixelMask>,
    /// Made on first use and shared by all methods.
    picture: OnceCell<DepthFrame>,
    seen: OnceCell<SeenObject>,
    seen_depths: OnceCell<Vec<f32>>,
}

/// Samples of a dataset in order, of one split or of all, at most `limit` of them, spread evenly; `verb` is for messages.
pub fn choose_samples(
    folder: &Folder,
    verb: &str,
    split: Option<&str>,
    limit: Option<u64>,
) -> Result<(DatasetReader, Vec<SampleIndex>), Failure> {
    refuse_set(folder)?;
    refuse_other_products(folder, verb, &completable_products())?;
    let split = split.map(|name| {
        let known = Split::ALL.map(Split::name).join(", ");
        Split::from_name(name)
            .ok_or_else(|| Failure::message(Exit::BadSpec, format!("--split {name}: no such split; one of {known}")))
    });
    let selection = Selection { split: split.transpose()?, subset: None };
    let reader = DatasetReader::open(folder)?;
    let all: Vec<SampleIndex> = reader.indices(selection).filter(|index| reader.is_kept(*index)).collect();
    let count = limit.map_or(all.len(), |limit| usize::try_from(limit).unwrap_or(usize::MAX).min(all.len()));
    let chosen: Vec<SampleIndex> = (0..count).map(|index| all[index * all.len() / count]).collect();
    if chosen.is_empty() {
        let message = format!("{}: no sample is in that split", folder.path().shown());
        return Err(Failure::message(Exit::BadSpec, message));
    }
    Ok((reader, chosen))
}

/// Reads a sample that the dataset lists.
pub fn listed(reader: &DatasetReader, index: SampleIndex) -> Result<Sample, Failure> {
    reader.sample(index)?.ok_or_else(|| {
        Failure::message(Exit::Failed, format!("{}: a listed sample is missing", reader.folder().path().shown()))
    })
}

impl StoredSample {
    /// Reads a sample.
    pub fn read(reader: &DatasetReader, index: SampleIndex) -> Result<Self, Failure> {
        let sample = listed(reader, index)?;
        let pair = sample.read::<VoxelPair>()?;
        let coverage = sample.find::<Coverage>()?.and_then(|coverage| {
            let values = coverage.share.iter().map(|share| f32::from(*share) / 255.0).collect();
            CubeField::from_values(coverage.resolution as usize, values)
        });
        let clutter = sample.find::<Clutter>()?;
        let support = clutter.as_ref().map(|_| support_of(&pair));
        let mut free = sample.find::<Visibility>()?.map(|visibility| visibility.free);
        if let (Some(free), Some(clutter), Some(support)) = (&mut free, &clutter, &support) {
            set_below(free, &pair, &clutter.others_solid, support);
        }
        Ok(Self {
            name: sample.id.to_string(),
            object: sample.object()?,
            free,
            support,
            touch: sample.touched()?.map(|touched| touched.tactile),
            coverage,
            depth: sample.find::<Depth>()?.map(|depth| depth.crop),
            occluder: sample.find::<Occlusion>()?.map(|occlusion| occlusion.mask),
            picture: OnceCell::new(),
            seen: OnceCell::new(),
            seen_depths: OnceCell::new(),
            pair,
        })
    }

    /// The depth picture, if depth is stored.
    pub fn picture(&self) -> Option<&DepthFrame> {
        let crop = self.depth.as_ref()?;
        let camera = self.pair.camera;
        Some(self.picture.get_or_init(|| DepthFrame::new(camera, crop.whole(camera.width, camera.height))))
    }

    /// The camera, and its depth per pixel [m]: NaN is unknown, infinity is empty space. A perfect sensor has a return wherever
    /// there is a surface. `None` without stored depth.
    pub fn seen_depths(&self, is_perfect: bool) -> Option<(Intrinsics, &[f32])> {
        let frame = self.picture()?;
        let seen = |(pixel, depth): (u32, &f32)| {
            if is_perfect && depth.is_nan() && !self.is_hidden(pixel) { f32::INFINITY } else { *depth }
        };
        let depths = self.seen_depths.get_or_init(|| (0..).zip(&frame.depth).map(seen).collect());
        Some((frame.camera, depths))
    }

    /// The object as the camera saw it. Pixels that show an occluder are unknown.
    pub fn seen_object(&self) -> Result<&SeenObject, Failure> {
        let Some(frame) = self.picture() else {
            let message = "the dataset stores no depth, which --method primitive and --detail thesis and joined require: make it with channels.depth = \"f32\"";
            return Err(Failure::message(Exit::BadSpec, message));
        };
        Ok(self.seen.get_or_init(|| self.object_in(frame)))
    }

    /// Whether something in front of the object is at a pixel.
    fn is_hidden(&self, pixel: u32) -> bool {
        let width = self.pair.camera.width;
        self.occluder.as_ref().is_some_and(|mask| mask.get(pixel % width, pixel / width))
    }

    fn object_in(&self, frame: &DepthFrame) -> SeenObject {
        let returns: Vec<u32> = frame.returns().collect();
        // Flying pixels of a sensor model, like those of a camera.
        let object = without_outliers(frame, &returns);
        let is_doubtful = |pixel: &u32| match frame.depth[*pixel as usize].is_nan() {
            true => self.is_hidden(*pixel),
            false => object.binary_search(pixel).is_err(),
        };
        let doubtful: Vec<u32> = (0..frame.depth.len() as u32).filter(is_doubtful).collect();
        SeenObject::new(&frame.camera, &frame.depth, &object, &doubtful)
    }

    /// Completes the sample with a model; an input that the dataset does not store is an error.
    pub fn complete(&self, model: &CompletionModel) -> Result<Prediction, Failure> {
        let partial = CubeField::from_grid(&self.pair.partial);
        let [free, touch] = [&self.free, &self.touch].map(|grid| grid.as_ref().map(CubeField::from_grid));
        let inputs = Inputs { partial: Some(&partial), free: free.as_ref(), touch: touch.as_ref() };
        let missing = model.inputs().iter().find(|name| inputs.get(**name).is_none());
        if let Some(name) = missing {
            let remedy = match name {
                InputName::Partial => "every completion dataset has it",
                InputName::Free => "make the dataset with channels.visibility = true",
                InputName::Touch => "make the dataset with touch",
            };
            let message = format!("the model requires the input `{name}`, which the dataset does not store: {remedy}");
            return Err(Failure::message(Exit::BadSpec, message));
        }
        model.predict(&inputs).map_err(|error| Failure::new(Exit::BadSpec, error))
    }
}

/// The plane z = 0 of the world, in the camera's frame.
fn support_of(pair: &VoxelPair) -> SupportPlane {
    let [_, _, _, _, _, _, _, _, x, y, z, offset] = pair.world_from_camera.to_rows();
    SupportPlane { normal: [x, y, z].into(), offset }
}

/// Sets the cells below a support that something other than the object is in: in a tilted bin, free space is below z = 0, too.
/// A picture's own plane is treated in the same way (`NetworkInput`).
fn set_below(free: &mut OccupancyGrid, pair: &VoxelPair, others: &OccupancyGrid, support: &SupportPlane) {
    let corner = pair.grid.lower_corner();
    for cell in others.cells().filter(|cell| !pair.partial.get(*cell)) {
        let centre = corner + Vector3::from(cell.map(|index| (f64::from(index) + 0.5) * pair.grid.cell_size));
        if support.height(&centre) < 0.0 {
            free.set(cell);
        }
    }
}
