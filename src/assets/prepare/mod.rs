//! From a file or a built-in shape to a mesh that every room can trust.
//!
//! In this order: read, join seams and cut polygons, drop unused vertices, scale, merge equal positions, drop faces
//! without area, settle faces on the same three vertices, orient faces and shells, check. Nothing is moved, simplified
//! or filled, except by rounding at seams. The bytes of the result depend only on the file's content, the scale rule
//! and this code.

mod digest;
pub(crate) mod thin;

pub use digest::object as object_id;
pub use thin::refuse_without_solid;

use nalgebra::{Matrix3, Vector3};

use crate::{
    AssetRecord, InsideMethod, LooseParts, MeshOrigin, MeshRefusal, MeshSource, PreparedMesh, Refuse, Repair,
    ScaleRule, SizeRule, Winding, built_in,
    read::{self, RawMesh},
    repair::{
        bodies::Bodies,
        edges::Edges,
        holes, mend,
        shells::{self, Shells},
        undecided::Rim,
    },
};
use kernel::{
    geom::TriMesh,
    ids::Digest,
    voxel::solid_effort,
    words::{LengthUnit, MAY_OVERLAP, SEPARATE_BODIES, counted},
};

/// Reads or makes a mesh, scales it to metres, checks, repairs and hashes it.
///
/// # Errors
/// With file, location and remedy, if the mesh cannot be read, is no solid of a plausible size, or is broken in a form
/// that cannot be repaired without guessing.
pub fn prepare(source: &MeshSource) -> Result<PreparedMesh, MeshRefusal> {
    prepare_and_judge(source).map(|(prepared, _)| prepared)
}

/// Findings about a mesh that its record does not hold.
pub(super) struct Judgement {
    /// Share of the surface at which the winding number is farther than 1/4 from a whole number; 0 for a closed mesh.
    pub(super) undecided: f64,
    /// Closed parts are in one another and wound alike, or their boxes meet: the volume in the record, a sum over
    /// parts, may count space twice.
    pub(super) counts_space_twice: bool,
}

/// [`prepare`], with the findings that the record does not hold.
pub(super) fn prepare_and_judge(source: &MeshSource) -> Result<(PreparedMesh, Judgement), MeshRefusal> {
    match &source.origin {
        MeshOrigin::File(path) => {
            let (bytes, raw) = read::read(path)?;
            let file = Digest::hash(&bytes);
            drop(bytes);
            finish(raw, source, Some(file)).map_err(|refuse| refuse.about(path.display().to_string()))
        }
        MeshOrigin::BuiltIn(name) => {
            let raw = built_in::make(name).map_err(|refuse| refuse.about(name))?;
            finish(raw, source, None).map_err(|refuse| refuse.about(name))
        }
    }
}

/// Prepares a mesh that has been read. A refusal tells of faces that were left out: they may be why.
fn finish(raw: RawMesh, source: &MeshSource, file: Option<Digest>) -> Result<(PreparedMesh, Judgement), Refuse> {
    let left_out = raw.left_out.clone();
    finish_faces(raw, source, file).map_err(|refuse| match left_out {
        Some(left_out) => refuse.noting(&left_out.note()),
        None => refuse,
    })
}

