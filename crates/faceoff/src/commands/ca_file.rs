use clap::Args;
use std::path::{Path, PathBuf};

/// Whom to believe that they are the server.
#[derive(Debug, Args)]
pub struct CaFile {
    /// Also believe the certificate authorities of this file (PEM): for a server behind TLS whose certificate is its
    /// organisers' own
    #[arg(long, global = true, value_name = "FILE", env = "FACEOFF_CA_FILE")]
    ca_file: Option<PathBuf>,
}

impl CaFile {
    pub fn path(&self) -> Option<&Path> {
        self.ca_file.as_deref()
    }
}
