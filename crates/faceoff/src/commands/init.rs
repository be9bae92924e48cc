//! `faceoff init`: a configuration to begin with.

use super::output::print;
use crate::config::{COMMENTED, DEFAULT_FILE};
use anyhow::{Context, bail};
use clap::Args;
use serde_json::json;
use std::{
    fs::File,
    io::{ErrorKind, Write as _},
    path::PathBuf,
};

/// Writes a configuration in which every value stands with its default, unit and meaning.
#[derive(Debug, Args)]
pub struct InitCommand {
    /// The file to write; one that exists is left as it is
    #[arg(default_value = DEFAULT_FILE)]
    file: PathBuf,
    /// Print what was written as JSON
    #[arg(long)]
    json: bool,
}

impl InitCommand {
    /// Writes the file.
    ///
    /// # Errors
    /// If it exists or cannot be written.
    pub fn run(self) -> anyhow::Result<()> {
        let shown = self.file.display();
        let mut file = match File::create_new(&self.file) {
            Ok(file) => file,
            Err(error) if error.kind() == ErrorKind::AlreadyExists => {
                bail!("{shown} exists and was left as it is; name another file, or remove it first")
            }
            Err(error) => return Err(error).with_context(|| format!("creating {shown}")),
        };
        file.write_all(COMMENTED.as_bytes())
            .with_context(|| format!("writing {shown}"))?;
        print(self.json, &json!({ "file": self.file }), || {
            format!(
                "wrote {shown}\nnext: change what you like, then `faceoff doctor --config {shown}` and \
                 `faceoff serve --config {shown}`"
            )
        })
    }
}