fn finish_faces(
    mut raw: RawMesh,
    source: &MeshSource,
    file: Option<Digest>,
) -> Result<(PreparedMesh, Judgement), Refuse> {
    // Repairs while reading: seams, crossing faces, unused vertices.
    let mut warnings = std::mem::take(&mut raw.notes);
    let mut repairs = Vec::new();
    if raw.joined > 0 {
        repairs.push(Repair::JoinedVertices { count: raw.joined as u32 });
    }
    if let Some(left_out) = &raw.left_out {
        repairs.push(Repair::CrossingFaces { count: left_out.count });
        warnings.push(left_out.note());
    }
    let unused = if raw.welded && raw.merged == 0 { 0 } else { drop_unused(&mut raw)?.saturating_sub(raw.merged) };
    if unused > 0 {
        repairs.push(Repair::UnusedVertices { count: unused as u32 });
    }

    // Scale to metres, and repair faces.
    let (mut mesh, scale) = scaled(raw, source.scale)?;
    let (edges, mended) = mend_faces(&mut mesh, &mut warnings)?;
    repairs.extend(mended);
    check_extent(&mesh, source)?;

    // Orient faces and shells; reversed faces need new edges.
    let mut edges = edges;
    let shells = shells::orient(&mut mesh, &edges);
    if shells.flipped > 0 {
        repairs.push(Repair::FlippedFaces { count: shells.flipped });
    }
    if shells.inside_out > 0 {
        repairs.push(Repair::InsideOut { count: shells.inside_out });
    }
    if shells.flipped + shells.inside_out > 0 {
        edges = Edges::of(&mesh.triangles, mesh.vertices.len());
    }
    // Checks, and the record.
    check_volume(&mesh, &shells)?;
    let undecided = check_sides(&mesh, &edges, &shells)?;
    let record = describe(&mesh, &edges, &shells, source, (file, scale, repairs, warnings));
    let counts_space_twice = shells.may_overlap || shells.solids_in_solids > 0;
    Ok((PreparedMesh { mesh, record }, Judgement { undecided, counts_space_twice }))
}

/// The parts of a mesh that nothing joins, each as a separate prepared mesh [m]; none if the mesh is connected, or has
/// too many bodies to distinguish.
///
/// # Errors
/// When the mesh cannot be used.
pub fn parts(source: &MeshSource) -> Result<Vec<TriMesh>, MeshRefusal> {
    let mut mesh = prepare(source)?.mesh;
    let edges = Edges::of(&mesh.triangles, mesh.vertices.len());
    let shells = shells::orient(&mut mesh, &edges);
    Ok(Bodies::of(&mesh, &shells).apart(&mesh, &shells))
}

/// Settles the faces that are not part of a plain surface; returns the edges of the rest.
fn mend_faces(mesh: &mut TriMesh, warnings: &mut Vec<String>) -> Result<(Edges, Vec<Repair>), Refuse> {
    // Collapsed faces, then faces on the same three vertices.
    let mut zero_area = mend::drop_collapsed(mesh);
    let mut edges = Edges::of(&mesh.triangles, mesh.vertices.len());
    let area = mesh_area(mesh, !edges.twins.is_empty());
    let mut twins = mend::drop_twins(mesh, &edges);
    if zero_area > 0 || twins.dropped() > 0 {
        let unused = mend::drop_unused(&mut mesh.vertices, &mut mesh.triangles);
        if unused > 0 || twins.dropped() > 0 {
            edges = Edges::of(&mesh.triangles, mesh.vertices.len());
        }
    }
    // Faces without area: splitting their neighbours may make further twins.
    let flat = mend::drop_zero_area(mesh);
    if flat > 0 {
        zero_area += flat;
        mend::drop_unused(&mut mesh.vertices, &mut mesh.triangles);
        edges = Edges::of(&mesh.triangles, mesh.vertices.len());
        // Splitting a neighbour can make a second face on the same vertices.
        let more = mend::drop_twins(mesh, &edges);
        if more.dropped() > 0 {
            mend::drop_unused(&mut mesh.vertices, &mut mesh.triangles);
            edges = Edges::of(&mesh.triangles, mesh.vertices.len());
            twins.add(&more);
        }
    }
    if mesh.triangles.is_empty() {
        let problem = "no face encloses anything: all are without area or back to back in pairs";
        return Err(Refuse::new("no_volume", problem, "check the unit, or export a solid"));
    }
    // Report a loss of more than 1 % of the surface.
    if twins.lost_area > 0.01 * area {
        let share = 100.0 * twins.lost_area / area;
        warnings.push(format!(
            "{share:.0} % of the surface was pairs of faces back to back that enclose nothing; it is gone"
        ));
    }
    let repairs = [
        Repair::ZeroAreaFaces { count: zero_area as u32 },
        Repair::DuplicateFaces { count: twins.duplicates },
        Repair::TwoSidedShell { count: twins.sheets },
    ];
    let counts = [zero_area as u32, twins.duplicates, twins.sheets];
    let made: Vec<Repair> = repairs.into_iter().zip(counts).filter(|(_, count)| *count > 0).map(|(r, _)| r).collect();
    Ok((edges, made))
}

