//! Rules for files that are left out of a bundle.

use anyhow::Context;
use ignore::{
    Match,
    gitignore::{Gitignore, GitignoreBuilder},
};
use std::{fs, io::ErrorKind, path::Path};

/// File in a bundle's folder that leaves out further files than [`DEFAULTS`], or includes them with `!`, in the syntax
/// of `.gitignore`.
pub const IGNORE_FILE: &str = ".faceoffignore";

/// Files that no agent needs: version control, caches, environments, builds, files of editors and operating systems,
/// and results and temporary files of `faceoff eval` and `play` in the folder. Links with these names are also left
/// out.
pub const DEFAULTS: [&str; 28] = [
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
    "._*",
    "__MACOSX",
    "Thumbs.db",
    "desktop.ini",
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

/// Compiled rules of a folder.
pub(super) struct Rules(Gitignore);

impl Rules {
    /// Reads the default rules and then those of the folder's own file; the last matching rule decides.
    ///
    /// # Errors
    /// If the file cannot be read, or a line is not a valid rule.
    pub(super) fn read(folder: &Path) -> anyhow::Result<Self> {
        let mut rules = GitignoreBuilder::new(folder);
        for line in DEFAULTS {
            rules.add_line(None, line).context("a default rule")?;
        }
        let file = folder.join(IGNORE_FILE);
        let reading = || format!("reading {}", file.display());
        let custom_rules = match fs::read_to_string(&file) {
            Err(error) if error.kind() == ErrorKind::NotFound => String::new(),
            text => text.with_context(reading)?,
        };
        // Editors of Windows may write a byte order mark, which is no part of the first rule.
        let custom_rules = custom_rules
            .strip_prefix('\u{feff}')
            .unwrap_or(&custom_rules);
        for (number, line) in custom_rules.lines().enumerate() {
            rules
                .add_line(None, line)
                .with_context(|| format!("{}, line {}", file.display(), number + 1))?;
        }
        Ok(Self(rules.build().with_context(reading)?))
    }

    /// Whether the rules leave out a path, relative to the folder. Callers do not ask about the content of a folder that is left out.
    pub(super) fn leaves_out(&self, path: &Path, is_folder: bool) -> bool {
        matches!(self.0.matched(path, is_folder), Match::Ignore(_))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn default_rules_are_documented() {
        let documented = include_str!("../../../../docs/cli.md");
        let (_, section) = documented
            .split_once("**What goes into a bundle.**")
            .unwrap();
        let (section, _) = section.split_once("**Downloads.**").unwrap();
        for rule in DEFAULTS {
            let name = rule.trim_matches('/');
            let expected = match name {
                "*.py[co]" => "`*.pyc`, `*.pyo`".to_owned(),
                ".mypy_cache" | ".pytest_cache" | ".ruff_cache" => {
                    name.trim_start_matches('.').replace("_cache", "")
                }
                ".ipynb_checkpoints" => "notebooks".to_owned(),
                name => format!("`{name}`"),
            };
            assert!(
                section.contains(&expected),
                "{rule} is not documented as {expected}"
            );
        }
    }
}
