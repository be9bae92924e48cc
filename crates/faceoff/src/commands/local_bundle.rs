//! A developer's own bundles, as `eval` and `play` run them.

use crate::{config::Config, packing::Selection};
use anyhow::Context;
use faceoff_runner::{
    AgentEnvironment,
    bundle::{self, Bundle, BundleLimits},
};
use faceoff_sandbox::{Isolation, Runtime, RuntimeFiles};
use std::{
    fs::{self, File},
    path::Path,
};
use tempfile::TempDir;

/// A folder for bundles and recordings under way, beside the results and not in /tmp: a recording may be
/// larger than a memory file system. An agent of another user can pass through.
pub(super) fn scratch_in(out: &Path) -> anyhow::Result<TempDir> {
    tempfile::Builder::new()
        .prefix(".eval-")
        .permissions(std::os::unix::fs::PermissionsExt::from_mode(0o755))
        .tempdir_in(out)
        .with_context(|| format!("making a folder in {}", out.display()))
}

/// A folder is packed as `faceoff submit` packs it and unpacked as the server does, so that here is what will be there,
/// and what the server would refuse is refused; without a sandbox it is used in place.
pub(super) fn open(
    path: &Path,
    scratch: &Path,
    no_sandbox: bool,
    limits: &BundleLimits,
) -> anyhow::Result<Bundle> {
    if !path.is_dir() || no_sandbox {
        return Ok(bundle::open(path, scratch, limits)?);
    }
    let archive = scratch.join("bundle.tar.gz");
    let file = File::create(&archive).with_context(|| format!("making {}", archive.display()))?;
    Selection::of(path)?.pack(file)?;
    let bundle = bundle::open(&archive, scratch, limits)?;
    fs::remove_file(&archive).with_context(|| format!("removing {}", archive.display()))?;
    Ok(bundle)
}

/// The server's limits, and what separates the agent from the host, if anything does.
pub(super) fn environment(config: &Config, runtime: &str, no_sandbox: bool) -> AgentEnvironment {
    let mut env = config.agent_environment();
    if no_sandbox {
        env.isolation = Isolation::None;
        // The developer's own machine offers whatever the developer's PATH finds.
        let path = std::env::var("PATH").unwrap_or_default();
        env.runtimes.insert(
            runtime.to_owned(),
            Runtime {
                read_only_paths: Vec::new(),
                path,
                files: RuntimeFiles::Host,
            },
        );
    }
    env
}
