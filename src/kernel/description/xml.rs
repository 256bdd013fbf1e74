//! Tags of an XML text, by the rules of tinyxml2, with which MuJoCo reads.
//!
//! A text that tinyxml2 would take in another way is [`Malformed`]: nothing may be hidden from the checks of a description.

use std::borrow::Cow;

/// A tag that opens or closes an element.
#[derive(Debug)]
pub(super) struct Tag<'t> {
    pub(super) kind: TagKind,
    pub(super) name: &'t str,
    /// In the order of the text.
    pub(super) attributes: Vec<(&'t str, Cow<'t, str>)>,
    /// Counted from 1.
    pub(super) line: u32,
}

/// Kind of a tag.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum TagKind {
    /// `<geom>`
    Start,
    /// `<geom/>`
    Empty,
    /// `</geom>`
    End,
}

/// A text that is not well-formed.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct Malformed {
    pub(super) line: u32,
    pub(super) problem: String,
}

/// Largest number of attributes of an element. Those of MJCF have 40 at most, and MuJoCo's parser compares each with all before it.
pub const MAX_ATTRIBUTES: usize = 100;

/// Marks around parts of the text that hold no tag.
const PASSED_OVER: [(&str, &str); 4] = [("<!--", "-->"), ("<![CDATA[", "]]>"), ("<?", "?>"), ("<!", ">")];

/// Reads a text tag by tag, up to the end of its first element.
pub(super) struct Tags<'t> {
    text: &'t str,
    at: usize,
    line: u32,
    /// Names of the elements that are open.
    open: Vec<&'t str>,
    ended: bool,
}

impl<'t> Tags<'t> {
    pub(super) fn new(text: &'t str) -> Self {
        Self { text, at: 0, line: 1, open: Vec::new(), ended: false }
    }

    /// Elements around the tag that was read last, itself included where it stays open.
    pub(super) fn depth(&self) -> usize {
        self.open.len()
    }

    /// The text up to the next tag.
    pub(super) fn text(&self) -> &'t str {
        let rest = &self.text[self.at..];
        &rest[..rest.find('<').unwrap_or(rest.len())]
    }

    /// The next tag; `None` behind the first element.
    pub(super) fn read_tag(&mut self) -> Result<Option<Tag<'t>>, Malformed> {
        while !self.ended {
            let Some(start) = self.text[self.at..].find('<') else {
                let problem = match self.open.last() {
                    Some(name) => format!("<{name}> is not closed"),
                    None => "it holds no XML element".to_owned(),
                };
                return Err(self.malformed(problem));
            };
            self.advance(start);
            let rest = &self.text[self.at..];
            if let Some((begin, end)) = PASSED_OVER.iter().find(|(begin, _)| rest.starts_with(begin)) {
                let length = rest[begin.len()..].find(end);
                let length = length.ok_or_else(|| self.malformed(format!("`{begin}` is not ended by `{end}`")))?;
                self.advance(begin.len() + length + end.len());
                continue;
            }
            return self.tag().map(Some);
        }
        Ok(None)
    }

    /// The tag that begins here.
    fn tag(&mut self) -> Result<Tag<'t>, Malformed> {
        let line = self.line;
        self.advance(1);
        let closes = self.take("/");
        let name = self.name().ok_or_else(|| self.malformed("`<` is not followed by a name".to_owned()))?;
        let mut attributes: Vec<(&str, Cow<'_, str>)> = Vec::new();
        let kind = loop {
            self.skip_space();
            if self.take(">") {
                break if closes { TagKind::End } else { TagKind::Start };
            }
            if !closes && self.take("/>") {
                break TagKind::Empty;
            }
            let attribute = self.attribute().filter(|_| !closes);
            let Some((key, value)) = attribute else {
                return Err(self.malformed(format!("the tag of <{name}> is not understood")));
            };
            if attributes.len() == MAX_ATTRIBUTES {
                return Err(self.malformed(format!("<{name}> has more than {MAX_ATTRIBUTES} attributes")));
            }
            if attributes.iter().any(|(known, _)| *known == key) {
                return Err(self.malformed(format!("<{name}> has `{key}` twice")));
            }
            attributes.push((key, value));
        };
        match kind {
            TagKind::Start => self.open.push(name),
            TagKind::Empty => {}
            TagKind::End => match self.open.pop() {
                Some(open) if open == name => {}
                Some(open) => return Err(Malformed { line, problem: format!("</{name}> closes <{open}>") }),
                None => return Err(Malformed { line, problem: format!("</{name}> closes nothing") }),
            },
        }
        self.ended = self.open.is_empty();
        Ok(Tag { kind, name, attributes, line })
    }

    /// `key="value"` or `key='value'`.
    fn attribute(&mut self) -> Option<(&'t str, Cow<'t, str>)> {
        let key = self.name()?;
        self.skip_space();
        if !self.take("=") {
            return None;
        }
        self.skip_space();
        let rest = &self.text[self.at..];
        let quote = rest.chars().next().filter(|quote| matches!(quote, '"' | '\''))?;
        let length = rest[1..].find(quote)?;
        self.advance(length + 2);
        Some((key, decoded(&rest[1..=length])))
    }

    /// The name that begins here.
    fn name(&mut self) -> Option<&'t str> {
        let rest = &self.text[self.at..];
        let length = rest.find(|c| !continues_name(c)).unwrap_or(rest.len());
        let name = rest[..length].starts_with(starts_name).then_some(&rest[..length])?;
        self.advance(length);
        Some(name)
    }

    fn skip_space(&mut self) {
        let rest = &self.text[self.at..];
        self.advance(rest.len() - rest.trim_ascii_start().len());
    }

    fn take(&mut self, word: &str) -> bool {
        let is_here = self.text[self.at..].starts_with(word);
        if is_here {
            self.advance(word.len());
        }
        is_here
    }

    /// Moves forward by `bytes` bytes, counting lines.
    fn advance(&mut self, bytes: usize) {
        let passed = &self.text.as_bytes()[self.at..self.at + bytes];
        self.line += passed.iter().filter(|byte| **byte == b'\n').count() as u32;
        self.at += bytes;
    }

    fn malformed(&self, problem: String) -> Malformed {
        Malformed { line: self.line, problem }
    }
}

