use faceoff_types::{Seed, StageId};
use faceoff_wire::dataset::DatasetManifest;
use jiff::civil::Date;

/// What an organiser has published of a season.
#[derive(Debug, Clone)]
pub struct SeasonClaim {
    /// The secret, revealed at the season's close.
    pub secret: Seed,
    /// BLAKE3 of the secret's 32 bytes, 64 hexadecimal digits, published before the season.
    pub commitment: Option<String>,
    /// The stage of the evaluation; `None` for a season without stages, or its first that began before there were
    /// any.
    pub stage: Option<StageId>,
    /// The date of the evaluation's day.
    pub day: Date,
}

/// A seed or commitment that does not follow from the season's secret.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("{what} does not follow from the season's secret: stated {stated}, derived {derived}")]
pub struct SeasonMismatch {
    pub what: &'static str,
    /// What the dataset or the organiser states.
    pub stated: String,
    /// What the secret gives.
    pub derived: String,
}

impl SeasonClaim {
    /// Do the dataset's seeds follow from the secret, and is it the secret that was committed to?
    ///
    /// # Errors
    /// The first that does not.
    pub fn check(&self, manifest: &DatasetManifest) -> Result<(), SeasonMismatch> {
        let of_days = self
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
                of_days.day(self.day).to_string(),
            )),
            Some((
                "the seed of the model mismatch",
                manifest.mismatch_seed.to_string(),
                self.secret.model_mismatch().to_string(),
            )),
        ];
        for (what, stated, derived) in claims.into_iter().flatten() {
            if stated != derived {
                return Err(SeasonMismatch {
                    what,
                    stated,
                    derived,
                });
            }
        }
        Ok(())
    }
}
