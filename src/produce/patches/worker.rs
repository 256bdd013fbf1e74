//! One thread's workshop: loads an object's mesh, then looks at its grasps one by one.

use nalgebra::Point3;

#[cfg(feature = "sim")]
use super::colour::ColourView;
use super::{PatchHand, camera_from_object, corner, heat::HeatView};
use crate::{
    assets::object_id,
    geom::{Pose, RenderMesh, SimdLevel, TriMesh},
    ids::{SampleId, ViewId},
    job::{ChosenGrasp, GraspedObject, PatchJob},
    produce::{Outcome, ProduceError, Producer},
    record::{Channel, Depth, DepthCoding, HeatmapPatch, PATCH_POINTS, PatchFacts, PatchPoint},
    render::Rasteriser,
};

/// Reads the mesh of an object, by its place in the job; the error says why it cannot, in words.
///
/// A producer knows no dataset, so whoever makes one passes it in.
pub type MeshReader<'a> = dyn Fn(usize) -> Result<TriMesh, String> + Send + Sync + 'a;

/// Why a grasp makes no sample: the patch of this point reaches out of the image.
const OUT_OF_FRAME: [&str; PATCH_POINTS] =
    ["palm_out_of_frame", "f0_out_of_frame", "f1_out_of_frame", "f2_out_of_frame"];

/// One thread's workshop; its memory is reused from grasp to grasp.
pub struct PatchWorker<'j> {
    job: &'j PatchJob,
    hand: &'j PatchHand,
    meshes: &'j MeshReader<'j>,
    /// The object that was loaded last, by its place in the job.
    loaded: Option<(usize, RenderMesh)>,
    rasteriser: Rasteriser,
    record: HeatmapPatch,
    payload: Vec<u8>,
    /// The whole image, where the job asks for it.
    image: Option<Vec<u8>>,
    /// Where the job asks for heatmaps.
    heat: Option<HeatView>,
    /// Where the job asks for colours.
    #[cfg(feature = "sim")]
    colours: Option<ColourView>,
}

impl<'j> PatchWorker<'j> {
    /// A workshop for one thread.
    pub fn new(
        job: &'j PatchJob,
        seed: u64,
        hand: &'j PatchHand,
        meshes: &'j MeshReader<'j>,
        level: SimdLevel,
    ) -> Self {
        let settings = &job.settings;
        let point = |name: &String| PatchPoint { name: name.clone(), point: [0.0; 3], pixel: [0.0; 2], corner: [0; 2] };
        let record = HeatmapPatch {
            sample: SampleId::of_object(job.hand.id, ViewId(0)),
            grasps: job.grasps.root,
            run: 0,
            rank: 0,
            type_index: 0,
            types: job.grasps.types.chosen.clone(),
            energy: 0.0,
            epsilon: 0.0,
            space: job.grasps.space.clone(),
            hand: hand.name().to_owned(),
            hand_id: job.hand.id,
            camera: settings.camera,
            point_focal_length: settings.point_focal_length,
            camera_from_object: Pose::identity(),
            object_from_approach: Pose::identity(),
            points: hand.names().each_ref().map(point),
            side: settings.side,
            depth: Vec::new(),
            label: settings.label.name().to_owned(),
            value: 0.0,
        };
        let rasteriser = Rasteriser::new(level);
        #[cfg(not(feature = "sim"))]
        let _ = seed;
        Self {
            #[cfg(feature = "sim")]
            colours: settings.colour.map(|colour| ColourView::new(colour, settings.image, seed, &record)),
            image: settings.image.then(Vec::new),
            heat: settings.heatmap_angle.map(|angle| HeatView::new(angle, record.sample, job)),
            job,
            hand,
            meshes,
            loaded: None,
            rasteriser,
            record,
            payload: Vec::new(),
        }
    }

    fn prepare(&mut self, place: usize) -> Result<RenderMesh, ProduceError> {
        let object = &self.job.grasps.objects[place];
        let gone = |why: String| ProduceError::NoGrasps { name: object.name.clone(), why };
        let mesh = (self.meshes)(place).map_err(gone)?;
        let (found, expected) = (object_id(&mesh), object.id);
        if found != expected {
            return Err(ProduceError::MeshChanged { name: object.name.clone(), found, expected });
        }
        if object.grasps.iter().any(|grasp| grasp.joints.len() != self.hand.joints()) {
            return Err(gone(format!("its grasps are not of a hand with {} joints", self.hand.joints())));
        }
        #[cfg(feature = "sim")]
        if let Some(colours) = &mut self.colours {
            colours.turn_to(&mesh)?;
        }
        if let Some(heat) = &mut self.heat {
            heat.turn_to(object, self.job, self.hand);
        }
        // Both sides of a face are seen: nobody says here whether the mesh is closed.
        Ok(RenderMesh::new(&mesh, false))
    }

