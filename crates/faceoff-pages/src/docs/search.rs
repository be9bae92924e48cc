//! Which sections have all words of a question, the best first.

use super::sections::Section;
use std::{cmp::Reverse, ops::Range};

/// So many are shown; who needs the next says more words.
pub(super) const SHOWN: usize = 30;
/// So much of a section is shown around the first word that was found, in bytes on each side.
const AROUND: usize = 110;

/// A section that was found.
#[derive(Debug, PartialEq, Eq)]
pub(super) struct Found {
    pub(super) page: String,
    pub(super) href: String,
    pub(super) heading: Vec<Piece>,
    pub(super) snippet: Vec<Piece>,
}

/// Text, one of the words or between them.
#[derive(Debug, PartialEq, Eq)]
pub(super) struct Piece {
    pub(super) text: String,
    pub(super) is_word: bool,
}

/// Sections as they are searched.
#[derive(Debug)]
pub(super) struct Index(Vec<Indexed>);

#[derive(Debug)]
struct Indexed {
    section: Section,
    /// In lower case, of ASCII alone: so a place in one is the same place in the other. The documents are English.
    heading: String,
    text: String,
}

impl Index {
    pub(super) fn new(sections: impl IntoIterator<Item = Section>) -> Self {
        let indexed = sections.into_iter().map(|section| Indexed {
            heading: section.heading.to_ascii_lowercase(),
            text: section.text.to_ascii_lowercase(),
            section,
        });
        Self(indexed.collect())
    }

    /// The first [`SHOWN`] of the sections that have all words, and how many there are.
    ///
    /// Sections with more of the words in their headings come first, of these the ones that say the words more often, of
    /// these in the order of the pages.
    pub(super) fn search(&self, question: &str) -> (Vec<Found>, usize) {
        let question = question.to_ascii_lowercase();
        let mut words: Vec<&str> = question.split_whitespace().collect();
        words.sort_unstable();
        words.dedup();
        if words.is_empty() {
            return (Vec::new(), 0);
        }
        let mut found: Vec<(Reverse<(usize, usize)>, &Indexed)> = self
            .0
            .iter()
            .filter_map(|one| one.rank(&words).map(|rank| (Reverse(rank), one)))
            .collect();
        found.sort_by_key(|(rank, _)| *rank);
        let shown = found.iter().take(SHOWN).map(|(_, one)| one.show(&words));
        (shown.collect(), found.len())
    }
}

impl Indexed {
    /// How many words the heading has, and how often the text has them; nothing if one is in neither.
    fn rank(&self, words: &[&str]) -> Option<(usize, usize)> {
        let (mut headed, mut said) = (0, 0);
        for word in words {
            let is_headed = self.heading.contains(word);
            let count = self.text.matches(word).count();
            if !is_headed && count == 0 {
                return None;
            }
            headed += usize::from(is_headed);
            said += count;
        }
        Some((headed, said))
    }

    fn show(&self, words: &[&str]) -> Found {
        let text = &self.section.text;
        let first = words.iter().filter_map(|word| self.text.find(word)).min();
        let shown = around(text, first.unwrap_or(0));
        let mut snippet = pieces(&text[shown.clone()], &self.text[shown.clone()], words);
        let dots = || Piece {
            text: "…".into(),
            is_word: false,
        };
        if shown.start > 0 {
            snippet.insert(0, dots());
        }
        if shown.end < text.len() {
            snippet.push(dots());
        }
        Found {
            page: self.section.page.clone(),
            href: self.section.href.clone(),
            heading: pieces(&self.section.heading, &self.heading, words),
            snippet,
        }
    }
}

