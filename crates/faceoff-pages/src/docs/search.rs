//! Full-text search: sections that contain all words of a query, ranked.

use super::sections::Section;
use memchr::memmem::Finder;
use std::{cmp::Reverse, ops::Range};

/// Largest number of results on the page.
pub(super) const MAX_RESULTS: usize = 30;
/// Length of a snippet on each side of the first match, in bytes.
const SNIPPET_BYTES: usize = 110;

#[derive(Debug, PartialEq, Eq)]
pub(super) struct SearchResult {
    pub(super) page: String,
    pub(super) href: String,
    pub(super) heading: Vec<Piece>,
    pub(super) snippet: Vec<Piece>,
}

/// A piece of text; matches are highlighted.
#[derive(Debug, PartialEq, Eq)]
pub(super) struct Piece {
    pub(super) text: String,
    pub(super) is_match: bool,
}

#[derive(Debug)]
pub(super) struct Index(Vec<IndexedSection>);

#[derive(Debug)]
struct IndexedSection {
    section: Section,
    /// In ASCII lower case, so that byte positions are the same as in the original text. The documents are English.
    heading: String,
    text: String,
}

impl Index {
    pub(super) fn new(sections: impl IntoIterator<Item = Section>) -> Self {
        let indexed = sections.into_iter().map(|section| IndexedSection {
            heading: section.heading.to_ascii_lowercase(),
            text: section.text.to_ascii_lowercase(),
            section,
        });
        Self(indexed.collect())
    }

    /// The first [`MAX_RESULTS`] sections that contain all words, and the total number.
    ///
    /// Sections are ranked by the number of words in the heading, then by matches in the text, then by the order of the pages.
    pub(super) fn search(&self, query: &str) -> (Vec<SearchResult>, usize) {
        let query = query.to_ascii_lowercase();
        let mut words: Vec<&str> = query.split_whitespace().collect();
        words.sort_unstable();
        words.dedup();
        if words.is_empty() {
            return (Vec::new(), 0);
        }
        // Long words first: they are rare, and a section without one of the words needs no further search.
        let mut finders: Vec<Finder> = words.iter().map(Finder::new).collect();
        finders.sort_by_key(|finder| Reverse(finder.needle().len()));
        let mut results: Vec<(Reverse<(usize, usize)>, &IndexedSection)> = self
            .0
            .iter()
            .filter_map(|section| section.rank(&finders).map(|rank| (Reverse(rank), section)))
            .collect();
        results.sort_by_key(|(rank, _)| *rank);
        let shown = results
            .iter()
            .take(MAX_RESULTS)
            .map(|(_, section)| section.result(&words));
        (shown.collect(), results.len())
    }
}

impl IndexedSection {
    /// Number of words in the heading, and number of matches in the text; `None` if a word is missing.
    fn rank(&self, words: &[Finder]) -> Option<(usize, usize)> {
        let (mut words_in_heading, mut matches_in_text) = (0, 0);
        for word in words {
            let is_in_heading = word.find(self.heading.as_bytes()).is_some();
            let count = word.find_iter(self.text.as_bytes()).count();
            if !is_in_heading && count == 0 {
                return None;
            }
            words_in_heading += usize::from(is_in_heading);
            matches_in_text += count;
        }
        Some((words_in_heading, matches_in_text))
    }

    fn result(&self, words: &[&str]) -> SearchResult {
        let text = &self.section.text;
        let first = words.iter().filter_map(|word| self.text.find(word)).min();
        let shown = snippet_range(text, first.unwrap_or(0));
        let mut snippet = pieces(&text[shown.clone()], &self.text[shown.clone()], words);
        let ellipsis = || Piece {
            text: "…".into(),
            is_match: false,
        };
        if shown.start > 0 {
            snippet.insert(0, ellipsis());
        }
        if shown.end < text.len() {
            snippet.push(ellipsis());
        }
        SearchResult {
            page: self.section.page.clone(),
            href: self.section.href.clone(),
            heading: pieces(&self.section.heading, &self.heading, words),
            snippet,
        }
    }
}

