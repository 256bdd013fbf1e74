//! The text of a description, expanded: included files replace their `include`, attached models are listed separately.

use std::{
    collections::{BTreeMap, BTreeSet},
    path::{Path, PathBuf},
    sync::Arc,
};

use super::{
    bounds::{MAX_DEPTH, MAX_ELEMENTS, MAX_FILES_DEEP},
    error::{DescriptionError, TooLarge},
    packages,
    statement::{Place, Statement, kind_of},
    xml::{Malformed, Tag, TagKind, Tags},
};
use crate::{
    files::{self, Bound},
    ids::Digest,
};

/// Kind of a description.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Format {
    /// MuJoCo's own.
    Mjcf,
    /// The Unified Robot Description Format.
    Urdf,
}

/// A text with all that it includes.
#[derive(Debug)]
pub(super) struct Document {
    pub(super) format: Format,
    /// The name that the text gives itself.
    pub(super) name: Option<String>,
    /// Elements in order, parents before their children.
    pub(super) statements: Vec<Statement>,
    /// Texts that were read, in order.
    pub(super) texts: Vec<Text>,
    /// Other files that statements name, in order.
    pub(super) files: Vec<NamedFile>,
    /// Models that statements bring in as assets.
    models: BTreeMap<usize, Arc<Document>>,
}

/// A text that was read.
#[derive(Debug)]
pub(super) struct Text {
    pub(super) path: PathBuf,
    pub(super) digest: Digest,
    /// Index of the first statement after its beginning.
    pub(super) before: usize,
}

/// A file that a statement names.
#[derive(Clone, Debug)]
pub(super) struct NamedFile {
    /// Index of the statement.
    pub(super) statement: usize,
    /// Name as the description has it.
    pub(super) written: String,
    /// Where the file is.
    pub(super) path: PathBuf,
}

impl Document {
    /// Reads a description.
    pub(super) fn read(path: &Path) -> Result<Arc<Self>, DescriptionError> {
        Reader::default().document(path, None)
    }

    /// The model that an element attaches.
    pub(super) fn attached(&self, statement: usize) -> Option<&Arc<Self>> {
        let attach = &self.statements[statement];
        let wanted = attach.get("model").filter(|_| attach.is("body/attach"))?;
        self.models.iter().find(|(asset, _)| self.model_name(**asset) == wanted).map(|(_, model)| model)
    }

    /// The name of a model that is an asset: its own where the element gives none.
    fn model_name(&self, asset: usize) -> &str {
        let model = &self.models[&asset];
        let own = || model.name.as_deref().unwrap_or_default();
        self.statements[asset].get("name").unwrap_or_else(own)
    }

    /// The model that is an asset by this statement.
    pub(super) fn model(&self, statement: usize) -> Option<&Arc<Self>> {
        self.models.get(&statement)
    }

    /// All models below, each once.
    pub(super) fn all_models(&self) -> Vec<Arc<Self>> {
        let mut found = Vec::new();
        self.add_models(&mut found);
        found
    }

    fn add_models(&self, found: &mut Vec<Arc<Self>>) {
        for model in self.models.values() {
            if !found.iter().any(|known| Arc::ptr_eq(known, model)) {
                found.push(Arc::clone(model));
                model.add_models(found);
            }
        }
    }
}

/// Reads documents, each once.
#[derive(Default)]
struct Reader {
    known: BTreeMap<PathBuf, Arc<Document>>,
    /// Files that are being read: each is named by the one before it.
    open: Vec<PathBuf>,
}

/// A document that is being read.
struct Expansion<'a> {
    /// Folder of the description: names are relative to it.
    folder: &'a Path,
    document: Document,
    included: BTreeSet<PathBuf>,
}

impl Reader {
    /// The document of a file that `by` names.
    fn document(&mut self, path: &Path, by: Option<&Place>) -> Result<Arc<Document>, DescriptionError> {
        let key = self.enter(path, by)?;
        if let Some(known) = self.known.get(&key) {
            self.open.pop();
            return Ok(Arc::clone(known));
        }
        let folder = path.parent().unwrap_or(Path::new(""));
        let document = Document {
            format: Format::Mjcf,
            name: None,
            statements: Vec::new(),
            texts: Vec::new(),
            files: Vec::new(),
            models: BTreeMap::new(),
        };
        let mut expansion = Expansion { folder, document, included: BTreeSet::new() };
        self.expand(&mut expansion, path, by, None)?;
        let files = named_files(&expansion.document, folder)?;
        let mut document = Document { files, ..expansion.document };
        for statement in 0..document.statements.len() {
            if let Some(file) = model_file(&document.statements[statement]) {
                let Statement { place, .. } = document.statements[statement].clone();
                let file = beside_or_below(folder, &place.file, Path::new(file));
                document.models.insert(statement, self.document(&file, Some(&place))?);
            }
        }
        let document = Arc::new(document);
        self.known.insert(key, Arc::clone(&document));
        self.open.pop();
        Ok(document)
    }

