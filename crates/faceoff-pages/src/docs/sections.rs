//! Sections of pages, split at headings, for the search.

use pulldown_cmark::{Event, TagEnd};

/// Text below a heading of the second or third level, or before the first one.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct Section {
    /// Title of the page.
    pub(super) page: String,
    pub(super) heading: String,
    /// Path of the page with the anchor of the heading.
    pub(super) href: String,
    /// The text in one line.
    pub(super) text: String,
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
    pub(super) fn new(path: &str, title: &str) -> Self {
        Self {
            path: path.to_owned(),
            title: title.to_owned(),
            finished: Vec::new(),
            current: Section {
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
