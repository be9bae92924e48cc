//! The words of the documentation, and where they occur. Words are indexed by *stem*, the part that the forms of a word share.

use super::super::{
    sections::Section,
    synonyms::SYNONYMS,
    words::{is_one_typo, parts, stem, words},
};
use std::collections::{BTreeMap, HashMap};

/// Shortest beginning of a word that is searched as such, in bytes.
const MIN_BEGINNING: usize = 3;
/// Shortest word in which a typo is corrected, in bytes.
const MIN_CORRECTED: usize = 5;

/// Occurrences of a stem in a section.
#[derive(Debug)]
pub(super) struct Posting {
    /// Index of the section.
    pub(super) section: usize,
    /// In the title of the page.
    pub(super) in_title: bool,
    /// In the heading or the summary.
    pub(super) in_heading: bool,
    /// Number of occurrences in the text.
    pub(super) in_text: u32,
    /// Position of the first occurrence in the text.
    pub(super) first: usize,
}

/// A stem that stands for a word of the query.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Term {
    /// Index of the stem in the vocabulary.
    pub(super) stem: usize,
    /// True for a synonym of a word that the documentation has itself. Its matches rank below those of the word.
    pub(super) is_secondary: bool,
}

/// The terms for a word of the query; none if the documentation has nothing like it.
#[derive(Debug, Default)]
pub(super) struct QueryTerms {
    pub(super) terms: Vec<Term>,
    /// The word of the documentation that replaces an unknown one.
    pub(super) correction: Option<String>,
}

#[derive(Debug, Default)]
pub(super) struct Vocabulary {
    /// Index of each stem in `postings`.
    stems: HashMap<String, usize>,
    /// By stem, in the order of the sections.
    postings: Vec<Vec<Posting>>,
    /// Each word, with the number of its occurrences.
    words: BTreeMap<String, u32>,
    /// By the stem of a searched word: words of the documentation that are searched beside it.
    synonyms: HashMap<String, &'static [&'static str]>,
}

#[derive(Debug, Clone, Copy)]
enum Place {
    Title,
    Heading,
    Text,
}

impl Term {
    fn of_query(stem: usize) -> Self {
        Self {
            stem,
            is_secondary: false,
        }
    }
}

impl Vocabulary {
    pub(super) fn new(sections: &[Section]) -> Self {
        let synonyms = SYNONYMS.iter().map(|(word, others)| (stem(word), *others));
        let mut vocabulary = Self {
            synonyms: synonyms.collect(),
            ..Self::default()
        };
        for (index, section) in sections.iter().enumerate() {
            for (place, text) in [
                (Place::Title, &section.page),
                (Place::Heading, &section.heading),
                (Place::Heading, &section.summary),
                (Place::Text, &section.text),
            ] {
                vocabulary.add_text(index, place, text);
            }
        }
        vocabulary
    }

    fn add_text(&mut self, section: usize, place: Place, text: &str) {
        for range in words(text) {
            let word = &text[range.clone()];
            self.add_word(section, place, range.start, word);
            for part in parts(word) {
                self.add_word(section, place, range.start + part.start, &word[part]);
            }
        }
    }

    fn add_word(&mut self, section: usize, place: Place, position: usize, word: &str) {
        let word = word.to_lowercase();
        let next = self.postings.len();
        let index = *self.stems.entry(stem(&word)).or_insert(next);
        if index == next {
            self.postings.push(Vec::new());
        }
        *self.words.entry(word).or_default() += 1;
        let postings = &mut self.postings[index];
        if postings.last().is_none_or(|last| last.section != section) {
            postings.push(Posting {
                section,
                in_title: false,
                in_heading: false,
                in_text: 0,
                first: position,
            });
        }
        let posting = postings.last_mut().expect("it was just added");
        match place {
            Place::Title => posting.in_title = true,
            Place::Heading => posting.in_heading = true,
            Place::Text => {
                if posting.in_text == 0 {
                    posting.first = position;
                }
                posting.in_text += 1;
            }
        }
    }

    pub(super) fn postings(&self, stem: usize) -> &[Posting] {
        &self.postings[stem]
    }

    /// The stem of a word of the documentation.
    pub(super) fn stem_of(&self, word: &str) -> Option<usize> {
        self.stems.get(&stem(&word.to_lowercase())).copied()
    }

    /// The terms for a word in lower case: its forms and synonyms; else words that begin with it; else those for a word that
    /// differs by a typo.
    pub(super) fn find(&self, word: &str) -> QueryTerms {
        let terms = self.forms_and_synonyms(word);
        if !terms.is_empty() {
            return QueryTerms {
                terms,
                correction: None,
            };
        }
        let terms = self.words_beginning_with(word);
        if !terms.is_empty() {
            return QueryTerms {
                terms,
                correction: None,
            };
        }
        let correction = self.correct(word);
        QueryTerms {
            terms: correction.map_or_else(Vec::new, |word| self.forms_and_synonyms(word)),
            correction: correction.map(str::to_owned),
        }
    }

    fn forms_and_synonyms(&self, word: &str) -> Vec<Term> {
        let word_stem = stem(word);
        let synonyms = self.synonyms.get(&word_stem).copied().unwrap_or_default();
        let own_index = self.stems.get(&word_stem).copied();
        let synonyms = synonyms.iter().filter_map(|synonym| self.stem_of(synonym));
        let synonyms = synonyms.map(|stem| Term {
            stem,
            is_secondary: own_index.is_some(),
        });
        let own_term = own_index.map(Term::of_query);
        own_term.into_iter().chain(synonyms).collect()
    }

    fn words_beginning_with(&self, beginning: &str) -> Vec<Term> {
        if beginning.len() < MIN_BEGINNING {
            return Vec::new();
        }
        let words = self.words.range(beginning.to_owned()..);
        let words = words.take_while(|(word, _)| word.starts_with(beginning));
        let mut stems: Vec<usize> = words.filter_map(|(word, _)| self.stem_of(word)).collect();
        stems.sort_unstable();
        stems.dedup();
        stems.into_iter().map(Term::of_query).collect()
    }

    /// The most frequent word of the documentation that differs by a typo; else a word that has synonyms there.
    fn correct(&self, word: &str) -> Option<&str> {
        let is_near = |other: &str| is_one_typo(word, other);
        if word.len() < MIN_CORRECTED {
            return None;
        }
        let near_words = self.words.iter().filter(|(other, _)| is_near(other));
        let most_frequent = near_words.max_by_key(|(_, count)| **count);
        let most_frequent = most_frequent.map(|(word, _)| word.as_str());
        let words_with_synonyms = SYNONYMS.iter().map(|(other, _)| *other);
        most_frequent.or_else(|| words_with_synonyms.into_iter().find(|other| is_near(other)))
    }
}
