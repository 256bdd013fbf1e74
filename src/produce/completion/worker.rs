//! One thread's workshop: loads an object, then makes its views one by one.

use nalgebra::Point3;

use super::{
    depth::DepthSource,
    payloads::{Made, Payloads},
    scene::{camera_from_world, distance, pivot_point, world_from_object},
    touch::TouchSurface,
};
#[cfg(feature = "sim")]
use super::{
    depth::SimObject,
    feel::{HandBeforeObject, TouchingHand},
};
use crate::{
    assets::{PreparedMesh, Winding},
    geom::{Aabb, DepthCrop, GridPlacement, OccupancyGrid, Pose, SimdLevel},
    ids::{ObjectId, SampleId, ViewId},
    job::{Completion, CompletionJob},
    produce::{
        Outcome, ProduceError, Producer,
        objects::{inside_test, prepared},
    },
    record::{Channel, VoxelPair},
    render::{Rasteriser, SensorScratch},
    seed::Stream,
    voxel::{
        NoGrid, SolidObject, ViewGrids,
        channels::{CoverageBlocks, Surface},
        solid_occupancy,
    },
};

/// Why a view makes no sample.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum RejectReason {
    /// No pixel sees the object.
    NothingSeen,
    /// All pixels see one point: a grid has no size.
    NoExtent,
    /// Fewer occupied partial cells than the gate asks for.
    FewPartialCells,
    /// Too small a share of the partial grid lies in the complete one.
    LowOverlap,
}

impl RejectReason {
    /// The name that is counted.
    pub fn name(self) -> &'static str {
        match self {
            Self::NothingSeen => "nothing_seen",
            Self::NoExtent => "no_extent",
            Self::FewPartialCells => "few_partial_cells",
            Self::LowOverlap => "low_overlap",
        }
    }
}

/// An object ready for its views.
pub struct CompletionObject {
    id: ObjectId,
    bounds: Aabb,
    pivot: Point3<f64>,
    pub(super) kernel: SolidObject,
    #[cfg(feature = "sim")]
    sim: SimObject,
    /// For the channels that want them.
    pub(super) coverage: Option<CoverageBlocks>,
    pub(super) surface: Option<Surface>,
    /// For touch, where the job wants it.
    pub(super) touch: Option<TouchSurface>,
}

/// Why a view gave no pair.
enum Unseen {
    Grid(NoGrid),
    Failed(ProduceError),
}

impl From<NoGrid> for Unseen {
    fn from(none: NoGrid) -> Self {
        Self::Grid(none)
    }
}

impl From<ProduceError> for Unseen {
    fn from(error: ProduceError) -> Self {
        Self::Failed(error)
    }
}

/// One thread's workshop; its memory is reused from view to view.
pub struct CompletionWorker<'j> {
    job: &'j CompletionJob,
    settings: &'j Completion,
    seed: u64,
    level: SimdLevel,
    /// The object that was loaded last, and its place in the job.
    loaded: Option<(usize, CompletionObject)>,
    /// The job's hand, and it before the object that was loaded last.
    #[cfg(feature = "sim")]
    hand: Option<TouchingHand>,
    #[cfg(feature = "sim")]
    touching: Option<HandBeforeObject>,
    rasteriser: Rasteriser,
    grids: ViewGrids,
    sensor: SensorScratch,
    source: DepthSource,
    crop: DepthCrop,
    pair: VoxelPair,
    payloads: Payloads,
}

impl<'j> CompletionWorker<'j> {
    /// A workshop for one thread.
    ///
    /// # Errors
    /// When the job's renderer is not available.
    pub fn new(job: &'j CompletionJob, seed: u64, level: SimdLevel) -> Result<Self, ProduceError> {
        let settings = &job.settings;
        Ok(Self {
            source: DepthSource::new(settings.renderer)?,
            job,
            settings,
            seed,
            level,
            loaded: None,
            #[cfg(feature = "sim")]
            hand: settings.touch.by_hand.as_ref().map(|by_hand| TouchingHand::new(&by_hand.hand)).transpose()?,
            #[cfg(feature = "sim")]
            touching: None,
            rasteriser: Rasteriser::new(level),
            grids: ViewGrids::new(level),
            sensor: SensorScratch::default(),
            crop: DepthCrop::default(),
            pair: empty_pair(settings),
            payloads: Payloads::new(settings),
        })
    }