/// Drops vertices that no face uses, and refuses a used one that is not finite.
fn drop_unused(raw: &mut RawMesh) -> Result<usize, Refuse> {
    if !raw.not_finite.is_empty() {
        let mut used = vec![false; raw.positions.len()];
        raw.faces.iter().flatten().for_each(|&vertex| used[vertex as usize] = true);
        if let Some((vertex, location)) = raw.not_finite.iter().find(|(vertex, _)| used[*vertex as usize]) {
            return Err(Refuse::not_finite(raw.positions[*vertex as usize]).at(location));
        }
    }
    Ok(mend::drop_unused(&mut raw.positions, &mut raw.faces))
}

/// To metres, with equal positions merged.
fn scaled(raw: RawMesh, rule: ScaleRule) -> Result<(TriMesh, f64), Refuse> {
    // Lowest and highest coordinate along each axis, in the file's unit.
    let ranges = raw.positions.iter().fold([[f64::INFINITY, f64::NEG_INFINITY]; 3], |ranges, position| {
        std::array::from_fn(|axis| [ranges[axis][0].min(position[axis]), ranges[axis][1].max(position[axis])])
    });
    let longest = ranges.map(|[low, high]| high - low).into_iter().fold(0.0, f64::max);
    let scale = match rule {
        ScaleRule::MetresPerUnit(scale) => scale,
        ScaleRule::LongestSide(_) if longest <= 0.0 => {
            return Err(Refuse::new("flat", "all vertices are at one point", "export a solid"));
        }
        ScaleRule::LongestSide(wanted) => wanted / longest,
    };
    let vertices: Vec<[f32; 3]> =
        raw.positions.iter().map(|position| position.map(|coordinate| (coordinate * scale) as f32)).collect();
    if let Some(vertex) = vertices.iter().position(|vertex| !vertex.iter().all(|coordinate| coordinate.is_finite())) {
        let refuse = Refuse::new("not_finite", "a coordinate exceeds 3.4e38 m after scaling", "check the unit");
        return Err(refuse.at(format!("vertex {}", vertex + 1)));
    }
    let farthest = ranges.into_iter().flatten().map(libm::fabs).fold(0.0, f64::max);
    check_distance_from_origin(scale * farthest, scale * longest)?;
    let mesh = TriMesh { vertices, triangles: raw.faces };
    Ok((if raw.welded && scale == 1.0 { mesh } else { mend::weld(mesh) }, scale))
}

/// Refuses a mesh so far from its origin that single precision distorts it; lengths in metres.
fn check_distance_from_origin(farthest: f64, longest: f64) -> Result<(), Refuse> {
    /// Largest distance of neighbouring positions, as a share of the longest side.
    const MAX_SPACING: f64 = 1e-4;
    let nearest = farthest as f32;
    // The largest number has no finite one above it.
    let below = if nearest == f32::MAX { nearest.next_down() } else { nearest };
    let spacing = f64::from(below.next_up()) - f64::from(below);
    if longest == 0.0 || spacing <= MAX_SPACING * longest {
        return Ok(());
    }
    let problem = format!(
        "reaches {} from its origin, where positions in single precision are {} apart: {} of its longest side, {}",
        length(farthest),
        length(spacing),
        percent(spacing / longest),
        length(longest)
    );
    let remedy = "move the mesh to its origin in the program that made it, and export it again: what the file has lost by \
                  then, such as a binary STL, cannot be repaired here";
    Err(Refuse::new("far_from_origin", problem, remedy))
}

/// A share in per cent, with two digits where it is small.
fn percent(share: f64) -> String {
    if share < 0.1 { format!("{:.2} %", 100.0 * share) } else { format!("{:.0} %", 100.0 * share) }
}

