//! The option `--ca-file` of all commands that connect to a server.

use clap::Args;
use std::path::{Path, PathBuf};

/// The option for an additional certificate authority.
#[derive(Debug, Args)]
pub struct CaFile {
    /// Also trust the certificate authorities of this file (PEM), for a server whose certificate is signed by the
    /// organisers' own authority
    #[arg(long, global = true, value_name = "FILE", env = "FACEOFF_CA_FILE")]
    ca_file: Option<PathBuf>,
}

impl CaFile {
    pub fn path(&self) -> Option<&Path> {
        self.ca_file.as_deref()
    }
}
