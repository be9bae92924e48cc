//! Full-text search: sections that contain all words of a query, or other forms or synonyms of them, ranked. The index is built
//! once; a search reads only the entries of its words, and the texts of the results that are shown.

mod snippet;
mod vocabulary;

use super::{
    sections::{Section, SectionKind},
    words::{is_stop_word, words},
};
use snippet::{Piece, pieces, snippet};
use std::{
    cmp::{Reverse, max},
    collections::HashSet,
};
use vocabulary::{Term, Vocabulary};

/// Largest number of results of a kind on the page.
const MAX_RESULTS_OF_A_KIND: usize = 20;
/// Occurrences of a word in a text beyond this do not improve the rank of a section.
const MAX_COUNTED_OCCURRENCES: u32 = 5;

/// Result of a search.
#[derive(Debug, Default, PartialEq, Eq)]
pub(super) struct SearchResults {
    /// Results of each kind that has some, documents first.
    pub(super) kinds: Vec<ResultGroup>,
    /// Number of results, including those that are not shown.
    pub(super) count: usize,
    pub(super) shown: usize,
    /// The corrected query that the results are for, if words of the query were replaced.
    pub(super) correction: Option<Correction>,
}

#[derive(Debug, PartialEq, Eq)]
pub(super) struct ResultGroup {
    pub(super) name: &'static str,
    pub(super) count: usize,
    pub(super) results: Vec<SearchResult>,
}

#[derive(Debug, PartialEq, Eq)]
pub(super) struct Correction {
    /// The query with words of the documentation.
    pub(super) query: String,
    /// Words of the query that the documentation does not have.
    pub(super) unknown: Vec<String>,
}

#[derive(Debug, PartialEq, Eq)]
pub(super) struct SearchResult {
    /// Title of the page; `None` if it is the heading.
    pub(super) page: Option<String>,
    pub(super) href: String,
    pub(super) heading: Vec<Piece>,
    pub(super) snippet: Vec<Piece>,
}

#[derive(Debug)]
pub(super) struct Index {
    sections: Vec<Section>,
    vocabulary: Vocabulary,
}

/// How well a section matches: numbers of matches by place. The most important place is first, since scores are compared field by field.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, PartialOrd, Ord)]
struct Score {
    title: u32,
    heading: u32,
    text: u32,
    synonyms: u32,
}

/// The match of a section with the words of the query that were searched so far.
#[derive(Debug, Clone, Copy)]
struct Hit {
    score: Score,
    /// Position of the first match in the text.
    first: Option<usize>,
    /// Does the section itself have a match, not only the title of its page? Later sections of a page are no results for its title.
    is_own: bool,
}

impl Index {
    pub(super) fn new(sections: impl IntoIterator<Item = Section>) -> Self {
        let sections: Vec<Section> = sections.into_iter().collect();
        let vocabulary = Vocabulary::new(&sections);
        Self {
            sections,
            vocabulary,
        }
    }

    /// Sections are ranked by matches in the title of a page, then in the heading or summary, then in the text, then by synonyms,
    /// then by the order of the pages.
    pub(super) fn search(&self, query: &str) -> SearchResults {
        let query = query.to_lowercase();
        let all_words: Vec<&str> = words(&query).map(|word| &query[word]).collect();
        let subject_words = all_words.iter().copied().filter(|word| !is_stop_word(word));
        let mut subject_words: Vec<&str> = subject_words.collect();
        if subject_words.is_empty() {
            subject_words.clone_from(&all_words);
        }
        subject_words.sort_unstable();
        subject_words.dedup();
        // By section: the match with all words so far; `None` if a word is missing.
        let mut hits: Option<Vec<Option<Hit>>> = None;
        let mut terms = HashSet::new();
        let mut replaced = Vec::new();
        for word in subject_words {
            let query_terms = self.vocabulary.find(word);
            if query_terms.terms.is_empty() {
                return SearchResults::default();
            }
            if let Some(correction) = query_terms.correction {
                replaced.push((word, correction));
            }
            let word_hits = self.sections_with(&query_terms.terms);
            terms.extend(query_terms.terms.iter().map(|term| term.stem));
            hits = Some(match hits {
                None => word_hits,
                Some(hits) => {
                    let pairs = hits.into_iter().zip(word_hits);
                    pairs
                        .map(|(hit, word_hit)| Some(hit?.and(word_hit?)))
                        .collect()
                }
            });
        }
        let hits = hits.unwrap_or_default().into_iter().zip(&self.sections);
        let mut hits: Vec<(Hit, &Section)> = hits
            .filter_map(|(hit, section)| Some((hit?, section)))
            .filter(|(hit, _)| hit.is_own)
            .collect();
        hits.sort_by_key(|(hit, _)| Reverse(hit.score));
        let kinds = SectionKind::ALL.map(|kind| self.results_of(kind, &hits, &terms));
        let kinds: Vec<ResultGroup> = kinds.into_iter().flatten().collect();
        SearchResults {
            count: hits.len(),
            shown: kinds.iter().map(|kind| kind.results.len()).sum(),
            kinds,
            correction: Correction::new(&all_words, &replaced),
        }
    }

