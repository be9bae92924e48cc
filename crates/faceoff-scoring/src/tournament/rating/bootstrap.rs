//! How sure ratings are: the bootstrap over games, or over mirrored pairs of games.

use super::{bradley_terry::Model, contest::Contest, pools::pools};
use crate::draws::Draws;

/// Samples that are drawn for the intervals of a pool.
pub const RESAMPLES: u32 = 1000;

/// Of fewer usable samples no interval is made: its ends would be single samples'.
pub const MIN_USABLE_SAMPLES: u32 = 500;

/// Names the streams of draws; another way of drawing is another stream.
const STREAM: &str = "faceoff-scoring ratings bootstrap 1";

/// Strengths of the usable samples.
#[derive(Debug)]
pub(super) struct Samples {
    /// By submission, ascending.
    strengths: Vec<Vec<f64>>,
    pub(super) usable: u32,
}

impl Samples {
    /// Draws as many of the pool's units as there are, with replacement, again and again, and fits each
    /// sample. A sample that no longer connects the pool cannot compare its submissions and is not used.
    /// Of less than two units nothing is drawn: every sample would be the same one.
    ///
    /// The draws come from BLAKE3 keyed with the units themselves in ascending order, so that the same
    /// games give the same intervals, whatever the machine or the order in which they are listed.
    pub(super) fn draw(
        submissions: usize,
        mut units: Vec<Vec<Contest>>,
        fit: impl Fn(&[&Contest]) -> Vec<f64>,
    ) -> Self {
        let mut samples = Self {
            strengths: vec![Vec::new(); submissions],
            usable: 0,
        };
        if units.len() < 2 {
            return samples;
        }
        for unit in &mut units {
            unit.sort_unstable();
        }
        units.sort_unstable();
        let count = u32::try_from(units.len()).expect("a file of games is far shorter");
        let mut draws = Draws::new(key(&units).finalize_xof());
        let mut drawn = Vec::new();
        for _ in 0..RESAMPLES {
            drawn.clear();
            for _ in 0..count {
                drawn.extend(&units[draws.below(count)]);
            }
            let of_pools = pools(submissions, drawn.iter().copied());
            if of_pools.iter().any(|pool| *pool != 0) {
                continue;
            }
            samples.usable += 1;
            for (all, strength) in samples.strengths.iter_mut().zip(fit(&drawn)) {
                all.push(strength);
            }
        }
        for all in &mut samples.strengths {
            all.sort_unstable_by(f64::total_cmp);
        }
        samples
    }

    /// The 2.5 % and 97.5 % points of a submission's strengths, if enough samples were usable.
    pub(super) fn interval95(&self, submission: usize) -> Option<[f64; 2]> {
        let all = &self.strengths[submission];
        if self.usable < MIN_USABLE_SAMPLES {
            return None;
        }
        // The smallest value that at least this share of the samples does not exceed.
        let at = |per_mille: usize| all[(per_mille * all.len()).div_ceil(1000) - 1];
        Some([at(25), at(975)])
    }
}

fn key(units: &[Vec<Contest>]) -> blake3::Hasher {
    let mut key = blake3::Hasher::new_derive_key(STREAM);
    let mut number = |number: u64| {
        key.update(&number.to_le_bytes());
    };
    for unit in units {
        number(unit.len() as u64);
        for contest in unit {
            contest.sides.iter().for_each(|side| number(*side as u64));
            contest.won.iter().for_each(|won| number(u64::from(*won)));
        }
    }
    key
}

/// The fit of a sample begins at that of all games, from where it is a step or two.
pub(super) fn fit_from<'a>(
    start: &'a [f64],
    value: f64,
    prior_sd: f64,
) -> impl Fn(&[&Contest]) -> Vec<f64> + 'a {
    move |drawn| Model::new(start.len(), drawn.iter().copied(), value, prior_sd).fit(start)
}