/// A range of whole words around a byte position.
fn snippet_range(text: &str, position: usize) -> Range<usize> {
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

/// Splits `text` at matches of the words; `lower` is the same text in lower case.
fn pieces(text: &str, lower: &str, words: &[&str]) -> Vec<Piece> {
    let mut pieces = Vec::new();
    // Up to here the text is split.
    let mut done = 0;
    let mut push = |range: Range<usize>, is_match| {
        if !range.is_empty() {
            let text = text[range].to_owned();
            pieces.push(Piece { text, is_match });
        }
    };
    // The nearest match next; the longest word if several start there.
    while let Some((start, Reverse(length))) = words
        .iter()
        .filter_map(|word| Some((done + lower[done..].find(word)?, Reverse(word.len()))))
        .min()
    {
        push(done..start, false);
        push(start..start + length, true);
        done = start + length;
    }
    push(done..text.len(), false);
    pieces
}

#[cfg(test)]
mod tests {
    use super::*;

    fn section(heading: &str, text: &str) -> Section {
        Section {
            page: "Page".into(),
            heading: heading.into(),
            href: format!("/docs/page#{heading}"),
            text: text.into(),
        }
    }

    fn headings(index: &Index, query: &str) -> Vec<String> {
        let (results, count) = index.search(query);
        assert_eq!(results.len(), count);
        let headings = results.iter().map(|result| {
            let texts = result.heading.iter().map(|piece| piece.text.as_str());
            texts.collect()
        });
        headings.collect()
    }

    #[test]
    fn ranking_prefers_headings_then_match_count() {
        let index = Index::new([
            section("Once", "the puck"),
            section("Often", "puck, Puck and PUCK"),
            section("The puck", "round"),
            section("Other", "text"),
        ]);
        assert_eq!(headings(&index, "puck"), ["The puck", "Often", "Once"]);
        assert_eq!(headings(&index, "PUCK the"), ["The puck", "Once"]);
        assert_eq!(headings(&index, "puck mallet"), [""; 0]);
        assert_eq!(headings(&index, "  "), [""; 0]);
    }

    #[test]
    fn matches_keep_their_original_case() {
        let index = Index::new([section("A Puck", "Pucks: ≤ 2 puckish µ")]);
        let (results, _) = index.search("puck PUCKS");
        let marked = |pieces: &[Piece]| {
            let pieces = pieces.iter().map(|piece| match piece.is_match {
                true => format!("[{}]", piece.text),
                false => piece.text.clone(),
            });
            pieces.collect::<String>()
        };
        assert_eq!(marked(&results[0].snippet), "[Pucks]: ≤ 2 [puck]ish µ");
        let (results, _) = index.search("puck µ");
        assert_eq!(marked(&results[0].heading), "A [Puck]");
        assert_eq!(marked(&results[0].snippet), "[Puck]s: ≤ 2 [puck]ish [µ]");
    }

    #[test]
    fn snippet_surrounds_first_match_on_char_boundaries() {
        let filler = "äöü … ".repeat(200);
        let index = Index::new([section("Long", &format!("{filler}here {filler}"))]);
        let (results, _) = index.search("here");
        let texts: Vec<&str> = results[0]
            .snippet
            .iter()
            .map(|piece| &*piece.text)
            .collect();
        assert_eq!(texts[0], "…");
        assert_eq!(texts[2], "here");
        assert_eq!(*texts.last().unwrap(), "…");
        assert!(texts.concat().len() < 4 * SNIPPET_BYTES, "{texts:?}");
        // A single long word.
        let index = Index::new([section("Word", &"ä".repeat(5000))]);
        let (results, _) = index.search("ä");
        let shown: usize = results[0]
            .snippet
            .iter()
            .map(|piece| piece.text.len())
            .sum();
        assert!(shown < 4 * SNIPPET_BYTES);
    }

    #[test]
    fn count_includes_results_that_are_not_shown() {
        let index = Index::new((0..100).map(|_| section("Same", "puck")));
        let (results, count) = index.search("puck");
        assert_eq!((results.len(), count), (MAX_RESULTS, 100));
    }
}
