use crate::{
    error::Result,
    store::Store,
    tables::season::{self, Season},
};
use jiff::civil::Date;

impl Store {
    /// The season with its secret.
    pub async fn season(&self) -> Result<Season> {
        season::read(&mut *self.database.read.acquire().await?).await
    }

    /// The last UTC day that the daily schedule has started; `None` before the first.
    pub async fn last_scheduled_day(&self) -> Result<Option<Date>> {
        season::last_scheduled_day(&mut *self.database.read.acquire().await?).await
    }
}
