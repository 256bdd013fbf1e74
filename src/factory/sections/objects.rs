//! Objects of a job: their meshes as found, then as prepared.

use std::{collections::BTreeMap, path::Path as FilePath};

use super::{
    FoundMesh, JobContext, KnownMass, KnownObject, ObjectChoice, PackageFile, SplitSettings, discover,
    spec::{ObjectsSpec, SplitSpec},
};
use assets::{AssetRecord, LooseParts, MeshRefusal, MeshSource, Repair, object::PreparedObject};
use form::{Checker, Document, FormErrors, Mistakes, Path, did_you_mean, fits_name};
use kernel::{ids::ObjectId, words::MassSource};

/// One object of a job.
#[derive(Clone, Debug, PartialEq)]
pub struct JobObject {
    /// Recipe to prepare the mesh again.
    pub source: MeshSource,
    /// The package that holds the file, if one does: a resolved job names it instead of a path.
    pub package: Option<PackageFile>,
    /// Row of the object in the asset table.
    pub asset: AssetRecord,
    /// Data of the job about the object other than its mesh.
    pub known: KnownObject,
}

/// Mass of an object, and how it is known.
#[derive(Clone, Debug, PartialEq)]
pub struct Weight {
    /// Mass [kg].
    pub kilograms: f64,
    /// Way in which it is known.
    pub from: MassSource,
    /// Source of the figure in words; may be empty.
    pub source: String,
}

impl JobObject {
    /// The object by content.
    pub fn id(&self) -> ObjectId {
        self.asset.object
    }

    /// Mass of the object: from the job, otherwise by the material that the job names, otherwise by its convex hull.
    pub fn weight(&self, prepared: &PreparedObject) -> Weight {
        if let Some(KnownMass { kilograms, source }) = &self.known.mass {
            return Weight { kilograms: *kilograms, from: MassSource::Table, source: source.clone() };
        }
        let by_material = self.known.made_of.and_then(|made_of| {
            let kilograms = prepared.mass_of_material(&made_of)?;
            Some(Weight { kilograms, from: MassSource::Material, source: made_of.in_words() })
        });
        by_material.unwrap_or_else(|| Weight {
            kilograms: prepared.mass_of_hull(),
            from: MassSource::Hull,
            source: String::new(),
        })
    }
}

/// The objects of a job, prepared, with the rules of their split.
#[derive(Clone, Debug, PartialEq)]
pub struct JobObjects {
    /// The objects, sorted by name; no two have the same content.
    pub list: Vec<JobObject>,
    /// Meshes that cannot be used; the run continues without them and ends with exit code 3.
    pub refused: Vec<MeshRefusal>,
    /// Rules of the split.
    pub split: SplitSettings,
    /// Whether samples depend on what the objects weigh.
    pub with_masses: bool,
}

impl JobObjects {
    /// Ids of the objects, in order.
    pub fn ids(&self) -> impl ExactSizeIterator<Item = ObjectId> {
        self.list.iter().map(JobObject::id)
    }

    /// Rows of the asset table.
    pub fn rows(&self) -> Vec<serde_json::Value> {
        let row = |object: &JobObject| serde_json::to_value(&object.asset).expect("a record is plain data");
        self.list.iter().map(row).collect()
    }

    /// Things that a user should know about the meshes.
    pub fn warnings(&self) -> impl Iterator<Item = String> {
        let refused = self.refused.iter().map(|refusal| format!("refused: {refusal}"));
        refused.chain(self.list.iter().flat_map(|object| {
            let name = &object.source.name;
            let joined = object.asset.loose.filter(|_| object.known.joins_parts);
            let joined = joined.map(|LooseParts { parts, .. }| {
                format!("{name}: its {parts} loose parts count as one body, as set in the job (bodies = \"join\")")
            });
            let seams = object.asset.repairs.iter().filter(|repair| matches!(repair, Repair::JoinedVertices { .. }));
            let seams = seams.map(move |repair| format!("{name}: {repair}"));
            object.asset.warnings.iter().map(move |warning| format!("{name}: {warning}")).chain(seams).chain(joined)
        }))
    }

