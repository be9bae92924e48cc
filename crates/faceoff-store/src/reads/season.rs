use crate::{
    error::Result,
    store::Store,
    tables::season::{self, Season},
};

impl Store {
    /// The season with its secret.
    pub async fn season(&self) -> Result<Season> {
        season::read(&mut *self.database.read.acquire().await?).await
    }
}
