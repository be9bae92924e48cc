//! Inventory of the *runtimes* (language environments that agents can use): each one reports its content from inside the agents' sandbox.

use crate::config::AgentEnvironment;
use faceoff_sandbox::{AgentProcess, Isolation, ReadLine, Runtime, SpawnSpec};
use faceoff_types::{IMAGE_RUNTIME, PythonInventory, RuntimeContent, RuntimeInventory};
use serde::Deserialize;
use std::{
    collections::BTreeMap,
    fs,
    os::unix::fs::PermissionsExt as _,
    path::Path,
    time::{Duration, Instant},
};
use tempfile::TempDir;

/// Time limit of one runtime: far more than an interpreter takes to start and to list a few hundred packages.
const TIMEOUT: Duration = Duration::from_secs(60);
/// Maximum length of the answer: enough for about ten thousand packages.
const MAX_LINE_BYTES: usize = 1 << 20;
/// Dynamic loaders, which print the version of the C library in a runtime without an interpreter.
const LOADERS: [&str; 2] = ["/lib64/ld-linux-x86-64.so.2", "/lib/ld-linux-aarch64.so.1"];
/// Program for a runtime's Python; prints one line of JSON, a [`PythonReport`].
const SCRIPT: &str = include_str!("inventory.py");

/// Inspects each runtime of `env`, one after another, on the CPUs and within the limits of an agent. A runtime that
/// does not answer is [`RuntimeContent::Failed`], with the reason. Container images come last, if they are supported.
#[must_use]
pub fn take_inventory(env: &AgentEnvironment) -> Vec<RuntimeInventory> {
    let describe = |(name, runtime): (&String, &Runtime)| RuntimeInventory {
        name: name.clone(),
        content: inspect(env, runtime).unwrap_or_else(|reason| RuntimeContent::Failed { reason }),
    };
    let image = env.supports_images().then(|| RuntimeInventory {
        name: IMAGE_RUNTIME.to_owned(),
        content: RuntimeContent::Image,
    });
    env.runtimes.iter().map(describe).chain(image).collect()
}

/// The content of one runtime, or the reason why it is unknown.
fn inspect(env: &AgentEnvironment, runtime: &Runtime) -> Result<RuntimeContent, String> {
    if let Some(path) = runtime.read_only_paths.iter().find(|path| !path.exists()) {
        return Err(format!("{} does not exist", path.display()));
    }
    let is_unconfined = env.isolation == Isolation::None;
    let is_visible = |path: &Path| {
        is_unconfined
            || runtime
                .read_only_paths
                .iter()
                .any(|root| path.starts_with(root))
    };
    if runtime
        .interpreter()
        .is_some_and(|python| is_visible(&python))
    {
        let line = first_line(env, runtime, &["python3", "-c", SCRIPT])?;
        return serde_json::from_str::<PythonReport>(&line)
            .map(|report| RuntimeContent::Python(report.into()))
            .map_err(|error| {
                format!("expected one line of JSON from its python3, got {line:?}: {error}")
            });
    }
    let loader = LOADERS.iter().find(|loader| Path::new(loader).exists());
    let libc = loader.and_then(|loader| first_line(env, runtime, &[loader, "--version"]).ok());
    Ok(RuntimeContent::Native {
        libc: libc.as_deref().and_then(libc_version),
    })
}

/// Output of `inventory.py`.
#[derive(Deserialize)]
struct PythonReport {
    implementation: String,
    version: String,
    libc: Option<String>,
    packages: BTreeMap<String, String>,
    unusable_packages: BTreeMap<String, String>,
}

impl From<PythonReport> for PythonInventory {
    fn from(report: PythonReport) -> Self {
        Self {
            implementation: report.implementation,
            version: report.version,
            libc: report.libc,
            packages: report.packages,
            unusable_packages: report.unusable_packages,
        }
    }
}

/// The first line that `command` prints in an empty bundle.
fn first_line(
    env: &AgentEnvironment,
    runtime: &Runtime,
    command: &[&str],
) -> Result<String, String> {
    let bundle = empty_bundle().map_err(|error| format!("cannot make a folder: {error}"))?;
    let spec = SpawnSpec {
        bundle_dir: bundle.path().to_owned(),
        command: command.iter().map(|&word| word.to_owned()).collect(),
        env: BTreeMap::new(),
        logs_output: false,
        runtime: runtime.clone(),
        limits: env.limits.clone(),
        isolation: env.isolation.clone(),
        cpus: env.agent_cpus.clone(),
    };
    let mut process = AgentProcess::spawn(&spec).map_err(|error| error.to_string())?;
    let line = process
        .read_line(MAX_LINE_BYTES, Instant::now() + TIMEOUT)
        .map_err(|error| error.to_string())?;
    if let ReadLine::Line { bytes, .. } = line {
        return Ok(String::from_utf8_lossy(&bytes).into_owned());
    }
    let log = process.stderr();
    let last_line = log.lines().last().unwrap_or("it printed nothing");
    Err(format!("{} gave no answer: {last_line}", command[0]))
}

/// An empty folder that an agent running as another user can enter.
fn empty_bundle() -> std::io::Result<TempDir> {
    let folder = tempfile::tempdir()?;
    fs::set_permissions(folder.path(), fs::Permissions::from_mode(0o755))?;
    Ok(folder)
}

/// Version in a line like `ld.so (…) stable release version 2.36.`
fn libc_version(line: &str) -> Option<String> {
    let (_, version) = line.rsplit_once("version ")?;
    let version = version.trim().trim_end_matches('.');
    let is_version =
        !version.is_empty() && version.bytes().all(|b| b.is_ascii_digit() || b == b'.');
    is_version.then(|| version.to_owned())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn libc_version_is_parsed_or_absent() {
        let debian = "ld.so (Debian GLIBC 2.36-9+deb12u10) stable release version 2.36.";
        assert_eq!(libc_version(debian).as_deref(), Some("2.36"));
        for other in ["", "version", "musl libc (x86_64)", "version x.y."] {
            assert_eq!(libc_version(other), None, "{other}");
        }
    }
}
