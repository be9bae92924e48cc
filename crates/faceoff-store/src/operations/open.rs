use crate::{
    artifacts::Artifacts,
    boxed,
    database::Database,
    error::{Result, StoreError},
    live::LiveGames,
    pulse::Pulse,
    room::Room,
    signals::Signals,
    store::Store,
    tables::{archived, season},
    workers::Workers,
};
use std::{fs::File, path::Path, sync::Arc};

impl Store {
    /// Opens `data_dir/faceoff.sqlite3` and `data_dir/artifacts`, creating and migrating them as
    /// needed, and draws the season's secret on the first time.
    #[boxed]
    pub async fn open(data_dir: &Path) -> Result<Self> {
        // Two processes that start together must not both migrate.
        let _opening = lock_folder(data_dir.to_owned()).await?;
        let artifacts = Artifacts::open(&data_dir.join("artifacts"))?;
        let database = Database::open(&data_dir.join(Self::DATABASE_FILE)).await?;
        let mut tx = database.begin().await?;
        season::draw_secret_once(&mut tx).await?;
        let archived = archived::read(&mut tx).await?;
        tx.commit().await?;
        Ok(Self {
            database,
            signals: Arc::new(Signals::new()),
            artifacts,
            room: Arc::new(Room::new(vec![data_dir.to_owned()], 0)),
            pulse: Arc::new(Pulse::new()),
            live: LiveGames::default(),
            workers: Workers::default(),
            archived: archived.map(Arc::new),
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