    /// For each section, how it matches a word of the query, given as the terms that stand for it.
    fn sections_with(&self, terms: &[Term]) -> Vec<Option<Hit>> {
        let mut section_hits: Vec<Option<Hit>> = vec![None; self.sections.len()];
        for term in terms {
            for posting in self.vocabulary.postings(term.stem) {
                let section = &self.sections[posting.section];
                let is_title = posting.in_title && section.is_start();
                let occurrences = posting.in_text.min(MAX_COUNTED_OCCURRENCES);
                let score = if term.is_secondary {
                    let is_heading = is_title || posting.in_heading;
                    Score {
                        synonyms: if is_heading {
                            MAX_COUNTED_OCCURRENCES
                        } else {
                            occurrences
                        },
                        ..Score::default()
                    }
                } else {
                    Score {
                        title: is_title.into(),
                        heading: posting.in_heading.into(),
                        text: occurrences,
                        synonyms: 0,
                    }
                };
                let hit = Hit {
                    score,
                    first: (posting.in_text > 0).then_some(posting.first),
                    is_own: section.is_start() || posting.in_heading || posting.in_text > 0,
                };
                let known = &mut section_hits[posting.section];
                *known = Some(known.map_or(hit, |known| known.or(hit)));
            }
        }
        section_hits
    }

    fn results_of(
        &self,
        kind: SectionKind,
        hits: &[(Hit, &Section)],
        terms: &HashSet<usize>,
    ) -> Option<ResultGroup> {
        let hits: Vec<_> = hits
            .iter()
            .filter(|(_, section)| section.kind == kind)
            .collect();
        let is_match = |word: &str| {
            let stem = self.vocabulary.stem_of(word);
            stem.is_some_and(|stem| terms.contains(&stem))
        };
        let shown = hits.iter().take(MAX_RESULTS_OF_A_KIND);
        let results = shown.map(|(hit, section)| SearchResult {
            page: (!section.is_start()).then(|| section.page.clone()),
            href: section.href.clone(),
            heading: pieces(&section.heading, is_match),
            snippet: match hit.first {
                None if !section.summary.is_empty() => pieces(&section.summary, is_match),
                first => snippet(&section.text, first.unwrap_or(0), is_match),
            },
        });
        (!hits.is_empty()).then(|| ResultGroup {
            name: kind.name(),
            count: hits.len(),
            results: results.collect(),
        })
    }
}

impl Hit {
    /// Combines the matches of a section with two words of the query: the scores add up.
    fn and(self, other: Self) -> Self {
        Self {
            score: Score {
                title: self.score.title + other.score.title,
                heading: self.score.heading + other.score.heading,
                text: self.score.text + other.score.text,
                synonyms: self.score.synonyms + other.score.synonyms,
            },
            first: self.first.into_iter().chain(other.first).min(),
            is_own: self.is_own || other.is_own,
        }
    }

    /// Combines the matches of a section with two terms for the same word: the better score counts.
    fn or(self, other: Self) -> Self {
        Self {
            score: Score {
                title: max(self.score.title, other.score.title),
                heading: max(self.score.heading, other.score.heading),
                text: max(self.score.text, other.score.text),
                synonyms: max(self.score.synonyms, other.score.synonyms),
            },
            ..self.and(other)
        }
    }
}

impl Correction {
    fn new(query: &[&str], replaced: &[(&str, String)]) -> Option<Self> {
        let corrected = query.iter().map(|word| {
            let other = replaced.iter().find(|(unknown, _)| unknown == word);
            other.map_or(*word, |(_, other)| other.as_str())
        });
        (!replaced.is_empty()).then(|| Self {
            query: corrected.collect::<Vec<_>>().join(" "),
            unknown: replaced.iter().map(|(word, _)| (*word).into()).collect(),
        })
    }
}

#[cfg(test)]
mod tests;
