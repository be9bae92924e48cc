//! The option `--config` of the commands on the server's machine.

use crate::config::Config;
use clap::Args;
use std::path::PathBuf;

/// The option for the configuration file.
#[derive(Debug, Args)]
pub struct ConfigFile {
    /// Configuration file [default: faceoff.toml in the working folder, if it exists]
    #[arg(long, value_name = "FILE", env = "FACEOFF_CONFIG")]
    config: Option<PathBuf>,
}

impl ConfigFile {
    /// Reads the configuration.
    ///
    /// # Errors
    /// If the file cannot be read, or has an invalid value.
    pub fn load(&self) -> anyhow::Result<Config> {
        Config::load(self.config.as_deref())
    }
}
