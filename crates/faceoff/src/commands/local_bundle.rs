//! Bundles that `eval` and `play` run on a developer's machine.

use crate::{
    competition::competition,
    config::{Config, RuntimeConfig},
    packing::Selection,
    user_scope,
};
use anyhow::{Context, bail};
use faceoff_runner::{
    AgentEnvironment,
    bundle::{self, Bundle, BundleLimits},
};
use faceoff_sandbox::{Isolation, Layer, Runtime, RuntimeFiles, unavailable_layers};
use faceoff_types::IMAGE_RUNTIME;
use std::{
    fs::{self, File},
    path::{Path, PathBuf},
};
use tempfile::TempDir;

/// Creates a folder for unpacked bundles and unfinished recordings. It is beside the results and not in /tmp, because a
/// recording may be larger than a memory file system. An agent that runs as another user can traverse it.
pub(super) fn create_scratch(out: &Path) -> anyhow::Result<TempDir> {
    tempfile::Builder::new()
        .prefix(".eval-")
        .permissions(std::os::unix::fs::PermissionsExt::from_mode(0o755))
        .tempdir_in(out)
        .with_context(|| format!("creating a folder in {}", out.display()))
}

/// Opens a bundle. A folder is packed like `faceoff submit` and unpacked like the server, so that the same files are
/// evaluated and the same bundles refused. Without a sandbox, the folder is used in place.
pub(super) fn open(
    path: &Path,
    scratch: &Path,
    no_sandbox: bool,
    limits: &BundleLimits,
) -> anyhow::Result<Bundle> {
    let open = |path: &Path| -> anyhow::Result<Bundle> {
        let bundle = bundle::open(path, scratch, limits)?;
        bundle::check_interpolation(&bundle, competition())?;
        Ok(bundle)
    };
    if !path.is_dir() || no_sandbox {
        return open(path);
    }
    let archive = scratch.join("bundle.tar.gz");
    let file = File::create(&archive).with_context(|| format!("creating {}", archive.display()))?;
    Selection::read(path)?.pack(file)?;
    let bundle = open(&archive)?;
    fs::remove_file(&archive).with_context(|| format!("removing {}", archive.display()))?;
    Ok(bundle)
}

/// Gives up the layers of the sandbox that are not available to this user on this host: developers run their own agents, which they
/// could also run without a sandbox. If a layer of control groups is missing, the command is first restarted in a systemd scope that
/// may provide it. Returns a note with the missing layers, if any.
///
/// # Errors
/// If a bundle is an archive, which may be another team's, and a layer is missing that keeps agents from the user's files and the
/// network; or if no process can be started.
pub(super) fn give_up_unavailable_layers(
    config: &mut Config,
    bundles: &[&Path],
) -> anyhow::Result<Option<String>> {
    let given_up = &mut config.sandbox.given_up;
    let wanted: Vec<Layer> = Layer::ALL
        .into_iter()
        .filter(|layer| !given_up.contains(layer))
        .collect();
    let missing: Vec<Layer> = unavailable_layers(&wanted)
        .map_err(|error| anyhow::anyhow!("the sandbox cannot be tried: {error}"))?
        .into_iter()
        .map(|feature| feature.layer)
        .collect();
    let cgroups = [Layer::CgroupMemory, Layer::CgroupPids, Layer::CgroupCpu];
    if missing.iter().any(|layer| cgroups.contains(layer)) {
        user_scope::enter();
    }
    let protection = [Layer::Namespaces, Layer::Seccomp];
    let missing_protection = missing.iter().find(|layer| protection.contains(layer));
    let archive = bundles.iter().find(|bundle| !bundle.is_dir());
    if let (Some(layer), Some(archive)) = (missing_protection, archive) {
        bail!(
            "this user cannot get the layer {layer} of the sandbox, without which an agent can read this user's files, and {} may be \
             another team's; `faceoff doctor` says how to get the layer. If you trust the agent, add --no-sandbox",
            archive.display()
        );
    }
    given_up.extend(&missing);
    let names: Vec<&str> = missing.iter().map(|layer| layer.as_str()).collect();
    Ok((!names.is_empty()).then(|| {
        format!(
            "note: your agent runs without these layers of the server's sandbox, which this user cannot get here: {}; `faceoff doctor` \
             says how",
            names.join(", ")
        )
    }))
}

/// The runtime that an organiser makes with `docker/runtime.sh`.
const ML_RUNTIME: &str = "python3-ml";

/// Uses `python3-ml` from its default folders if it is there and not configured.
pub(super) fn adopt_default_runtime(config: &mut Config) {
    let has_python = |folder: &PathBuf| folder.join("bin/python3").exists();
    if !config.runtimes.contains_key(ML_RUNTIME)
        && let Some(folder) = default_folders().into_iter().find(has_python)
    {
        let runtime = RuntimeConfig::Folder(folder);
        config.runtimes.insert(ML_RUNTIME.to_owned(), runtime);
    }
}

/// Checks that this machine has a bundle's runtime.
///
/// # Errors
/// If it does not; the error says how to get it.
pub(super) fn check_runtime(config: &Config, runtime: &str) -> anyhow::Result<()> {
    let built_in = ["native", "python3", IMAGE_RUNTIME];
    if built_in.contains(&runtime) || config.runtimes.contains_key(runtime) {
        return config.check_runtime(runtime);
    }
    let missing =
        format!("agent.toml names the runtime {runtime:?}, which this machine does not have");
    if runtime == ML_RUNTIME {
        let folders = default_folders();
        let places: Vec<String> = folders
            .iter()
            .map(|folder| folder.display().to_string())
            .collect();
        bail!(
            "{missing} in {}. Make it with Faceoff's sources: docker/runtime.sh {}",
            places.join(" or "),
            places[0]
        );
    }
    let configured = config.runtimes.keys().map(String::as_str);
    let offered: Vec<&str> = ["native", "python3"]
        .into_iter()
        .chain(configured)
        .collect();
    bail!(
        "{missing}; it has {}. Name another one, or configure it in faceoff.toml: [runtimes.{runtime}]",
        offered.join(", ")
    );
}

/// The folders in which `python3-ml` is looked for: below the user's data folder, then the folder that the documentation names.
fn default_folders() -> Vec<PathBuf> {
    let data = std::env::var_os("XDG_DATA_HOME").map(PathBuf::from);
    let data = data.filter(|folder| folder.is_absolute()).or_else(|| {
        let home = std::env::var_os("HOME").map(PathBuf::from)?;
        home.is_absolute().then(|| home.join(".local/share"))
    });
    data.map(|data| data.join("faceoff"))
        .into_iter()
        .chain([PathBuf::from("/srv/faceoff")])
        .map(|folder| folder.join(ML_RUNTIME))
        .collect()
}

/// The environment of an agent: with the server's limits and isolation, or without isolation if `no_sandbox`.
pub(super) fn environment(config: &Config, runtime: &str, no_sandbox: bool) -> AgentEnvironment {
    let mut env = config.agent_environment();
    if no_sandbox {
        env.isolation = Isolation::None;
        // Without a sandbox, the developer's own PATH applies.
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
