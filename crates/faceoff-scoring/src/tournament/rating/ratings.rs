//! Ratings of submissions by the Bradley–Terry model, with intervals.

use super::{
    bootstrap::{RESAMPLES, Samples, fit_from},
    bradley_terry::Model,
    pools::pool_numbers,
    sampling_units::{InvalidPair, sampling_units},
    scale::{MEAN_RATING, PRIOR_SD, PRIOR_SD_STRENGTH, rating_of},
    trial_counts::TrialCounts,
};
use crate::tournament::{game::PlayedGame, side::Side, submission_label::SubmissionLabel};
use faceoff_types::TeamName;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

/// Maximum number of submissions in a pool. The computation time is cubic in this number, times a thousand for the
/// intervals.
const MAX_POOL: usize = 200;

/// Ratings from results and from goals.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "openapi", derive(utoipa::ToSchema))]
pub struct Ratings {
    /// The prior of all ratings, in rating points.
    pub prior: Prior,
    /// Number of bootstrap samples for the intervals of each pool.
    pub resamples: u32,
    /// Ratings from results: a win is a trial won, a draw is half a trial for each side.
    pub results: Vec<Pool>,
    /// Ratings from goals: each goal is a trial, regardless of the result. Forfeited games are left out.
    pub goals: Vec<Pool>,
}

/// The normal prior of a submission's rating.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "openapi", derive(utoipa::ToSchema))]
pub struct Prior {
    /// Mean, in rating points.
    pub mean: f64,
    /// Standard deviation, in rating points.
    pub sd: f64,
}

/// Submissions that games connect, the strongest first. Ratings of different pools are not comparable: the mean of each
/// pool is that of the prior.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "openapi", derive(utoipa::ToSchema))]
pub struct Pool {
    /// Number of sampling units of the bootstrap: games and mirrored pairs with an influence on the pool.
    pub units: u32,
    /// Number of bootstrap samples that connect the pool; the intervals are from these.
    pub usable_samples: u32,
    /// Ratings, highest first.
    pub ratings: Vec<Rating>,
}

/// A rated submission or, if games have no submission labels, a team.
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[cfg_attr(feature = "openapi", derive(utoipa::ToSchema))]
pub struct RatedSubmission {
    /// Name of the team.
    pub team: TeamName,
    /// Label of the submission; absent if games have none.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[cfg_attr(feature = "openapi", schema(value_type = Option<String>))]
    pub submission: Option<SubmissionLabel>,
}

impl RatedSubmission {
    /// The submission on one side of a game.
    pub(in crate::tournament) fn from_side(game: &PlayedGame, side: Side) -> Self {
        Self {
            team: game.teams()[side as usize].clone(),
            submission: game.submissions()[side as usize].cloned(),
        }
    }
}

/// A submission's rating.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "openapi", derive(utoipa::ToSchema))]
pub struct Rating {
    /// The rated submission.
    #[serde(flatten)]
    pub rated: RatedSubmission,
    /// Rating on the Elo scale: 400 points more are odds of ten to one, 1500 is the mean of the pool.
    pub rating: f64,
    /// 95 % interval in rating points. A bound is `None` if the games do not determine it: the upper one for a submission
    /// that never lost, the lower one for one that never won, both if there are too few games for a bootstrap.
    pub ci95: [Option<f64>; 2],
    /// Number of games with an influence on the rating.
    pub games: u32,
}

/// Why ratings cannot be computed.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum RatingError {
    /// Games with the same pair number are not a mirrored pair.
    #[error(transparent)]
    Pair(#[from] InvalidPair),
    /// A pool has too many submissions.
    #[error(
        "ratings are for at most {MAX_POOL} submissions that games connect, got {0}; leave out rounds or teams"
    )]
    TooMany(usize),
}

/// Rates the submissions of `games`; the caller leaves out games that do not count.
///
/// In the Bradley–Terry model, a beats b with probability 1 / (1 + 10^((R_b − R_a) / 400)). The prior of each rating is
/// normal around [`MEAN_RATING`] with standard deviation [`PRIOR_SD`]; ratings are the maximum of the posterior. Intervals are
/// percentiles of the same estimate over games drawn with replacement; a mirrored pair is drawn as a whole.
///
/// # Errors
/// If games with the same pair number are not a mirrored pair, or a pool is too large.
pub fn rate<'a>(games: impl IntoIterator<Item = &'a PlayedGame>) -> Result<Ratings, RatingError> {
    let units = sampling_units(games)?;
    let mut numbers = BTreeMap::<RatedSubmission, usize>::new();
    for game in units.iter().flatten() {
        for side in Side::BOTH {
            numbers.insert(RatedSubmission::from_side(game, side), 0);
        }
    }
    for (number, entry) in numbers.values_mut().enumerate() {
        *entry = number;
    }
    let input = RatingInput { units, numbers };
    Ok(Ratings {
        prior: Prior {
            mean: MEAN_RATING,
            sd: PRIOR_SD,
        },
        resamples: RESAMPLES,
        results: input.pools(RatingBasis::Results)?,
        goals: input.pools(RatingBasis::Goals)?,
    })
}

/// What ratings are computed from.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum RatingBasis {
    /// Games won.
    Results,
    /// Goals scored.
    Goals,
}