fn mesh_area(mesh: &TriMesh, wanted: bool) -> f64 {
    let area = |face| {
        let [a, b, c] = mesh.corners(face);
        (b - a).cross(&(c - a)).norm() / 2.0
    };
    if wanted { (0..mesh.triangles.len()).map(area).sum() } else { 0.0 }
}

fn check_extent(mesh: &TriMesh, source: &MeshSource) -> Result<(), Refuse> {
    if mesh.vertices.len() < 4 {
        let problem = format!("{} distinct vertices; a solid has at least 4", mesh.vertices.len());
        return Err(Refuse::new("too_few_vertices", problem, "export a solid"));
    }
    let (longest, diagonal) =
        mesh.aabb().map_or((0.0, 0.0), |aabb| (aabb.longest_side(), (aabb.max - aabb.min).norm()));
    let SizeRule { min, max } = source.size;
    if longest < min || longest > max {
        let reason = if longest < min { "too_small" } else { "too_large" };
        let problem = format!("longest side {}, outside {} to {}", length(longest), length(min), length(max));
        return Err(Refuse::new(reason, problem, guess_unit(longest, diagonal, source)));
    }
    Ok(())
}

/// A remedy for a mesh of the wrong size: the real size of a normalised mesh, or the units that make it as large as a thing
/// to grasp, the one nearest to 150 mm first.
fn guess_unit(longest: f64, diagonal: f64, source: &MeshSource) -> String {
    /// Deviation of a normalised size, as a share.
    const NORMALISED: f64 = 1e-3;
    const TYPICAL: f64 = 0.15;
    /// Units that modelling programs write.
    const COMMON: [&str; 4] = ["mm", "cm", "in", "m"];
    /// A second unit is named if its distance from the typical size is less than this many times larger.
    const AS_LIKELY: f64 = 4.0;
    let ScaleRule::MetresPerUnit(unit) = source.scale else {
        return "change its size, or widen the job's size limits".to_owned();
    };
    let in_file = longest / unit;
    if let Some(what) = normalised_size(in_file, diagonal / unit, NORMALISED) {
        return format!("it is probably normalised ({what}): set its real longest side, such as size = 0.25");
    }
    let distance = |unit: &LengthUnit| libm::fabs(libm::log(in_file * unit.metres / TYPICAL));
    let fits = |other: &&LengthUnit| {
        other.metres != unit && (source.size.min..=source.size.max).contains(&(in_file * other.metres))
    };
    let mut units: Vec<&LengthUnit> = COMMON.iter().filter_map(|name| LengthUnit::named(name)).filter(fits).collect();
    units.sort_by(|a, b| distance(a).total_cmp(&distance(b)));
    let size = |unit: &LengthUnit| length(in_file * unit.metres);
    match units[..] {
        [] => "no common unit fits: set the longest side as size, or widen the job's size limits".to_owned(),
        [first, second, ..] if distance(second) < distance(first) + libm::log(AS_LIKELY) => format!(
            "the file is probably in {} ({}): set unit = \"{}\"; or in {} ({}): unit = \"{}\"",
            first.plural,
            size(first),
            first.symbol,
            second.plural,
            size(second),
            second.symbol
        ),
        [first, ..] => format!("the file is probably in {}: set unit = \"{}\"", first.plural, first.symbol),
    }
}

/// The size that data sets of shapes give all of their meshes, if a mesh with this longest side and this diagonal of
/// its box, in the file's unit, has one: ModelNet and ShapeNet, for example.
pub(super) fn normalised_size(longest: f64, diagonal: f64, tolerance: f64) -> Option<&'static str> {
    let sizes = [(longest, 1.0, "longest side 1"), (longest, 2.0, "longest side 2"), (diagonal, 1.0, "diagonal 1")];
    let is_near = |found: f64, size: f64| libm::fabs(found - size) < tolerance * size;
    sizes.into_iter().find(|&(found, size, _)| is_near(found, size)).map(|(.., what)| what)
}

