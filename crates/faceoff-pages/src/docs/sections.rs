//! Pages cut at their headings: what a search finds.

use pulldown_cmark::{Event, TagEnd};

/// What stands below a heading of the second or third level, or above the first of them.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct Section {
    pub(super) page: String,
    pub(super) heading: String,
    pub(super) href: String,
    /// Its words, in one line.
    pub(super) text: String,
}

/// A page's sections while it is read.
#[derive(Debug)]
pub(super) struct Sections {
    path: String,
    title: String,
    done: Vec<Section>,
    now: Section,
}

impl Sections {
    pub(super) fn new(path: &str, title: &str) -> Self {
        Self {
            path: path.to_owned(),
            title: title.to_owned(),
            done: Vec::new(),
            now: Section {
                page: title.to_owned(),
                heading: title.to_owned(),
                href: path.to_owned(),
                text: String::new(),
            },
        }
    }

    /// A heading with its id.
    pub(super) fn begin(&mut self, heading: &str, id: &str) {
        let next = Section {
            page: self.title.clone(),
            heading: heading.to_owned(),
            href: format!("{}#{id}", self.path),
            text: String::new(),
        };
        self.done.push(std::mem::replace(&mut self.now, next));
    }

    pub(super) fn say(&mut self, words: &str) {
        self.now.text.push_str(words);
    }

    /// What follows is another word.
    pub(super) fn pause(&mut self) {
        self.now.text.push(' ');
    }

    /// Likewise, where this ended a block; emphasis may end within a word.
    pub(super) fn pause_after(&mut self, event: &Event<'_>) {
        let within = [TagEnd::Emphasis, TagEnd::Strong];
        if !matches!(event, Event::End(end) if within.contains(end)) {
            self.pause();
        }
    }

    pub(super) fn done(mut self) -> Vec<Section> {
        self.done.push(self.now);
        for section in &mut self.done {
            let words: Vec<&str> = section.text.split_whitespace().collect();
            section.text = words.join(" ");
        }
        self.done
    }
}
