//! Shared code of the end-to-end tests: the real `faceoff` program as a child process, bundles on disk, and an HTTP client
//! that does not use the server's types.

pub mod browser;
pub mod bucket;
pub mod bundle;
pub mod faketime;
pub mod nats;
pub mod packages;
pub mod relay;
pub mod server;
pub mod small_disk;
pub mod worker;

use std::path::PathBuf;

/// The root folder of this repository.
#[must_use]
pub fn repository() -> PathBuf {
    PathBuf::from(env!("CARGO_MANIFEST_DIR"))
        .parent()
        .expect("tests/ is in the repository's root")
        .to_path_buf()
}

/// A program of this workspace, built beside the running test.
///
/// # Panics
/// If it has not been built; `make test` builds all programs before it runs a test.
#[must_use]
pub fn program(name: &str) -> PathBuf {
    let test = std::env::current_exe().expect("a running test has a path");
    // <target>/<profile>/deps/<test>
    let folder = test
        .ancestors()
        .nth(2)
        .expect("a test is two folders below the target folder");
    let program = folder.join(name);
    assert!(
        program.is_file(),
        "{} is not built; run `make test`, or `cargo build --workspace --bins` first",
        program.display()
    );
    program
}
