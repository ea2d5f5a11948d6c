//! Cuts the body of a batch into its cases while it arrives: the lines of NDJSON or the elements of a JSON array.
//!
//! Only the case under way is held. What a case says is for others to read; here a comma, a bracket or a line break is
//! found, nothing else.

use crate::http::problem::error::ApiError;
use crate::http::problem::kinds::ProblemKind;

/// How cases stand in a body.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Layout {
    /// One per line; empty lines count as lines and hold no case.
    Lines,
    /// As elements of one JSON array.
    Array,
}

/// The text of one case.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Element {
    /// The line it begins on, counted from 1; not of an array.
    pub line: Option<u64>,
    /// The text.
    pub text: Vec<u8>,
}

/// Where in an array the cutting stands.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum SplitterState {
    Before,
    /// In an element, or before it.
    Inside,
    After,
}

/// Cuts a body piece by piece.
#[derive(Debug)]
pub struct Splitter {
    layout: Layout,
    max_bytes: usize,
    held: Vec<u8>,
    line: u64,
    place: SplitterState,
    depth: usize,
    in_string: bool,
    escaped: bool,
    elements: u64,
}

impl Splitter {
    /// Ready for the first piece; no case may be larger than `max_bytes`.
    #[must_use]
    pub fn new(layout: Layout, max_bytes: usize) -> Self {
        Splitter {
            layout,
            max_bytes,
            held: Vec::new(),
            line: 1,
            place: SplitterState::Before,
            depth: 0,
            in_string: false,
            escaped: false,
            elements: 0,
        }
    }

    /// Bytes of the case under way.
    #[must_use]
    pub fn held(&self) -> usize {
        self.held.len()
    }

    /// Takes a piece of the body and appends the cases that it completes.
    ///
    /// # Errors
    /// A case is too large, or the body is no array.
    pub fn feed(&mut self, piece: &[u8], out: &mut Vec<Element>) -> Result<(), ApiError> {
        match self.layout {
            Layout::Lines => self.feed_lines(piece, out),
            Layout::Array => piece.iter().try_for_each(|byte| self.feed_byte(*byte, out)),
        }
    }

    /// Ends the body.
    ///
    /// # Errors
    /// The array is not closed.
    pub fn end(mut self, out: &mut Vec<Element>) -> Result<(), ApiError> {
        match self.layout {
            Layout::Lines => self.complete_line(out),
            Layout::Array if self.place == SplitterState::After => {}
            Layout::Array if self.place == SplitterState::Before => {
                return Err(malformed("the body is empty; send an array of cases"));
            }
            Layout::Array => {
                return Err(malformed(&format!(
                    "the array is not closed; the body ends in element {} (counted from 0)",
                    self.elements
                )));
            }
        }
        Ok(())
    }

    fn feed_lines(&mut self, piece: &[u8], out: &mut Vec<Element>) -> Result<(), ApiError> {
        let mut parts = piece.split(|byte| *byte == b'\n').peekable();
        while let Some(part) = parts.next() {
            self.require_room(part.len())?;
            self.held.extend_from_slice(part);
            if parts.peek().is_some() {
                self.complete_line(out);
            }
        }
        Ok(())
    }

    fn complete_line(&mut self, out: &mut Vec<Element>) {
        if !blank(&self.held) {
            out.push(Element {
                line: Some(self.line),
                text: std::mem::take(&mut self.held),
            });
        }
        self.held.clear();
        self.line += 1;
    }

    fn feed_byte(&mut self, byte: u8, out: &mut Vec<Element>) -> Result<(), ApiError> {
        match self.place {
            _ if self.place != SplitterState::Inside && byte.is_ascii_whitespace() => {}
            SplitterState::Before if byte == b'[' => self.place = SplitterState::Inside,
            SplitterState::Before => return Err(no_array()),
            SplitterState::After => {
                return Err(malformed("something follows the end of the array"));
            }
            SplitterState::Inside if self.in_string => {
                self.hold(byte)?;
                match byte {
                    _ if self.escaped => self.escaped = false,
                    b'\\' => self.escaped = true,
                    b'"' => self.in_string = false,
                    _ => {}
                }
            }
            SplitterState::Inside => match byte {
                b',' if self.depth == 0 => self.complete_element(out)?,
                b']' if self.depth == 0 => {
                    if self.elements > 0 || !blank(&self.held) {
                        self.complete_element(out)?;
                    }
                    self.place = SplitterState::After;
                }
                _ => {
                    match byte {
                        b'"' => self.in_string = true,
                        b'[' | b'{' => self.depth += 1,
                        b']' | b'}' => self.depth = self.depth.saturating_sub(1),
                        _ => {}
                    }
                    if !(self.held.is_empty() && byte.is_ascii_whitespace()) {
                        self.hold(byte)?;
                    }
                }
            },
        }
        Ok(())
    }

