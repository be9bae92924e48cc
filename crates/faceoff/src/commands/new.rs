//! `faceoff new`: creates a folder with a working agent.

mod example;
mod templates;

use super::output::print;
use anyhow::{Context, ensure};
use clap::{Args, ValueEnum};
use example::Example;
use flate2::{Compression, GzBuilder};
use serde_json::json;
use std::{
    fs, io,
    path::{Path, PathBuf},
};

/// Creates a folder with a working agent, its tests and a README that explains how to edit, evaluate and inspect it.
#[derive(Debug, Args)]
pub struct NewCommand {
    /// The folder to create; its last part is the agent's name
    folder: PathBuf,
    /// Programming language of the agent
    #[arg(long, value_enum, default_value_t = Language::Python)]
    lang: Language,
    /// Behaviour that the agent starts with
    #[arg(long, value_enum, default_value_t = Example::Defender)]
    example: Example,
    /// Print a summary as JSON
    #[arg(long)]
    json: bool,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
enum Language {
    /// Python with the standard library only; runs wherever the evaluator runs
    Python,
    /// A Rust crate; the bundle is its compiled program
    Rust,
}

/// Longest name; it becomes a file name and has to fit on the board.
const MAX_NAME_CHARS: usize = 40;

impl NewCommand {
    /// Writes the folder and prints the next steps.
    ///
    /// # Errors
    /// If the name is invalid, the folder exists, or it cannot be written.
    pub fn run(self) -> anyhow::Result<()> {
        let name = agent_name(&self.folder)?;
        ensure!(
            fs::symlink_metadata(&self.folder).is_err(),
            "{} already exists; choose another name, or remove it first",
            self.folder.display()
        );
        let mut written = Vec::new();
        for (path, text) in agent_files(self.lang, self.example, name) {
            let path = self.folder.join(path);
            let parent = path.parent().unwrap_or(&self.folder);
            fs::create_dir_all(parent).with_context(|| format!("creating {}", parent.display()))?;
            fs::write(&path, text).with_context(|| format!("writing {}", path.display()))?;
            written.push(path);
        }
        let (folder, task) = (self.folder.display(), self.example.task());
        // A bundle is uploaded with all its files, so results are written beside it.
        let (test_command, bundle, out_prefix) = match self.lang {
            Language::Python => ("python3 -m unittest", ".", "../"),
            Language::Rust => ("cargo test && sh pack.sh", "bundle", ""),
        };
        let summary =
            json!({ "folder": self.folder, "name": name, "task": task, "files": written });
        print(self.json, &summary, |_| {
            format!(
                "{folder}: an agent for the task {task}; README.md explains its files. Next:\n\n  cd {folder}\n  {test_command}\n  \
                faceoff eval {bundle} --task {task} --episodes 20 --out {out_prefix}result\n  \
                faceoff replay {out_prefix}result --task {task} --episode 0 --out {out_prefix}look.html"
            )
        })
    }
}

/// The files of a new agent: paths and texts.
fn agent_files(
    language: Language,
    example: Example,
    name: &str,
) -> impl Iterator<Item = (&'static str, String)> {
    let files = match language {
        Language::Python => templates::python(example),
        Language::Rust => templates::rust(example),
    };
    files.into_iter().map(move |(path, text)| {
        let text = text
            .replace("{{name}}", name)
            .replace("{{task}}", example.task())
            .replace("{{version}}", env!("CARGO_PKG_VERSION"));
        (path, text)
    })
}

/// The examples as archives: file name, content, and the bytes of a .tar.gz with one folder.
///
/// # Errors
/// Never on a working machine: the archives are made in memory.
pub(super) fn example_archives() -> io::Result<Vec<(&'static str, &'static str, Vec<u8>)>> {
    const NAME: &str = "my-agent";
    let archive = |language, example| {
        let files = agent_files(language, example, NAME);
        tar_gz(files.map(|(path, text)| (format!("{NAME}/{path}"), text)))
    };
    Ok(vec![
        (
            "agent-python-defender.tar.gz",
            "An agent in Python that stops pucks, with its tests",
            archive(Language::Python, Example::Defender)?,
        ),
        (
            "agent-python-hitter.tar.gz",
            "An agent in Python that shoots at the goal, with its tests",
            archive(Language::Python, Example::Hitter)?,
        ),
        (
            "agent-rust-defender.tar.gz",
            "An agent in Rust that stops pucks, with its tests",
            archive(Language::Rust, Example::Defender)?,
        ),
        (
            "agent-rust-hitter.tar.gz",
            "An agent in Rust that shoots at the goal, with its tests",
            archive(Language::Rust, Example::Hitter)?,
        ),
        (
            "runtime-python3-ml.tar.gz",
            "A script that builds the runtime python3-ml, with the versions of its packages",
            tar_gz(templates::machine_learning_runtime().into_iter())?,
        ),
    ])
}

fn tar_gz(files: impl Iterator<Item = (String, String)>) -> io::Result<Vec<u8>> {
    let gzip = GzBuilder::new().write(Vec::new(), Compression::default());
    let mut archive = tar::Builder::new(gzip);
    for (path, text) in files {
        let mut header = tar::Header::new_gnu();
        header.set_mtime(0);
        header.set_mode(if path.ends_with(".sh") { 0o755 } else { 0o644 });
        header.set_size(text.len() as u64);
        archive.append_data(&mut header, path, text.as_bytes())?;
    }
    archive.into_inner()?.finish()
}

/// The last part of the path, if it is a valid name in both languages and on the board.
fn agent_name(folder: &Path) -> anyhow::Result<&str> {
    let name = folder.file_name().and_then(|name| name.to_str());
    let is_valid = |name: &&str| {
        name.len() <= MAX_NAME_CHARS
            && name.starts_with(|c: char| c.is_ascii_lowercase())
            && name
                .bytes()
                .all(|b| b.is_ascii_lowercase() || b.is_ascii_digit() || matches!(b, b'-' | b'_'))
    };
    name.filter(is_valid).with_context(|| {
        format!(
            "expected a name of at most {MAX_NAME_CHARS} lower-case letters, digits, - and _ that begins with a letter, \
             such as my-agent, got {}",
            folder.display()
        )
    })
}
