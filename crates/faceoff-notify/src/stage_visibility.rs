//! Visibility of the stages' results to the public. The results of a *blind* stage are hidden until the organisers reveal
//! them; after a stage's boards are *frozen*, new results are hidden.

use crate::boxed_future;
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
    #[boxed_future]
    pub async fn read(store: &Store) -> Result<Self, StoreError> {
        let freeze_times: HashMap<StageId, Timestamp> = store
            .frozen_boards()
            .await?
            .into_iter()
            .map(|(stage, decision)| (stage, decision.at))
            .collect();
        let stages = store.stages().await?.into_iter().map(|stage| {
            let state = StageState {
                is_blind: stage.settings.blind,
                frozen_at: freeze_times.get(&stage.id).copied(),
            };
            (stage.id, state)
        });
        Ok(Self {
            stages: stages.collect(),
        })
    }

    /// Whether the stage lets the public see a result. `finished_at` is `None` for one that is not finished.
    #[must_use]
    pub fn is_result_visible(&self, stage: StageId, finished_at: Option<Timestamp>) -> bool {
        self.stages.get(&stage).is_some_and(|state| {
            let is_hidden_by_freeze =
                |frozen_at| finished_at.is_none_or(|finished_at| finished_at > frozen_at);
            !state.is_blind && !state.frozen_at.is_some_and(is_hidden_by_freeze)
        })
    }
}