fn check_volume(mesh: &TriMesh, shells: &Shells) -> Result<(), Refuse> {
    let side = mesh.aabb().map_or(0.0, |aabb| aabb.longest_side());
    let is_closed = shells.shells.iter().all(|shell| shell.closed);
    // Only a nearly empty mesh is worth the check against one plane.
    if libm::fabs(shells.volume) < 1e-4 * side * side * side {
        let thickness = thickness(mesh);
        if thickness <= 1e-6 * side {
            let problem = format!("a flat sheet: {} long and {} thick", length(side), length(thickness));
            return Err(Refuse::new("flat", problem, "give it thickness, or leave it out"));
        }
    }
    let remedy = "export a closed surface, or repair it in a mesh editor";
    // Area vectors that mostly agree in direction belong to a sheet, not to a solid with a hole.
    if !is_closed && shells.openness > 0.9 {
        let problem = format!("an open sheet: {:.0} % of its area faces one way", 100.0 * shells.openness);
        return Err(Refuse::new("open_sheet", problem, remedy));
    }
    // Smallest plausible volume: relative to the box where closed, to area^(3/2) where open.
    let min = if is_closed { 1e-7 * side * side * side } else { 1e-3 * shells.area * libm::sqrt(shells.area) };
    if libm::fabs(shells.volume) < min {
        let problem = format!(
            "encloses no volume: {:.1} mm3 under {:.0} mm2 of surface in {} pieces",
            1e9 * shells.volume,
            1e6 * shells.area,
            shells.shells.len()
        );
        return Err(Refuse::new("no_volume", problem, remedy));
    }
    Ok(())
}

/// Refuses surfaces without an inside; returns the share of the surface where the inside is undecided.
fn check_sides(mesh: &TriMesh, edges: &Edges, shells: &Shells) -> Result<f64, Refuse> {
    /// Largest share of the area in one-sided shells.
    const MAX_ONE_SIDED: f64 = 0.5;
    /// Largest accepted share of the surface where the inside is undecided.
    const MAX_UNDECIDED: f64 = 0.9;
    /// Largest such share where the shells, one by one, are sheets: of a dense soup half is undecided by chance.
    const MAX_UNDECIDED_OF_SHEETS: f64 = 0.3;
    /// From this openness on a shell is a sheet.
    const SHEET: f64 = 0.9;
    let remedy = "close the surface, or give its sheets thickness, in a mesh editor";
    if shells.one_sided > MAX_ONE_SIDED {
        let share = 100.0 * shells.one_sided;
        let problem =
            format!("no inside: {share:.0} % of its area is one-sided like a Moebius strip or a Klein bottle");
        return Err(Refuse::new("one_sided", problem, remedy));
    }
    let rim = Rim::of(mesh, edges);
    let undecided = rim.undecided_share(mesh);
    let are_sheets = shells.openness_by_shell > SHEET;
    if undecided > if are_sheets { MAX_UNDECIDED_OF_SHEETS } else { MAX_UNDECIDED } {
        let problem = format!(
            "no inside: at {:.0} % of its surface the winding number is farther than 1/4 from a whole number; its open edges \
             are {} long, {:.1} times the square root of its area, in {}",
            100.0 * undecided,
            length(rim.length),
            rim.length / libm::sqrt(shells.area),
            counted(shells.shells.len() as u64, if are_sheets { "loose sheet" } else { "piece" }),
        );
        return Err(Refuse::new("no_inside", problem, remedy));
    }
    Ok(undecided)
}

/// Extent across the plane that fits the vertices best [m].
fn thickness(mesh: &TriMesh) -> f64 {
    let points = || mesh.vertices.iter().map(|vertex| Vector3::from(vertex.map(f64::from)));
    let mean = points().sum::<Vector3<f64>>() / mesh.vertices.len() as f64;
    let spread: Matrix3<f64> = points().map(|point| (point - mean) * (point - mean).transpose()).sum();
    let eigen = spread.symmetric_eigen();
    let normal = eigen.eigenvectors.column(eigen.eigenvalues.imin()).into_owned();
    let along = points().map(|point| (point - mean).dot(&normal));
    let (low, high) = along.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), d| (low.min(d), high.max(d)));
    high - low
}

