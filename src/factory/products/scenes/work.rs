//! A job for scenes as the factory runs it.

use std::{collections::BTreeMap, path::Path};

use super::{
    import::{Import, ImportedScene},
    loaded::LoadedObjects,
    settings::{PileWalls, SceneJob},
    worker::{SceneWorker, Shared},
};
use crate::{
    ProduceError, RunError,
    objects::{cost_of_descriptions, describe_all},
    plan::{JobSplits, SubjectItems},
    products::{
        settled::{by_content, cost_of_meshes, write_meshes},
        surroundings::{contact_body, settled_container},
    },
    sections::{JobObject, JobObjects, SplitInput, shards_section},
    work::{Closing, OpenWork, Opening, Producer, SideCost, Work, WorkTables},
};
use format::Product;
use kernel::{
    contact::Sampled,
    files::Folder,
    geom::TriMesh,
    ids::{Digest, JobDigest, ObjectId},
    words::{NumberClass, ObjectSplit, Split},
};
use sim::{Walls, sim_facts};

impl Work for SceneJob {
    fn product(&self) -> Product {
        Product::SCENES
    }

    fn subjects(&self) -> Vec<SubjectItems> {
        let of = |(split, items)| SubjectItems { id: self.settings.subject(split), items, samples_per_item: 1 };
        self.settings.splits().map(of).collect()
    }

    fn resolved(&self, folder: &Path, shard_samples: u32) -> toml::Table {
        let mut keys = self.keys(str::to_owned, Some(folder));
        keys.extend(self.objects.resolved(folder));
        keys.extend([shards_section("scenes", shard_samples)]);
        keys
    }

    /// Objects of imported scenes by content.
    fn sample_keys(&self) -> toml::Table {
        let name = |name: &str| self.object_named(name).map_or_else(String::new, |(_, object)| object.id().0.hex());
        self.keys(name, None)
    }

    fn subject_keys(&self) -> toml::Table {
        self.objects.subject_keys()
    }

    fn objects(&self) -> Option<&JobObjects> {
        Some(&self.objects)
    }

    fn divided(&self) -> Option<SplitInput<'_>> {
        Some(self.objects.divided(vec![0]))
    }

    /// Objects and scenes are split: a whole scene has one split, and so do its objects.
    fn tables(&self, splits: Option<&JobSplits>) -> WorkTables {
        let mut table = splits.map(|splits| splits.table.clone()).unwrap_or_default();
        let mut subjects = Vec::new();
        for (split, scenes) in self.settings.splits() {
            let object = self.settings.subject(split);
            let name = format!("{} {}", split.name(), self.settings.mode.name());
            subjects.push(serde_json::json!({ "object": object, "name": name, "split": split, "scenes": scenes }));
            let holdout_items = if split == Split::Holdout { (0..scenes).collect() } else { Vec::new() };
            table.objects.push(ObjectSplit { object, split: side_of(split), holdout_items, subset: None });
        }
        WorkTables {
            class: NumberClass::Physics,
            channel_classes: BTreeMap::new(),
            platform: sim_facts().platform(None),
            assets: self.objects.rows(),
            subjects,
            hands: Vec::new(),
            containers: self.settings.container_rows(),
            splits: Some(table),
        }
    }

    fn open(&self, opening: Opening<'_>) -> Result<Box<dyn OpenWork + '_>, ProduceError> {
        let Opening { seed, level, splits } = opening;
        let (mut sides, mut imported) = (Vec::new(), Vec::new());
        for (split, _) in self.settings.splits() {
            let is_of_side = |id: &ObjectId| {
                let rows = splits.map_or(&[][..], |splits| splits.objects.as_slice());
                let row = rows.iter().find(|row| row.object == *id);
                row.map_or(Split::Training, |row| row.split) == side_of(split)
            };
            let side: Vec<_> = self.objects.ids().enumerate().filter(|(_, id)| is_of_side(id)).collect();
            match &self.settings.import {
                Some(import) => imported = self.imported(import, &side)?,
                None => self.check_enough(split, side.len())?,
            }
            sides.push((split, side));
        }
        let container = settled_container(&self.settings.container)?;
        let walls = self.settings.walls.map(standing_walls).transpose()?;
        let objects = LoadedObjects::default();
        Ok(Box::new(OpenScenes(Shared { job: self, seed, level, container, walls, sides, imported, objects })))
    }

    fn remarks(&self) -> Vec<String> {
        let scenes: Vec<String> =
            self.settings.splits().map(|(split, count)| format!("{count} {}", split.name())).collect();
        vec![format!("scenes: {}", scenes.join(", "))]
    }
}