    /// Fills the record but for depth; `Err` is why there is none.
    fn fill(&mut self, object: &GraspedObject, view: ViewId, middle: &Point3<f64>) -> Result<(), (usize, String)> {
        let settings = &self.job.settings;
        let grasp = &object.grasps[view.0 as usize];
        let record = &mut self.record;
        record.sample = SampleId::of_object(object.id, view);
        (record.run, record.rank) = (grasp.run, grasp.rank);
        record.type_index = self.job.grasps.types.index_of(grasp.kind).unwrap_or_default() as u32;
        (record.energy, record.epsilon) = (grasp.energy, grasp.epsilon);
        record.value = settings.label_of(grasp);
        record.object_from_approach = grasp.object_from_approach;
        let pose = camera_from_object(&grasp.object_from_approach, middle, settings.distance);
        record.camera_from_object = pose;
        let points = self.hand.points(grasp);
        let projection = settings.projection();
        for (place, (point, record)) in points.iter().zip(&mut record.points).enumerate() {
            let seen = pose.point(point);
            if seen.z < settings.camera.near {
                return Err((place, format!("{:.3} m before the camera", seen.z)));
            }
            let (u, v) = projection.project(&seen);
            let corners =
                (corner(u, settings.side, settings.camera.width), corner(v, settings.side, settings.camera.height));
            let (Some(left), Some(top)) = corners else { return Err((place, format!("at ({u:.1}, {v:.1}) px"))) };
            (record.point, record.pixel, record.corner) = (point.coords.into(), [u, v], [left, top]);
        }
        Ok(())
    }

    /// The depth of the patches, cut out of the image.
    fn look(&mut self, mesh: &RenderMesh) {
        let record = &mut self.record;
        let crop = self.rasteriser.render(mesh, &record.camera, &record.camera_from_object);
        record.depth.clear();
        for PatchPoint { corner: [left, top], .. } in &record.points {
            for row in *top..top + record.side {
                record.depth.extend((*left..left + record.side).map(|column| crop.at(column, row)));
            }
        }
        if let Some(image) = &mut self.image {
            image.clear();
            Depth::encode_parts(&record.sample, crop, DepthCoding::F32, image);
        }
    }

    fn make(&mut self, place: usize, mesh: &RenderMesh, view: ViewId) -> Result<(SampleId, Outcome), ProduceError> {
        let object = &self.job.grasps.objects[place];
        self.payload.clear();
        if let Err((point, detail)) = self.fill(object, view, &mesh.centre()) {
            let facts = self.facts(&object.grasps[view.0 as usize]).into();
            return Ok((self.record.sample, Outcome::Rejected { reason: OUT_OF_FRAME[point], detail, facts }));
        }
        self.look(mesh);
        self.record.encode(&mut self.payload);
        if let Some(heat) = &mut self.heat {
            heat.look(&self.record, view.0 as usize, &self.job.settings);
        }
        #[cfg(feature = "sim")]
        if let Some(colours) = &mut self.colours {
            colours.look(&self.record)?;
        }
        Ok((self.record.sample, Outcome::Kept(self.record.facts().into())))
    }

    fn facts(&self, grasp: &ChosenGrasp) -> PatchFacts {
        PatchFacts {
            kind: grasp.kind,
            type_index: self.record.type_index,
            energy: grasp.energy,
            epsilon: grasp.epsilon,
        }
    }
}

impl Producer for PatchWorker<'_> {
    fn channels(&self) -> Vec<Channel> {
        let settings = &self.job.settings;
        let colour = settings.colour.map(|_| Channel::PatchColour);
        let image = settings.image.then_some(Channel::PatchImage);
        let image_colour = colour.and(image).map(|_| Channel::PatchImageColour);
        let heatmap = settings.heatmap_angle.map(|_| Channel::PatchHeatmap);
        [Channel::Patch].into_iter().chain(colour).chain(image).chain(image_colour).chain(heatmap).collect()
    }

    fn load(&mut self, subject: usize) -> Result<(), ProduceError> {
        if self.loaded.as_ref().is_none_or(|(place, _)| *place != subject) {
            // The memory of the one before goes first.
            self.loaded = None;
            self.loaded = Some((subject, self.prepare(subject)?));
        }
        Ok(())
    }

    fn produce(&mut self, view: ViewId) -> Result<(SampleId, Outcome), ProduceError> {
        let (place, mesh) = self.loaded.take().expect("an object is loaded before its grasps are looked at");
        let made = self.make(place, &mesh, view);
        self.loaded = Some((place, mesh));
        made
    }

    fn payloads(&self) -> Vec<(Channel, &[u8])> {
        if self.payload.is_empty() {
            return Vec::new();
        }
        let patch = (Channel::Patch, self.payload.as_slice());
        #[cfg(feature = "sim")]
        let colours = self.colours.as_ref().map(|colours| (Channel::PatchColour, colours.payload.as_slice()));
        #[cfg(feature = "sim")]
        let image_colour = self.colours.as_ref().and_then(|colours| colours.image.as_ref());
        #[cfg(feature = "sim")]
        let image_colour = image_colour.map(|(_, payload)| (Channel::PatchImageColour, payload.as_slice()));
        #[cfg(not(feature = "sim"))]
        let (colours, image_colour) = (None, None);
        let image = self.image.as_ref().map(|image| (Channel::PatchImage, image.as_slice()));
        let heatmap = self.heat.as_ref().map(|heat| (Channel::PatchHeatmap, heat.payload.as_slice()));
        [patch].into_iter().chain(colours).chain(image).chain(image_colour).chain(heatmap).collect()
    }
}