type Found = (Option<Digest>, f64, Vec<Repair>, Vec<String>);

fn describe(
    mesh: &TriMesh,
    edges: &Edges,
    shells: &Shells,
    source: &MeshSource,
    (file, scale, repairs, mut warnings): Found,
) -> AssetRecord {
    let watertight = edges.boundary == 0 && edges.crowded.is_empty() && edges.same_direction == 0;
    let found = Bodies::of(mesh, shells);
    let bodies = found.count;
    let loose = found.loose(mesh, shells);
    warn_of_topology(mesh, edges, shells, watertight, (bodies, loose), &mut warnings);
    let aabb = mesh.aabb().expect("a checked mesh has vertices");
    let longest = aabb.longest_side();
    let away = aabb.centre().coords.norm();
    if away > 1000.0 * longest {
        warnings.push(format!("is {} from its origin, so positions are coarse (f32)", length(away)));
    }
    let is_closed = !shells.mixed && shells.shells.iter().all(|shell| shell.closed);
    let inside = if is_closed { InsideMethod::Crossings } else { InsideMethod::WindingNumber };
    let solid_effort = if is_closed { None } else { dear_effort(mesh) };
    warnings.extend(solid_effort.map(|times| format!("{}; {CLOSE_IT}", effort_words(times))));
    AssetRecord {
        name: source.name.clone(),
        object: digest::object(mesh),
        geometry: digest::geometry(mesh),
        file,
        triangles: mesh.triangles.len() as u32,
        vertices: mesh.vertices.len() as u32,
        bodies,
        loose,
        euler: mesh.vertices.len() as i64 - edges.count as i64 + mesh.triangles.len() as i64,
        watertight,
        winding: if shells.mixed { Winding::Mixed } else { Winding::Outward },
        volume: shells.volume,
        lower: aabb.min.coords.into(),
        extents: aabb.extents(),
        scale,
        repairs,
        inside,
        solid_effort,
        warnings,
        licence: source.licence.clone(),
        citation: source.citation.clone(),
        group: source.group.clone(),
    }
}

/// Duration of making the solid over that of a closed mesh, to two digits, where that is worth a warning.
fn dear_effort(mesh: &TriMesh) -> Option<u32> {
    /// Effort from which a solid counts as expensive: a quarter of a second.
    const DEAR: f64 = 100.0;
    let effort = solid_effort(mesh);
    let digit = libm::pow(10.0, libm::floor(libm::log10(effort)) - 1.0);
    (effort >= DEAR).then(|| (digit * libm::round(effort / digit)) as u32)
}

/// Text about a solid that takes `times` times as long as that of a closed mesh.
pub fn effort_words(times: u32) -> String {
    format!("it is open: its solid takes about {times} times as long to make as that of a closed mesh")
}

/// Remedy for a solid that takes long.
const CLOSE_IT: &str = "merge its vertices by distance and fill its holes in a mesh editor";

