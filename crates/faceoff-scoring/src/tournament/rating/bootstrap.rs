//! Uncertainty of ratings: the bootstrap over *sampling units*, which are single games or mirrored pairs (two games with the
//! same seed and swapped sides). The ratings are fitted again to many samples of the units, drawn with replacement.

use super::{bradley_terry::Model, pools::pool_numbers, trial_counts::TrialCounts};
use crate::random_numbers::RandomNumbers;

/// Bootstrap samples for the intervals of a pool (the submissions that games connect).
pub const RESAMPLES: u32 = 1000;

/// Minimum number of usable samples for an interval: with fewer, single samples would determine its ends.
pub const MIN_USABLE_SAMPLES: u32 = 500;

/// Identifies the streams of random draws; a change of the method needs a new name.
const STREAM: &str = "faceoff-scoring ratings bootstrap 1";

/// Fitted strengths of the usable samples.
#[derive(Debug)]
pub(super) struct Samples {
    /// For each submission its strengths in all samples, ascending.
    strengths: Vec<Vec<f64>>,
    pub(super) usable: u32,
}

impl Samples {
    /// Draws [`RESAMPLES`] samples of the pool's sampling units, with replacement, and fits each of them. A sample that does
    /// not connect the pool cannot compare its submissions and is not used. With fewer than two units all samples would
    /// be equal, so none is drawn.
    ///
    /// The draws come from BLAKE3 keyed with the units in ascending order. The same games therefore give the same
    /// intervals, regardless of the machine and the sequence of games.
    pub(super) fn draw(
        submissions: usize,
        mut units: Vec<Vec<TrialCounts>>,
        fit: impl Fn(&[&TrialCounts]) -> Vec<f64>,
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
        let mut random_numbers = RandomNumbers::new(key(&units).finalize_xof());
        let mut drawn = Vec::new();
        for _ in 0..RESAMPLES {
            drawn.clear();
            for _ in 0..count {
                drawn.extend(&units[random_numbers.below(count)]);
            }
            let pool_numbers = pool_numbers(submissions, drawn.iter().copied());
            if pool_numbers.iter().any(|pool| *pool != 0) {
                continue;
            }
            samples.usable += 1;
            for (strengths, strength) in samples.strengths.iter_mut().zip(fit(&drawn)) {
                strengths.push(strength);
            }
        }
        for strengths in &mut samples.strengths {
            strengths.sort_unstable_by(f64::total_cmp);
        }
        samples
    }

    /// The 2.5 % and 97.5 % quantiles of a submission's strength; `None` with too few usable samples.
    pub(super) fn interval95(&self, submission: usize) -> Option<[f64; 2]> {
        let strengths = &self.strengths[submission];
        if self.usable < MIN_USABLE_SAMPLES {
            return None;
        }
        // The smallest value that at least this share of the samples does not exceed.
        let quantile =
            |per_mille: usize| strengths[(per_mille * strengths.len()).div_ceil(1000) - 1];
        Some([quantile(25), quantile(975)])
    }
}

/// The key of the random draws: a hash of the units.
fn key(units: &[Vec<TrialCounts>]) -> blake3::Hasher {
    let mut key = blake3::Hasher::new_derive_key(STREAM);
    let mut add = |number: u64| {
        key.update(&number.to_le_bytes());
    };
    for unit in units {
        add(unit.len() as u64);
        for trials in unit {
            trials.sides.iter().for_each(|side| add(*side as u64));
            trials.won.iter().for_each(|won| add(u64::from(*won)));
        }
    }
    key
}

/// The fit of a sample. It starts at the strengths that all games give, so that a step or two are enough.
pub(super) fn fit_from<'a>(
    start: &'a [f64],
    trials_per_count: f64,
    prior_sd: f64,
) -> impl Fn(&[&TrialCounts]) -> Vec<f64> + 'a {
    move |drawn| {
        Model::new(
            start.len(),
            drawn.iter().copied(),
            trials_per_count,
            prior_sd,
        )
        .fit(start)
    }
}
