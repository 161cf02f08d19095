//! The elements of an XML text, each with its place.

use quick_xml::events::{BytesStart, Event};
use quick_xml::{Reader, XmlVersion};

use crate::BodyError;
use crate::body_error::{BodyErrorKind, Place};
use crate::shown::{escaped, shown};

/// Elements nested deeper are refused. No URDF needs a tenth of it, and the tree is dropped by recursion.
const MAX_DEPTH: usize = 100;

/// The attributes that hold the name of a joint or link. Such a name stands on one line.
const NAMES: [&str; 3] = ["name", "link", "joint"];

/// An element with its attributes and children. Its text is left out: a URDF has none.
#[derive(Clone, Debug)]
pub(crate) struct Element {
    pub(crate) tag: String,
    pub(crate) place: Place,
    pub(crate) attributes: Vec<(String, String)>,
    pub(crate) children: Vec<Element>,
}

impl Element {
    /// The root element of a text.
    ///
    /// # Errors
    ///
    /// [`BodyErrorKind::Urdf`] if the text is not well-formed.
    pub(crate) fn root(text: &str) -> Result<Self, BodyError> {
        let text = text.strip_prefix('\u{feff}').unwrap_or(text);
        let mut reader = Reader::from_str(text);
        let mut places = Places { text, offset: 0, place: Place::START };
        let mut open: Vec<Self> = Vec::new();
        let mut root: Option<Self> = None;
        loop {
            let start = places.at(reader.buffer_position());
            let event = reader
                .read_event()
                .map_err(|error| malformed(places.at(reader.error_position()), error.to_string()))?;
            let finished = match event {
                Event::Start(tag) => {
                    if open.len() == MAX_DEPTH {
                        let reason = format!("its elements are nested deeper than {MAX_DEPTH}");
                        return Err(malformed(start, reason));
                    }
                    open.push(Self::opened(&tag, start, &reader)?);
                    None
                }
                Event::Empty(tag) => Some(Self::opened(&tag, start, &reader)?),
                // The reader compares the names.
                Event::End(_) => open.pop(),
                Event::Text(text) if open.is_empty() && !text.trim_ascii().is_empty() => {
                    return Err(malformed(start, "text outside of the elements"));
                }
                Event::Eof => break,
                Event::Text(_)
                | Event::CData(_)
                | Event::Comment(_)
                | Event::Decl(_)
                | Event::PI(_)
                | Event::DocType(_)
                | Event::GeneralRef(_) => None,
            };
            let Some(finished) = finished else { continue };
            match open.last_mut() {
                Some(parent) => parent.children.push(finished),
                None if root.is_some() => {
                    return Err(malformed(
                        finished.place,
                        format!("a second root element: `<{}>`", shown(&finished.tag)),
                    ));
                }
                None => root = Some(finished),
            }
        }
        if let Some(open) = open.pop() {
            return Err(malformed(open.place, format!("`<{}>` is never closed", shown(&open.tag))));
        }
        root.ok_or_else(|| malformed(Place::START, "no element `<robot>`"))
    }

    fn opened(tag: &BytesStart<'_>, place: Place, reader: &Reader<&[u8]>) -> Result<Self, BodyError> {
        let text = |bytes: &[u8]| String::from_utf8_lossy(bytes).into_owned();
        let tag_name = text(tag.name().as_ref());
        let wrong = |error: String| malformed(place, format!("`<{}>`: {error}", shown(&tag_name)));
        let checked = |text: &str, of: &str, is_name: bool| match control(text, is_name) {
            Some(found) => Err(wrong(format!("control character {} in {of}", found.escape_unicode()))),
            None => Ok(()),
        };
        checked(&tag_name, "the tag", true)?;
        let mut attributes = Vec::new();
        for attribute in tag.attributes() {
            let attribute = attribute.map_err(|error| wrong(error.to_string()))?;
            let name = text(attribute.key.as_ref());
            checked(&name, "the name of an attribute", true)?;
            let value = attribute
                .decoded_and_normalized_value(XmlVersion::Implicit1_0, reader.decoder())
                .map_err(|error| wrong(error.to_string()))?;
            let is_name = NAMES.contains(&name.as_str());
            // A line break becomes a space in the value; the character reference of a control character becomes one.
            for value in [&*String::from_utf8_lossy(&attribute.value), &*value] {
                checked(value, &format!("`{}`", shown(&name)), is_name)?;
            }
            attributes.push((name, value.into_owned()));
        }
        Ok(Self { tag: tag_name, place, attributes, children: Vec::new() })
    }

    pub(crate) fn attribute(&self, name: &str) -> Option<&str> {
        self.attributes.iter().find(|(known, _)| known == name).map(|(_, value)| value.as_str())
    }

    /// The first child with a tag.
    pub(crate) fn child(&self, tag: &str) -> Option<&Self> {
        self.children.iter().find(|child| child.tag == tag)
    }
}

