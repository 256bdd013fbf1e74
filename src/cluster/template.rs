//! Text with places to fill, `{{so}}`.

/// Fills every place of a template.
///
/// # Panics
/// When the template has a place without a value: templates are part of the program, and its tests fill each.
pub(super) fn fill(template: &str, values: &[(&str, String)]) -> String {
    let mut filled = String::with_capacity(template.len());
    let mut rest = template;
    while let Some((before, after)) = rest.split_once("{{") {
        let (name, after) = after.split_once("}}").unwrap_or_else(|| panic!("a place that does not end: {after}"));
        let value = values.iter().find(|(key, _)| *key == name);
        filled.push_str(before);
        filled.push_str(&value.unwrap_or_else(|| panic!("no value for '{name}'")).1);
        rest = after;
    }
    filled.push_str(rest);
    filled
}

/// A word of a shell's command line.
pub(super) fn shell_word(text: &str) -> String {
    let plain = |byte: u8| byte.is_ascii_alphanumeric() || b"_-./=:,+@%".contains(&byte);
    if !text.is_empty() && text.bytes().all(plain) {
        text.to_owned()
    } else {
        format!("'{}'", text.replace('\'', r"'\''"))
    }
}

/// A name that engines take: small letters, digits and hyphens, at most 40 (Kubernetes adds to it).
pub(super) fn plain_name(text: &str) -> String {
    let letter = |letter: char| if letter.is_ascii_alphanumeric() { letter.to_ascii_lowercase() } else { '-' };
    let name: String = text.chars().map(letter).take(40).collect();
    let name = name.trim_matches('-');
    if name.is_empty() { "graspmill".to_owned() } else { name.to_owned() }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn places_are_filled() {
        let values = [("a", "1".to_owned()), ("b", "{{a}}".to_owned())];
        assert_eq!(fill("x {{a}} {} {{b}}{{a}}", &values), "x 1 {} {{a}}1");
    }

    #[test]
    fn words_and_names_are_safe() {
        assert_eq!(shell_word("/a/b-c_1.toml"), "/a/b-c_1.toml");
        assert_eq!(shell_word("it's $HOME"), r"'it'\''s $HOME'");
        assert_eq!(shell_word(""), "''");
        assert_eq!(plain_name("My job (2)"), "my-job--2");
        assert_eq!(plain_name("..."), "graspmill");
    }
}
