//! `faceoff new`: creates a folder with a working agent.

mod example;
mod templates;

use super::output::print;
use anyhow::{Context, ensure};
use clap::{Args, ValueEnum};
use example::Example;
use serde_json::json;
use std::{
    fs,
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
        let files = match self.lang {
            Language::Python => templates::python(self.example),
            Language::Rust => templates::rust(self.example),
        };
        let mut written = Vec::new();
        for (path, text) in files {
            let path = self.folder.join(path);
            let parent = path.parent().unwrap_or(&self.folder);
            fs::create_dir_all(parent).with_context(|| format!("creating {}", parent.display()))?;
            let text = text
                .replace("{{name}}", name)
                .replace("{{task}}", self.example.task())
                .replace("{{version}}", env!("CARGO_PKG_VERSION"));
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
