//! `faceoff init`: writes a default configuration.

use super::output::print;
use crate::config::{COMMENTED_DEFAULTS, DEFAULT_FILE};
use anyhow::{Context, bail};
use clap::Args;
use serde_json::json;
use std::{
    fs::File,
    io::{ErrorKind, Write as _},
    path::PathBuf,
};

/// Writes a configuration file that lists every value with its default, unit and meaning.
#[derive(Debug, Args)]
pub struct InitCommand {
    /// The file to write; an existing file is not overwritten
    #[arg(default_value = DEFAULT_FILE)]
    file: PathBuf,
    /// Print the file's path as JSON
    #[arg(long)]
    json: bool,
}

impl InitCommand {
    /// Writes the file.
    ///
    /// # Errors
    /// If the file exists or cannot be written.
    pub fn run(self) -> anyhow::Result<()> {
        let shown = self.file.display();
        let mut file = match File::create_new(&self.file) {
            Ok(file) => file,
            Err(error) if error.kind() == ErrorKind::AlreadyExists => {
                bail!(
                    "{shown} already exists and was not changed; name another file, or remove it first"
                )
            }
            Err(error) => return Err(error).with_context(|| format!("creating {shown}")),
        };
        file.write_all(COMMENTED_DEFAULTS.as_bytes())
            .with_context(|| format!("writing {shown}"))?;
        print(self.json, &json!({ "file": self.file }), |_| {
            format!(
                "wrote {shown}\nnext: edit it, then run `faceoff doctor --config {shown}` and \
                `faceoff serve --config {shown}`"
            )
        })
    }
}