    /// Notes that a file is being read. Refuses one that is being read already, and too many within each other.
    fn enter(&mut self, path: &Path, by: Option<&Place>) -> Result<PathBuf, DescriptionError> {
        // Two names of one file are one file.
        let key = files::canonical(path).unwrap_or_else(|_| path.to_owned());
        let place = by.cloned().unwrap_or_else(|| Place::start_of(path));
        if let Some(first) = self.open.iter().position(|open| *open == key) {
            let files = self.open[first..].iter().chain([&key]).cloned().collect();
            return Err(DescriptionError::Cycle { place, file: path.to_owned(), files });
        }
        if self.open.len() == MAX_FILES_DEEP {
            return Err(TooLarge::Files { most: MAX_FILES_DEEP }.at(&place));
        }
        self.open.push(key.clone());
        Ok(key)
    }

    /// Appends the elements of a text to a document. `parent`: the element around the `include` that names the text.
    fn expand(
        &mut self,
        expansion: &mut Expansion<'_>,
        path: &Path,
        by: Option<&Place>,
        parent: Option<usize>,
    ) -> Result<(), DescriptionError> {
        let bytes = files::read(path, Bound::DESCRIPTION).map_err(|source| DescriptionError::Unreadable {
            path: path.to_owned(),
            by: by.cloned(),
            source,
        })?;
        let before = expansion.document.statements.len();
        expansion.document.texts.push(Text { path: path.to_owned(), digest: Digest::hash(&bytes), before });
        let text = String::from_utf8_lossy(&bytes);
        let file = Arc::new(path.to_owned());
        let malformed = |Malformed { line, problem }| DescriptionError::Malformed {
            place: Place { file: Arc::clone(&file), line },
            problem,
        };
        let mut tags = Tags::new(&text);
        // The statement of each open element; the root of a text that is included is none.
        let mut around: Vec<Option<usize>> = Vec::new();
        while let Some(tag) = tags.read_tag().map_err(malformed)? {
            if tag.kind == TagKind::End {
                around.pop();
                continue;
            }
            let place = Place { file: Arc::clone(&file), line: tag.line };
            if around.len() >= MAX_DEPTH {
                return Err(TooLarge::Depth.at(&place));
            }
            let is_root = around.is_empty();
            if is_root && before > 0 {
                // The root of an included text: its content replaces the `include`.
                around.extend((tag.kind == TagKind::Start).then_some(parent));
                continue;
            }
            if is_root {
                expansion.take_root(&tag);
            }
            let parent = around.last().copied().flatten().or(parent);
            let index = expansion.push(place.clone(), parent, &tag)?;
            if tag.name == "include" && expansion.document.format == Format::Mjcf {
                self.include(expansion, index, &place, parent)?;
            }
            if tag.kind == TagKind::Start {
                around.push(Some(index));
            }
        }
        Ok(())
    }

    /// Appends the elements of the file that an `include` names; one that is included already is not included again.
    fn include(
        &mut self,
        expansion: &mut Expansion<'_>,
        include: usize,
        place: &Place,
        parent: Option<usize>,
    ) -> Result<(), DescriptionError> {
        let Some(name) = expansion.document.statements[include].get("file").filter(|name| !name.is_empty()) else {
            return Ok(());
        };
        let file = beside_or_below(expansion.folder, &place.file, Path::new(name));
        let key = self.enter(&file, Some(place))?;
        if expansion.included.insert(key) {
            self.expand(expansion, &file, Some(place), parent)?;
        }
        self.open.pop();
        Ok(())
    }
}

