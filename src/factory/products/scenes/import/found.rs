//! Arrangements as read, with the position of each body in its file, and their mistakes.

use form::{FormError, FormProblem, Location, Mistakes, did_you_mean};

use super::{ImportedBody, ImportedScene};

/// Bodies of a scene, at most: as many as a settled one may have.
pub(super) const MAX_BODIES: usize = 20;

/// An arrangement as it was read.
pub(super) struct FoundScene {
    /// The scene among its files.
    pub source: String,
    /// The bodies.
    pub bodies: Vec<FoundBody>,
    /// Where it begins.
    pub location: Location,
}

/// A body as it was read.
pub(super) struct FoundBody {
    /// The body.
    pub body: ImportedBody,
    /// Number by which a file of BOP names the object.
    pub obj_id: Option<u32>,
    /// Position in the file.
    pub location: Location,
}

/// A mistake in a file that a key of the job names.
pub(super) fn mistake(
    location: Location,
    key: &str,
    expected: impl Into<String>,
    found: impl Into<String>,
    help: Option<String>,
) -> FormError {
    let problem = FormProblem::Invalid { expected: expected.into(), found: found.into() };
    FormError { location, key: key.to_owned(), problem, help }
}

impl FoundScene {
    /// Reports mistakes of the arrangement: its count of bodies, objects that the job does not have, and bodies listed
    /// twice. `key` is the one that names the file, `names` the objects of the job.
    pub fn check(&self, key: &str, names: &[&str], errors: &mut Mistakes) {
        let count = self.bodies.len();
        if !(1..=MAX_BODIES).contains(&count) {
            let expected = format!("1 to {MAX_BODIES} bodies in scene `{}`", self.source);
            let help = if count == 0 { "leave the scene out" } else { "leave bodies out, or split the scene" };
            // The reader stops at the first body too many.
            let found = if count > MAX_BODIES { format!("more than {MAX_BODIES}") } else { count.to_string() };
            errors.push(mistake(self.location.clone(), key, expected, found, Some(help.to_owned())));
            return;
        }
        for (index, FoundBody { body, obj_id, location }) in self.bodies.iter().enumerate() {
            if !names.contains(&body.object.as_str()) {
                let near = did_you_mean(&body.object, names.iter().copied());
                let (found, help) = match obj_id {
                    Some(id) => {
                        let named = format!("name its object: import.objects = {{ \"{id}\" = \"NAME\" }}");
                        (format!("obj_id {id}, which is called `{}`", body.object), Some(named))
                    }
                    None => (format!("`{}`", body.object), near),
                };
                errors.push(mistake(location.clone(), key, "the name of an object of this job", found, help));
            }
            if self.bodies[..index].iter().any(|other| other.body == *body) {
                let found = format!("`{}` in scene `{}` twice in one pose", body.object, self.source);
                let help = Some("leave one of the two out".to_owned());
                errors.push(mistake(location.clone(), key, "each body once", found, help));
            }
        }
    }

    /// The arrangement alone.
    pub fn into_scene(self) -> ImportedScene {
        ImportedScene { source: self.source, bodies: self.bodies.into_iter().map(|found| found.body).collect() }
    }
}