impl SceneJob {
    /// Refuses a split with fewer objects on its side than a scene may have bodies.
    fn check_enough(&self, split: Split, on_side: usize) -> Result<(), ProduceError> {
        let (most, repeats) = (self.settings.count[1] as usize, self.settings.repeats);
        if on_side * if repeats { 2 } else { 1 } >= most {
            return Ok(());
        }
        let (often, remedy) =
            if repeats { ("no object more than twice", "") } else { ("no object twice", "set `repeats = true`, ") };
        let cause = format!(
            "a scene has up to {most} bodies, {often}, and {on_side} of the {} objects of this job are {} objects; \
             lower `count`, {remedy}add objects, change `split`, or set scenes.{} = 0",
            self.objects.list.len(),
            side_of(split).name(),
            split.name()
        );
        Err(ProduceError::unusable(format!("scenes.{}", split.name()), cause))
    }

    /// Indices of the objects of each arrangement, all of the side of its split.
    fn imported(&self, import: &Import, side: &[(usize, ObjectId)]) -> Result<Vec<Vec<usize>>, ProduceError> {
        let wanted = side_of(import.split).name();
        let index_of = |source: &str, name: &str| {
            let cause = match self.object_named(name) {
                Some((index, _)) if side.iter().any(|(of_side, _)| *of_side == index) => return Ok(index),
                Some(_) => format!(
                    "its object `{name}` does not have the split {wanted}, and imported scenes have the split {}; set \
                     `import.split`, or change the object's split in `[split]`",
                    import.split.name()
                ),
                None => format!("its object `{name}` was refused as a mesh; repair the mesh, or leave the scene out"),
            };
            Err(ProduceError::unusable(format!("import, scene {source}"), cause))
        };
        let indices = |scene: &ImportedScene| {
            scene.bodies.iter().map(|body| index_of(&scene.source, &body.object)).collect::<Result<Vec<_>, _>>()
        };
        import.scenes.iter().map(indices).collect()
    }

    /// An object by its name, with its index.
    fn object_named(&self, name: &str) -> Option<(usize, &JobObject)> {
        self.objects.list.iter().enumerate().find(|(_, object)| object.source.name == name)
    }
}

/// Side of the objects of a split's scenes.
fn side_of(split: Split) -> Split {
    if split == Split::Holdout { Split::Training } else { split }
}

/// Thickness of the walls of a pile [m].
const WALL: f64 = 0.02;

/// The walls of a pile, ready for contacts.
fn standing_walls(walls: PileWalls) -> Result<Walls, ProduceError> {
    let inner = walls.inner();
    Ok(Walls::new(contact_body("walls", &TriMesh::walls(inner, WALL), Sampled::Edges)?, inner, walls.lift_speed))
}

/// A job for scenes whose container is known.
struct OpenScenes<'j>(Shared<'j>);

impl OpenWork for OpenScenes<'_> {
    fn producer(&self) -> Result<Box<dyn Producer + '_>, ProduceError> {
        Ok(Box::new(SceneWorker::new(&self.0)))
    }

    /// Estimated cost from the rows of the objects, and of the meshes from a few of them.
    fn side_cost(&self, _: &[usize], folder: &Folder) -> Result<SideCost, ProduceError> {
        let objects = &self.0.job.objects;
        let all: Vec<usize> = (0..objects.list.len()).collect();
        let write = |few: &[&JobObject]| write_meshes(few, folder, &JobDigest(Digest([0; 32])), Product::SCENES);
        Ok(cost_of_descriptions(objects, &all)? + cost_of_meshes(objects, write)?)
    }

    /// Writes mass and metadata of every object into its row, and the meshes.
    fn finish(&self, closing: &mut Closing<'_>) -> Result<(), RunError> {
        describe_all(&self.0.job.objects, closing)?;
        write_meshes(&by_content(&self.0.job.objects), closing.folder, &closing.job, Product::SCENES)?;
        Ok(())
    }
}
