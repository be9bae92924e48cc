//! Python packages for test agents, from the package index and cached for later runs.

use crate::{bundle::copy_folder, program, repository};
use std::{
    fs,
    path::{Path, PathBuf},
    process::Command,
};

/// Cargo's target folder.
fn target() -> PathBuf {
    let programs = program("faceoff");
    let target = programs.ancestors().nth(2);
    let target = target.expect("programs are two folders below the target folder");
    target.to_owned()
}

/// The folder for downloaded packages.
fn download_cache() -> PathBuf {
    target().join("runtimes")
}

/// The folder of the runtime `python3-ml`, which `tests/runtimes.sh` makes the first time.
///
/// # Panics
/// If it cannot be made, for example without a package index.
#[must_use]
pub fn python3_ml() -> PathBuf {
    let script = repository().join("tests/runtimes.sh");
    let folder = run(Command::new(script).arg(target()));
    Path::new(folder.trim_end_matches('\n')).join("python3-ml")
}

/// Copies the bundle `tests/bundles/NAME` below `scratch`, with the protocol module that it needs.
///
/// # Panics
/// If it cannot be copied.
#[must_use]
pub fn test_bundle(name: &str, scratch: &Path) -> PathBuf {
    let folder = scratch.join(name);
    copy_folder(&repository().join("tests/bundles").join(name), &folder);
    let protocol = repository().join("agents/hold/protocol.py");
    fs::copy(protocol, folder.join("protocol.py")).expect("a scratch file can be written");
    folder
}

/// Installs the packages of a bundle's `requirements.txt` into its folder `vendor`, as docs/sandbox.md describes, for a
/// server with this version of Python (`3.11`).
///
/// # Panics
/// If the installation fails, for example without a package index.
pub fn vendor(bundle: &Path, version: &str) {
    // Packages that an earlier test downloaded need no index.
    let wheels = download_cache().join(format!("wheels-{version}"));
    let requirements = bundle.join("requirements.txt");
    let pip = |verb: &str, target: &Path| {
        let mut pip = Command::new("/usr/bin/python3");
        pip.args(["-m", "pip", "--disable-pip-version-check", verb])
            .args([
                "--quiet",
                "--only-binary",
                ":all:",
                "--python-version",
                version,
            ])
            .args(["--platform", "manylinux2014_x86_64", "--requirement"])
            .arg(&requirements)
            .arg(if verb == "download" {
                "--dest"
            } else {
                "--target"
            })
            .arg(target);
        pip
    };
    if !wheels.exists() {
        fs::create_dir_all(download_cache()).expect("the target folder can be written");
        let fetched =
            tempfile::tempdir_in(download_cache()).expect("the target folder can be written");
        run(&mut pip("download", fetched.path()));
        // A concurrent test may have created the folder.
        let _ = fs::rename(fetched.path(), &wheels);
    }
    let mut install = pip("install", &bundle.join("vendor"));
    run(install.args(["--no-index", "--find-links"]).arg(&wheels));
}

/// Runs a command that must succeed; returns its output.
fn run(command: &mut Command) -> String {
    let output = command.output().expect("the program can be started");
    assert!(
        output.status.success(),
        "{command:?}: {}{}",
        String::from_utf8_lossy(&output.stdout),
        String::from_utf8_lossy(&output.stderr)
    );
    String::from_utf8(output.stdout).expect("scripts and pip print text")
}