/// The first control character of a text, which could change the terminal or the log that shows it. Tabs and line breaks
/// are allowed outside of names.
fn control(text: &str, is_name: bool) -> Option<char> {
    text.chars().find(|found| found.is_control() && (is_name || !matches!(found, '\t' | '\n' | '\r')))
}

/// An error of the text. The reason may quote the text, and is escaped.
pub(crate) fn malformed(place: Place, reason: impl AsRef<str>) -> BodyError {
    const MAX_CHARACTERS: usize = 200;
    place.error(BodyErrorKind::Urdf { reason: escaped(reason.as_ref(), MAX_CHARACTERS) })
}

/// Counts lines and columns up to an offset.
struct Places<'t> {
    text: &'t str,
    offset: usize,
    place: Place,
}

impl Places<'_> {
    /// The place of a byte. The text is counted from the last place, or from the start for an earlier byte.
    fn at(&mut self, byte: u64) -> Place {
        let byte = usize::try_from(byte).unwrap_or(usize::MAX).min(self.text.len());
        if byte < self.offset {
            (self.offset, self.place) = (0, Place::START);
        }
        let passed = self.text.as_bytes().get(self.offset..byte).unwrap_or_default();
        for byte in passed {
            if *byte == b'\n' {
                self.place = Place { line: self.place.line + 1, column: 1 };
            } else if !matches!(byte, 0x80..=0xbf) {
                // Only the first byte of a character counts.
                self.place.column += 1;
            }
        }
        self.offset = byte;
        self.place
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn refused(text: &str) -> String {
        let error = Element::root(text).unwrap_err();
        format!("{}:{}: {}", error.line, error.column, error.kind)
    }

    #[test]
    fn elements_have_their_places_and_attributes() {
        let text = "\u{feff}<?xml version=\"1.0\"?>\n<!-- ä --><robot name=\"a &lt; b\">\n  <link\n name='ü'/><x:y/></robot>";
        let robot = Element::root(text).unwrap();
        assert_eq!((robot.tag.as_str(), robot.attribute("name")), ("robot", Some("a < b")));
        assert_eq!(robot.place, Place { line: 2, column: 11 });
        let link = robot.child("link").unwrap();
        assert_eq!((link.place, link.attribute("name")), (Place { line: 3, column: 3 }, Some("ü")));
        assert_eq!(robot.children.len(), 2);
    }

    #[test]
    fn a_malformed_text_is_refused_with_the_place() {
        let deep = "<a>".repeat(1_000_000);
        let long = format!("<{}>", "a".repeat(1_000_000));
        let texts = [
            "",
            "robot",
            "<robot",
            "<robot>\n<link></robot>",
            "<robot>\n <link name=\"a\">\n",
            "<robot/>\n<robot/>",
            "<robot/> and more",
            "<robot>\n<link name=\"a\" name=\"b\"/></robot>",
            "<robot>\n<link name=a/></robot>",
            "<robot>\n<link name=\"&own;\"/></robot>",
            "<robot></robot></robot>",
            "<robot>\n<\u{1b}[2J/></robot>",
            "<robot>\n<link></\u{1b}[2J></robot>",
            "<robot>\n<link na\u{7f}me=\"a\"/></robot>",
            "<robot>\n<link name=\"\u{1b}]0;a\"/></robot>",
            "<robot>\n<link name=\"a&#27;[2J\"/></robot>",
            "<robot>\n<link name=\"a&#x9b;2J\"/></robot>",
            "<robot>\n<link name=\"a\nb\"/></robot>",
            "<robot>\n<link name=\"a&#10;b\"/></robot>",
            "<robot>\n<child link=\"a\tb\"/></robot>",
            "<robot>\n<axis xyz=\"0\u{0} 1\"/></robot>",
            "<robot>\n<link name=\"&\u{1b};\"/></robot>",
            &deep,
            &long,
        ];
        insta::assert_snapshot!(texts.map(refused).join("\n"));
    }

    #[test]
    fn a_value_may_hold_tabs_and_line_breaks() {
        let robot =
            Element::root("<robot><axis xyz=\"0\t0\r\n1\" note=\"&#9;&#10;&#13;\"/></robot>").unwrap();
        let axis = robot.child("axis").unwrap();
        let words = axis.attribute("xyz").unwrap().split_whitespace().collect::<Vec<_>>();
        assert_eq!((words, axis.attribute("note")), (vec!["0", "0", "1"], Some("\t\n\r")));
    }

    #[test]
    fn many_attributes_are_read_in_linear_time() {
        use std::fmt::Write as _;
        let mut text = "<robot".to_owned();
        for number in 0..300_000 {
            write!(text, " a{number}=''").unwrap();
        }
        assert_eq!(Element::root(&format!("{text}/>")).unwrap().attributes.len(), 300_000);
        assert!(refused(&format!("{text} a7=''/>")).contains("duplicated attribute"));
    }
}