fn starts_name(c: char) -> bool {
    c.is_ascii_alphabetic() || c == ':' || c == '_' || !c.is_ascii()
}

fn continues_name(c: char) -> bool {
    starts_name(c) || c.is_ascii_digit() || c == '.' || c == '-'
}

/// A value with its entities replaced; an unknown one stays as it is.
fn decoded(value: &str) -> Cow<'_, str> {
    if !value.contains('&') {
        return Cow::Borrowed(value);
    }
    let mut out = String::with_capacity(value.len());
    let mut rest = value;
    while let Some(start) = rest.find('&') {
        out.push_str(&rest[..start]);
        rest = &rest[start..];
        let entity = rest.split_once(';').and_then(|(entity, after)| Some((character(&entity[1..])?, after)));
        let (character, after) = entity.unwrap_or(('&', &rest[1..]));
        out.push(character);
        rest = after;
    }
    out.push_str(rest);
    Cow::Owned(out)
}

/// The character of an entity: one of XML's five, or a number.
fn character(entity: &str) -> Option<char> {
    match entity {
        "lt" => Some('<'),
        "gt" => Some('>'),
        "amp" => Some('&'),
        "quot" => Some('"'),
        "apos" => Some('\''),
        _ => {
            let digits = entity.strip_prefix('#')?;
            let number = match digits.strip_prefix('x') {
                Some(digits) => u32::from_str_radix(digits, 16),
                None => digits.parse(),
            };
            number.ok().and_then(char::from_u32)
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// All tags, as `+name`, `-name` and `name`, with line and attributes.
    fn read(text: &str) -> Result<String, Malformed> {
        let (mut tags, mut out) = (Tags::new(text), Vec::new());
        while let Some(Tag { kind, name, attributes, line }) = tags.read_tag()? {
            let sign = match kind {
                TagKind::Start => "+",
                TagKind::Empty => "",
                TagKind::End => "-",
            };
            let attributes: String = attributes.iter().map(|(key, value)| format!(" {key}={value}")).collect();
            out.push(format!("{line}{sign}{name}{attributes}"));
        }
        Ok(out.join("|"))
    }

    #[test]
    fn tags_are_read_with_their_lines() {
        let text = "<?xml version='1.0'?>\n<!-- <a b='>'> -->\n<!DOCTYPE m>junk<m a = 'x > y'\n b=\"&lt;&#65;&#x42;&no;&amp;\">\n\
                    <![CDATA[<b>]]><g:h/><c_1.2-é/></m >\n<m/> after";
        assert_eq!(read(text).unwrap(), "3+m a=x > y b=<AB&no;&|5g:h|5c_1.2-é|5-m");
    }

    #[test]
    fn what_is_not_well_formed_is_refused_with_its_line() {
        for (text, line, problem) in [
            ("<m>\n<a></m>", 2, "</m> closes <a>"),
            ("</m>", 1, "</m> closes nothing"),
            ("<m>\n<a/>", 2, "<m> is not closed"),
            ("", 1, "it holds no XML element"),
            ("<m a=1/>", 1, "the tag of <m> is not understood"),
            ("<m a/>", 1, "the tag of <m> is not understood"),
            ("<m a='1/>", 1, "the tag of <m> is not understood"),
            ("<m a='1' a='2'/>", 1, "<m> has `a` twice"),
            ("<m MANY/>", 1, "<m> has more than 100 attributes"),
            ("<m><1/></m>", 1, "`<` is not followed by a name"),
            ("<m></m a='1'>", 1, "the tag of <m> is not understood"),
            ("<m><!-- ", 1, "`<!--` is not ended by `-->`"),
        ] {
            let many: String = (0..=MAX_ATTRIBUTES).map(|index| format!("a{index}='' ")).collect();
            assert_eq!(
                read(&text.replace("MANY", &many)),
                Err(Malformed { line, problem: problem.to_owned() }),
                "{text}"
            );
        }
    }
}
