//! Labels of seeds. The seed of a run (the episodes of an evaluation or ablation) derives from its label, such as its day, and the
//! secret of the season. Labels are stored and published instead of the secret seeds.

use crate::{EvaluationId, ProposalId, StageDay, seed::Seed};
use jiff::civil::Date;
use std::{fmt, str::FromStr};

/// What a seed is derived from, together with the season secret. Evaluations with the same label play the same episodes.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum SeedLabel {
    /// The counting evaluations of one day in a season without stages, or in its first stage if that predates stages.
    /// Its text is the ISO date.
    Day(Date),
    /// The counting evaluations of one day of a stage.
    StageDay(StageDay),
    /// All ablations of the season. Its text is `ablation`.
    Ablation,
    /// An extra evaluation on a day whose seed is public. Its text is `extra/` and the evaluation's id.
    Extra(EvaluationId),
    /// The evaluations of a trial. Its text is `trial/` and the id of the proposal.
    Trial(ProposalId),
}

impl SeedLabel {
    /// Derives the seed from the season secret.
    #[must_use]
    pub fn seed(self, season_secret: &Seed) -> Seed {
        match self {
            Self::Day(day) => season_secret.day(day),
            Self::StageDay(day) => season_secret.stage(day.stage).day(day.date),
            Self::Ablation => season_secret.ablation(),
            Self::Extra(id) => season_secret.extra(id),
            Self::Trial(id) => season_secret.trial(id),
        }
    }
}

impl fmt::Display for SeedLabel {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Day(day) => day.fmt(f),
            Self::StageDay(day) => day.fmt(f),
            Self::Ablation => f.write_str("ablation"),
            Self::Extra(id) => write!(f, "extra/{id}"),
            Self::Trial(id) => write!(f, "trial/{id}"),
        }
    }
}

/// Text that is not a seed label.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error(
    "not a seed label: expected a day as YYYY-MM-DD, a stage's as ID/YYYY-MM-DD, “ablation”, “extra/ID” or “trial/ID”"
)]
pub struct ParseSeedLabelError;

impl FromStr for SeedLabel {
    type Err = ParseSeedLabelError;
    fn from_str(s: &str) -> Result<Self, Self::Err> {
        let parsed = match s.split_once('/') {
            None if s == "ablation" => return Ok(Self::Ablation),
            None => s.parse().ok().map(Self::Day),
            Some(("extra", id)) => id.parse().ok().map(Self::Extra),
            Some(("trial", id)) => id.parse().ok().map(Self::Trial),
            Some(_) => s.parse().ok().map(Self::StageDay),
        };
        parsed.ok_or(ParseSeedLabelError)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::StageId;

    #[test]
    fn seed_labels_derive_distinct_seeds_and_round_trip() {
        let secret = Seed::from_number(7);
        let day = jiff::civil::date(2026, 3, 1);
        assert_eq!(SeedLabel::Day(day).seed(&secret), secret.day(day));
        assert_eq!(SeedLabel::Ablation.seed(&secret), secret.ablation());
        let label = |stage| SeedLabel::StageDay(StageDay { stage, date: day });
        let stage = StageId::new();
        let stage_day = label(stage);
        assert_eq!(stage_day.seed(&secret), secret.stage(stage).day(day));
        assert_ne!(stage_day.seed(&secret), secret.day(day));
        assert_ne!(stage_day.seed(&secret), label(StageId::new()).seed(&secret));
        let [extra, trial] = [
            SeedLabel::Extra(EvaluationId::new()),
            SeedLabel::Trial(ProposalId::new()),
        ];
        assert_ne!(extra.seed(&secret), trial.seed(&secret));
        let another = SeedLabel::Extra(EvaluationId::new());
        assert_ne!(extra.seed(&secret), another.seed(&secret));
        for label in [
            SeedLabel::Day(day),
            stage_day,
            SeedLabel::Ablation,
            extra,
            trial,
        ] {
            assert_eq!(label.to_string().parse(), Ok(label));
        }
        for wrong in [
            "someday",
            "stage/2026-03-01",
            "/2026-03-01",
            "extra/",
            "trial/1",
        ] {
            assert!(wrong.parse::<SeedLabel>().is_err(), "{wrong}");
        }
    }
}
