//! Contacts of a hand or a probe, as `--touch` reads them.

use std::path::Path;

use super::exit::{Exit, Failure};
use kernel::{
    files::{self, Bound},
    words::Show,
};

/// Names of the columns.
const COLUMNS: [&str; 3] = ["x", "y", "z"];

/// Reads points [m] in the camera's frame, one per line: x, y, z, with or without a first line of these names.
pub fn read_contacts(path: &Path) -> Result<Vec<[f32; 3]>, Failure> {
    let failed = |error: std::io::Error| {
        Failure::of_input(anyhow::Error::new(error).context(format!("{}: it cannot be read", path.shown())))
    };
    let text = files::read_text(path, Bound::CONTACTS).map_err(failed)?;
    parse_contacts(&text).map_err(|problem| Failure::message(Exit::BadSpec, format!("{}: {problem}", path.shown())))
}

fn parse_contacts(text: &str) -> Result<Vec<[f32; 3]>, String> {
    let mut contacts = Vec::new();
    for (index, line) in text.lines().enumerate().filter(|(_, line)| !line.trim().is_empty()) {
        let fields: Vec<&str> = line.split(',').map(str::trim).collect();
        if index == 0 && fields == COLUMNS {
            continue;
        }
        let numbers: Option<Vec<f32>> =
            fields.iter().map(|field| field.parse().ok().filter(|number: &f32| number.is_finite())).collect();
        let contact = numbers.and_then(|numbers| <[f32; 3]>::try_from(numbers).ok());
        let contact = contact.ok_or_else(|| {
            format!(
                "line {}: '{}'; each line must contain three numbers x,y,z: metres in the camera's frame",
                index + 1,
                line.trim()
            )
        })?;
        contacts.push(contact);
    }
    if contacts.is_empty() {
        return Err("the file contains no contact: give one line x,y,z per contact, or leave out --touch".to_owned());
    }
    Ok(contacts)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn contacts_are_lines_of_three_numbers() {
        assert_eq!(parse_contacts("x,y,z\n0.1, -0.2,0.7\n\n1,2,3\n"), Ok(vec![[0.1, -0.2, 0.7], [1.0, 2.0, 3.0]]));
        assert_eq!(parse_contacts("1,2,3"), Ok(vec![[1.0, 2.0, 3.0]]));
        for (text, says) in [
            ("", "no contact"),
            ("x,y,z\n", "no contact"),
            ("1,2\n", "line 1"),
            ("1,2,3\n1,2,3,4\n", "line 2"),
            ("1,2,3\n1,2,far\n", "line 2: '1,2,far'"),
            ("1,nan,3\n", "three numbers"),
        ] {
            let said = parse_contacts(text).expect_err("refused");
            assert!(said.contains(says), "{says}: {said}");
        }
    }
}
