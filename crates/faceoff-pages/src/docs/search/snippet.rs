//! Texts of results with their matches marked.

use super::super::words::{parts, words};
use std::ops::Range;

/// Length of a snippet on each side of the first match, in bytes.
pub(super) const SNIPPET_BYTES: usize = 110;

/// A piece of text; matches are highlighted.
#[derive(Debug, PartialEq, Eq)]
pub(in crate::docs) struct Piece {
    pub(in crate::docs) text: String,
    pub(in crate::docs) is_match: bool,
}

/// The text around a byte position.
pub(super) fn snippet(text: &str, position: usize, is_match: impl Fn(&str) -> bool) -> Vec<Piece> {
    let shown_range = range(text, position);
    let mut snippet = pieces(&text[shown_range.clone()], is_match);
    let ellipsis = || Piece {
        text: "…".into(),
        is_match: false,
    };
    if shown_range.start > 0 {
        snippet.insert(0, ellipsis());
    }
    if shown_range.end < text.len() {
        snippet.push(ellipsis());
    }
    snippet
}

/// A range of whole words around a byte position.
fn range(text: &str, position: usize) -> Range<usize> {
    let from = text.floor_char_boundary(position.saturating_sub(SNIPPET_BYTES));
    let start = match text[from..position].find(' ') {
        Some(space) if from > 0 => from + space + 1,
        _ => from,
    };
    let to = text.ceil_char_boundary((position + SNIPPET_BYTES).min(text.len()));
    let end = text[to..].find(' ').map_or(text.len(), |space| to + space);
    // Limits the range even if a single word is very long.
    start..end.min(text.ceil_char_boundary((to + SNIPPET_BYTES).min(text.len())))
}

/// Splits a text at its matching words and matching parts of names.
pub(super) fn pieces(text: &str, is_match: impl Fn(&str) -> bool) -> Vec<Piece> {
    let mut pieces: Vec<Piece> = Vec::new();
    // Up to here the text is split.
    let mut done = 0;
    // Splits off a match, and the text before it.
    let mut push_match = |range: Range<usize>| {
        for (range, is_match) in [(done..range.start, false), (range.clone(), true)] {
            if !range.is_empty() {
                let text = text[range].to_owned();
                pieces.push(Piece { text, is_match });
            }
        }
        done = range.end;
    };
    for word in words(text) {
        if is_match(&text[word.clone()]) {
            push_match(word);
            continue;
        }
        for part in parts(&text[word.clone()]) {
            let part = word.start + part.start..word.start + part.end;
            if is_match(&text[part.clone()]) {
                push_match(part);
            }
        }
    }
    push_match(text.len()..text.len());
    pieces
}