    /// Prepares an object again and checks that it is still the one of the job.
    fn prepare(&mut self, place: usize) -> Result<CompletionObject, ProduceError> {
        let object = &self.job.objects[place];
        let prepared = prepared(object)?;
        #[cfg(feature = "sim")]
        let sim = self.source.model(&prepared.mesh)?;
        #[cfg(feature = "sim")]
        if let Some(hand) = &self.hand {
            self.touching = Some(hand.before(&prepared.mesh, inside_test(&prepared.record))?);
        }
        Ok(CompletionObject::new(
            prepared,
            self.settings,
            self.level,
            #[cfg(feature = "sim")]
            sim,
        ))
    }

    fn make(&mut self, object: &CompletionObject, view: ViewId) -> Result<(SampleId, Outcome), ProduceError> {
        let sample = SampleId::of_object(object.id, view);
        let reason = match self.fill_pair(object, &sample) {
            Ok(()) => self.gate(),
            Err(Unseen::Failed(error)) => return Err(error),
            Err(Unseen::Grid(NoGrid::NothingSeen)) => {
                Some((RejectReason::NothingSeen, "no pixel sees the object".to_owned()))
            }
            Err(Unseen::Grid(NoGrid::NoExtent)) => {
                Some((RejectReason::NoExtent, "all pixels see one point".to_owned()))
            }
        };
        let facts = self.pair.facts().into();
        if let Some((reason, detail)) = reason {
            self.payloads.clear();
            return Ok((sample, Outcome::Rejected { reason: reason.name(), detail, facts }));
        }
        let made = Made { settings: self.settings, seed: self.seed, pair: &self.pair, crop: &self.crop, object };
        self.payloads.encode(
            &made,
            &mut self.grids,
            #[cfg(feature = "sim")]
            self.touching.as_mut(),
        )?;
        Ok((sample, Outcome::Kept(facts)))
    }

    /// The depth image of the last sample, after the sensor.
    pub fn depth(&self) -> &DepthCrop {
        &self.crop
    }

    /// The pair of the last sample.
    pub fn pair(&self) -> &VoxelPair {
        &self.pair
    }

    fn fill_pair(&mut self, object: &CompletionObject, sample: &SampleId) -> Result<(), Unseen> {
        let settings = self.settings;
        let rotation = settings.views.rotation(sample.view.0 as usize);
        let distance = distance(settings, &object.bounds, || Stream::of_sample(self.seed, sample, "distance"));
        let pair = &mut self.pair;
        (pair.partial_cells, pair.complete_cells, pair.both_cells, pair.solid_share) = (0, 0, 0, 0.0);
        pair.sample = *sample;
        pair.world_from_object = world_from_object(&object.pivot, &rotation, distance);
        pair.camera_from_object = camera_from_world() * pair.world_from_object;

        match &mut self.source {
            DepthSource::Raster => {
                let seen = self.rasteriser.render(&object.kernel.render, &settings.camera, &pair.camera_from_object);
                self.crop.clone_from(seen);
            }
            #[cfg(feature = "sim")]
            source => source.look(&object.sim, &settings.camera, &pair.camera_from_object, &mut self.crop)?,
        }
        if let Some(sensor) = &settings.sensor {
            let mut stream = Stream::of_sample(self.seed, sample, "sensor");
            sensor.apply_with(&mut self.sensor, &settings.camera, &mut self.crop, &mut stream);
        }

        let (grids, drop_zero) = (&mut self.grids, settings.drop_index_zero);
        pair.grid = grids.place(&self.crop, &settings.camera, settings.resolution)?;
        grids.partial(&self.crop, &settings.camera, &pair.grid, drop_zero, &mut pair.partial);
        pair.partial_cells = pair.partial.count();
        if pair.partial_cells < settings.gate.min_partial_cells {
            // The complete grid of a view that is left out need not be made.
            return Ok(());
        }
        let pose = &pair.camera_from_object;
        grids.complete(&object.kernel, pose, &pair.grid, settings.truth, drop_zero, &mut pair.complete);
        pair.complete_cells = pair.complete.count();
        pair.both_cells = pair.partial.count_both(&pair.complete);
        pair.solid_share = grids.solid_share(&object.kernel, pose, &pair.grid);
        Ok(())
    }

