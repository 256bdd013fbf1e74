//! Permissions of licences: sharing copies of a shape, sharing data made from it, commercial use.

use spdx::{Expression, LicenseReq};

/// A required permission.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Need {
    /// Whether to share derived data; otherwise only copies.
    pub derived: bool,
    /// Whether to allow commercial use.
    pub commercial: bool,
}

/// Permissions of one licence; all of these licences allow sharing copies.
#[derive(Clone, Copy)]
struct Terms {
    derived: bool,
    commercial: bool,
}

/// Licences for data that neither the Open Source Initiative nor the Free Software Foundation has reviewed.
const OPEN_DATA: [&str; 8] = [
    "CC-PDDC",
    "CDLA-Permissive-1.0",
    "CDLA-Permissive-2.0",
    "CDLA-Sharing-1.0",
    "ODC-By-1.0",
    "ODbL-1.0",
    "PDDL-1.0",
    "etalab-2.0",
];

/// Whether a text is an SPDX expression of listed licences.
pub(super) fn is_spdx(text: &str) -> bool {
    Expression::parse(text)
        .is_ok_and(|expression| expression.requirements().all(|requirement| requirement.req.license.id().is_some()))
}

/// Whether a licence gives a required permission; `None` if it is not an SPDX expression of licences with known terms.
pub(super) fn allows(text: &str, need: Need) -> Option<bool> {
    let expression = Expression::parse(text).ok()?;
    if !expression.requirements().all(|requirement| terms_of(&requirement.req).is_some()) {
        return None;
    }
    // One of several alternative licences must give all required permissions.
    Some(expression.evaluate(|licence| {
        terms_of(licence)
            .is_some_and(|terms| (terms.derived || !need.derived) && (terms.commercial || !need.commercial))
    }))
}

/// Whether a licence allows commercial use; `false` if this is not known.
pub(super) fn is_commercial(text: &str) -> bool {
    allows(text, Need { derived: false, commercial: true }) == Some(true)
}

/// Whether derived works must have the same licence.
pub(super) fn shares_alike(text: &str) -> bool {
    Expression::parse(text).is_ok_and(|expression| {
        let free = |licence: &LicenseReq| {
            licence
                .license
                .id()
                .is_some_and(|id| !id.is_copyleft() && !id.name.contains("-SA-") && id.name != "ODbL-1.0")
        };
        !expression.evaluate(free)
    })
}

fn terms_of(licence: &LicenseReq) -> Option<Terms> {
    let id = licence.license.id()?;
    if id.name.starts_with("CC-BY-") {
        return Some(Terms { derived: !id.name.contains("-ND"), commercial: !id.name.contains("-NC") });
    }
    let free = id.is_osi_approved() || id.is_fsf_free_libre() || OPEN_DATA.contains(&id.name);
    free.then_some(Terms { derived: true, commercial: true })
}

/// Names of the licences of an expression.
pub(super) fn names(text: &str) -> Vec<&'static str> {
    let Ok(expression) = Expression::parse(text) else { return Vec::new() };
    expression.requirements().filter_map(|requirement| Some(requirement.req.license.id()?.name)).collect()
}

/// Whether an expression offers a choice and does not require two licences at once.
pub(super) fn is_choice(text: &str) -> bool {
    !text.split_whitespace().any(|word| word == "AND" || word == "WITH")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn licences_allow_what_they_say() {
        let [copy, derive] = [false, true].map(|derived| Need { derived, commercial: true });
        let [free_copy, free_derive] = [copy, derive].map(|need| Need { commercial: false, ..need });
        for (licence, expected) in [
            ("CC0-1.0", [Some(true); 4]),
            ("CC-BY-4.0", [Some(true); 4]),
            ("MIT OR Apache-2.0", [Some(true); 4]),
            ("PDDL-1.0", [Some(true); 4]),
            ("CC-BY-NC-4.0", [Some(false), Some(false), Some(true), Some(true)]),
            ("CC-BY-ND-4.0", [Some(true), Some(false), Some(true), Some(false)]),
            ("CC-BY-NC-SA-4.0 AND CC-BY-NC-ND-4.0", [Some(false), Some(false), Some(true), Some(false)]),
            // Neither of the two allows commercial use of derived data.
            ("CC-BY-NC-4.0 OR CC-BY-ND-4.0", [Some(true), Some(false), Some(true), Some(true)]),
            ("LicenseRef-mine", [None; 4]),
            ("proprietary", [None; 4]),
            ("per model, in furniture.csv", [None; 4]),
        ] {
            assert_eq!([copy, derive, free_copy, free_derive].map(|need| allows(licence, need)), expected, "{licence}");
        }
        assert!(is_spdx("CC-BY-4.0") && !is_spdx("CC BY 4.0") && !is_spdx("LicenseRef-mine"));
        assert!(shares_alike("CC-BY-SA-4.0") && !shares_alike("CC-BY-4.0") && !shares_alike("MIT OR GPL-3.0-only"));
    }
}
