//! Answers that take some work, kept until something of the season changes.

use crate::problem::Problem;
use faceoff_store::Store;
use faceoff_types::TournamentId;
use std::{collections::HashMap, sync::Arc};
use tokio::sync::Mutex;

/// Tournaments whose answers are kept; a season has a few.
const KEPT: usize = 20;

/// By tournament what was worked out, and the id of the newest change that it has. One is worked out at a time: the
/// slots need the processors.
#[derive(Debug)]
pub struct Kept<T> {
    answers: Mutex<HashMap<TournamentId, (i64, Arc<T>)>>,
}

impl<T> Default for Kept<T> {
    fn default() -> Self {
        Self {
            answers: Mutex::default(),
        }
    }
}

impl<T> Kept<T> {
    /// What was kept since the newest change; else what `make` makes, which is kept.
    pub async fn get(
        &self,
        store: &Store,
        id: TournamentId,
        make: impl AsyncFnOnce() -> Result<T, Problem>,
    ) -> Result<Arc<T>, Problem> {
        let mut answers = self.answers.lock().await;
        // Before it is made: a change in between makes it anew next time.
        let change = store.newest_change().await?;
        if let Some((_, answer)) = answers.get(&id).filter(|(kept_at, _)| *kept_at == change) {
            return Ok(Arc::clone(answer));
        }
        let answer = Arc::new(make().await?);
        if answers.len() >= KEPT && !answers.contains_key(&id) {
            answers.clear();
        }
        answers.insert(id, (change, Arc::clone(&answer)));
        Ok(answer)
    }
}