    /// Why the pair of this view is left out, with numbers.
    fn gate(&self) -> Option<(RejectReason, String)> {
        let (pair, gate) = (&self.pair, &self.settings.gate);
        let cells = pair.partial_cells;
        if cells < gate.min_partial_cells {
            return Some((RejectReason::FewPartialCells, format!("{cells} cells, {} asked", gate.min_partial_cells)));
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
        self.payloads.channels()
    }

    fn load(&mut self, subject: usize) -> Result<(), ProduceError> {
        if self.loaded.as_ref().is_none_or(|(place, _)| *place != subject) {
            // The memory of the one before goes first.
            self.loaded = None;
            #[cfg(feature = "sim")]
            {
                self.touching = None;
            }
            self.loaded = Some((subject, self.prepare(subject)?));
        }
        Ok(())
    }

    fn produce(&mut self, view: ViewId) -> Result<(SampleId, Outcome), ProduceError> {
        let (place, object) = self.loaded.take().expect("an object is loaded before its views are made");
        let made = self.make(&object, view);
        self.loaded = Some((place, object));
        made
    }

    fn payloads(&self) -> Vec<(Channel, &[u8])> {
        self.payloads.iter().collect()
    }
}

impl CompletionObject {
    fn new(
        prepared: PreparedMesh,
        settings: &Completion,
        level: SimdLevel,
        #[cfg(feature = "sim")] sim: SimObject,
    ) -> Self {
        let PreparedMesh { mesh, record } = prepared;
        let lower = Point3::from(record.lower);
        let bounds = Aabb { min: lower, max: lower + nalgebra::Vector3::from(record.extents) };
        let solid = solid_occupancy(&mesh, inside_test(&record), settings.solid_with_surface);
        let channels = &settings.channels;
        let wants_surface = channels.tsdf.is_some() || channels.implicit.is_some();
        Self {
            id: record.object,
            pivot: pivot_point(settings.pivot, &bounds),
            bounds,
            #[cfg(feature = "sim")]
            sim,
            coverage: channels.coverage.then(|| CoverageBlocks::new(&solid)),
            surface: wants_surface.then(|| Surface::new(&mesh)),
            touch: settings.touch.is_asked().then(|| TouchSurface::new(&mesh, level)),
            kernel: SolidObject::new(
                &mesh,
                solid,
                record.watertight,
                record.winding == Winding::Outward,
                settings.truth,
            ),
        }
    }
}

fn empty_pair(settings: &Completion) -> VoxelPair {
    VoxelPair {
        sample: SampleId::of_object(ObjectId(crate::ids::Digest([0; 32])), ViewId(0)),
        grid: GridPlacement { resolution: settings.resolution, centre: Point3::origin(), cell_size: 1.0 },
        camera: settings.camera,
        camera_from_object: Pose::identity(),
        world_from_object: Pose::identity(),
        world_from_camera: camera_from_world().inverse(),
        partial: OccupancyGrid::new(settings.resolution),
        complete: OccupancyGrid::new(settings.resolution),
        partial_cells: 0,
        complete_cells: 0,
        both_cells: 0,
        solid_share: 0.0,
    }
}
