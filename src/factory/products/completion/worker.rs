//! The producer of completion pairs for one thread: loads an object, then makes its views one by one.

use super::{
    depth::DepthSource,
    encode::{MadeView, ViewEncoder, channels_of},
    object::CompletionObject,
    occlusion::ViewOcclusion,
    scene::{camera_from_world, distance, world_from_object},
    settings::{CompletionJob, CompletionSettings},
};
use crate::{
    ProduceError, SampleWriter,
    objects::prepared,
    products::pair::{
        empty_pair, fill_grids,
        touch::{HandOnObject, TouchByHand, TouchingHand},
    },
    work::Producer,
};
use format::{Channel, PairFacts, VoxelPair};
use kernel::{
    cancel::Cancel,
    geom::{DepthCrop, SimdLevel},
    ids::{ItemId, SampleId},
    render::{Rasteriser, SensorScratch},
    seed::Stream,
    voxel::{NoGrid, ViewGrids},
};

/// Reason why a view makes no sample.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum RejectReason {
    /// No pixel sees the object.
    NothingSeen,
    /// All pixels see one point: a grid has no size.
    NoExtent,
    /// Fewer occupied partial cells than the gate requires.
    FewPartialCells,
    /// The occluder hides a share of the object outside the limits of the job.
    HiddenShare,
    /// The occluder leaves too little of the object.
    LittleRemains,
    /// Too small a share of the partial grid is in the complete one.
    LowOverlap,
}

impl RejectReason {
    /// Name that is counted.
    pub fn name(self) -> &'static str {
        match self {
            Self::NothingSeen => "nothing_seen",
            Self::NoExtent => "no_extent",
            Self::FewPartialCells => "few_partial_cells",
            Self::HiddenShare => "hidden_share",
            Self::LittleRemains => "little_remains",
            Self::LowOverlap => "low_overlap",
        }
    }
}

/// Reason why a view gave no pair.
enum PairError {
    Grid(NoGrid),
    Failed(ProduceError),
}

impl From<NoGrid> for PairError {
    fn from(none: NoGrid) -> Self {
        Self::Grid(none)
    }
}

impl From<ProduceError> for PairError {
    fn from(error: ProduceError) -> Self {
        Self::Failed(error)
    }
}

/// The producer of one thread; its memory is reused from view to view.
pub struct CompletionWorker<'j> {
    scratch: ViewScratch<'j>,
    /// The job's hand.
    hand: Option<TouchingHand>,
    /// The object that was loaded last, with its index in the job.
    loaded: Option<(usize, LoadedObject)>,
}

/// An object, and the job's hand.
struct LoadedObject {
    object: CompletionObject,
    hand: Option<HandOnObject>,
}

/// Memory in which views are made.
struct ViewScratch<'j> {
    job: &'j CompletionJob,
    settings: &'j CompletionSettings,
    seed: u64,
    level: SimdLevel,
    rasteriser: Rasteriser,
    grids: ViewGrids,
    sensor: SensorScratch,
    source: DepthSource,
    crop: DepthCrop,
    occlusion: ViewOcclusion,
    pair: VoxelPair,
    encoder: ViewEncoder,
}

impl<'j> CompletionWorker<'j> {
    /// A producer for one thread; without a hand it cannot touch by one.
    ///
    /// # Errors
    /// When the job's renderer is not available, or its hand cannot be read.
    pub fn new(
        job: &'j CompletionJob,
        seed: u64,
        level: SimdLevel,
        by_hand: Option<&TouchByHand>,
    ) -> Result<Self, ProduceError> {
        let settings = &job.settings;
        let scratch = ViewScratch {
            source: DepthSource::new(settings.renderer),
            job,
            settings,
            seed,
            level,
            rasteriser: Rasteriser::new(level),
            grids: ViewGrids::new(level),
            sensor: SensorScratch::new(level),
            crop: DepthCrop::default(),
            occlusion: ViewOcclusion::default(),
            pair: VoxelPair {
                world_from_camera: camera_from_world().inverse(),
                ..empty_pair(settings.resolution, settings.camera)
            },
            encoder: ViewEncoder::default(),
        };
        let hand = by_hand.map(|by_hand| TouchingHand::new(&by_hand.hand)).transpose()?;
        Ok(Self { scratch, hand, loaded: None })
    }

    /// Prepares an object again and checks that it is still the one of the job.
    fn prepare(&self, index: usize, cancel: &Cancel) -> Result<LoadedObject, ProduceError> {
        let ViewScratch { job, settings, seed, level, source, .. } = &self.scratch;
        let prepared = prepared(&job.objects.list[index])?;
        cancel.check()?;
        let sim = source.model(prepared.mesh())?;
        if self.hand.is_some() {
            prepared.make_contact_surface(cancel)?;
        }
        cancel.check()?;
        let hand = self.hand.as_ref().map(|hand| hand.on_object(&prepared)).transpose()?;
        Ok(LoadedObject { object: CompletionObject::new(&prepared, settings, *seed, *level, sim), hand })
    }

    /// Makes the depth image of an item of the loaded object, after the sensor, without storing anything.
    ///
    /// # Errors
    /// When a renderer fails.
    pub fn depth_of(&mut self, item: ItemId) -> Result<&DepthCrop, ProduceError> {
        let (_, loaded) = self.loaded.as_ref().expect("an object is loaded before its views are made");
        match self.scratch.fill_pair(&loaded.object, &SampleId::of_object(loaded.object.id, item)) {
            Err(PairError::Failed(error)) => Err(error),
            Ok(()) | Err(PairError::Grid(_)) => Ok(&self.scratch.crop),
        }
    }
}

