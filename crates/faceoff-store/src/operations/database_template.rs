//! An empty database with the current schema, which tests copy instead of running all migrations.

use crate::{
    boxed_future,
    database::Database,
    error::{Result, StoreError},
    schema,
    store::Store,
};
use std::{
    fs, io,
    path::{Path, PathBuf},
};
use uuid::Uuid;

impl Store {
    /// Name of the database in a data folder.
    pub const DATABASE_FILE: &'static str = "faceoff.sqlite3";

    /// Path of an empty database in `folder` with this program's schema, without even a season. Created if missing. A
    /// copy of it in a new data folder spares [`Store::open`] the migrations.
    ///
    /// # Errors
    /// [`StoreError::Database`] if it cannot be written.
    #[boxed_future]
    pub async fn template(folder: &Path) -> Result<PathBuf> {
        let digest = schema::digest();
        let template = folder.join(format!("{}.sqlite3", digest.to_hex()));
        if template.exists() {
            return Ok(template);
        }
        let io_error = |error: io::Error| StoreError::Database(sqlx::Error::Io(error));
        fs::create_dir_all(folder).map_err(io_error)?;
        // Several processes may create the file concurrently, and none may see an incomplete one.
        let unfinished = folder.join(format!("{}.sqlite3", Uuid::now_v7()));
        let database = Database::open(&unfinished).await?;
        // Closing the last connection writes the log back into the file.
        database.close().await;
        fs::rename(&unfinished, &template).map_err(io_error)?;
        Ok(template)
    }
}
