//! Opening of a data folder: its database, its artifacts and the season in it.

use crate::{
    artifacts::Artifacts,
    boxed_future,
    database::Database,
    error::{Result, StoreError},
    free_space::FreeSpace,
    health_probes::HealthProbes,
    signals::Signals,
    store::Store,
    tables::{archive, season},
};
use std::{fs::File, path::Path, sync::Arc};

impl Store {
    /// Opens `data_dir/faceoff.sqlite3` and `data_dir/artifacts`, creating and migrating them as
    /// needed. On the first start it draws the season's secret, from which all seeds are derived.
    #[boxed_future]
    pub async fn open(data_dir: &Path) -> Result<Self> {
        // Two processes that start at the same time must not both migrate.
        let _folder_lock = lock_folder(data_dir.to_owned()).await?;
        let artifacts = Artifacts::open(&data_dir.join("artifacts"))?;
        let database = Database::open(&data_dir.join(Self::DATABASE_FILE)).await?;
        let mut tx = database.begin().await?;
        season::create_once(&mut tx).await?;
        let archived = archive::read(&mut tx).await?;
        tx.commit().await?;
        Ok(Self {
            database,
            signals: Arc::new(Signals::new()),
            artifacts,
            free_space: Arc::new(FreeSpace::new(vec![data_dir.to_owned()], 0)),
            probes: Arc::new(HealthProbes::new()),
            archive: archived.map(Arc::new),
        })
    }
}

/// Creates the folder and holds its lock until the file is dropped (or the process dies).
async fn lock_folder(data_dir: std::path::PathBuf) -> Result<File> {
    let lock = move || {
        std::fs::create_dir_all(&data_dir)?;
        let file = File::create(data_dir.join("faceoff.lock"))?;
        file.lock()?;
        Ok(file)
    };
    tokio::task::spawn_blocking(lock)
        .await
        .unwrap_or_else(|panic| Err(std::io::Error::other(panic)))
        .map_err(|error| StoreError::Database(sqlx::Error::Io(error)))
}
