//! The documents that are pages, in their order.

use super::{
    images,
    markdown::{self, Entry, Site},
    sections::Section,
};
use crate::packed::{Packed, packed};
use std::sync::LazyLock;

/// Documents for one purpose.
#[derive(Debug)]
pub(super) struct Group {
    pub(super) name: &'static str,
    pub(super) pages: Vec<Page>,
}

/// A document as a page.
#[derive(Debug)]
pub(super) struct Page {
    pub(super) name: &'static str,
    pub(super) title: &'static str,
    /// What it is good for, in one line.
    pub(super) about: &'static str,
    pub(super) html: String,
    pub(super) contents: Vec<Entry>,
    pub(super) sections: Vec<Section>,
}

impl Page {
    pub(super) fn path(&self) -> String {
        path(self.name)
    }
}

fn path(name: &str) -> String {
    format!("/docs/{name}")
}

struct Source {
    name: &'static str,
    about: &'static str,
    markdown: Packed,
}

/// A file of `docs/`, by its name.
macro_rules! source {
    ($name:literal, $about:literal) => {
        Source {
            name: $name,
            about: $about,
            markdown: packed!("docs/", $name, ".md"),
        }
    };
}

static SOURCES: LazyLock<[(&str, Vec<Source>); 4]> = LazyLock::new(|| {
    [
        (
            "Take part",
            vec![
                source!(
                    "start",
                    "From nothing to an agent on the board in an hour, and what to do next."
                ),
                source!(
                    "rules",
                    "Tasks, fouls, penalty points, tiers, boards, the tournament: what counts, and how."
                ),
                source!(
                    "protocol",
                    "The conversation between the evaluator and an agent, line by line, and the bundle."
                ),
                source!(
                    "robot",
                    "The arm, the table and the puck: frames, lengths, limits, what an agent observes."
                ),
                source!(
                    "python",
                    "Environments to train in, games, evaluation and kinematics, from Python."
                ),
                source!(
                    "sandbox",
                    "Runtimes, packages, memory, time: what an agent can use on the server."
                ),
                source!(
                    "tournament",
                    "How games between teams are drawn, played, counted and shown."
                ),
            ],
        ),
        (
            "Results and data",
            vec![
                source!(
                    "dataset",
                    "What is recorded of an evaluation or a game, file by file and column by column."
                ),
                source!(
                    "replay",
                    "What the pages of episodes and games show, who sees it, and the clips that it is drawn from."
                ),
                source!(
                    "verifying",
                    "How anybody computes a score again from its dataset."
                ),
                source!(
                    "archive",
                    "The files of a whole season, to keep and to show again."
                ),
            ],
        ),
        (
            "Reference",
            vec![
                source!(
                    "cli",
                    "The program's commands, their status and their files."
                ),
                source!(
                    "api",
                    "What programs can ask of the server, explained by topic."
                ),
                source!(
                    "simulator",
                    "The physics behind the scores, and how near to the reference it is."
                ),
                source!(
                    "security",
                    "What keeps agents from each other, from the server and from the episodes."
                ),
            ],
        ),
        (
            "For organisers",
            vec![source!(
                "operating",
                "Setting up a server and running a season on it."
            )],
        ),
    ]
});

/// Rendered when somebody reads for the first time.
pub(super) static LIBRARY: LazyLock<Vec<Group>> = LazyLock::new(|| {
    let groups = SOURCES.iter().map(|(name, sources)| Group {
        name,
        pages: sources.iter().map(rendered).collect(),
    });
    groups.collect()
});

fn rendered(source: &'static Source) -> Page {
    let title = markdown::title(source.markdown.text());
    let rendered = markdown::document(source.markdown.text(), &path(source.name), title, &Here);
    Page {
        name: source.name,
        title,
        about: source.about,
        html: rendered.html,
        contents: rendered.contents,
        sections: rendered.sections,
    }
}

/// The page of this name.
pub(super) fn page(name: &str) -> Option<&'static Page> {
    let mut pages = LIBRARY.iter().flat_map(|group| &group.pages);
    pages.find(|page| page.name == name)
}

struct Here;

impl Site for Here {
    fn page(&self, file: &str) -> Option<(&str, String)> {
        let name = file.strip_suffix(".md")?;
        let mut sources = SOURCES.iter().flat_map(|(_, sources)| sources.iter());
        let source = sources.find(|source| source.name == name)?;
        Some((markdown::title(source.markdown.text()), path(name)))
    }

    fn picture(&self, file: &str) -> Option<String> {
        images::path(file.strip_prefix("images/")?)
    }
}
