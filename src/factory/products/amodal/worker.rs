//! The producer of amodal pairs for one thread.

use std::{iter, sync::Arc};

use super::{
    hands::SceneHands,
    image::{BodyPoints, ViewImage},
    meshes::{LoadedObject, LoadedObjects},
    neighbours::{Neighbours, window_of},
    scene::{LoadedScene, StillSolid},
    settings::{AmodalJob, AmodalSettings},
    touch::obstacles,
};
use crate::{
    ProduceError, SampleWriter,
    products::{
        pair::{ChannelScratch, ChannelView, empty_pair, fill_grids, touch::SeenSurface},
        viewed::{ViewedScene, changed_view},
    },
    work::Producer,
};
use format::{
    AmodalFacts, Channel, Clutter, Depth, Product, SceneImage, SceneInstance, TactileContacts, VoxelPair,
    dataset::{DatasetReader, Sample},
};
use kernel::{
    cancel::Cancel,
    geom::{DepthCrop, Intrinsics, SimdLevel},
    ids::{ItemId, SampleId},
    seed::Stream,
    voxel::ViewGrids,
};

/// Reason of a body whose view was rejected.
const NO_VIEW: &str = "no_view";

/// Reason of a body without a pixel of its silhouette in the image.
const OUTSIDE_VIEW: &str = "outside_view";

/// Reason of a body that is seen by too small a share.
const HIDDEN: &str = "hidden";

/// Reason of a body whose partial grid has too few cells.
const FEW_PARTIAL_CELLS: &str = "few_partial_cells";

/// Parts that all threads share.
pub(super) struct Shared<'j> {
    pub job: &'j AmodalJob,
    pub seed: u64,
    pub level: SimdLevel,
    /// The dataset of views.
    pub views: DatasetReader,
    pub objects: LoadedObjects,
}

/// The producer of one thread; its memory is reused from body to body.
pub struct AmodalWorker<'s> {
    shared: &'s Shared<'s>,
    /// Index of the scene that was loaded last.
    scene: usize,
    /// The image that was read last.
    image: Option<ViewImage>,
    /// Container and table of the scene whose image was drawn last.
    still: Option<StillSolid>,
    /// The job's hand, where it has one.
    hands: Option<SceneHands>,
    scratch: PairScratch,
}

/// Memory in which pairs are made.
struct PairScratch {
    grids: ViewGrids,
    pair: VoxelPair,
    clutter: Clutter,
    neighbours: Neighbours,
    sight: DepthCrop,
    channels: ChannelScratch,
    touch: TactileContacts,
}

impl<'s> AmodalWorker<'s> {
    /// A producer for one thread.
    ///
    /// # Errors
    /// When the hand cannot be read.
    pub(super) fn new(shared: &'s Shared<'s>) -> Result<Self, ProduceError> {
        let by_hand = shared.job.settings.touch.by_hand.as_ref();
        let hands = by_hand.map(|touch| SceneHands::new(&touch.hand)).transpose()?;
        let resolution = shared.job.settings.rules.resolution;
        let camera = Intrinsics { width: 1, height: 1, fx: 1.0, fy: 1.0, cx: 0.5, cy: 0.5, near: 0.01 };
        let pair = empty_pair(resolution, camera);
        let scratch = PairScratch {
            grids: ViewGrids::new(shared.level),
            clutter: Clutter::none(pair.sample, pair.sample.subject, resolution),
            touch: TactileContacts::none(pair.sample),
            pair,
            neighbours: Neighbours::default(),
            sight: DepthCrop::default(),
            channels: ChannelScratch::default(),
        };
        Ok(Self { shared, scene: 0, image: None, still: None, hands, scratch })
    }
}

/// The meshes of the scene of an image, whose depth is read, or, where no sensor measured it, rendered again.
fn load_scene<'w>(
    Shared { job, level, objects, .. }: &Shared<'_>,
    still: &'w mut Option<StillSolid>,
    image: &mut ViewImage,
    stored: &Sample,
) -> Result<LoadedScene<'w>, ProduceError> {
    let SceneImage { container, table, .. } = &image.record;
    still.take_if(|still| !still.is_of(container, *table));
    let still = still.get_or_insert_with(|| StillSolid::new(container, *table, *level));
    let bodies = image.record.bodies.iter().map(|body| objects.get(body.object, &job.settings, *level));
    let bodies: Vec<Arc<LoadedObject>> = bodies.collect::<Result<_, _>>()?;
    if image.record.point_instances.is_some() {
        let depth = stored.find::<Depth>()?.ok_or_else(|| changed_view(stored, "it has no depth"))?;
        image.measured(depth.crop);
    } else if !image.render(&bodies, still) {
        return Err(changed_view(stored, "its scene, drawn again, is another picture"));
    }
    Ok(LoadedScene { bodies, still })
}

