//! Check of meshes: facts, repairs and refusals per mesh. The report behind `graspmill meshes check`.

use std::{
    fmt,
    path::{Path, PathBuf},
};

use crate::{
    AssetRecord, DuplicateOf, InsideMethod, MeshRefusal, MeshSource, PreparedMesh, ScaleRule, SizeRule, duplicates,
    list_folder,
    prepare::{normalised_size, prepare_and_judge, thin},
};
use kernel::{
    files,
    geom::{SolidGrid, TriMesh},
    remedy,
    voxel::solid_occupancy,
    words::{Show, counted},
};

/// The outcome of checking meshes; as JSON and, through `Display`, as a table for 80 to 100 columns.
#[derive(Clone, Debug, PartialEq, serde::Serialize)]
pub struct MeshCheckReport {
    /// One row per mesh, in the order of the paths, folders sorted.
    pub meshes: Vec<MeshCheckRow>,
    /// Number of meshes of each kind.
    pub counts: MeshCheckCounts,
}

/// One mesh.
#[derive(Clone, Debug, PartialEq, serde::Serialize)]
pub struct MeshCheckRow {
    /// The file, as it was named or found.
    pub file: String,
    /// Facts and repairs of the mesh; `None` when it is refused.
    pub record: Option<AssetRecord>,
    /// Reason of the refusal, and the remedy.
    pub refusal: Option<MeshRefusal>,
    /// The file further up that holds the same triangles.
    pub duplicate_of: Option<String>,
    /// Share of the surface at which the winding number is farther than 1/4 from a whole number, so that neither side of it
    /// is clearly inside; 0 for a closed mesh, `None` when it is refused.
    pub undecided: Option<f64>,
    /// Volume of all parts as one solid, where the parts are closed and the record's sum over them may count space twice.
    pub union: Option<UnionVolume>,
    /// Remarks for the user that no record of a run contains.
    pub notes: Vec<String>,
}

/// Volume of a solid by its cells, space that several parts share counted once.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize)]
pub struct UnionVolume {
    /// Volume of the cells whose centres lie inside [m^3].
    pub volume: f64,
    /// Side of a cell [m]: 1/256 of the mesh's longest side.
    pub cell: f64,
}

/// Number of meshes of each kind.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, serde::Serialize)]
pub struct MeshCheckCounts {
    /// All meshes.
    pub total: u32,
    /// Usable as found.
    pub fine: u32,
    /// Usable after repairs.
    pub repaired: u32,
    /// Not usable.
    pub refused: u32,
    /// Usable, but copies of another one.
    pub copies: u32,
}

impl MeshCheckReport {
    /// Whether a run over these meshes would have to leave some out (exit code 3).
    pub fn has_refusals(&self) -> bool {
        self.counts.refused > 0
    }
}

/// Prepares every mesh that `paths` name (files, or folders with all that is below them) and reports the results.
///
/// A folder that cannot be listed, or contains no mesh, is a separate refusal.
pub fn check_report(paths: &[PathBuf], scale: ScaleRule, size: SizeRule) -> MeshCheckReport {
    let mut meshes: Vec<MeshCheckRow> = Vec::new();
    for path in paths {
        if !files::is_folder(path) {
            meshes.push(check(path, scale, size));
            continue;
        }
        let (problem, remedy) = match list_folder(path) {
            Ok(files) if !files.is_empty() => {
                meshes.extend(files.iter().map(|file| check(file, scale, size)));
                continue;
            }
            Ok(_) => ("no mesh file below this folder".to_owned(), "name a folder with .stl, .obj, .ply or .off files"),
            Err(error) => (format!("cannot be listed: {}", error.error), remedy::for_reading(&error.error)),
        };
        let file = path.display().to_string();
        let reason = "unreadable".to_owned();
        let refusal = MeshRefusal { file: file.clone(), reason, problem, location: None, remedy: remedy.to_owned() };
        meshes.push(MeshCheckRow::of_refusal(file, refusal));
    }

    let usable: Vec<usize> = (0..meshes.len()).filter(|&row| meshes[row].record.is_some()).collect();
    for DuplicateOf { index, of } in duplicates(usable.iter().filter_map(|&row| meshes[row].record.as_ref())) {
        meshes[usable[index]].duplicate_of = Some(meshes[usable[of]].file.clone());
    }
    let count = |kind: &dyn Fn(&MeshCheckRow) -> bool| meshes.iter().filter(|row| kind(row)).count() as u32;
    let is_repaired = |row: &MeshCheckRow| row.record.as_ref().is_some_and(|record| !record.repairs.is_empty());
    let counts = MeshCheckCounts {
        total: meshes.len() as u32,
        fine: count(&|row| row.record.is_some() && !is_repaired(row)),
        repaired: count(&is_repaired),
        refused: count(&|row| row.refusal.is_some()),
        copies: count(&|row| row.duplicate_of.is_some()),
    };
    MeshCheckReport { meshes, counts }
}

