//! `faceoff new`: an agent of one's own, as a folder that runs as it is.

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

/// Makes a folder with an agent that plays, its tests, and a README with the loop: edit, evaluate, look.
#[derive(Debug, Args)]
pub struct NewCommand {
    /// The folder to make; its last part is the agent's name
    folder: PathBuf,
    /// What the agent is written in
    #[arg(long, value_enum, default_value_t = Language::Python)]
    lang: Language,
    /// What it can do from the start
    #[arg(long, value_enum, default_value_t = Example::Defender)]
    example: Example,
    /// Print what was made as JSON
    #[arg(long)]
    json: bool,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
enum Language {
    /// Standard library only; runs wherever the evaluator does
    Python,
    /// A crate of its own; the bundle is the program
    Rust,
}

/// Longest name: that of a crate's program is a file name, and the board has little room.
const NAME_CHARS: usize = 40;

impl NewCommand {
    /// Writes the folder and says what to do next.
    ///
    /// # Errors
    /// If the name is none, something is there already, or the disk refuses.
    pub fn run(self) -> anyhow::Result<()> {
        let name = name_of(&self.folder)?;
        ensure!(
            fs::symlink_metadata(&self.folder).is_err(),
            "{} is there already; choose another name, or remove it first",
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
            fs::create_dir_all(parent).with_context(|| format!("making {}", parent.display()))?;
            let text = text
                .replace("{{name}}", name)
                .replace("{{task}}", self.example.task())
                .replace("{{version}}", env!("CARGO_PKG_VERSION"));
            fs::write(&path, text).with_context(|| format!("writing {}", path.display()))?;
            written.push(path);
        }
        let (folder, task) = (self.folder.display(), self.example.task());
        // A bundle is uploaded with all that lies in it: results lie beside it.
        let (tested, bundle, beside) = match self.lang {
            Language::Python => ("python3 -m unittest", ".", "../"),
            Language::Rust => ("cargo test && sh pack.sh", "bundle", ""),
        };
        let made = json!({ "folder": self.folder, "name": name, "task": task, "files": written });
        print(self.json, &made, || {
            format!(
                "{folder}: an agent that plays {task}; README.md says what is what. Now:\n\n  cd {folder}\n  {tested}\n  \
                 faceoff eval {bundle} --task {task} --episodes 20 --out {beside}result\n  \
                 faceoff replay {beside}result --task {task} --episode 0 --out {beside}look.html"
            )
        })
    }
}

/// The folder's own name, which both languages and the board take.
fn name_of(folder: &Path) -> anyhow::Result<&str> {
    let name = folder.file_name().and_then(|name| name.to_str());
    let fits = |name: &&str| {
        name.len() <= NAME_CHARS
            && name.starts_with(|c: char| c.is_ascii_lowercase())
            && name
                .bytes()
                .all(|b| b.is_ascii_lowercase() || b.is_ascii_digit() || matches!(b, b'-' | b'_'))
    };
    name.filter(fits).with_context(|| {
        format!(
            "expected a name of at most {NAME_CHARS} lower-case letters, digits, - and _ that begins with a letter, \
             such as my-agent, got {}",
            folder.display()
        )
    })
}