impl Expansion<'_> {
    /// Takes format and name from the root of the description.
    fn take_root(&mut self, root: &Tag<'_>) {
        let (format, key) = if root.name == "robot" { (Format::Urdf, "name") } else { (Format::Mjcf, "model") };
        let name = root.attributes.iter().find(|(attribute, _)| *attribute == key);
        self.document.format = format;
        self.document.name = name.map(|(_, value)| value.clone().into_owned());
    }

    /// Appends an element; its index.
    fn push(&mut self, place: Place, parent: Option<usize>, tag: &Tag<'_>) -> Result<usize, DescriptionError> {
        let statements = &mut self.document.statements;
        if statements.len() as f64 >= MAX_ELEMENTS {
            let elements = statements.len() as f64 + 1.0;
            return Err(TooLarge::Elements { elements, most: MAX_ELEMENTS }.at(&place));
        }
        let within = parent.map_or("", |parent| kind_of(&statements[parent].element)).to_owned();
        let attributes = tag.attributes.iter().map(|(name, value)| ((*name).to_owned(), value.clone().into_owned()));
        let (element, attributes) = (tag.name.to_owned(), attributes.collect());
        statements.push(Statement { place, parent, within, element, attributes });
        Ok(statements.len() - 1)
    }
}

/// The file of a model that a statement brings in as an asset.
fn model_file(statement: &Statement) -> Option<&str> {
    statement.get("file").filter(|file| statement.is("asset/model") && !file.is_empty())
}

/// A file that a text names: relative to the folder of the description, else to that of the text.
fn beside_or_below(folder: &Path, text: &Path, name: &Path) -> PathBuf {
    let beside = text.parent().unwrap_or(Path::new("")).join(name);
    Some(folder.join(name)).filter(|file| files::is_present(file) || !files::is_present(&beside)).unwrap_or(beside)
}

/// Folders of each kind of file, from the `compiler` elements: the last one applies.
#[derive(Default)]
struct Folders {
    meshes: PathBuf,
    textures: PathBuf,
    strip: bool,
    /// Whether MuJoCo drops what of a URDF is only drawn.
    drops_visual: bool,
}

impl Folders {
    fn of(document: &Document) -> Self {
        let mut folders = Self { drops_visual: document.format == Format::Urdf, ..Self::default() };
        let compilers = document.statements.iter().filter(|statement| statement.element == "compiler");
        for (key, value) in compilers.flat_map(|compiler| &compiler.attributes) {
            match key.as_str() {
                "meshdir" => folders.meshes = value.into(),
                "texturedir" => folders.textures = value.into(),
                "assetdir" => (folders.meshes, folders.textures) = (value.into(), value.into()),
                "strippath" => folders.strip = value == "true",
                "discardvisual" if document.format == Format::Urdf => folders.drops_visual = value == "true",
                _ => {}
            }
        }
        folders
    }
}

/// The files that the statements of a document name, but for texts.
fn named_files(document: &Document, folder: &Path) -> Result<Vec<NamedFile>, DescriptionError> {
    let folders = Folders::of(document);
    let mut files = Vec::new();
    for (index, statement) in document.statements.iter().enumerate() {
        if matches!(statement.element.as_str(), "include" | "model" | "mujoco") || is_dropped(document, &folders, index)
        {
            continue;
        }
        for (_, written) in
            statement.attributes.iter().filter(|(key, file)| key.starts_with("file") && !file.is_empty())
        {
            let path = match packages::uri(written) {
                Some(uri) if document.format == Format::Urdf => uri.find(folder, &statement.place)?,
                _ => {
                    let name = Path::new(written.as_str());
                    let stripped = name.file_name().filter(|_| folders.strip).map(Path::new);
                    let below = match statement.element.as_str() {
                        "mesh" | "hfield" | "skin" | "flexcomp" | "composite" => folders.meshes.as_path(),
                        "texture" => folders.textures.as_path(),
                        _ => Path::new(""),
                    };
                    let named = folder.join(below.join(stripped.unwrap_or(name)));
                    let beside = statement.place.file.parent().unwrap_or(Path::new("")).join(name);
                    Some(named).filter(|file| files::is_present(file) || !files::is_present(&beside)).unwrap_or(beside)
                }
            };
            files.push(NamedFile { statement: index, written: written.clone(), path });
        }
    }
    Ok(files)
}

/// Whether MuJoCo never reads a statement: it is part of a URDF's `visual`, or of an extension for other programs.
fn is_dropped(document: &Document, folders: &Folders, statement: usize) -> bool {
    let mut next = Some(statement).filter(|_| document.format == Format::Urdf);
    while let Some(index) = next {
        let Statement { element, within, parent, .. } = &document.statements[index];
        let is_shown = element == "visual" && within == "link" && folders.drops_visual;
        if is_shown
            || element == "material"
            || (within == "robot" && !matches!(element.as_str(), "link" | "joint" | "mujoco"))
        {
            return true;
        }
        next = *parent;
    }
    false
}
