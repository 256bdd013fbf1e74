//! From a draft and its prepared meshes to a job.

use std::collections::BTreeMap;

use super::{
    checked::{Completion, CompletionJob, Distance, GraspJob, Job, JobObject, ModelChoice, SplitSettings, Work},
    decode::did_you_mean,
    document::{Document, Path},
    draft::{CompletionDraft, GraspDraft, JobDraft, ObjectsDraft, WorkDraft},
    errors::{JobError, JobErrors, Problem},
    pattern,
};
use crate::{
    assets::{AssetRecord, MeshOrigin, MeshRefusal},
    geom::GridPlacement,
};

impl JobDraft {
    /// The job: `assets` holds what came of [`JobDraft::sources`], in the same order.
    ///
    /// Meshes that could not be prepared, whose content is not the pinned one, or whose content or geometry another
    /// mesh (earlier by name) has already, are refused with a reason; the others make the job.
    ///
    /// # Errors
    /// When no usable object is left, or the split names models that the job does not have.
    ///
    /// # Panics
    /// If `assets` is not as long as the draft's meshes.
    pub fn resolve(self, assets: Vec<Result<AssetRecord, MeshRefusal>>) -> Result<Job, JobErrors> {
        assert_eq!(assets.len(), self.sources().len(), "one result a mesh");
        let mut notes = self.notes;
        let work = match self.work {
            WorkDraft::Completion(draft) => Work::Completion(draft.resolve(assets, &self.document, &mut notes)?),
            WorkDraft::Reachability(job) => Work::Reachability(job),
            WorkDraft::Patches(job) => Work::Patches(job),
            WorkDraft::Grasps(draft) => Work::Grasps(draft.resolve(assets, &self.document)?),
        };
        Ok(Job {
            name: self.name,
            profile: self.profile,
            overrides: self.overrides,
            seed: self.seed,
            notes,
            shard_samples: self.shard_samples,
            work,
        })
    }
}

impl CompletionDraft {
    fn resolve(
        self,
        assets: Vec<Result<AssetRecord, MeshRefusal>>,
        document: &Document,
        notes: &mut Vec<String>,
    ) -> Result<CompletionJob, JobErrors> {
        let Resolved { objects, refused, split } = self.objects.resolve(assets, document, false)?;
        notes.extend(dotted_partials(&objects, &self.settings));
        Ok(CompletionJob { objects, refused, settings: self.settings, split })
    }
}

impl GraspDraft {
    fn resolve(
        self,
        assets: Vec<Result<AssetRecord, MeshRefusal>>,
        document: &Document,
    ) -> Result<GraspJob, JobErrors> {
        let with_masses = self.settings.asks_for_masses();
        let Resolved { objects, refused, split } = self.objects.resolve(assets, document, with_masses)?;
        Ok(GraspJob { objects, refused, hand: self.hand, settings: self.settings, split })
    }
}

/// The objects of a job, and who trains and who tests.
struct Resolved {
    objects: Vec<JobObject>,
    refused: Vec<MeshRefusal>,
    split: SplitSettings,
}

