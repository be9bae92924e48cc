//! Whose work is.

use crate::{boxed, error::Result, queue, store::Store, workers::WorkerName};
use uuid::Uuid;

impl Store {
    /// Is a unit of work still its holder's? Its time may be over, as long as nobody else has it.
    #[boxed]
    pub async fn is_held(&self, unit: Uuid, nonce: Uuid) -> Result<bool> {
        queue::is_leased(&mut *self.database.read.acquire().await?, unit, nonce).await
    }

    /// Whose a unit of work is, if it is somebody's under this nonce.
    #[boxed]
    pub async fn lease_holder(&self, unit: Uuid, nonce: Uuid) -> Result<Option<String>> {
        queue::holder_of(&mut *self.database.read.acquire().await?, unit, nonce).await
    }

    /// Is a unit of work this worker's, under this nonce, and has it begun? What was given out is nobody's before.
    #[boxed]
    pub async fn is_of(&self, worker: &WorkerName, unit: Uuid, nonce: Uuid) -> Result<bool> {
        let holder = self.lease_holder(unit, nonce).await?;
        let slots = format!("{}/", worker.holder());
        Ok(holder.is_some_and(|holder| holder.starts_with(&slots)))
    }
}
