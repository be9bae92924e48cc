use clap::Args;
use std::ffi::OsString;

/// What `faceoff dataset export` was given, which is Python's now.
#[derive(Debug, Args)]
pub struct MovedArgs {
    /// Ignored
    #[arg(trailing_var_arg = true, allow_hyphen_values = true)]
    arguments: Vec<OsString>,
}

impl MovedArgs {
    pub fn run(self) -> anyhow::Result<()> {
        let Self { arguments: _ } = self;
        anyhow::bail!(
            "other layouts are written by the Python package: pip install 'faceoff[dataset]', then \
             python -m faceoff.dataset export DATASET --layout 2023 --out DIR (or minari, lerobot)"
        )
    }
}