fn check(path: &Path, scale: ScaleRule, size: SizeRule) -> MeshCheckRow {
    let file = path.display().to_string();
    let name = path.file_stem().map_or_else(|| file.clone(), |stem| stem.to_string_lossy().into_owned());
    let source = MeshSource { scale, size, ..MeshSource::of_file(name, path) };
    let (PreparedMesh { mesh, record }, judgement) = match prepare_and_judge(&source) {
        Ok(prepared) => prepared,
        Err(refusal) => return MeshCheckRow::of_refusal(file, refusal),
    };
    // The volume under an open surface is a rough figure anyway.
    let union = (judgement.counts_space_twice && record.inside == InsideMethod::Crossings).then(|| {
        let solid = solid_occupancy(&mesh, record.inside.test(), false);
        UnionVolume { volume: solid.volume(), cell: solid.pitch }
    });
    let notes = note_size(&record, scale).into_iter().chain(note_thickness(&mesh, &record)).collect();
    let undecided = Some(judgement.undecided);
    MeshCheckRow { file, record: Some(record), refusal: None, duplicate_of: None, undecided, union, notes }
}

/// Note about a mesh that was read in metres and has the size of a normalised one.
fn note_size(record: &AssetRecord, scale: ScaleRule) -> Option<String> {
    /// Deviation of a normalised size, as a share: text files hold six digits.
    const EXACTLY: f64 = 1e-5;
    let [x, y, z] = record.extents;
    let longest = x.max(y).max(z);
    let what = normalised_size(longest, libm::sqrt(x * x + y * y + z * z), EXACTLY)?;
    (scale == ScaleRule::MetresPerUnit(1.0)).then(|| {
        format!(
            "{what}: it may be normalised, not in metres; if so, give its real longest side: --size 0.25 here, size = 0.25 \
             in a job"
        )
    })
}

/// Note about a mesh whose solid has no cell inside.
fn note_thickness(mesh: &TriMesh, record: &AssetRecord) -> Option<String> {
    let longest = record.extents.into_iter().fold(0.0, f64::max);
    // Only a mesh of about that thickness is worth the solid.
    if thin::thickness(mesh, record.volume) > 4.0 * longest / SolidGrid::SIDE as f64 {
        return None;
    }
    let solid = solid_occupancy(mesh, record.inside.test(), false);
    (solid.volume() == 0.0).then(|| {
        let words = thin::words(mesh, record.volume, solid.pitch);
        format!("no solid inside: {words}; jobs for grasps refuse it, complete grids of others are empty")
    })
}

impl MeshCheckRow {
    fn of_refusal(file: String, refusal: MeshRefusal) -> Self {
        Self {
            file,
            refusal: Some(refusal),
            record: None,
            duplicate_of: None,
            undecided: None,
            union: None,
            notes: vec![],
        }
    }
}

/// Columns of the text form.
const WIDTH: usize = 96;
/// Share of undecided surface from which the table mentions it.
const NOTED_UNDECIDED: f64 = 0.05;
/// Longest name in the first column; a longer one is cut at its front.
const LONGEST_NAME: usize = 34;

impl fmt::Display for MeshCheckReport {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let names: Vec<String> = self.meshes.iter().map(|row| shortened(&row.file.shown().to_string())).collect();
        let width = names.iter().map(|name| name.chars().count()).max().unwrap_or(0).max(4);
        writeln!(f, "{:width$}  {:>9}  {:>20}  {:>9}  state", "mesh", "triangles", "size [mm]", "[cm3]")?;
        for (row, name) in self.meshes.iter().zip(&names) {
            let pad = width - name.chars().count();
            write!(f, "{name}{:pad$}", "")?;
            match (&row.record, &row.refusal) {
                (Some(record), _) => write_record(f, record)?,
                (None, _) => writeln!(f, "  {:>9}  {:>20}  {:>9}  refused", "-", "-", "-")?,
            }
            write_remarks(f, row)?;
        }
        let MeshCheckCounts { total, fine, repaired, refused, copies } = self.counts;
        let [meshes, copies] = [(total, "mesh"), (copies, "copy")].map(|(count, noun)| counted(u64::from(count), noun));
        writeln!(f, "\n{meshes}: {fine} fine, {repaired} repaired, {refused} refused; {copies}")
    }
}

