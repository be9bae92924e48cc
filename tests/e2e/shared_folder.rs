//! Folders that several tests need, such as the data folder of a server with a finished evaluation. The first test of a run makes one, and
//! each test copies it.

use crate::CONFIG;
use faceoff_tests::{bundle::copy_folder, server::Server};
use std::{
    fs::{self, File},
    path::{Path, PathBuf},
    sync::LazyLock,
    time::Duration,
};
use uuid::Uuid;

/// Folders of other test runs are removed after this time. No run takes as long.
const MAX_AGE: Duration = Duration::from_hours(24);

/// Names this test run. `cargo test` has no name for it, but runs all tests in one process.
static RUN: LazyLock<String> = LazyLock::new(|| {
    std::env::var("NEXTEST_RUN_ID").unwrap_or_else(|_| Uuid::now_v7().to_string())
});

/// The folder of this name. The first test that asks for it in a test run calls `make`, which fills it; other tests wait meanwhile. Tests
/// copy what they change.
///
/// # Panics
/// If the folder cannot be made. The next test tries it again.
pub(crate) fn shared_folder(name: &str, make: impl FnOnce(&Path)) -> PathBuf {
    let runs = Path::new(env!("CARGO_TARGET_TMPDIR")).join("shared-folders");
    let run = runs.join(RUN.as_str());
    if !run.exists() {
        remove_old(&runs);
    }
    fs::create_dir_all(&run).expect("a folder for test data can be made");
    let lock = File::create(run.join(format!("{name}.lock"))).expect("a lock file can be made");
    lock.lock().expect("a file can be locked");
    let folder = run.join(name);
    if !folder.exists() {
        let unfinished = run.join(format!("{name}.unfinished"));
        // A test that failed meanwhile has left it.
        let _ = fs::remove_dir_all(&unfinished);
        fs::create_dir(&unfinished).expect("a folder for test data can be made");
        make(&unfinished);
        fs::rename(&unfinished, &folder).expect("a folder for test data can be renamed");
    }
    folder
}

fn remove_old(runs: &Path) {
    for entry in fs::read_dir(runs).into_iter().flatten().flatten() {
        let age = entry.metadata().and_then(|metadata| metadata.modified());
        let age = age.ok().and_then(|modified| modified.elapsed().ok());
        if age.is_some_and(|age| age > MAX_AGE) {
            // Another run may be removing it, too.
            let _ = fs::remove_dir_all(entry.path());
        }
    }
}

/// Starts a server on a copy of a shared data folder. For the first test, `prepare` gets a server with a new data folder, and a scratch
/// folder. It creates what the tests need and returns a path on that server, which every test gets with its server.
pub(crate) fn start_prepared(
    name: &str,
    scratch: &Path,
    prepare: impl FnOnce(&Server, &Path) -> String,
) -> (Server, String) {
    let shared = shared_folder(name, |folder| {
        let server = Server::start(&folder.join("data"), CONFIG);
        let path = prepare(&server, folder);
        server.kill();
        fs::write(folder.join("path"), path).expect("test data can be written");
    });
    let data_dir = scratch.join("data");
    copy_folder(&shared.join("data"), &data_dir);
    let path = fs::read_to_string(shared.join("path")).expect("the path was written");
    (Server::start(&data_dir, CONFIG), path)
}
