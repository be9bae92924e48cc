//! A new store in an empty folder.

use faceoff_store::Store;
use std::{
    env, fs,
    path::{Path, PathBuf},
};

/// Opens a store on a new data folder at this path.
///
/// Its database is a copy of a template that was migrated once, since running all migrations in hundreds of tests would
/// be slow. Each store draws its own season secret.
///
/// # Panics
/// If there is a database already, or the folder cannot be written.
pub async fn new_store(data_dir: &Path) -> Store {
    let template = Store::template(&template_folder())
        .await
        .expect("an empty database can be created next to the test program");
    fs::create_dir_all(data_dir).expect("the data folder can be created");
    let database = data_dir.join(Store::DATABASE_FILE);
    assert!(!database.exists(), "{} exists", database.display());
    fs::copy(&template, &database).expect("an empty database can be copied");
    Store::open(data_dir)
        .await
        .expect("a store can be opened on a new data folder")
}

/// Folder of the templates: inside the target folder, so that `cargo clean` removes them.
fn template_folder() -> PathBuf {
    let program = env::current_exe().expect("the path of the test program is known");
    let folder = program.parent().expect("the test program is in a folder");
    folder.join("databases")
}
