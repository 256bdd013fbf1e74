//! Patterns of names and paths: `*` matches any part of a name, `**` any folders, `?` one letter, `\` the next letter literally.

/// Whether `pattern` matches `path` (separated by `/`). A pattern without `/` is compared with the last part only.
pub fn fits_path(pattern: &str, path: &str) -> bool {
    if pattern.contains('/') {
        let parts: Vec<&str> = path.split('/').collect();
        let wanted: Vec<&str> = pattern.trim_start_matches("./").split('/').collect();
        folders(&wanted, &parts)
    } else {
        fits_name(pattern, path.rsplit('/').next().unwrap_or(path))
    }
}

/// Matches folder by folder with one backtracking point, so never in exponential time.
fn folders(wanted: &[&str], parts: &[&str]) -> bool {
    let (mut w, mut p) = (0, 0);
    let mut stars: Option<(usize, usize)> = None;
    while p < parts.len() {
        match wanted.get(w) {
            Some(&"**") => {
                stars = Some((w + 1, p));
                w += 1;
            }
            Some(pattern) if fits_name(pattern, parts[p]) => (w, p) = (w + 1, p + 1),
            _ => match stars {
                Some((after, from)) => {
                    stars = Some((after, from + 1));
                    (w, p) = (after, from + 1);
                }
                None => return false,
            },
        }
    }
    wanted[w..].iter().all(|pattern| *pattern == "**")
}

/// Whether `pattern` matches all of `text`: greedy with one backtracking point, so never in exponential time.
pub fn fits_name(pattern: &str, text: &str) -> bool {
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

/// The pattern that matches only `text`.
pub fn literal_pattern(text: &str) -> String {
    let escape = |letter: char| if matches!(letter, '*' | '?' | '\\') { vec!['\\', letter] } else { vec![letter] };
    text.chars().flat_map(escape).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_and_folders() {
        for (pattern, path, expected) in [
            ("*.stl", "a/b/mug.stl", true),
            ("*.stl", "mug.ply", false),
            ("a/*.stl", "a/b/mug.stl", false),
            ("a/**/*.stl", "a/b/c/mug.stl", true),
            ("a/**/*.stl", "a/mug.stl", true),
            ("draft/**", "draft/x/y.obj", true),
            ("draft/**", "kept/draft/y.obj", false),
            ("**/draft/**", "kept/draft/y.obj", true),
            ("**/a/**/b/*.stl", "a/x/a/b/y/b/m.stl", true),
            ("./mug.stl", "mug.stl", true),
            ("./mug.stl", "a/mug.stl", false),
        ] {
            assert_eq!(fits_path(pattern, path), expected, "{pattern} on {path}");
        }
    }

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
            assert_eq!(fits_name(pattern, text), expected, "{pattern} on {text}");
        }
        let odd = r"a*b?c\d";
        assert!(fits_name(&literal_pattern(odd), odd) && !fits_name(&literal_pattern(odd), r"axbyc\d"));
        assert!(!fits_name(&"*a".repeat(30), &"a".repeat(200).replace("aa", "ab")));
    }
}
