//! The solved episodes of a task, stored as one bit per episode.

use serde::{Deserialize, Serialize};

/// The solved episodes of a task as a bit set over the episodes 0, 1, … n − 1.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(try_from = "RawSuccesses")]
pub struct Successes {
    episodes: u32,
    /// Episode e is bit e % 64 of word e / 64; bits beyond the last episode are 0.
    words: Vec<u64>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct RawSuccesses {
    episodes: u32,
    words: Vec<u64>,
}

impl TryFrom<RawSuccesses> for Successes {
    type Error = &'static str;

    fn try_from(RawSuccesses { episodes, words }: RawSuccesses) -> Result<Self, Self::Error> {
        // Bits that the last word uses; 0 if it is full.
        let used_bits = episodes % 64;
        let has_surplus_bit = words
            .last()
            .is_some_and(|last| used_bits > 0 && last >> used_bits != 0);
        if words.len() != episodes.div_ceil(64) as usize || has_surplus_bit {
            return Err("expected one bit per episode");
        }
        Ok(Self { episodes, words })
    }
}

impl FromIterator<bool> for Successes {
    /// Collects one value per episode, in the sequence of the episodes.
    fn from_iter<I: IntoIterator<Item = bool>>(solved: I) -> Self {
        let mut set = Self {
            episodes: 0,
            words: Vec::new(),
        };
        for solved in solved {
            let bit = set.episodes % 64;
            if bit == 0 {
                set.words.push(0);
            }
            if let Some(word) = set.words.last_mut() {
                *word |= u64::from(solved) << bit;
            }
            set.episodes += 1;
        }
        set
    }
}

impl Successes {
    /// Number of episodes, solved or not.
    #[must_use]
    pub const fn episodes(&self) -> u32 {
        self.episodes
    }

    /// Number of solved episodes.
    #[must_use]
    pub fn count(&self) -> u32 {
        self.words.iter().map(|word| word.count_ones()).sum()
    }

    /// Whether each episode was solved, in the sequence of the episodes.
    pub(crate) fn iter(&self) -> impl Iterator<Item = bool> {
        (0..self.episodes).map(|episode| {
            let word = self.words.get((episode / 64) as usize);
            word.is_some_and(|word| word >> (episode % 64) & 1 == 1)
        })
    }

    /// Number of episodes solved in both sets; surplus episodes of the longer one are ignored.
    pub(crate) fn count_common(&self, other: &Self) -> u32 {
        self.words
            .iter()
            .zip(&other.words)
            .map(|(a, b)| (a & b).count_ones())
            .sum()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bits_count_solved_episodes_and_round_trip() {
        for n in [0u32, 1, 63, 64, 65, 1000] {
            let every_third: Successes = (0..n).map(|e| e % 3 == 0).collect();
            let even: Successes = (0..n).map(|e| e % 2 == 0).collect();
            assert_eq!(every_third.episodes(), n);
            assert_eq!(every_third.count(), n.div_ceil(3));
            assert_eq!(every_third.count_common(&even), n.div_ceil(6));
            let json = serde_json::to_string(&every_third).unwrap();
            assert_eq!(
                serde_json::from_str::<Successes>(&json).unwrap(),
                every_third
            );
        }
    }

    #[test]
    fn bits_without_episode_are_refused() {
        for json in [
            r#"{"episodes":3,"words":[8]}"#,
            r#"{"episodes":3,"words":[]}"#,
            r#"{"episodes":64,"words":[1,0]}"#,
        ] {
            assert!(serde_json::from_str::<Successes>(json).is_err(), "{json}");
        }
    }
}
