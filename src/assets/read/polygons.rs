//! Vertices and polygons as a file lists them.

use super::{
    cut::Cutter,
    delaunay::Fault,
    raw::{LeftOut, RawMesh},
};
use crate::{
    Refuse,
    repair::seams::{self, Seams},
};

/// Vertices and faces that a reader has found so far.
pub(super) struct Builder {
    mesh: RawMesh,
    /// Corners of all polygons, one after the other.
    corners: Vec<u32>,
    /// Where each polygon ends in `corners`.
    ends: Vec<u32>,
    /// Where the polygons of more than three corners are in the file: the polygon's index and its number there.
    numbers: Vec<(u32, u32)>,
    /// Unit of these numbers: "line", "face".
    counted: &'static str,
    highest: Option<(u32, String)>,
    degenerate: usize,
}

impl Builder {
    /// A builder without vertices and faces; `counted` is the noun for numbered faces in the file.
    pub(super) fn new(counted: &'static str) -> Self {
        Self {
            mesh: RawMesh::default(),
            corners: Vec::new(),
            ends: Vec::new(),
            numbers: Vec::new(),
            counted,
            highest: None,
            degenerate: 0,
        }
    }

    /// A builder of triangles whose equal positions are merged already, and whose coordinates are of single precision.
    pub(super) fn of_welded(positions: Vec<[f64; 3]>, corners: Vec<u32>, notes: Vec<String>) -> Self {
        let ends = (3..=corners.len() as u32).step_by(3).collect();
        let mesh = RawMesh { positions, welded: true, notes, ..RawMesh::default() };
        Self { mesh, corners, ends, ..Self::new("triangle") }
    }

    pub(super) fn vertices(&self) -> usize {
        self.mesh.positions.len()
    }

    pub(super) fn reserve(&mut self, vertices: usize, polygons: usize) {
        self.mesh.positions.reserve(vertices);
        self.ends.reserve(polygons);
        self.corners.reserve(3 * polygons);
    }

    pub(super) fn note(&mut self, note: String) {
        self.mesh.notes.push(note);
    }

    pub(super) fn vertex(&mut self, position: [f64; 3], location: impl FnOnce() -> String) {
        if !position.iter().all(|coordinate| coordinate.is_finite()) {
            // A scan may have a NaN for every missing pixel: those beyond the first thousand lose their location, but
            // are counted.
            let location = if self.mesh.not_finite.len() < 1000 { location() } else { String::new() };
            self.mesh.not_finite.push((self.mesh.positions.len() as u32, location));
        }
        self.mesh.positions.push(position);
    }

    /// Adds a corner to the polygon under way; `index` counts from 0 and is checked when all vertices are known.
    pub(super) fn corner(&mut self, index: i64, location: impl FnOnce() -> String) -> Result<(), Refuse> {
        let Ok(corner) = u32::try_from(index) else {
            return Err(out_of_range(index, self.vertices(), location()));
        };
        if self.highest.as_ref().is_none_or(|(highest, _)| *highest < corner) && corner as usize >= self.vertices() {
            self.highest = Some((corner, location()));
        }
        self.corners.push(corner);
        Ok(())
    }

    /// Ends the polygon under way, which has this number in the file; one of fewer than three corners is dropped and counted.
    pub(super) fn end_polygon(&mut self, number: usize) {
        let start = self.ends.last().map_or(0, |&end| end as usize);
        if self.corners.len() < start + 3 {
            self.corners.truncate(start);
            self.degenerate += 1;
            return;
        }
        if self.corners.len() > start + 3 {
            self.numbers.push((self.ends.len() as u32, number as u32));
        }
        self.ends.push(self.corners.len() as u32);
    }

    /// Checks the corners, joins the vertices that are one and cuts the polygons into triangles.
    pub(super) fn finish(mut self) -> Result<RawMesh, Refuse> {
        if let Some((highest, location)) =
            self.highest.take().filter(|(highest, _)| *highest as usize >= self.mesh.positions.len())
        {
            return Err(out_of_range(i64::from(highest), self.mesh.positions.len(), location));
        }
        if self.degenerate > 0 {
            self.mesh.notes.push(format!("{} faces of fewer than three corners are ignored", self.degenerate));
        }
        let mut polygons = seams::Polygons { corners: &mut self.corners, ends: &self.ends };
        let seams = Seams::join(&mut self.mesh.positions, &mut polygons);
        if seams.is_crowd {
            let note = "too many vertices within a millionth of its longest side of each other to tell which are one";
            self.mesh.notes.push(note.to_owned());
        }
        (self.mesh.merged, self.mesh.joined) = (seams.equal + seams.near, seams.near);
        self.cut(&seams);
        match &self.mesh.left_out {
            Some(left_out) if self.mesh.faces.is_empty() => Err(left_out.refusal()),
            _ => Ok(self.mesh),
        }
    }

    fn cut(&mut self, seams: &Seams) {
        let mut faces = std::mem::take(&mut self.mesh.faces);
        faces.reserve(self.ends.len());
        let cutter = Cutter::new(&self.mesh.positions, seams);
        let mut numbers = self.numbers.iter().peekable();
        let (mut left_out, mut start): (Option<LeftOut>, _) = (None, 0);
        for (index, &end) in self.ends.iter().enumerate() {
            let number = numbers.next_if(|(polygon, _)| *polygon == index as u32);
            let cut = cutter.cut(&self.corners[start..end as usize], &mut faces);
            start = end as usize;
            let (Err(fault), Some((_, number))) = (cut, number) else { continue };
            let location = || format!("{} {number}", self.counted);
            left_out.get_or_insert_with(|| first_left_out(&fault, location())).count += 1;
        }
        (self.mesh.faces, self.mesh.left_out) = (faces, left_out);
    }
}

/// The first face that is left out, not counted yet.
fn first_left_out(fault: &Fault, location: String) -> LeftOut {
    LeftOut { count: 0, location, problem: fault.to_string() }
}

fn out_of_range(index: i64, vertices: usize, location: String) -> Refuse {
    let problem = format!("a face names vertex {index} (counted from 0), but there are {vertices}");
    Refuse::new("index_out_of_range", problem, "export it again: vertices are missing or the file was cut").at(location)
}