impl ViewScratch<'_> {
    /// Makes one view, and stores or rejects it.
    fn make(
        &mut self,
        loaded: &mut LoadedObject,
        item: ItemId,
        out: &mut SampleWriter<'_>,
    ) -> Result<(), ProduceError> {
        let LoadedObject { object, hand } = loaded;
        let sample = SampleId::of_object(object.id, item);
        let reason = match self.fill_pair(object, &sample) {
            Ok(()) => self.gate(),
            Err(PairError::Failed(error)) => return Err(error),
            Err(PairError::Grid(none)) if self.occlusion.occluder().is_some() => {
                Some((RejectReason::LittleRemains, none.to_string()))
            }
            Err(PairError::Grid(NoGrid::NothingSeen)) => {
                Some((RejectReason::NothingSeen, "no pixel sees the object".to_owned()))
            }
            Err(PairError::Grid(NoGrid::NoExtent)) => {
                Some((RejectReason::NoExtent, "all pixels see one point".to_owned()))
            }
        };
        let record = self.settings.occlusion.as_ref().map(|_| self.occlusion.record(sample));
        let occlusion = record.as_ref().map(|record| record.facts()).unwrap_or_default();
        let facts = PairFacts { occlusion, ..self.pair.facts() };
        if let Some((reason, detail)) = reason {
            return out.reject(sample, facts, reason.name(), &detail);
        }
        let made = MadeView {
            settings: self.settings,
            seed: self.seed,
            pair: &self.pair,
            crop: &self.crop,
            occlusion: &self.occlusion,
            object,
        };
        self.encoder.encode(&made, &mut self.grids, hand.as_mut(), out)?;
        out.keep(sample, facts)
    }

    fn fill_pair(&mut self, object: &CompletionObject, sample: &SampleId) -> Result<(), PairError> {
        let settings = self.settings;
        let view = settings.views.rotation(sample.item.0 as usize);
        let rotation = object.own_rotation.map_or(view, |own| view * own);
        let distance = distance(settings, &object.bounds, || Stream::of_sample(self.seed, sample, "distance"));
        let pair = &mut self.pair;
        pair.sample = *sample;
        pair.world_from_object = world_from_object(&object.pivot, &rotation, distance);
        pair.camera_from_object = camera_from_world() * pair.world_from_object;

        match &mut self.source {
            DepthSource::Raster => {
                let seen = self.rasteriser.render(&object.kernel.render, &settings.camera, &pair.camera_from_object);
                self.crop.clone_from(seen);
            }
            source => source.render(&object.sim, &settings.camera, &pair.camera_from_object, &mut self.crop)?,
        }
        let (seed, occlusion) = (self.seed, &mut self.occlusion);
        let stream = |name: &'static str| move || Stream::of_sample(seed, sample, name);
        occlusion.draw(settings, &mut self.rasteriser, &self.crop, stream("occlusion"));
        occlusion.measure(settings, &mut self.sensor, &mut self.crop, stream("sensor"));

        fill_grids(&mut self.grids, &settings.rules(), &object.kernel, &self.crop, pair)?;
        Ok(())
    }

    /// Why the pair of this view is left out, with numbers.
    fn gate(&self) -> Option<(RejectReason, String)> {
        let (pair, gate) = (&self.pair, &self.settings.gate);
        let cells = pair.partial_cells;
        let asked = format!("{cells} cells, {} asked", gate.min_partial_cells);
        if let (Some(occluder), Some(model)) = (self.occlusion.occluder(), &self.settings.occlusion) {
            let (share, [min, max]) = (occluder.hidden_share(), model.hidden);
            if !(min..=max).contains(&share) {
                return Some((RejectReason::HiddenShare, format!("{share:.3} hidden, {min} to {max} asked")));
            }
            if cells < gate.min_partial_cells {
                let hidden = format!("{asked}; {} of {} pixels hidden", occluder.hidden_pixels, occluder.object_pixels);
                return Some((RejectReason::LittleRemains, hidden));
            }
        }
        if cells < gate.min_partial_cells {
            return Some((RejectReason::FewPartialCells, asked));
        }
        let overlap = f64::from(pair.both_cells) / f64::from(cells);
        (gate.min_overlap > 0.0 && overlap < gate.min_overlap).then(|| {
            (
                RejectReason::LowOverlap,
                format!("{} of {cells} cells overlap, share {} asked", pair.both_cells, gate.min_overlap),
            )
        })
    }
}

impl Producer for CompletionWorker<'_> {
    fn channels(&self) -> Vec<Channel> {
        channels_of(self.scratch.settings)
    }

    fn load(&mut self, subject: usize, cancel: &Cancel) -> Result<(), ProduceError> {
        if self.loaded.as_ref().is_none_or(|(index, _)| *index != subject) {
            // The memory of the object before goes first.
            self.loaded = None;
            self.loaded = Some((subject, self.prepare(subject, cancel)?));
        }
        Ok(())
    }

    fn produce(&mut self, item: ItemId, out: &mut SampleWriter<'_>) -> Result<(), ProduceError> {
        let (_, loaded) = self.loaded.as_mut().expect("an object is loaded before its views are made");
        self.scratch.make(loaded, item, out)
    }
}
