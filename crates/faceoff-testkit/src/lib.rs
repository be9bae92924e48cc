//! What tests of several crates set up.
#![expect(
    clippy::expect_used,
    reason = "helpers of tests fail as tests do: by panicking"
)]

use faceoff_store::Store;
use std::{
    env, fs,
    path::{Path, PathBuf},
};

/// A store on a new data folder at this path.
///
/// Its database is a copy of one that was migrated once for all tests: hundreds of them open a new one, and each would
/// run every migration. The season's secret is drawn anew.
///
/// # Panics
/// If there is a database already, or the folder cannot be written.
pub async fn new_store(data_dir: &Path) -> Store {
    let template = Store::template(&templates())
        .await
        .expect("an empty database can be made beside the test's program");
    fs::create_dir_all(data_dir).expect("the data folder can be made");
    let database = data_dir.join(Store::DATABASE_FILE);
    assert!(!database.exists(), "{} exists", database.display());
    fs::copy(&template, &database).expect("an empty database can be copied");
    Store::open(data_dir)
        .await
        .expect("a store opens on a new data folder")
}

/// In the target folder, so that `cargo clean` removes them.
fn templates() -> PathBuf {
    let program = env::current_exe().expect("a test knows where its program is");
    let folder = program.parent().expect("a program is in a folder");
    folder.join("databases")
}