    /// The objects as their split sees them; `first_equal` has one entry per item.
    pub fn divided(&self, first_equal: Vec<u32>) -> SplitInput<'_> {
        SplitInput { objects: &self.list, split: &self.split, first_equal }
    }
}

/// The objects of a job, as their split sees them.
#[derive(Clone, Debug, PartialEq)]
pub struct SplitInput<'j> {
    /// The objects, in the job's order.
    pub objects: &'j [JobObject],
    /// Rules of the split.
    pub split: &'j SplitSettings,
    /// For each item, the first item that shows the same: equal rotations.
    pub first_equal: Vec<u32>,
}

impl SplitInput<'_> {
    /// Items of each object.
    pub fn items(&self) -> u32 {
        self.first_equal.len() as u32
    }
}

/// The objects of a job before their meshes are read.
#[derive(Clone, Debug, PartialEq)]
pub struct ObjectsDraft {
    /// Rules of the split; names may still be patterns.
    split: SplitSettings,
    /// The meshes to prepare, by name.
    meshes: Vec<FoundMesh>,
    /// Files that were found but cannot be used.
    refused: Vec<MeshRefusal>,
    /// The job file, for the locations of mistakes.
    document: Document,
}

impl ObjectsDraft {
    /// Checks `split` and `[[objects]]` and lists the meshes, without opening one: the draft, and notes for the user.
    ///
    /// # Errors
    /// Every mistake of the job that has been found so far.
    pub fn read(
        mut checker: Checker,
        split: &SplitSpec,
        objects: &[ObjectsSpec],
        folder: &FilePath,
        context: &JobContext,
    ) -> Result<(Self, Vec<String>), FormErrors> {
        let split = SplitSettings::check(&mut checker, split);
        let found = discover::discover(&mut checker, objects, folder, context);
        let document = checker.finish()?;
        Ok((Self { split, meshes: found.meshes, refused: found.refused, document }, found.notes))
    }

    /// The meshes to prepare, in order.
    pub fn sources(&self) -> impl ExactSizeIterator<Item = &MeshSource> {
        self.meshes.iter().map(|mesh| &mesh.source)
    }

    /// The objects from the results of preparing [`Self::sources`], in the same order. `with_masses`: whether samples
    /// depend on the mass of each object; `of_one_body`: whether each object must be in one part.
    ///
    /// Meshes that could not be prepared, whose content is not the pinned one, whose parts are loose where they must not be,
    /// or whose content or geometry another mesh (earlier by name) has already, are refused with a reason; the others make
    /// the job.
    ///
    /// # Errors
    /// When no usable object is left, or the split names objects that the job does not have.
    ///
    /// # Panics
    /// If `assets` is not as long as the draft's meshes.
    pub fn resolve(
        self,
        assets: Vec<Result<AssetRecord, MeshRefusal>>,
        with_masses: bool,
        of_one_body: bool,
    ) -> Result<JobObjects, FormErrors> {
        assert_eq!(assets.len(), self.meshes.len(), "one result per mesh");
        let mut refused = self.refused;
        let mut list: Vec<JobObject> = Vec::new();
        let mut seen: BTreeMap<_, String> = BTreeMap::new();
        for (mesh, asset) in self.meshes.into_iter().zip(assets) {
            let asset = match asset {
                Ok(asset) => asset,
                Err(refusal) => {
                    refused.push(refusal);
                    continue;
                }
            };
            let in_parts = asset.loose.filter(|_| of_one_body && !mesh.known.joins_parts);
            if let Some(refusal) = changed(&mesh, &asset).or_else(|| in_parts.map(|parts| loose(&mesh, &parts))) {
                refused.push(refusal);
                continue;
            }
            let contents = [asset.object.0, asset.geometry];
            if let Some(first) = contents.iter().find_map(|content| seen.get(content)) {
                refused.push(duplicate(&mesh, first));
                continue;
            }
            contents.into_iter().for_each(|content| drop(seen.insert(content, asset.name.clone())));
            list.push(JobObject { source: mesh.source, package: mesh.package, asset, known: mesh.known });
        }
        let mut checker = Checker::new(self.document, Mistakes::default());
        if list.is_empty() {
            let found = format!("none: {} refused{}", refused.len(), first_refusals(&refused));
            checker.invalid("objects", "at least one usable mesh", found);
        }
        let mut split = self.split;
        let names: Vec<&str> = list.iter().map(|object| object.source.name.as_str()).collect();
        name_objects(&mut checker, "validation_objects", &mut split.validation_objects, &names);
        name_objects(&mut checker, "test_objects", &mut split.test_objects, &names);
        checker.finish()?;
        Ok(JobObjects { list, refused, split, with_masses })
    }
}