impl RatingBasis {
    /// Trials or half trials that each side won in a game; `None` if the game has no influence.
    fn trials_won(self, game: &PlayedGame) -> Option<[u32; 2]> {
        match self {
            Self::Results => Some(match game.winner() {
                Some(Side::Home) => [2, 0],
                Some(Side::Away) => [0, 2],
                None => [1, 1],
            }),
            Self::Goals => (game.forfeits() == [None, None]).then(|| game.goals()),
        }
    }

    /// Trials per count of [`Self::trials_won`].
    const fn trials_per_count(self) -> f64 {
        match self {
            Self::Results => 0.5,
            Self::Goals => 1.0,
        }
    }
}

/// The games and submissions that are rated.
struct RatingInput<'a> {
    /// The sampling units of the bootstrap: single games and mirrored pairs.
    units: Vec<Vec<&'a PlayedGame>>,
    /// All submissions, numbered by name from 0.
    numbers: BTreeMap<RatedSubmission, usize>,
}

impl RatingInput<'_> {
    /// The pools of submissions that games connect, with their ratings.
    fn pools(&self, basis: RatingBasis) -> Result<Vec<Pool>, RatingError> {
        let units: Vec<Vec<TrialCounts>> = self
            .units
            .iter()
            .map(|unit| {
                unit.iter()
                    .filter_map(|game| self.trial_counts(game, basis))
                    .collect::<Vec<_>>()
            })
            .filter(|unit| !unit.is_empty())
            .collect();
        let pool_of = pool_numbers(self.numbers.len(), units.iter().flatten());
        // For each pool its members and units; all games of a unit are between the same two submissions.
        let pool_count = pool_of.iter().max().map_or(0, |last| last + 1);
        let mut members = vec![Vec::new(); pool_count];
        let mut index_in_pool = vec![0; self.numbers.len()];
        for (submission, pool) in pool_of.iter().enumerate() {
            index_in_pool[submission] = members[*pool].len();
            members[*pool].push(submission);
        }
        let mut units_by_pool = vec![Vec::new(); pool_count];
        for unit in units {
            let pool = pool_of[unit[0].sides[0]];
            let with_pool_indices = |counts: &TrialCounts| {
                TrialCounts::new(counts.sides.map(|side| index_in_pool[side]), counts.won)
            };
            units_by_pool[pool].push(unit.iter().map(with_pool_indices).collect::<Vec<_>>());
        }
        let rated: Vec<&RatedSubmission> = self.numbers.keys().collect();
        members
            .into_iter()
            .zip(units_by_pool)
            // A pool of one submission has no informative games.
            .filter(|(members, _)| members.len() > 1)
            .map(|(members, units)| {
                if members.len() > MAX_POOL {
                    return Err(RatingError::TooMany(members.len()));
                }
                let rated: Vec<&RatedSubmission> =
                    members.iter().map(|member| rated[*member]).collect();
                Ok(rate_pool(&rated, units, basis))
            })
            .collect()
    }

    /// The trials of a game; `None` if it has no influence on the ratings.
    fn trial_counts(&self, game: &PlayedGame, basis: RatingBasis) -> Option<TrialCounts> {
        let sides = Side::BOTH.map(|side| self.numbers[&RatedSubmission::from_side(game, side)]);
        Some(TrialCounts::new(sides, basis.trials_won(game)?)).filter(TrialCounts::is_informative)
    }
}

fn rate_pool(rated: &[&RatedSubmission], units: Vec<Vec<TrialCounts>>, basis: RatingBasis) -> Pool {
    let mut games = vec![0; rated.len()];
    let mut lost_and_won = vec![[false; 2]; rated.len()];
    for counts in units.iter().flatten() {
        for (own, other) in [(0, 1), (1, 0)] {
            let side = counts.sides[own];
            games[side] += 1;
            lost_and_won[side][0] |= counts.won[other] > 0;
            lost_and_won[side][1] |= counts.won[own] > 0;
        }
    }
    let strengths = Model::new(
        rated.len(),
        units.iter().flatten(),
        basis.trials_per_count(),
        PRIOR_SD_STRENGTH,
    )
    .fit(&vec![0.0; rated.len()]);
    let unit_count = u32::try_from(units.len()).expect("a file of games is far shorter");
    let samples = Samples::draw(
        rated.len(),
        units,
        fit_from(&strengths, basis.trials_per_count(), PRIOR_SD_STRENGTH),
    );
    let mut ratings: Vec<Rating> = rated
        .iter()
        .enumerate()
        .map(|(number, rated)| {
            let [lost, won] = lost_and_won[number];
            let interval = samples.interval95(number);
            let bound = |index: usize, is_determined: bool| {
                interval
                    .filter(|_| is_determined)
                    .map(|bounds| rating_of(bounds[index]))
            };
            Rating {
                rated: (*rated).clone(),
                rating: rating_of(strengths[number]),
                ci95: [bound(0, won), bound(1, lost)],
                games: games[number],
            }
        })
        .collect();
    // The sort is stable: ties stay sorted by name.
    ratings.sort_by(|a, b| b.rating.total_cmp(&a.rating));
    Pool {
        units: unit_count,
        usable_samples: samples.usable,
        ratings,
    }
}
