//! The outline of the documentation: all pages in groups, for the contents page and for the list beside each page.

use super::{
    library::LIBRARY,
    reference::{self, Reference},
};

/// Pages for one kind of readers.
#[derive(Debug)]
pub(super) struct OutlineGroup {
    pub(super) name: &'static str,
    pub(super) entries: Vec<OutlineEntry>,
}

#[derive(Debug)]
pub(super) struct OutlineEntry {
    pub(super) title: String,
    pub(super) path: String,
    /// What the page is about, in one line.
    pub(super) summary: String,
}

/// The documents, then the pages of the API reference.
pub(super) fn outline(reference: &Reference) -> Vec<OutlineGroup> {
    let documents = LIBRARY.iter().map(|group| OutlineGroup {
        name: group.name,
        entries: group
            .pages
            .iter()
            .map(|page| OutlineEntry::new(page.title, page.path(), page.summary))
            .collect(),
    });
    let operations = reference.groups.iter().map(|group| {
        let title = format!("API: {}", group.name);
        let summary = format!("Operations. {}.", group.description.plain);
        OutlineEntry::new(title, group.path(), summary)
    });
    let overview = OutlineEntry::new(
        "API reference",
        reference::PATH,
        "Tokens, and all operations in a list.",
    );
    let schemas = OutlineEntry::new(
        "API: schemas",
        reference::SCHEMAS_PATH,
        "All request and response types of the API.",
    );
    let reference = OutlineGroup {
        name: "API",
        entries: [overview]
            .into_iter()
            .chain(operations)
            .chain([schemas])
            .collect(),
    };
    documents.chain([reference]).collect()
}

impl OutlineEntry {
    fn new(title: impl Into<String>, path: impl Into<String>, summary: impl Into<String>) -> Self {
        Self {
            title: title.into(),
            path: path.into(),
            summary: summary.into(),
        }
    }
}

/// The list of all pages beside a page.
#[derive(Debug)]
pub(super) struct SideList<'a> {
    pub(super) groups: &'a [OutlineGroup],
    /// Path of the page.
    current: String,
    /// Id and title of each heading of the page.
    pub(super) headings: Vec<(&'a str, String)>,
}

impl<'a> SideList<'a> {
    pub(super) fn new(
        groups: &'a [OutlineGroup],
        current: String,
        headings: Vec<(&'a str, String)>,
    ) -> Self {
        Self {
            groups,
            current,
            headings,
        }
    }

    /// Value of `aria-current`: `page` for the page itself, `true` for an entry above it; `None` for others. The pages of the
    /// schemas have no entries of their own.
    pub(super) fn current_state(&self, entry: &OutlineEntry) -> Option<&'static str> {
        let rest = self.current.strip_prefix(&entry.path)?;
        match rest {
            "" => Some("page"),
            _ => (entry.path == reference::SCHEMAS_PATH).then_some("true"),
        }
    }
}
