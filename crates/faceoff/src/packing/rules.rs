//! What of a folder stays out of the bundle.

use anyhow::Context;
use ignore::{
    Match,
    gitignore::{Gitignore, GitignoreBuilder},
};
use std::{fs, io::ErrorKind, path::Path};

/// In a bundle's folder: what stays out of it besides [`DEFAULTS`], and with `!` what does not, in the syntax of
/// `.gitignore`.
pub const IGNORE_FILE: &str = ".faceoffignore";

/// What no agent needs to run: histories, caches, environments, builds, what editors and systems leave behind, and the
/// results of `faceoff eval` and `play` in the folder itself, among them what they are just unpacking there. Links that are
/// called so, too.
pub const DEFAULTS: [&str; 25] = [
    ".git",
    ".hg",
    ".svn",
    "__pycache__",
    "*.py[co]",
    ".venv",
    "venv",
    ".mypy_cache",
    ".pytest_cache",
    ".ruff_cache",
    ".ipynb_checkpoints",
    "node_modules",
    "/target",
    ".DS_Store",
    "Thumbs.db",
    ".idea",
    ".vscode",
    "*.swp",
    "*.swo",
    "*~",
    ".#*",
    "/faceoff-eval",
    "/faceoff-game",
    ".eval-*/",
    "/.faceoffignore",
];

/// The rules of a folder.
pub(super) struct Rules(Gitignore);

impl Rules {
    /// Those of all bundles, then those of the folder's own file: the last one that speaks of a name counts.
    ///
    /// # Errors
    /// If that file cannot be read, or a line of it is no rule.
    pub(super) fn of(folder: &Path) -> anyhow::Result<Self> {
        let mut rules = GitignoreBuilder::new(folder);
        for line in DEFAULTS {
            rules.add_line(None, line).context("a default rule")?;
        }
        let file = folder.join(IGNORE_FILE);
        let reading = || format!("reading {}", file.display());
        let own = match fs::read_to_string(&file) {
            Err(error) if error.kind() == ErrorKind::NotFound => String::new(),
            own => own.with_context(reading)?,
        };
        for (number, line) in own.lines().enumerate() {
            rules
                .add_line(None, line)
                .with_context(|| format!("{}, line {}", file.display(), number + 1))?;
        }
        Ok(Self(rules.build().with_context(reading)?))
    }

    /// Does it stay out? `path` is within the folder; what is inside of a folder that does is not asked for.
    pub(super) fn leave_out(&self, path: &Path, is_folder: bool) -> bool {
        matches!(self.0.matched(path, is_folder), Match::Ignore(_))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_stays_out_is_told_in_the_documents() {
        let documented = include_str!("../../../../docs/cli.md");
        let (_, told) = documented
            .split_once("**What goes into a bundle.**")
            .unwrap();
        let (told, _) = told.split_once("**Downloads.**").unwrap();
        for rule in DEFAULTS {
            let name = rule.trim_matches('/');
            let words = match name {
                "*.py[co]" => "`*.pyc`, `*.pyo`".to_owned(),
                ".mypy_cache" | ".pytest_cache" | ".ruff_cache" => {
                    name.trim_start_matches('.').replace("_cache", "")
                }
                ".ipynb_checkpoints" => "notebooks".to_owned(),
                name => format!("`{name}`"),
            };
            assert!(told.contains(&words), "{rule} is not told as {words}");
        }
    }
}
