//! `faceoff dataset export`, which has moved to the Python package: it only says so.

use clap::Args;
use std::ffi::OsString;

/// Arguments of `faceoff dataset export`, which has moved to the Python package.
#[derive(Debug, Args)]
pub struct MovedExportArgs {
    /// Ignored
    #[arg(trailing_var_arg = true, allow_hyphen_values = true)]
    arguments: Vec<OsString>,
}

impl MovedExportArgs {
    pub fn run(self) -> anyhow::Result<()> {
        let Self { arguments: _ } = self;
        anyhow::bail!(
            "the Python package exports other layouts: pip install 'faceoff-robotics[dataset]', then \
             python -m faceoff.dataset export DATASET --layout 2023 --out DIR (or minari, lerobot)"
        )
    }
}