fn write_record(f: &mut fmt::Formatter<'_>, record: &AssetRecord) -> fmt::Result {
    let size = record.extents.map(|side| format!("{:.1}", 1e3 * side)).join(" x ");
    let state = match (record.repairs.is_empty(), record.watertight) {
        (true, true) => "fine",
        (true, false) => "fine, open",
        (false, true) => "repaired",
        (false, false) => "repaired, open",
    };
    writeln!(f, "  {:>9}  {size:>20}  {:>9.2}  {state}", record.triangles, 1e6 * record.volume)
}

fn write_remarks(f: &mut fmt::Formatter<'_>, row: &MeshCheckRow) -> fmt::Result {
    if let Some(copy) = &row.duplicate_of {
        remark(f, "copy", &format!("the same triangles as {copy}"))?;
    }
    if let Some(record) = &row.record {
        for repair in &record.repairs {
            remark(f, "repaired", &repair.to_string())?;
        }
        for warning in &record.warnings {
            remark(f, "note", warning)?;
        }
        if let Some(UnionVolume { volume, cell }) = row.union {
            let (sum, volume, cell) = (1e6 * record.volume, 1e6 * volume, 1e3 * cell);
            let text =
                format!("{sum:.2} cm3 is a sum over parts; as one solid: {volume:.2} cm3 (cells of {cell:.3} mm)");
            remark(f, "volume", &text)?;
        }
    }
    if let Some(share) = row.undecided.filter(|&share| share >= NOTED_UNDECIDED) {
        let share = 100.0 * share;
        let text = format!(
            "at {share:.0} % of its surface neither side is clearly inside (docs/jobs.md, Meshes that are not solids)"
        );
        remark(f, "note", &text)?;
    }
    for note in &row.notes {
        remark(f, "note", note)?;
    }
    if let Some(refusal) = &row.refusal {
        let location = refusal.location.as_ref().map(|location| format!(" ({location})")).unwrap_or_default();
        remark(f, "problem", &format!("{}{location}", refusal.problem))?;
        remark(f, "remedy", &refusal.remedy)?;
    }
    Ok(())
}

/// An indented line with its kind in front, wrapped at spaces.
fn remark(f: &mut fmt::Formatter<'_>, kind: &str, text: &str) -> fmt::Result {
    let mut column = 13;
    write!(f, "    {kind:<8}")?;
    for word in text.shown().to_string().split(' ') {
        let length = word.chars().count();
        if column + 1 + length > WIDTH && column > 13 {
            write!(f, "\n{:12}", "")?;
            column = 13;
        }
        write!(f, " {word}")?;
        column += 1 + length;
    }
    writeln!(f)
}

fn shortened(name: &str) -> String {
    let count = name.chars().count();
    if count <= LONGEST_NAME {
        return name.to_owned();
    }
    format!("...{}", name.chars().skip(count + 3 - LONGEST_NAME).collect::<String>())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_table_fits_its_width_and_says_what_to_do() {
        let folder = tempfile::tempdir().unwrap();
        let tetrahedron = "v 0 0 0\nv 0.1 0 0\nv 0 0.1 0\nv 0 0 0.1\nf 1 3 2\nf 1 2 4\nf 2 3 4\nf 3 1 4\n";
        let write = |name: &str, text: &str| std::fs::write(folder.path().join(name), text).unwrap();
        write("a.obj", tetrahedron);
        write("b copy with a name that is far too long for any table to hold.obj", tetrahedron);
        write("c.obj", &tetrahedron.replace("f 1 3 2", "f 1 2 3"));
        write("d.obj", &tetrahedron.replace("0.1", "100"));
        let report = check_report(
            &[folder.path().to_owned(), folder.path().join("none.stl")],
            ScaleRule::MetresPerUnit(1.0),
            SizeRule::default(),
        );
        assert_eq!(report.counts, MeshCheckCounts { total: 5, fine: 2, repaired: 1, refused: 2, copies: 2 });
        assert!(report.has_refusals());
        let text = report.to_string();
        assert!(text.lines().all(|line| line.chars().count() <= 100), "{text}");
        for part in [
            "  fine\n",
            "    repaired 1 face against its neighbours reversed\n",
            "    copy     the same triangles as ",
            "    remedy   the file is probably in millimetres: set unit = \"mm\"\n",
            "    problem  no such file\n",
            "\n5 meshes: 2 fine, 1 repaired, 2 refused; 2 copies\n",
        ] {
            assert!(text.contains(part), "{part}\n{text}");
        }
        let json = serde_json::to_value(&report).unwrap();
        assert_eq!(json["counts"]["refused"], 2);
        assert_eq!(json["meshes"][3]["refusal"]["reason"], "too_large");
    }
}
