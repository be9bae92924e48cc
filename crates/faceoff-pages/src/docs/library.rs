//! The library: the documents of the repository that have a page, in groups and in order.

use super::{
    images,
    markdown::{self, ContentsEntry, LinkResolver},
    sections::Section,
};
use crate::compressed_text::{CompressedText, compressed_text};
use std::sync::LazyLock;

/// Pages for one kind of readers.
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
    /// What the page is about, in one line.
    pub(super) summary: &'static str,
    pub(super) html: String,
    pub(super) contents: Vec<ContentsEntry>,
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

/// A document before it is rendered.
struct Source {
    name: &'static str,
    summary: &'static str,
    markdown: CompressedText,
}

/// A file of `docs/`, by its name.
macro_rules! source {
    ($name:literal, $summary:literal) => {
        Source {
            name: $name,
            summary: $summary,
            markdown: compressed_text!("docs/", $name, ".md"),
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
                    "Your first agent on the board within an hour: evaluate, submit, and next steps."
                ),
                source!(
                    "rules",
                    "Tasks, fouls, penalty points, tiers, boards and the tournament."
                ),
                source!(
                    "protocol",
                    "Messages between evaluator and agent, line by line, and the bundle format."
                ),
                source!(
                    "robot",
                    "Arm, table and puck: frames, dimensions, limits and observations."
                ),
                source!(
                    "python",
                    "Training environments, games, evaluation and kinematics in Python."
                ),
                source!(
                    "from-2023",
                    "Agents written for air_hockey_challenge: old and new names, and a converter."
                ),
                source!(
                    "from-sb3",
                    "Train with Stable-Baselines3, export the policy as an agent, and submit it."
                ),
                source!(
                    "tuning",
                    "How to find out whether a change of an agent is an improvement."
                ),
                source!(
                    "sandbox",
                    "Runtimes, packages and hardware of agents on the server: CPU, memory, time, and no GPU."
                ),
                source!(
                    "tournament",
                    "Schedule, games, scoring and pages of tournaments."
                ),
            ],
        ),
        (
            "Results and data",
            vec![
                source!(
                    "dataset",
                    "Recordings of evaluations and games, by file and column."
                ),
                source!(
                    "replay",
                    "Replay pages of episodes and games, their visibility, and the clip format."
                ),
                source!("verifying", "How to recompute a score from its dataset."),
                source!(
                    "archive",
                    "The files of a whole season, for storage and for a read-only server."
                ),
            ],
        ),
        (
            "Reference",
            vec![
                source!("cli", "Commands with their exit codes and files."),
                source!("api", "The API explained by topic."),
                source!(
                    "simulator",
                    "The physics behind the scores, and its accuracy against the reference."
                ),
                source!(
                    "security",
                    "How agents are isolated from each other, the server and future episodes."
                ),
                source!(
                    "security-input",
                    "How the server treats answers, bundles, text and connections from outside."
                ),
            ],
        ),
        (
            "For organisers",
            vec![
                source!(
                    "operating",
                    "Where to find what: installing, running and watching a server."
                ),
                source!(
                    "season",
                    "One season in order, from the installation to the archive."
                ),
                source!(
                    "install",
                    "The program, its sandbox, a service, a proxy and TLS."
                ),
                source!(
                    "containers",
                    "Images for Docker, Compose and Kubernetes, and what they need."
                ),
                source!(
                    "configuration",
                    "Every value of faceoff.toml with its default, unit and meaning."
                ),
                source!(
                    "accounts",
                    "Invitations, registration, teams, tokens and the dashboard."
                ),
                source!(
                    "stages",
                    "Rules, evaluation days, corrections, trials, retention and ablations."
                ),
                source!(
                    "monitoring",
                    "Health, metrics, log, full disks, host interference and the queue."
                ),
                source!("workers", "Evaluating on other machines over NATS."),
                source!(
                    "capacity",
                    "How many teams, shards and workers a server can carry, measured."
                ),
                source!(
                    "backup",
                    "Backup, restore, upgrade and the archive of a season."
                ),
            ],
        ),
    ]
});

/// Rendered on first use.
pub(super) static LIBRARY: LazyLock<Vec<Group>> = LazyLock::new(|| {
    let groups = SOURCES.iter().map(|(name, sources)| Group {
        name,
        pages: sources.iter().map(render).collect(),
    });
    groups.collect()
});

fn render(source: &'static Source) -> Page {
    let title = markdown::title(source.markdown.text());
    let document = markdown::render_document(
        source.markdown.text(),
        &path(source.name),
        title,
        source.summary,
        &LibraryLinks,
    );
    Page {
        name: source.name,
        title,
        summary: source.summary,
        html: document.html,
        contents: document.contents,
        sections: document.sections,
    }
}

pub(super) fn page(name: &str) -> Option<&'static Page> {
    let mut pages = LIBRARY.iter().flat_map(|group| &group.pages);
    pages.find(|page| page.name == name)
}

/// The documents before and after a page.
pub(super) fn neighbours(page: &Page) -> (Option<&'static Page>, Option<&'static Page>) {
    let pages: Vec<&Page> = LIBRARY.iter().flat_map(|group| &group.pages).collect();
    let position = pages.iter().position(|other| other.name == page.name);
    let at = |index: Option<usize>| pages.get(index?).copied();
    (
        at(position.and_then(|position| position.checked_sub(1))),
        at(position.map(|position| position + 1)),
    )
}

/// Links between documents of the library.
struct LibraryLinks;

impl LinkResolver for LibraryLinks {
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
