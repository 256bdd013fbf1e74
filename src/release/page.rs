//! Text inside HTML.

/// `text` with the characters that HTML and SVG give a meaning to spelled out.
pub(super) fn escaped(text: &str) -> String {
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

#[cfg(test)]
mod tests {
    #[test]
    fn no_tag_gets_through() {
        assert_eq!(super::escaped("<b a=\"x\">&'é"), "&lt;b a=&quot;x&quot;&gt;&amp;&#39;é");
    }
}
