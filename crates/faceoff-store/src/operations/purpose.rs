use crate::{
    error::{Result, StoreError},
    queue::{Lane, NewUnit},
    tables::{
        drafts, finalisations, games,
        shards::{self, Shard},
        smoke_runs,
    },
};
use faceoff_types::{EvaluationId, GameId, ProposalId, RunId, SubmissionId};
use sqlx::SqliteConnection;
use uuid::Uuid;

/// What there is to do. The queue knows it as a label.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Kind {
    Smoke,
    Finalise,
    Shard,
    Game,
}

impl Kind {
    const ALL: [Self; 4] = [Self::Smoke, Self::Finalise, Self::Shard, Self::Game];

    const fn label(self) -> &'static str {
        match self {
            Self::Smoke => "smoke",
            Self::Finalise => "finalise",
            Self::Shard => "shard",
            Self::Game => "game",
        }
    }

    const fn waiting_in(self, lane: Lane) -> NewUnit {
        NewUnit {
            kind: self.label(),
            lane,
            batch: 0,
            rest_s: 0,
        }
    }
}

const fn lane(name: &'static str, urgency: u32, rank: u32) -> Lane {
    Lane {
        name,
        urgency,
        rank,
    }
}

// A finalisation runs no agent, is the platform's own, and ends what has had its turn. Smoke runs, shards and games of
// rounds share the slots equally, so that none makes the others wait for long. Ablations, trials, proposals and all
// other games do not count: they have what is left.
pub(crate) const FINALISE: NewUnit = Kind::Finalise.waiting_in(lane("finalise", 0, 0));
pub(crate) const SMOKE: NewUnit = Kind::Smoke.waiting_in(lane("smoke", 1, 0));
pub(crate) const SHARD: NewUnit = Kind::Shard.waiting_in(lane("shard", 1, 1));
pub(crate) const ABLATION_SHARD: NewUnit = Kind::Shard.waiting_in(lane("ablation", 2, 0));
pub(crate) const ROUND_GAME: NewUnit = Kind::Game.waiting_in(lane("game", 1, 2));
pub(crate) const FREE_GAME: NewUnit = Kind::Game.waiting_in(lane("free_game", 2, 2));
pub(crate) const REPLAY_GAME: NewUnit = Kind::Game.waiting_in(lane("replay", 2, 3));
pub(crate) const PROPOSAL_SHARD: NewUnit = Kind::Shard.waiting_in(lane("proposal", 2, 1));

/// Which work is asked for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Lot {
    All,
    /// What is played: shards and games.
    Plays,
    /// What is not: smoke runs and finalisations.
    Rest,
}

impl Lot {
    /// The names of its lanes, as a JSON array.
    pub(crate) const fn lanes(self) -> &'static str {
        match self {
            Self::All => {
                r#"["finalise","smoke","shard","ablation","proposal","game","free_game","replay"]"#
            }
            Self::Plays => r#"["shard","ablation","proposal","game","free_game","replay"]"#,
            Self::Rest => r#"["finalise","smoke"]"#,
        }
    }
}

/// Finalisations are done for nobody in particular, in the order in which evaluations were played.
pub(crate) const PLATFORM: &str = "";

/// What a unit of work is for.
#[derive(Debug)]
pub(crate) enum Purpose {
    Smoke(SubmissionId),
    Game(GameId),
    Shard {
        run: RunId,
        shard: Shard,
    },
    Finalise(EvaluationId),
    FinaliseDraft {
        id: EvaluationId,
        run: RunId,
        proposal: ProposalId,
    },
}

/// What the unit with this label is for: the row that refers to it.
pub(crate) async fn of_unit(
    connection: &mut SqliteConnection,
    unit: Uuid,
    label: &str,
) -> Result<Purpose> {
    let purpose = match Kind::ALL.into_iter().find(|kind| kind.label() == label) {
        Some(Kind::Smoke) => smoke_runs::of_unit(connection, unit)
            .await?
            .map(Purpose::Smoke),
        Some(Kind::Game) => games::of_unit(connection, unit).await?.map(Purpose::Game),
        Some(Kind::Shard) => shards::of_unit(connection, unit)
            .await?
            .map(|(run, shard)| Purpose::Shard { run, shard }),
        // Applied, a draft is an evaluation.
        Some(Kind::Finalise) => match finalisations::of_unit(connection, unit).await? {
            Some(id) => Some(Purpose::Finalise(id)),
            None => drafts::of_finalisation(connection, unit)
                .await?
                .map(|(id, run, proposal)| Purpose::FinaliseDraft { id, run, proposal }),
        },
        None => None,
    };
    purpose.ok_or_else(|| {
        StoreError::Damaged(format!(
            "unit {unit}: it is labelled {label:?}, and no such row refers to it"
        ))
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_lane_is_somebodys() {
        let units = [
            FINALISE,
            SMOKE,
            SHARD,
            ABLATION_SHARD,
            PROPOSAL_SHARD,
            ROUND_GAME,
            FREE_GAME,
            REPLAY_GAME,
        ];
        let lanes =
            |lot: Lot| serde_json::from_str::<Vec<String>>(lot.lanes()).expect("it is JSON");
        let (all, plays, rest) = (lanes(Lot::All), lanes(Lot::Plays), lanes(Lot::Rest));
        assert_eq!(
            (all.len(), plays.len() + rest.len()),
            (units.len(), units.len())
        );
        for unit in units {
            let lane = unit.lane.name.to_owned();
            assert!(all.contains(&lane), "{lane}");
            let is_played = matches!(unit.kind, "shard" | "game");
            assert_eq!(plays.contains(&lane), is_played, "{lane}");
            assert_eq!(rest.contains(&lane), !is_played, "{lane}");
        }
    }
}
