//! Visibility of the stages' results.

use crate::boxed;
use faceoff_store::{Store, StoreError};
use faceoff_types::StageId;
use jiff::Timestamp;
use std::collections::HashMap;

/// Which stages are blind, and which have frozen boards.
#[derive(Debug, Clone, Default)]
pub struct StageVisibility {
    stages: HashMap<StageId, StageState>,
}

#[derive(Debug, Clone)]
struct StageState {
    is_blind: bool,
    frozen_at: Option<Timestamp>,
}

impl StageVisibility {
    /// Reads the current state.
    ///
    /// # Errors
    /// If the database cannot be read.
    #[boxed]
    pub async fn read(store: &Store) -> Result<Self, StoreError> {
        let frozen: HashMap<StageId, Timestamp> = store
            .frozen_boards()
            .await?
            .into_iter()
            .map(|(stage, ruling)| (stage, ruling.at))
            .collect();
        let stages = store.stages().await?.into_iter().map(|stage| {
            let state = StageState {
                is_blind: stage.settings.blind,
                frozen_at: frozen.get(&stage.id).copied(),
            };
            (stage.id, state)
        });
        Ok(Self {
            stages: stages.collect(),
        })
    }

    /// Whether the stage's settings let the public see a result that finished at `finished_at`.
    #[must_use]
    pub fn is_result_visible(&self, stage: StageId, finished_at: Option<Timestamp>) -> bool {
        self.stages.get(&stage).is_some_and(|state| {
            let is_after = |frozen| finished_at.is_none_or(|at| at > frozen);
            !state.is_blind && !state.frozen_at.is_some_and(is_after)
        })
    }
}
