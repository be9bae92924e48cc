//! Sections of pages, split at headings, for the search.

use pulldown_cmark::{Event, TagEnd};

/// What a section belongs to.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum SectionKind {
    Document,
    Operation,
    Schema,
}

impl SectionKind {
    /// In the order of search results.
    pub(super) const ALL: [Self; 3] = [Self::Document, Self::Operation, Self::Schema];

    pub(super) fn name(self) -> &'static str {
        match self {
            Self::Document => "Documents",
            Self::Operation => "API operations",
            Self::Schema => "API schemas",
        }
    }
}

/// Text below a heading of the second or third level, or before the first one.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct Section {
    pub(super) kind: SectionKind,
    /// Title of the page.
    pub(super) page: String,
    pub(super) heading: String,
    /// What the page is about, in one line; empty for sections other than its first.
    pub(super) summary: String,
    /// Path of the page with the anchor of the heading.
    pub(super) href: String,
    /// The text in one line.
    pub(super) text: String,
}

impl Section {
    /// Is it the first section of its page? Its heading is the title of the page.
    pub(super) fn is_start(&self) -> bool {
        self.heading == self.page
    }
}

/// Collects the sections of a page while it is rendered.
#[derive(Debug)]
pub(super) struct Sections {
    path: String,
    title: String,
    finished: Vec<Section>,
    current: Section,
}

impl Sections {
    pub(super) fn new(path: &str, title: &str, summary: &str) -> Self {
        Self {
            path: path.to_owned(),
            title: title.to_owned(),
            finished: Vec::new(),
            current: Section {
                kind: SectionKind::Document,
                summary: summary.to_owned(),
                page: title.to_owned(),
                heading: title.to_owned(),
                href: path.to_owned(),
                text: String::new(),
            },
        }
    }

    /// Starts a section at a heading.
    pub(super) fn start(&mut self, heading: &str, id: &str) {
        let next = Section {
            kind: SectionKind::Document,
            summary: String::new(),
            page: self.title.clone(),
            heading: heading.to_owned(),
            href: format!("{}#{id}", self.path),
            text: String::new(),
        };
        self.finished
            .push(std::mem::replace(&mut self.current, next));
    }

    pub(super) fn push_text(&mut self, text: &str) {
        self.current.text.push_str(text);
    }

    /// Separates the following text from the previous word.
    pub(super) fn push_space(&mut self) {
        self.current.text.push(' ');
    }

    /// Adds a space if the event ends a block; emphasis may end inside a word.
    pub(super) fn push_space_after(&mut self, event: &Event<'_>) {
        let inline = [TagEnd::Emphasis, TagEnd::Strong];
        if !matches!(event, Event::End(end) if inline.contains(end)) {
            self.push_space();
        }
    }

    pub(super) fn finish(mut self) -> Vec<Section> {
        self.finished.push(self.current);
        for section in &mut self.finished {
            let words: Vec<&str> = section.text.split_whitespace().collect();
            section.text = words.join(" ");
        }
        self.finished
    }
}
