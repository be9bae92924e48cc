//! The runtimes that are offered when the configuration names none.

use anyhow::{Context, ensure};
use faceoff_sandbox::Runtime;
use std::{
    collections::BTreeMap,
    path::{Path, PathBuf},
    process::Command,
};

/// What a dynamically linked program needs of a Linux host: libraries and their cache, no
/// configuration, no homes.
const SYSTEM_PATHS: [&str; 6] =
    ["/usr", "/bin", "/lib", "/lib64", "/etc/ld.so.cache", "/etc/alternatives"];
const SYSTEM_PATH: &str = "/usr/local/bin:/usr/bin:/bin";
/// Where a distribution puts its Python.
const SYSTEM_PYTHON: &str = "/usr/bin/python3";

/// `native` always; `python3` where this host has one.
pub(super) fn of_this_host() -> anyhow::Result<BTreeMap<String, Runtime>> {
    let native = Runtime {
        read_only_paths: SYSTEM_PATHS
            .iter()
            .map(PathBuf::from)
            .filter(|path| path.exists())
            .collect(),
        path: SYSTEM_PATH.to_owned(),
    };
    let mut runtimes = BTreeMap::new();
    if Path::new(SYSTEM_PYTHON).exists() {
        runtimes.insert("python3".to_owned(), native.clone());
    } else if let Some(prefix) = python_prefix()? {
        let mut python = native.clone();
        python.path = format!("{}:{SYSTEM_PATH}", prefix.join("bin").display());
        python.read_only_paths.push(prefix);
        runtimes.insert("python3".to_owned(), python);
    }
    runtimes.insert("native".to_owned(), native);
    Ok(runtimes)
}

/// The folder of the `python3` on the PATH, as it says itself (it may be a shim); `None` without one.
fn python_prefix() -> anyhow::Result<Option<PathBuf>> {
    let asked = Command::new("python3")
        .args(["-I", "-c", "import sys; print(sys.base_prefix)"])
        .output();
    let output = match asked {
        Ok(output) => output,
        Err(error) if error.kind() == std::io::ErrorKind::NotFound => return Ok(None),
        Err(error) => return Err(error).context("starting python3 to find its folder"),
    };
    ensure!(
        output.status.success(),
        "python3 ended with {} when asked for its folder; repair it, or name its folders in \
         [runtimes.python3]",
        output.status
    );
    let prefix = String::from_utf8(output.stdout).context("python3's folder is not UTF-8")?;
    Ok(Some(PathBuf::from(prefix.trim())))
}