/// Refusal of a mesh whose content is not the pinned one.
fn changed(mesh: &FoundMesh, asset: &AssetRecord) -> Option<MeshRefusal> {
    let pinned = mesh.pinned.filter(|pinned| *pinned != asset.object)?;
    Some(MeshRefusal {
        file: mesh.source.origin.to_string(),
        reason: "changed".to_owned(),
        problem: format!("its content is {}, the job pins {}", asset.object.0.short(), pinned.0.short()),
        location: None,
        remedy: "restore the mesh, or remove the pin from the job for a new dataset".to_owned(),
    })
}

/// Refusal of a mesh in parts that nothing joins.
fn loose(mesh: &FoundMesh, LooseParts { parts, gap, joined_below }: &LooseParts) -> MeshRefusal {
    let [gap, joined_below] = [gap, joined_below].map(|metres| 1e3 * metres);
    MeshRefusal {
        file: mesh.source.origin.to_string(),
        reason: "loose_parts".to_owned(),
        problem: format!(
            "has {parts} separate parts: the nearest two are {gap:.1} mm apart, and parts count as one below \
             {joined_below:.1} mm"
        ),
        location: None,
        remedy: "if the object is one body and its scan lacks the connection, set bodies = \"join\" in its entry, in \
                 its row of `meshes` or in the table; if these are several objects, split the file: `graspmill meshes \
                 split FILE --out DIR`; otherwise exclude it"
            .to_owned(),
    }
}

/// Refusal of a mesh that has the geometry of another one, by the other's name.
fn duplicate(mesh: &FoundMesh, first: &str) -> MeshRefusal {
    MeshRefusal {
        file: mesh.source.origin.to_string(),
        reason: "duplicate".to_owned(),
        problem: format!("has the same geometry as `{first}`"),
        location: None,
        remedy: "no data is lost; exclude one of the two to silence this warning".to_owned(),
    }
}

/// Expands the patterns of a choice to the names that they fit; each must fit one.
fn name_objects(checker: &mut Checker, key: &str, choice: &mut ObjectChoice, names: &[&str]) {
    let ObjectChoice::Named(patterns) = choice else { return };
    for (index, wanted) in patterns.iter().enumerate() {
        if !names.is_empty() && !names.iter().any(|name| fits_name(wanted, name)) {
            let path = Path::from("split").key(key).index(index);
            let report = checker.not_found(path, "object", format!("`{wanted}`"));
            report.help_if(did_you_mean(wanted, names.iter().copied()));
        }
    }
    let named = |name: &&&str| patterns.iter().any(|wanted| fits_name(wanted, name));
    *patterns = names.iter().filter(named).map(|name| (*name).to_owned()).collect();
}

fn first_refusals(refused: &[MeshRefusal]) -> String {
    refused.iter().take(3).map(|refusal| format!("; {refusal}")).collect()
}
