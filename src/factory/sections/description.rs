//! Descriptions of hands and robots that a job names.

use std::path::Path as FilePath;

use form::{Checker, Path};
use kernel::{
    description::{Description, DescriptionError},
    ids::Digest,
    words::Show,
};

/// The description at `key`, compared with the content that the job pins. `None` when it cannot be read or differs,
/// which is reported. `noun` is `hand` or `robot`.
pub fn pinned_description(
    checker: &mut Checker,
    key: &str,
    noun: &str,
    scene: &FilePath,
    read: Result<Description, DescriptionError>,
    pinned: Option<&str>,
) -> Option<Description> {
    let description = match read {
        Ok(description) => description,
        Err(error) => {
            let (key, message) = (Path::from(key).key("model"), error.to_string());
            let report = match &error {
                DescriptionError::Unreadable { .. } => checker.not_found(key, noun, message),
                _ => checker.invalid(key, format!("a {noun} that can be read"), message),
            };
            report.help(error.remedy());
            return None;
        }
    };
    check_content(checker, key, noun, scene, description.digest, pinned);
    Some(description)
}

/// Whether the description at `key` has the content that the job pins; a difference is reported. `noun` names its kind.
pub fn check_content(
    checker: &mut Checker,
    key: &str,
    noun: &str,
    file: &FilePath,
    digest: Digest,
    pinned: Option<&str>,
) -> bool {
    let Some(pinned) = pinned.and_then(Digest::from_hex).filter(|pinned| *pinned != digest) else { return true };
    let expected = format!("a {noun} of content {}", pinned.short());
    let found = format!("{}: {} has changed", digest.short(), file.shown());
    let report = checker.invalid(Path::from(key).key("content"), expected, found);
    report.help("restore its files, or remove `content` from the job for a new dataset");
    false
}