    fn complete_element(&mut self, out: &mut Vec<Element>) -> Result<(), ApiError> {
        if blank(&self.held) {
            return Err(malformed(&format!(
                "element {} of the array (counted from 0) is empty",
                self.elements
            )));
        }
        self.elements += 1;
        out.push(Element {
            line: None,
            text: std::mem::take(&mut self.held),
        });
        Ok(())
    }

    fn hold(&mut self, byte: u8) -> Result<(), ApiError> {
        self.require_room(1)?;
        self.held.push(byte);
        Ok(())
    }

    fn require_room(&self, bytes: usize) -> Result<(), ApiError> {
        if self.held.len() + bytes <= self.max_bytes {
            return Ok(());
        }
        let place = match self.layout {
            Layout::Lines => format!("line {}", self.line),
            Layout::Array => format!("element {} (counted from 0)", self.elements),
        };
        Err(ApiError::new(
            ProblemKind::BodyTooLarge,
            format!(
                "{place} is larger than the {} bytes that are allowed for one case",
                self.max_bytes
            ),
        ))
    }
}

fn blank(text: &[u8]) -> bool {
    text.iter().all(u8::is_ascii_whitespace)
}

fn malformed(detail: &str) -> ApiError {
    ApiError::new(
        ProblemKind::MalformedJson,
        format!("the body is not JSON: {detail}"),
    )
}

fn no_array() -> ApiError {
    ApiError::new(
        ProblemKind::FaultyBatch,
        "the body is no array; send `[case, case, …]`, or one case per line with `Content-Type: application/x-ndjson`",
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    fn cut(
        layout: Layout,
        text: &str,
        piece: usize,
    ) -> Result<Vec<(Option<u64>, String)>, ApiError> {
        let mut splitter = Splitter::new(layout, 40);
        let mut out = Vec::new();
        for piece in text.as_bytes().chunks(piece) {
            splitter.feed(piece, &mut out)?;
        }
        splitter.end(&mut out)?;
        let text = |element: Element| {
            let text = String::from_utf8(element.text).unwrap();
            (element.line, text.trim().to_owned())
        };
        Ok(out.into_iter().map(text).collect())
    }

    #[test]
    fn lines_keep_their_numbers_however_the_body_is_cut() {
        for piece in 1..30 {
            let cases = cut(Layout::Lines, "{\"a\":1}\n\n  \r\n{\"b\":2}\r\nx", piece).unwrap();
            let expected = [(1, "{\"a\":1}"), (4, "{\"b\":2}"), (5, "x")];
            let expected = expected.map(|(line, text)| (Some(line), text.to_owned()));
            assert_eq!(cases, expected);
        }
    }

    #[test]
    fn elements_end_at_their_own_commas_only() {
        let text = r#" [ {"a":[1,2],"s":"],\",{"} , [3] ,7 ] "#;
        for piece in 1..text.len() {
            let cases = cut(Layout::Array, text, piece).unwrap();
            let texts: Vec<_> = cases.iter().map(|(_, text)| text.as_str()).collect();
            assert_eq!(texts, [r#"{"a":[1,2],"s":"],\",{"}"#, "[3]", "7"]);
        }
        assert_eq!(cut(Layout::Array, "[]", 1).unwrap(), []);
    }

    #[test]
    fn broken_arrays_and_large_cases_are_refused() {
        for text in ["", "[1", "[1,]", "[,1]", "[1] 2", "{\"a\":1}", "[\"]"] {
            assert!(
                cut(Layout::Array, text, 2).is_err(),
                "{text:?} was accepted"
            );
        }
        let just = format!("\"{}\"", "a".repeat(38));
        assert!(cut(Layout::Array, &format!("[{just},{just}]"), 3).is_ok());
        assert!(cut(Layout::Array, &format!("[{just}0]"), 3).is_err());
        assert!(cut(Layout::Lines, &format!("{just}\n{just}"), 3).is_ok());
        assert!(cut(Layout::Lines, &format!("{just}0\n"), 50).is_err());
    }
}