/// Why a body is rejected before any computation, with numbers.
fn unseen(body: &SceneInstance, settings: &AmodalSettings) -> Option<(&'static str, String)> {
    let (share, least) = (body.visible_share(), settings.min_visible_share);
    if body.mask.count() == 0 {
        return Some((OUTSIDE_VIEW, "no pixel of its silhouette is in the image".to_owned()));
    }
    let seen = || format!("{share:.3} of it is seen, {least} asked: {} of {} px", body.pixels_visible, body.pixels_all);
    (share < least).then(|| (HIDDEN, seen()))
}

impl PairScratch {
    /// Enters a body into the records, without a cell.
    fn begin(&mut self, sample: SampleId, view: &ViewImage) {
        let (Self { pair, clutter, .. }, image) = (self, &view.record);
        let body = &image.bodies[sample.instance as usize - 1];
        (pair.sample, clutter.sample, clutter.object) = (sample, sample, body.object);
        (pair.camera, pair.world_from_camera) = (image.camera, image.world_from_camera);
        pair.world_from_object = body.world_from_object;
        pair.camera_from_object = view.camera_from_object(body);
        (pair.partial_cells, pair.complete_cells, pair.both_cells, pair.solid_share) = (0, 0, 0, 0.0);
        (clutter.pixels_all, clutter.pixels_visible) = (body.pixels_all, body.pixels_visible);
        (clutter.pixels_in_image, clutter.points, clutter.own_points) = (body.mask.count(), 0, 0);
        clutter.others_solid.reset(pair.grid.resolution);
    }

    /// Makes the pair of a body that is seen, and stores or rejects it.
    fn make(
        &mut self,
        shared: &Shared<'_>,
        image: &mut ViewImage,
        scene: &LoadedScene<'_>,
        hands: Option<&mut SceneHands>,
        out: &mut SampleWriter<'_>,
    ) -> Result<(), ProduceError> {
        let AmodalSettings { rules, channels, .. } = &shared.job.settings;
        let Self { grids, pair, clutter, neighbours, sight, channels: scratch, .. } = self;
        let (number, drop_zero) = (pair.sample.instance as u8, rules.drop_index_zero);

        // Its points, and the grids around them.
        let object = &scene.bodies[usize::from(number) - 1];
        let BodyPoints { all, own } = image.take_body(number, object);
        (clutter.points, clutter.own_points) = (all, own);
        let placed = fill_grids(grids, rules, &object.pair.kernel, &image.body, pair);
        if placed.is_err() || pair.partial_cells < rules.min_partial_cells {
            let cells = pair.partial_cells;
            let detail = format!("{cells} cells, {} asked; {all} points", rules.min_partial_cells);
            return out.reject(pair.sample, AmodalFacts::from_pair(pair, clutter), FEW_PARTIAL_CELLS, &detail);
        }

        // What surrounds it.
        neighbours.fill_seen(grids, image, pair, drop_zero, &mut clutter.others_seen);
        neighbours.fill_solid(grids, image, scene, pair, drop_zero, &mut clutter.others_solid);

        if let Some(payload) = out.payload(Channel::AMODAL_PAIR) {
            pair.encode(payload);
        }
        image.sight(window_of(&pair.grid, &pair.camera), sight);
        let made = ChannelView {
            product: Product::AMODAL,
            seed: shared.seed,
            camera: &pair.camera,
            pair,
            crop: &image.body,
            sight,
            ends_at_image: true,
            solid: &object.pair.kernel.solid,
            object: &object.pair.channels,
        };
        scratch.encode(channels, &made, grids, out);
        if let Some(payload) = out.payload(Channel::CLUTTER) {
            clutter.encode(payload);
        }
        self.encode_touch(shared, image, scene, hands, out)?;
        let Self { pair, clutter, .. } = self;
        out.keep(pair.sample, AmodalFacts::from_pair(pair, clutter))
    }

