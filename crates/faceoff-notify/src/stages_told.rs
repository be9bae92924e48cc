//! What stages keep from others.

use crate::boxed;
use faceoff_store::{Store, StoreError};
use faceoff_types::StageId;
use jiff::Timestamp;
use std::collections::HashMap;

/// Which stages hide their scores, and which boards stand still.
#[derive(Debug, Clone, Default)]
pub struct StagesTold {
    stages: HashMap<StageId, Told>,
}

#[derive(Debug, Clone)]
struct Told {
    is_blind: bool,
    frozen_at: Option<Timestamp>,
}

impl StagesTold {
    /// As they are now.
    ///
    /// # Errors
    /// If they cannot be read.
    #[boxed]
    pub async fn read(store: &Store) -> Result<Self, StoreError> {
        let frozen: HashMap<StageId, Timestamp> = store
            .frozen_boards()
            .await?
            .into_iter()
            .map(|(stage, ruling)| (stage, ruling.at))
            .collect();
        let told = store.stages().await?.into_iter().map(|stage| {
            let told = Told {
                is_blind: stage.settings.blind,
                frozen_at: frozen.get(&stage.id).copied(),
            };
            (stage.id, told)
        });
        Ok(Self {
            stages: told.collect(),
        })
    }

    /// Does everybody see what ended then, as far as its stage goes?
    #[must_use]
    pub fn shows(&self, stage: StageId, finished_at: Option<Timestamp>) -> bool {
        self.stages.get(&stage).is_some_and(|told| {
            let stands_still = |frozen| finished_at.is_none_or(|at| at > frozen);
            !told.is_blind && !told.frozen_at.is_some_and(stands_still)
        })
    }
}
