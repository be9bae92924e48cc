//! Whose work is.

use crate::{error::Result, queue, store::Store};
use uuid::Uuid;

impl Store {
    /// Is a unit of work still its holder's? Its time may be over, as long as nobody else has it.
    pub async fn is_held(&self, unit: Uuid, nonce: Uuid) -> Result<bool> {
        queue::is_leased(&mut *self.database.read.acquire().await?, unit, nonce).await
    }
}