    /// Contacts of rays and of a hand among everything else of the scene.
    fn encode_touch(
        &mut self,
        shared: &Shared<'_>,
        image: &ViewImage,
        scene: &LoadedScene<'_>,
        hands: Option<&mut SceneHands>,
        out: &mut SampleWriter<'_>,
    ) -> Result<(), ProduceError> {
        let AmodalSettings { rules, touch, .. } = &shared.job.settings;
        let Self { pair, touch: contacts, .. } = self;
        let object = &scene.bodies[pair.sample.instance as usize - 1];
        let Some(surface) = &object.touch else { return Ok(()) };
        let around = obstacles(scene, image, pair);
        let seen = SeenSurface::new(surface, &object.pair.kernel.render, &pair.camera_from_object, &around);
        let stream = |name: &str| Stream::of_sample(shared.seed, &pair.sample, name);
        if let (Some(rays), Some(payload)) = (touch.random_rays, out.payload(Channel::AMODAL_TOUCH_RAYS)) {
            seen.random_rays(rays, pair, rules.drop_index_zero, &mut stream("touch"), contacts);
            contacts.encode(payload);
        }
        let channel = Channel::AMODAL_TOUCH_EXPLORATION;
        if let (Some(by_hand), Some(hands), Some(payload)) = (&touch.by_hand, hands, out.payload(channel)) {
            let hand = hands.with_body(pair.sample.instance as u8, image, scene)?;
            hand.touch(channel, by_hand, pair, &seen, rules.drop_index_zero, stream)?.encode(payload);
        }
        Ok(())
    }
}

impl Producer for AmodalWorker<'_> {
    fn channels(&self) -> Vec<Channel> {
        let AmodalSettings { channels, touch, .. } = &self.shared.job.settings;
        let rays = touch.random_rays.map(|_| Channel::AMODAL_TOUCH_RAYS);
        let hand = touch.by_hand.as_ref().map(|_| Channel::AMODAL_TOUCH_EXPLORATION);
        let beside = channels.stored(Product::AMODAL).chain([Channel::CLUTTER]).chain(rays).chain(hand);
        iter::once(Channel::AMODAL_PAIR).chain(beside).collect()
    }

    fn load(&mut self, subject: usize, _: &Cancel) -> Result<(), ProduceError> {
        if self.scene != subject {
            self.hands.iter_mut().for_each(SceneHands::forget);
        }
        self.scene = subject;
        Ok(())
    }

    fn produce(&mut self, item: ItemId, out: &mut SampleWriter<'_>) -> Result<(), ProduceError> {
        let shared = self.shared;
        let ViewedScene { id, bodies, cameras, .. } = &shared.job.views.scenes[self.scene];
        let view = SampleId { camera: cameras[item.0 as usize], ..SampleId::of_object(*id, item) };
        let of_body = |number: u32| SampleId { instance: number, ..view };
        let Some(stored) = shared.views.sample_of(&view)? else {
            return (1..=*bodies).try_for_each(|number| {
                out.reject(of_body(number), AmodalFacts::default(), NO_VIEW, "the view of its scene was rejected")
            });
        };
        let record = stored.read::<SceneImage>()?;
        if record.bodies.len() != *bodies as usize {
            return Err(changed_view(&stored, "it has other bodies than its scene"));
        }

        let Self { image, still, hands, scratch, .. } = self;
        let image = match image {
            Some(image) => image.with(record),
            none => none.insert(ViewImage::new(record, shared.job.settings.points, shared.level)),
        };
        let reasons = image.record.bodies.iter().map(|body| unseen(body, &shared.job.settings));
        let reasons: Vec<_> = reasons.collect();
        let scene = match reasons.iter().any(Option::is_none) {
            true => Some(load_scene(shared, still, image, &stored)?),
            false => None,
        };
        for (number, reason) in (1..).zip(reasons) {
            scratch.begin(of_body(number), image);
            if let Some((reason, detail)) = reason {
                let facts = AmodalFacts::from_pair(&scratch.pair, &scratch.clutter);
                out.reject(of_body(number), facts, reason, &detail)?;
            } else {
                scratch.make(shared, image, scene.as_ref().expect("a body is seen"), hands.as_mut(), out)?;
            }
        }
        Ok(())
    }
}
