//! `faceoff completions`: prints completion scripts for shells.

use anyhow::Context;
use clap::{Args, Command};
use clap_complete::Shell;
use std::io::Write;

/// Prints a script that completes commands and options in a shell. For bash: faceoff completions bash >
/// ~/.local/share/bash-completion/completions/faceoff
#[derive(Debug, Args)]
pub struct CompletionsCommand {
    shell: Shell,
}

impl CompletionsCommand {
    /// Prints the script for `program`.
    ///
    /// # Errors
    /// If standard output cannot be written.
    pub fn run(self, mut program: Command) -> anyhow::Result<()> {
        let mut script = Vec::new();
        clap_complete::generate(self.shell, &mut program, "faceoff", &mut script);
        let mut out = crate::terminal::stdout();
        out.write_all(&script).context("standard output")?;
        out.flush().context("standard output")
    }
}
