//! Seeds, and the derivation of each seed from a secret one. Each season has one secret seed, the *season secret*.

use crate::{EvaluationId, ProposalId, StageId, SubmissionId, Task};
use jiff::civil::Date;
use serde::{Deserialize, Serialize, de::Error as _};
use std::{fmt, str::FromStr};

/// 256 bits from which every random draw is derived by keyed BLAKE3.
///
/// A child seed is `BLAKE3(key = parent, label ‖ 0x00 ‖ data)`, so that knowing a child says nothing
/// about its parent or its siblings: publishing the seed of one evaluation keeps the others secret.
#[derive(Clone, Copy, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "openapi", derive(utoipa::ToSchema), schema(value_type = String))]
pub struct Seed([u8; 32]);

impl Seed {
    /// A seed from its bytes.
    #[must_use]
    pub const fn from_bytes(bytes: [u8; 32]) -> Self {
        Self(bytes)
    }

    /// A seed from a number, for use on a command line.
    #[must_use]
    pub fn from_number(number: u64) -> Self {
        Self(*blake3::keyed_hash(&[0; 32], &number.to_le_bytes()).as_bytes())
    }

    /// The bytes, for seeding a random generator.
    #[must_use]
    pub const fn as_bytes(&self) -> &[u8; 32] {
        &self.0
    }

    /// The child seed of a label and data.
    #[must_use]
    pub fn derive(&self, label: &str, data: &[u8]) -> Self {
        let mut hasher = blake3::Hasher::new_keyed(&self.0);
        hasher.update(label.as_bytes());
        hasher.update(&[0]);
        hasher.update(data);
        Self(*hasher.finalize().as_bytes())
    }

    // The functions below derive a child from `self`, which must be the seed that their comment names before the arrow.

    /// Season secret → the seed from which all days of a stage are derived.
    #[must_use]
    pub fn stage(&self, stage: StageId) -> Self {
        self.derive("stage", stage.as_uuid().as_bytes())
    }

    /// A stage's seed → the seed of all evaluations of one day. In a season without stages, and in the first stage of
    /// a season that began without stages, the season secret takes the place of the stage's seed.
    #[must_use]
    pub fn day(&self, day: Date) -> Self {
        self.derive("day", day.to_string().as_bytes())
    }

    /// Season secret → the seed of all ablations, which evaluate a submission without perturbations, with each one
    /// alone, and with all. It differs from every day's seed, whose episodes may still count.
    #[must_use]
    pub fn ablation(&self) -> Self {
        self.derive("ablation", &[])
    }

    /// Season secret → the seed of a submission's validation run.
    #[must_use]
    pub fn validation(&self, submission: SubmissionId) -> Self {
        // "smoke" was the name of validation runs. Another label would change all seeds.
        self.derive("smoke", submission.as_uuid().as_bytes())
    }

    /// Season secret → the seed of an extra evaluation on a day whose seed is public; unique to that evaluation.
    #[must_use]
    pub fn extra(&self, evaluation: EvaluationId) -> Self {
        self.derive("extra", evaluation.as_uuid().as_bytes())
    }

    /// Season secret → the seed of all evaluations of a trial: a rehearsal by organisers that does not count, stored as a proposal.
    #[must_use]
    pub fn trial(&self, proposal: ProposalId) -> Self {
        self.derive("trial", proposal.as_uuid().as_bytes())
    }

    /// Season secret (or a local seed) → the seed of the season's model mismatch: the differences between the robot's model that
    /// teams have and the evaluator's, which are the same in all episodes of a season.
    #[must_use]
    pub fn model_mismatch(&self) -> Self {
        self.derive("model_mismatch", &[])
    }

    /// Evaluation seed → the seed of one episode. It does not depend on the shard, the worker or the order in which
    /// episodes run.
    #[must_use]
    pub fn episode(&self, task: impl Into<Task>, episode: u32) -> Self {
        let task = task.into();
        self.derive(task.as_str(), &episode.to_le_bytes())
    }

    /// A game's seed → the seed of one of its rallies, from 0.
    #[must_use]
    pub fn rally(&self, rally: u32) -> Self {
        self.derive("rally", &rally.to_le_bytes())
    }
}

impl fmt::Display for Seed {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&hex::encode(self.0))
    }
}

impl fmt::Debug for Seed {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        // A seed may be the season's secret, and debug output ends in logs.
        f.write_str("Seed(..)")
    }
}

/// Text that is not a seed.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("not a seed: expected a number below 2^64 or 64 hexadecimal digits")]
pub struct ParseSeedError;

impl FromStr for Seed {
    type Err = ParseSeedError;
    fn from_str(s: &str) -> Result<Self, Self::Err> {
        if s.len() == 64 {
            let mut bytes = [0; 32];
            hex::decode_to_slice(s, &mut bytes).map_err(|_| ParseSeedError)?;
            return Ok(Self(bytes));
        }
        s.parse::<u64>()
            .map(Self::from_number)
            .map_err(|_| ParseSeedError)
    }
}

impl Serialize for Seed {
    fn serialize<S: serde::Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.collect_str(self)
    }
}

impl<'de> Deserialize<'de> for Seed {
    fn deserialize<D: serde::Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        String::deserialize(deserializer)?
            .parse()
            .map_err(D::Error::custom)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn seed_text_round_trips_and_debug_hides_it() {
        let seed = Seed::from_number(7);
        assert_eq!(seed.to_string().parse(), Ok(seed));
        assert_eq!("7".parse(), Ok(seed));
        assert!("seven".parse::<Seed>().is_err());
        assert!(!format!("{seed:?}").contains(&seed.to_string()[..8]));
    }

    #[test]
    fn seeds_differ_by_every_part() {
        let root = Seed::from_number(0);
        let [hit, defend] = ["hit", "defend"].map(Task::new);
        let all = [
            root.episode(hit, 0),
            root.episode(hit, 1),
            root.episode(defend, 0),
            root.model_mismatch(),
            root.day(jiff::civil::date(2026, 1, 1)),
            root.day(jiff::civil::date(2026, 1, 2)),
            Seed::from_number(1).episode(hit, 0),
        ];
        for (i, a) in all.iter().enumerate() {
            for b in &all[i + 1..] {
                assert_ne!(a, b);
            }
        }
    }
}