/// Whole words around a place.
fn around(text: &str, at: usize) -> Range<usize> {
    let from = text.floor_char_boundary(at.saturating_sub(AROUND));
    let start = match text[from..at].find(' ') {
        Some(space) if from > 0 => from + space + 1,
        _ => from,
    };
    let to = text.ceil_char_boundary((at + AROUND).min(text.len()));
    let end = text[to..].find(' ').map_or(text.len(), |space| to + space);
    // A word may be as long as a page.
    start..end.min(text.ceil_char_boundary((to + AROUND).min(text.len())))
}

/// `text` cut where `lower`, the same in lower case, has one of the words.
fn pieces(text: &str, lower: &str, words: &[&str]) -> Vec<Piece> {
    let mut pieces = Vec::new();
    let mut done = 0;
    let mut push = |range: Range<usize>, is_word| {
        if !range.is_empty() {
            let text = text[range].to_owned();
            pieces.push(Piece { text, is_word });
        }
    };
    // The nearest word next, the longest of those that begin there.
    while let Some((at, Reverse(length))) = words
        .iter()
        .filter_map(|word| Some((done + lower[done..].find(word)?, Reverse(word.len()))))
        .min()
    {
        push(done..at, false);
        push(at..at + length, true);
        done = at + length;
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

    fn headings(index: &Index, question: &str) -> Vec<String> {
        let (found, count) = index.search(question);
        assert_eq!(found.len(), count);
        let headings = found.iter().map(|one| {
            let texts = one.heading.iter().map(|piece| piece.text.as_str());
            texts.collect()
        });
        headings.collect()
    }

    #[test]
    fn headings_come_first_then_what_says_it_more_often() {
        let index = Index::new([
            section("Once", "the puck"),
            section("Often", "puck, Puck and PUCK"),
            section("The puck", "round"),
            section("Nothing", "of it"),
        ]);
        assert_eq!(headings(&index, "puck"), ["The puck", "Often", "Once"]);
        assert_eq!(headings(&index, "PUCK the"), ["The puck", "Once"]);
        assert_eq!(headings(&index, "puck mallet"), [""; 0]);
        assert_eq!(headings(&index, "  "), [""; 0]);
    }

    #[test]
    fn words_are_marked_as_they_are_written() {
        let index = Index::new([section("A Puck", "Pucks: ≤ 2 puckish µ")]);
        let (found, _) = index.search("puck PUCKS");
        let marked = |pieces: &[Piece]| {
            let pieces = pieces.iter().map(|piece| match piece.is_word {
                true => format!("[{}]", piece.text),
                false => piece.text.clone(),
            });
            pieces.collect::<String>()
        };
        assert_eq!(marked(&found[0].snippet), "[Pucks]: ≤ 2 [puck]ish µ");
        let (found, _) = index.search("puck µ");
        assert_eq!(marked(&found[0].heading), "A [Puck]");
        assert_eq!(marked(&found[0].snippet), "[Puck]s: ≤ 2 [puck]ish [µ]");
    }

    #[test]
    fn a_long_section_is_shown_around_the_first_word_and_never_cut_within_a_character() {
        let filler = "äöü … ".repeat(200);
        let index = Index::new([section("Long", &format!("{filler}here {filler}"))]);
        let (found, _) = index.search("here");
        let texts: Vec<&str> = found[0].snippet.iter().map(|piece| &*piece.text).collect();
        assert_eq!(texts[0], "…");
        assert_eq!(texts[2], "here");
        assert_eq!(*texts.last().unwrap(), "…");
        assert!(texts.concat().len() < 4 * AROUND, "{texts:?}");
        // A single word without an end.
        let index = Index::new([section("Word", &"ä".repeat(5000))]);
        let (found, _) = index.search("ä");
        let shown: usize = found[0].snippet.iter().map(|piece| piece.text.len()).sum();
        assert!(shown < 4 * AROUND);
    }

    #[test]
    fn more_than_are_shown_are_counted() {
        let index = Index::new((0..100).map(|_| section("Same", "puck")));
        let (found, count) = index.search("puck");
        assert_eq!((found.len(), count), (SHOWN, 100));
    }
}
