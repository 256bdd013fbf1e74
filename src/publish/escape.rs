//! Escapes text for a document, so that the document's format does not interpret it.

/// Escapes text for HTML and SVG, between tags or inside a quoted attribute.
pub(super) fn html(text: &str) -> String {
    let mut out = String::with_capacity(text.len());
    for character in text.chars() {
        match character {
            '&' => out.push_str("&amp;"),
            '<' => out.push_str("&lt;"),
            '>' => out.push_str("&gt;"),
            '"' => out.push_str("&quot;"),
            '\'' => out.push_str("&#39;"),
            other => out.push(other),
        }
    }
    out
}

/// Escapes text for one line of Markdown (CommonMark 0.31 with the tables and strike-throughs of GitHub): a paragraph, a list
/// item, a heading or a table cell. The result starts no tag, entity, link, emphasis or block; control characters become spaces.
pub(super) fn markdown(text: &str) -> String {
    inline(text.trim(), true)
}

/// Escapes a sentence of this program for one line of Markdown: text between backticks becomes a code span, the rest plain text.
pub(super) fn prose(text: &str) -> String {
    let (mut out, mut rest) = (String::with_capacity(text.len() + 8), text.trim());
    loop {
        let span = rest.split_once('`').and_then(|(before, rest)| Some((before, rest.split_once('`')?)));
        // A bar would end a table cell even inside a code span.
        let Some((before, (span, after))) = span.filter(|(_, (span, _))| !span.is_empty() && !span.contains('|'))
        else {
            return out.clone() + &inline(rest, out.is_empty());
        };
        out.push_str(&inline(before, out.is_empty()));
        out.push_str(&code(span));
        rest = after;
    }
}

/// Text inside a line or at its start.
fn inline(text: &str, begins_line: bool) -> String {
    let line: Vec<char> = text.chars().map(|character| if character.is_control() { ' ' } else { character }).collect();
    let mut out = String::with_capacity(text.len() + 8);
    let marker = list_marker(&line).filter(|_| begins_line);
    for (index, character) in line.iter().copied().enumerate() {
        let is_first = begins_line && index == 0;
        let special = match character {
            '\\' | '`' | '*' | '[' | ']' | '|' | '~' | '$' => true,
            '_' => !is_inside_word(&line, index),
            // Heading marks are at the start of a heading and, after a space, at its end.
            '#' => index == 0 || line[index - 1] == ' ',
            '>' => is_first,
            '-' | '+' | '=' => is_first && line.get(1).is_none_or(|next| !next.is_alphanumeric() && *next != '.'),
            '.' | ')' => marker == Some(index),
            _ => false,
        };
        match character {
            '<' => out.push_str("&lt;"),
            '&' if begins_entity(&line[index + 1..]) => out.push_str("&amp;"),
            other => {
                if special {
                    out.push('\\');
                }
                out.push(other);
            }
        }
    }
    out
}

/// Index of the point or bracket after a number that would start an ordered list.
fn list_marker(line: &[char]) -> Option<usize> {
    let digits = line.iter().take_while(|character| character.is_ascii_digit()).count();
    let ends = line.get(digits + 1).is_none_or(|next| *next == ' ');
    (digits > 0 && ends && matches!(line.get(digits), Some('.' | ')'))).then_some(digits)
}

/// Whether a run of underscores has letters or digits on both sides and therefore emphasises nothing.
fn is_inside_word(line: &[char], index: usize) -> bool {
    let is_letter = |character: Option<&char>| character.is_some_and(|character| character.is_alphanumeric());
    let before = line[..index].iter().rev().find(|character| **character != '_');
    let after = line[index..].iter().find(|character| **character != '_');
    is_letter(before) && is_letter(after)
}

/// Whether an ampersand starts an entity: a name or a number and a semicolon follow.
fn begins_entity(rest: &[char]) -> bool {
    let name = rest.iter().take_while(|character| character.is_ascii_alphanumeric() || **character == '#').count();
    name > 0 && rest.get(name) == Some(&';')
}

/// Formats text as a Markdown code span outside tables, with more backticks around it than any run inside.
pub(super) fn code(text: &str) -> String {
    let line: String = text.chars().map(|character| if character.is_control() { ' ' } else { character }).collect();
    let longest = line.split(|character| character != '`').map(str::len).max().unwrap_or(0);
    let fence = "`".repeat(longest + 1);
    // A space next to each fence is not part of the span.
    let pad = if longest > 0 || line.starts_with(' ') || line.is_empty() { " " } else { "" };
    format!("{fence}{pad}{line}{pad}{fence}")
}

