use crate::{
    error::{Result, StoreError},
    queue::NewUnit,
    tables::{
        finalisations,
        shards::{self, Shard},
        smoke_runs,
    },
};
use faceoff_types::{EvaluationId, RunId, SubmissionId};
use sqlx::SqliteConnection;
use uuid::Uuid;

/// What there is to do. The queue knows it as a label.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Kind {
    Smoke,
    Finalise,
    Shard,
}

impl Kind {
    const ALL: [Self; 3] = [Self::Smoke, Self::Finalise, Self::Shard];

    const fn label(self) -> &'static str {
        match self {
            Self::Smoke => "smoke",
            Self::Finalise => "finalise",
            Self::Shard => "shard",
        }
    }

    const fn urgency(self, urgency: u32) -> NewUnit {
        NewUnit {
            kind: self.label(),
            urgency,
            rest_s: 0,
        }
    }
}

// Teams wait for a smoke run and for a finished score; shards are the bulk; ablations can wait.
pub(crate) const SMOKE: NewUnit = Kind::Smoke.urgency(0);
pub(crate) const FINALISE: NewUnit = Kind::Finalise.urgency(1);
pub(crate) const SHARD: NewUnit = Kind::Shard.urgency(2);
pub(crate) const ABLATION_SHARD: NewUnit = Kind::Shard.urgency(3);

/// What a unit of work is for.
#[derive(Debug)]
pub(crate) enum Purpose {
    Smoke(SubmissionId),
    Shard { run: RunId, shard: Shard },
    Finalise(EvaluationId),
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
        Some(Kind::Shard) => shards::of_unit(connection, unit)
            .await?
            .map(|(run, shard)| Purpose::Shard { run, shard }),
        Some(Kind::Finalise) => finalisations::of_unit(connection, unit)
            .await?
            .map(Purpose::Finalise),
        None => None,
    };
    purpose.ok_or_else(|| {
        StoreError::Damaged(format!(
            "unit {unit}: it is labelled {label:?}, and no such row refers to it"
        ))
    })
}
