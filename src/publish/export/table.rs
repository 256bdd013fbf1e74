//! `samples.csv`: the sample of each row of the arrays or of each file (RFC 4180, with a heading).

use std::{
    fs::File,
    io::{BufWriter, Write},
    path::PathBuf,
};

use super::{error::ExportError, pair::PairSample, selected::SelectedSample, target::Target};

const HEADING: &str = "row,sample_index,sample,object,subject,item,instance,camera,split,partial_cells,complete_cells,\
    both_cells,solid_share,resolution,cell_size,centre_x,centre_y,centre_z,stem";

/// The table while it is written.
pub(super) struct SampleTable {
    file: BufWriter<File>,
    path: PathBuf,
    rows: u64,
}

impl SampleTable {
    pub fn create(target: &mut Target) -> Result<Self, ExportError> {
        let (mut file, path) = target.open("samples.csv")?;
        writeln!(file, "{HEADING}").map_err(ExportError::io("writing", &path))?;
        Ok(Self { file, path, rows: 0 })
    }

    /// One sample.
    pub fn row(&mut self, sample: &PairSample<'_>) -> Result<(), ExportError> {
        let PairSample { pair, names, stem, .. } = *sample;
        let SelectedSample { object, split, .. } = *names;
        let (index, id, grid, row) = (sample.index(), pair.sample, pair.grid, self.rows);
        self.rows += 1;
        writeln!(
            self.file,
            "{row},{index},{id},{},{},{},{},{},{split},{},{},{},{},{},{},{},{},{},{}",
            quoted(object),
            id.subject,
            id.item,
            id.instance,
            id.camera,
            pair.partial_cells,
            pair.complete_cells,
            pair.both_cells,
            pair.solid_share,
            grid.resolution,
            grid.cell_size,
            grid.centre.x,
            grid.centre.y,
            grid.centre.z,
            quoted(stem),
        )
        .map_err(ExportError::io("writing", &self.path))
    }

    pub fn finish(mut self) -> Result<(), ExportError> {
        self.file.flush().map_err(ExportError::io("writing", &self.path))
    }
}

/// A text field, in quotes if necessary. An apostrophe precedes text that a spreadsheet would interpret as a formula (OWASP, "CSV
/// injection").
fn quoted(field: &str) -> String {
    let field =
        if field.starts_with(['=', '+', '-', '@', '\t', '\r']) { format!("'{field}") } else { field.to_owned() };
    if field.contains([',', '"', '\n', '\r']) { format!("\"{}\"", field.replace('"', "\"\"")) } else { field }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn fields_are_quoted_as_the_rfc_says() {
        assert_eq!(quoted("mug"), "mug");
        assert_eq!(quoted("a,\"b\""), "\"a,\"\"b\"\"\"");
    }

    #[test]
    fn no_name_is_a_formula() {
        assert_eq!(quoted("=cmd|'/c calc'!A1"), "'=cmd|'/c calc'!A1");
        assert_eq!(quoted("@sum(a,b)"), "\"'@sum(a,b)\"");
        assert_eq!(quoted("mug-1=2"), "mug-1=2");
    }
}
