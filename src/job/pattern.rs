//! Patterns for the names of models and shapes: `*` any letters, `?` one, `\` takes the next letter as it is.
//!
//! Patterns for files are `assets::list_folder`'s.

/// Whether `pattern` fits all of `text`: greedy with one point to fall back to, so never exponential.
pub(super) fn name(pattern: &str, text: &str) -> bool {
    let (pattern, text): (Vec<char>, Vec<char>) = (pattern.chars().collect(), text.chars().collect());
    let (mut p, mut t) = (0, 0);
    let mut star: Option<(usize, usize)> = None;
    while t < text.len() {
        let (fits, step) = match pattern.get(p) {
            Some('*') => {
                star = Some((p + 1, t));
                p += 1;
                continue;
            }
            Some('?') => (true, 1),
            Some('\\') if p + 1 < pattern.len() => (pattern[p + 1] == text[t], 2),
            Some(letter) => (*letter == text[t], 1),
            None => (false, 0),
        };
        if fits {
            p += step;
            t += 1;
        } else if let Some((after, from)) = star {
            p = after;
            t = from + 1;
            star = Some((after, from + 1));
        } else {
            return false;
        }
    }
    pattern[p..].iter().all(|letter| *letter == '*')
}

/// The pattern that fits `text` alone.
pub(super) fn literal(text: &str) -> String {
    let escape = |letter: char| if matches!(letter, '*' | '?' | '\\') { vec!['\\', letter] } else { vec![letter] };
    text.chars().flat_map(escape).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn stars_and_question_marks() {
        for (pattern, text, expected) in [
            ("0??_*", "003_cracker_box", true),
            ("*a*b*c", "xaxbxc", true),
            ("*a*b*c", "xaxbx", false),
            ("Tasse ü?", "Tasse üb", true),
            ("", "", true),
            ("*", "", true),
            ("?", "", false),
        ] {
            assert_eq!(name(pattern, text), expected, "{pattern} on {text}");
        }
        let odd = r"a*b?c\d";
        assert!(name(&literal(odd), odd) && !name(&literal(odd), r"axbyc\d"));
        assert!(!name(&"*a".repeat(30), &"a".repeat(200).replace("aa", "ab")));
    }
}