impl ObjectsDraft {
    /// `with_masses`: whether something depends on what they weigh.
    fn resolve(
        self,
        assets: Vec<Result<AssetRecord, MeshRefusal>>,
        document: &Document,
        with_masses: bool,
    ) -> Result<Resolved, JobErrors> {
        let mut refused = self.refused;
        let mut objects: Vec<JobObject> = Vec::new();
        let mut seen = BTreeMap::new();
        for (mesh, asset) in self.meshes.into_iter().zip(assets) {
            let asset = match asset {
                Ok(asset) => asset,
                Err(refusal) => {
                    refused.push(refusal);
                    continue;
                }
            };
            let file = match &mesh.source.origin {
                MeshOrigin::File(path) => path.display().to_string(),
                MeshOrigin::BuiltIn(name) => name.clone(),
            };
            if let Some(pinned) = mesh.pinned
                && pinned != asset.object
            {
                refused.push(MeshRefusal {
                    file,
                    reason: "changed".to_owned(),
                    problem: format!("its content is {}, the job pins {}", asset.object.0.short(), pinned.0.short()),
                    place: None,
                    remedy: "restore the mesh, or take the pin out of the job for a new dataset".to_owned(),
                });
                continue;
            }
            let contents = [asset.object.0, asset.geometry];
            if let Some(first) = contents.iter().find_map(|content| seen.get(content)) {
                refused.push(MeshRefusal {
                    file,
                    reason: "duplicate".to_owned(),
                    problem: format!("has the same geometry as `{first}`"),
                    place: None,
                    remedy: "nothing is lost; exclude one of the two to silence this".to_owned(),
                });
                continue;
            }
            contents.into_iter().for_each(|content| drop(seen.insert(content, asset.name.clone())));
            // What nothing depends on is no part of the job.
            let mass = mesh.mass.filter(|_| with_masses);
            objects.push(JobObject { source: mesh.source, package: mesh.package, asset, mass });
        }
        let mut errors = Vec::new();
        if objects.is_empty() {
            let found = format!("none: {} refused{}", refused.len(), first_refusals(&refused));
            let problem = Problem::Senseless { expected: "at least one usable mesh".to_owned(), found };
            errors.push(JobError::at(document.place_of(&Path::of("objects")), "objects", problem));
        }
        let mut split = self.split;
        let names: Vec<&str> = objects.iter().map(|object| object.source.name.as_str()).collect();
        name_models(document, "validation_models", &mut split.validation_models, &names, &mut errors);
        name_models(document, "test_models", &mut split.test_models, &names, &mut errors);
        JobErrors::check(errors)?;
        Ok(Resolved { objects, refused, split })
    }
}

/// Turns the patterns of a choice into the names that they fit; each must fit one.
fn name_models(document: &Document, key: &str, choice: &mut ModelChoice, names: &[&str], errors: &mut Vec<JobError>) {
    let ModelChoice::Named(patterns) = choice else { return };
    for (index, wanted) in patterns.iter().enumerate() {
        if !names.is_empty() && !names.iter().any(|name| pattern::name(wanted, name)) {
            let path = Path::of("split").key(key).index(index);
            let problem = Problem::NotFound { what: "model".to_owned(), detail: format!("`{wanted}`") };
            let help = did_you_mean(wanted, names.iter().copied());
            errors.push(JobError { place: document.place_of(&path), key: path.to_string(), problem, help });
        }
    }
    let named = |name: &&&str| patterns.iter().any(|wanted| pattern::name(wanted, name));
    *patterns = names.iter().filter(named).map(|name| (*name).to_owned()).collect();
}

/// A warning about objects whose grid cells are narrower than a pixel: their partial grids come out dotted.
fn dotted_partials(objects: &[JobObject], completion: &Completion) -> Option<String> {
    let distance = match completion.distance {
        Distance::Fixed(distance) => distance,
        Distance::Range { max, .. } => max,
        Distance::Fit { .. } => return None,
    };
    let pixel = distance / completion.camera.fx.min(completion.camera.fy);
    let cells = GridPlacement::FILL * f64::from(completion.resolution);
    let side = |object: &&JobObject| object.asset.extents.into_iter().fold(0.0, f64::max);
    let small: Vec<&JobObject> = objects.iter().filter(|object| side(object) < pixel * cells).collect();
    let least = small.iter().copied().min_by(|a, b| side(a).total_cmp(&side(b)))?;
    Some(format!(
        "{} of {} objects are under {:.0} mm: at {distance} m their grid cells are narrower than a pixel, so their \
         partials are dotted (smallest: `{}`, {:.0} mm); a shorter `distance`, or `distance = {{ fit = 0.6 }}`, mends it",
        small.len(),
        objects.len(),
        pixel * cells * 1e3,
        least.source.name,
        side(&least) * 1e3,
    ))
}

fn first_refusals(refused: &[MeshRefusal]) -> String {
    refused.iter().take(3).map(|refusal| format!("; {refusal}")).collect()
}
