use crate::{
    EvaluationState, Store, StoreError, Submission, Team, evaluations, submissions, teams,
};
use faceoff_types::{EvaluationId, EvaluationResult};
use jiff::{Timestamp, civil::Date};
use std::collections::HashMap;

/// What a board row is made of.
#[derive(Debug, Clone)]
pub struct BoardRecord {
    /// The team.
    pub team: Team,
    /// The submission that was evaluated.
    pub submission: Submission,
    /// The team's newest finished counting evaluation.
    pub evaluation: EvaluationId,
    /// Its day.
    pub day: Date,
    /// When it was scored.
    pub finished_at: Timestamp,
    /// The score.
    pub result: EvaluationResult,
}

impl Store {
    /// What the board is made of: each team's newest finished counting evaluation, in the teams'
    /// order of names. Ranks and tiers are the scoring's.
    pub async fn board(&self) -> Result<Vec<BoardRecord>, StoreError> {
        // one snapshot for the three queries
        let mut tx = self.database.read.begin().await?;
        let mut newest: HashMap<_, _> = evaluations::newest_finished(&mut tx)
            .await?
            .into_iter()
            .map(|evaluation| (evaluation.team, evaluation))
            .collect();
        let mut board = Vec::with_capacity(newest.len());
        for team in teams::all(&mut tx).await? {
            let Some(evaluation) = newest.remove(&team.id) else {
                continue;
            };
            let EvaluationState::Finished {
                finished_at,
                result,
                ..
            } = evaluation.state
            else {
                continue;
            };
            board.push(BoardRecord {
                team,
                submission: submissions::find(&mut tx, evaluation.submission).await?,
                evaluation: evaluation.id,
                day: evaluation.day,
                finished_at,
                result: *result,
            });
        }
        Ok(board)
    }
}
