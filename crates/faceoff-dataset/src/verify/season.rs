//! Checks that the seeds of a dataset follow from the secret of its season. The secret's hash (the commitment) is published
//! before the season, the secret at its end.

use faceoff_types::{Seed, StageId};
use faceoff_wire::dataset::DatasetManifest;
use jiff::civil::Date;

/// What is published about a season and an evaluation, to be checked against a dataset.
#[derive(Debug, Clone)]
pub struct SeasonClaim {
    /// The secret, revealed at the season's close.
    pub secret: Seed,
    /// BLAKE3 of the secret's 32 bytes, 64 hexadecimal digits, published before the season.
    pub commitment: Option<String>,
    /// The stage of the evaluation; `None` for a season without stages, or for a first stage that began before stages
    /// existed.
    pub stage: Option<StageId>,
    /// The date of the evaluation.
    pub day: Date,
}

/// A seed or commitment that does not follow from the season's secret.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("{claim} does not follow from the season's secret: stated {stated}, derived {derived}")]
pub struct SeasonMismatch {
    /// What does not follow: the commitment, or the name of a seed.
    pub claim: &'static str,
    /// The value that the dataset or the organiser states.
    pub stated: String,
    /// The value that follows from the secret.
    pub derived: String,
}

impl SeasonClaim {
    /// Checks that the dataset's seeds follow from the secret, and that the secret matches the commitment.
    ///
    /// # Errors
    /// The first mismatch.
    pub fn check(&self, manifest: &DatasetManifest) -> Result<(), SeasonMismatch> {
        let stage_seed = self
            .stage
            .map_or(self.secret, |stage| self.secret.stage(stage));
        let commitment = blake3::hash(self.secret.as_bytes()).to_hex().to_string();
        let claims = [
            self.commitment
                .as_ref()
                .map(|stated| ("the commitment", stated.to_lowercase(), commitment)),
            Some((
                "the evaluation's seed",
                manifest.seed.to_string(),
                stage_seed.day(self.day).to_string(),
            )),
            Some((
                "the seed of the model mismatch",
                manifest.mismatch_seed.to_string(),
                self.secret.model_mismatch().to_string(),
            )),
        ];
        for (claim, stated, derived) in claims.into_iter().flatten() {
            if stated != derived {
                return Err(SeasonMismatch {
                    claim,
                    stated,
                    derived,
                });
            }
        }
        Ok(())
    }
}