fn warn_of_topology(
    mesh: &TriMesh,
    edges: &Edges,
    shells: &Shells,
    watertight: bool,
    (bodies, loose): (u32, Option<LooseParts>),
    warnings: &mut Vec<String>,
) {
    let holes = holes::holes(mesh, edges);
    if !holes.is_empty() {
        let locations = holes.iter().take(3).map(|hole| {
            let [x, y, z] = hole.centre();
            format!("{} edges, {} wide at ({x:.4}, {y:.4}, {z:.4})", hole.edges, length(hole.width()))
        });
        let locations = locations.collect::<Vec<_>>().join("; ");
        let rest = if holes.len() > 3 { "; ..." } else { "" };
        warnings.push(format!("{}: {locations}{rest}", counted(holes.len() as u64, "hole")));
    }
    if !edges.crowded.is_empty() {
        warnings.push(format!("{} shared by three faces or more", counted(edges.crowded.len() as u64, "edge")));
    }
    if shells.mixed {
        warnings.push("its faces have no consistent winding (one-sided like a Moebius strip)".to_owned());
    }
    if watertight {
        let pinches = holes::pinches(mesh, edges);
        if pinches > 0 {
            warnings.push(format!("touches itself in {}", counted(pinches as u64, "point")));
        }
    }
    if bodies > 1 {
        warnings.push(format!("{bodies} {SEPARATE_BODIES}"));
    }
    if let Some(LooseParts { parts, gap, .. }) = loose {
        warnings.push(format!(
            "{parts} loose parts that nothing joins, the nearest two {} apart: jobs for grasps refuse it unless they say \
             bodies = \"join\"",
            length(gap)
        ));
    }
    if shells.cavities > 0 {
        warnings.push(format!("{} inside, kept hollow", counted(u64::from(shells.cavities), "cavity")));
    }
    if shells.solids_in_solids > 0 {
        let parts = counted(u64::from(shells.solids_in_solids), "part");
        warnings.push(format!("{parts} inside another and wound like it: taken as solid, not as a cavity"));
    }
    if shells.is_crowd {
        warnings.push(
            "too many parts to tell which lie in one another: some may count as solid that are cavities".to_owned(),
        );
    }
    if shells.may_overlap {
        warnings.push(MAY_OVERLAP.to_owned());
    }
}

/// A length for people: the unit that leaves one to three digits before the point.
pub(super) fn length(metres: f64) -> String {
    match metres {
        metres if metres >= 1e9 => format!("{metres:.3e} m"),
        metres if metres >= 1.0 => format!("{metres:.3} m"),
        metres if metres >= 1e-4 => format!("{:.3} mm", 1e3 * metres),
        0.0 => "0 mm".to_owned(),
        metres => format!("{:.3} um", 1e6 * metres),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{HalfShape, built_in_names, built_in_source};

    #[test]
    fn every_built_in_shape_is_watertight_and_needs_no_repair() {
        let halves = [None, Some(20), Some(300)].into_iter().flat_map(HalfShape::all).map(|shape| shape.to_string());
        let names = built_in_names(8 * 16).chain(halves);
        for name in names.chain([
            "mug-04@16k".to_owned(),
            "can-01@16k".to_owned(),
            "half-cube-diamond@16k".to_owned(),
            "box-02@500".to_owned(),
        ]) {
            let prepared = prepare(&built_in_source(&name)).unwrap();
            let record = &prepared.record;
            assert!(record.watertight && record.repairs.is_empty(), "{record:#?}");
            assert_eq!(
                (record.bodies, record.inside, &record.warnings),
                (1, InsideMethod::Crossings, &vec![]),
                "{name}"
            );
            let wanted = if name.ends_with("16k") {
                16_000
            } else if name.ends_with("500") {
                500
            } else {
                6_000
            };
            assert!((wanted..wanted * 3 / 2).contains(&record.triangles), "{name}: {}", record.triangles);
        }
    }

    #[test]
    fn a_name_without_a_shape_is_refused_and_told_what_there_is() {
        for (name, problem) in [
            ("spoon-01", "no built-in shape is called spoon-01"),
            ("can-1", "can-1: shapes count -01, -02, ..."),
            ("can-01@10", "the triangles after @ are 500 to 4000000"),
            ("half-cube-egg", "half-cube-egg: half-shapes are called half-FRONT-BACK, each of sphere, cube, diamond"),
            ("half-cube-cube-301mm@16k", "half-cube-cube-301mm: the size of a half-shape is 20 to 300"),
        ] {
            let refusal = prepare(&built_in_source(name)).unwrap_err();
            assert_eq!((refusal.file.as_str(), refusal.reason.as_str()), (name, "unknown_built_in"));
            assert!(refusal.problem.contains(problem), "{name}: {}", refusal.problem);
            assert!(refusal.remedy.contains("half-FRONT-BACK-80mm"), "{}", refusal.remedy);
        }
    }
}
