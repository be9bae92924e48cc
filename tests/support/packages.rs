//! Python packages for agents of tests, from the package index, kept for later runs.

use crate::{bundle::copied, program, repository};
use std::{
    fs,
    path::{Path, PathBuf},
    process::Command,
};

fn target() -> PathBuf {
    let programs = program("faceoff");
    let target = programs.ancestors().nth(2);
    let target = target.expect("programs lie two folders below the target folder's");
    target.to_owned()
}

/// Where what was downloaded stays.
fn kept() -> PathBuf {
    target().join("runtimes")
}

/// The runtime `python3-ml`, made by `tests/runtimes.sh` the first time, where agents see it.
///
/// # Panics
/// If it cannot be made, as without a package index.
#[must_use]
pub fn python3_ml() -> PathBuf {
    let script = repository().join("tests/runtimes.sh");
    let folder = run(Command::new(script).arg(target()));
    Path::new(folder.trim_end_matches('\n')).join("python3-ml")
}

/// The bundle `tests/bundles/NAME`, complete.
///
/// # Panics
/// If it cannot be copied.
#[must_use]
pub fn test_bundle(name: &str, into: &Path) -> PathBuf {
    let folder = copied(
        &repository().join("tests/bundles").join(name),
        &into.join(name),
    );
    let protocol = repository().join("agents/hold/protocol.py");
    fs::copy(protocol, folder.join("protocol.py")).expect("a scratch file can be written");
    folder
}

/// Brings what `requirements.txt` of a bundle names into its folder `vendor`, as docs/sandbox.md tells teams to, for a
/// server whose Python is `version` (`3.11`).
///
/// # Panics
/// If that cannot be done, as without a package index.
pub fn vendor(bundle: &Path, version: &str) {
    // What pip fetched for an earlier test is there without the index.
    let wheels = kept().join(format!("wheels-{version}"));
    let requirements = bundle.join("requirements.txt");
    let pip = |verb: &str, place: &Path| {
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
            .arg(place);
        pip
    };
    if !wheels.exists() {
        fs::create_dir_all(kept()).expect("the target folder can be written");
        let fetched = tempfile::tempdir_in(kept()).expect("the target folder can be written");
        run(&mut pip("download", fetched.path()));
        // Another test may have been faster.
        let _ = fs::rename(fetched.path(), &wheels);
    }
    let mut install = pip("install", &bundle.join("vendor"));
    run(install.args(["--no-index", "--find-links"]).arg(&wheels));
}

/// What it prints; it must succeed.
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