/// Formats text as a JSON string, which is also a YAML string.
pub(super) fn quoted(text: &str) -> String {
    let mut out = String::with_capacity(text.len() + 2);
    for character in serde_json::Value::from(text).to_string().chars() {
        // JSON allows these characters unescaped, but YAML does not print them or treats them as line ends.
        match character {
            '\u{7f}'..='\u{9f}' | '\u{2028}' | '\u{2029}' | '\u{feff}' | '\u{fffe}' | '\u{ffff}' => {
                out.push_str(&format!("\\u{:04x}", character as u32));
            }
            other => out.push(other),
        }
    }
    out
}

/// Escapes text for the braces of a BibTeX field.
pub(super) fn bibtex(text: &str) -> String {
    let mut out = String::with_capacity(text.len());
    for character in text.chars() {
        match character {
            '{' | '}' | '\\' => {}
            '&' | '%' | '$' | '#' | '_' => out.extend(['\\', character]),
            control if control.is_control() => out.push(' '),
            other => out.push(other),
        }
    }
    out
}

/// Escapes a URL for the braces of a BibTeX field, which is verbatim: characters that would end the field are percent-encoded.
pub(super) fn address(text: &str) -> String {
    let mut out = String::with_capacity(text.len());
    for character in text.chars() {
        match character {
            '{' | '}' | '\\' | ' ' | '`' => out.push_str(&format!("%{:02X}", character as u32)),
            control if control.is_control() => {}
            other => out.push(other),
        }
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn no_tag_gets_through() {
        assert_eq!(html("<b a=\"x\">&'é"), "&lt;b a=&quot;x&quot;&gt;&amp;&#39;é");
    }

    #[test]
    fn markdown_stays_text() {
        for (text, expected) in [
            // Names and sentences stay unchanged.
            ("003_cracker_box", "003_cracker_box"),
            ("072-a_toy_airplane, view 4", "072-a_toy_airplane, view 4"),
            ("-0.25 to 3.5 m, B & C > D #4", "-0.25 to 3.5 m, B & C > D \\#4"),
            ("1.0.0", "1.0.0"),
            // Tags, entities, links, code, emphasis, cells.
            ("<img src=x onerror=y>", "&lt;img src=x onerror=y>"),
            ("a &lt; b &#60; c", "a &amp;lt; b &amp;#60; c"),
            ("[a](javascript:b) ![c](d)", "\\[a\\](javascript:b) !\\[c\\](d)"),
            ("`a` *b* ~~c~~ | d $e$ \\", "\\`a\\` \\*b\\* \\~\\~c\\~\\~ \\| d \\$e\\$ \\\\"),
            ("_a_ __b__ c__d", "\\_a\\_ \\_\\_b\\_\\_ c__d"),
            // Blocks.
            ("# a #", "\\# a \\#"),
            ("> a", "\\> a"),
            ("- a", "\\- a"),
            ("---", "\\---"),
            ("===", "\\==="),
            ("12. a", "12\\. a"),
            ("3) a", "3\\) a"),
            ("a\n\n# b\r\n\tc\0", "a  \\# b   c "),
            ("    a", "a"),
        ] {
            assert_eq!(markdown(text), expected, "{text:?}");
        }
    }

    #[test]
    fn sentences_keep_their_code() {
        for (text, expected) in [
            ("say `derived = true` or `false` <now>", "say `derived = true` or `false` &lt;now>"),
            ("`a_` is *b", "`a_` is \\*b"),
            ("one ` alone", "one \\` alone"),
            ("`a|b` c", "\\`a\\|b\\` c"),
            ("- `a`", "\\- `a`"),
        ] {
            assert_eq!(prose(text), expected, "{text:?}");
        }
    }

    #[test]
    fn code_spans_hold_backticks() {
        for (text, expected) in
            [("a", "`a`"), ("a`b", "`` a`b ``"), ("``", "``` `` ```"), ("a\nb", "`a b`"), ("", "`  `")]
        {
            assert_eq!(code(text), expected, "{text:?}");
        }
    }

    #[test]
    fn strings_of_yaml_and_bibtex() {
        assert_eq!(quoted("a\"b\n\u{85}\u{2028}é"), "\"a\\\"b\\n\\u0085\\u2028é\"");
        assert_eq!(bibtex("{A} & b_c\\d\n"), "A \\& b\\_cd ");
        assert_eq!(address("https://a/b_c}{"), "https://a/b_c%7D%7B");
    }
}
