use super::{
    bootstrap::{RESAMPLES, Samples, fit_from},
    bradley_terry::Model,
    contest::Contest,
    pools::pools,
    scale::{CENTRE, PRIOR_SD, PRIOR_SD_STRENGTH, rating_of},
    units::{InvalidPair, units},
};
use crate::tournament::{game::PlayedGame, side::Side, submission_label::SubmissionLabel};
use faceoff_types::TeamName;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

/// The most submissions that one pool may have: the work grows with their number's cube, a thousand
/// times for the intervals.
const MAX_POOL: usize = 200;

/// Ratings by both ways.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "openapi", derive(utoipa::ToSchema))]
pub struct Ratings {
    /// Mean and standard deviation of the prior, in points.
    pub prior: Prior,
    /// Samples drawn for each pool's intervals.
    pub resamples: u32,
    /// From who won: a win is a game won, a draw half a game for each.
    pub results: Vec<Pool>,
    /// From goals alone: every goal is a trial, whoever won the game. Forfeited games are left out.
    pub goals: Vec<Pool>,
}

/// What is taken for known of a submission before its first game.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "openapi", derive(utoipa::ToSchema))]
pub struct Prior {
    /// Mean rating.
    pub mean: f64,
    /// Standard deviation.
    pub sd: f64,
}

/// Submissions that games connect, the strongest first. Ratings of different pools cannot be compared:
/// each pool's mean is that of the prior.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "openapi", derive(utoipa::ToSchema))]
pub struct Pool {
    /// What the bootstrap draws: games and mirrored pairs that say something about the pool.
    pub units: u32,
    /// Samples that the intervals are of: those that still connected the pool.
    pub usable_samples: u32,
    /// The ratings.
    pub ratings: Vec<Rating>,
}

/// What is rated: a submission, or, where games do not name submissions, all that a team played.
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[cfg_attr(feature = "openapi", derive(utoipa::ToSchema))]
pub struct Rated {
    /// The team.
    pub team: TeamName,
    /// Which of its submissions.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[cfg_attr(feature = "openapi", schema(value_type = Option<String>))]
    pub submission: Option<SubmissionLabel>,
}

impl Rated {
    /// Who played a side of a game.
    pub(in crate::tournament) fn of(game: &PlayedGame, side: Side) -> Self {
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
    /// Whose.
    #[serde(flatten)]
    pub rated: Rated,
    /// On Elo's scale: 400 points more are odds of ten to one, 1500 is the pool's mean.
    pub rating: f64,
    /// 95 % interval. An end is missing where the games have none: above for a side that lost nothing,
    /// below for one that won nothing, both where there were too few games for a bootstrap.
    pub ci95: [Option<f64>; 2],
    /// Games that it is of.
    pub games: u32,
}

/// Why there are no ratings.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum RatingError {
    /// What is called a mirrored pair is none.
    #[error(transparent)]
    Pair(#[from] InvalidPair),
    /// More than can be rated together.
    #[error(
        "ratings are for at most {MAX_POOL} submissions that games connect, got {0}; leave out rounds or teams"
    )]
    TooMany(usize),
}

/// Rates the submissions that played `games`, which are those that count.
///
/// Bradley and Terry's model: a beats b with probability 1 / (1 + 10^((R_b − R_a) / 400)). Beforehand
/// each rating is normal around [`CENTRE`] with standard deviation [`PRIOR_SD`], independently;
/// given are the most probable ratings afterwards. Intervals are percentiles of the same estimate
/// over games drawn with replacement, mirrored pairs as a whole.
///
/// # Errors
/// If what is called a mirrored pair is none, or a pool is too large.
pub fn rate<'a>(games: impl IntoIterator<Item = &'a PlayedGame>) -> Result<Ratings, RatingError> {
    let units = units(games)?;
    let mut numbers = BTreeMap::<Rated, usize>::new();
    for game in units.iter().flatten() {
        for side in Side::BOTH {
            numbers.insert(Rated::of(game, side), 0);
        }
    }
    for (number, of) in numbers.values_mut().enumerate() {
        *of = number;
    }
    let field = Field { units, numbers };
    Ok(Ratings {
        prior: Prior {
            mean: CENTRE,
            sd: PRIOR_SD,
        },
        resamples: RESAMPLES,
        results: field.pools(RatedBy::Results)?,
        goals: field.pools(RatedBy::Goals)?,
    })
}

/// What a rating is from.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum RatedBy {
    /// Games won.
    Results,
    /// Goals scored.
    Goals,
}

impl RatedBy {
    /// What each side won of a game, in this way's smallest parts; `None` if the game says nothing.
    fn won(self, game: &PlayedGame) -> Option<[u32; 2]> {
        match self {
            Self::Results => Some(match game.winner() {
                Some(Side::Home) => [2, 0],
                Some(Side::Away) => [0, 2],
                None => [1, 1],
            }),
            Self::Goals => (game.forfeits() == [None, None]).then(|| game.goals()),
        }
    }

    /// How many trials the smallest part is.
    const fn value(self) -> f64 {
        match self {
            Self::Results => 0.5,
            Self::Goals => 1.0,
        }
    }
}

/// All games, and the submissions that played them, numbered by name.
struct Field<'a> {
    units: Vec<Vec<&'a PlayedGame>>,
    numbers: BTreeMap<Rated, usize>,
}

impl Field<'_> {
    fn pools(&self, by: RatedBy) -> Result<Vec<Pool>, RatingError> {
        let units: Vec<Vec<Contest>> = self
            .units
            .iter()
            .map(|unit| {
                unit.iter()
                    .filter_map(|game| self.contest(game, by))
                    .collect::<Vec<_>>()
            })
            .filter(|unit| !unit.is_empty())
            .collect();
        let of_pools = pools(self.numbers.len(), units.iter().flatten());
        // By pool: its members, and its units, whose contests are all between the same two.
        let count = of_pools.iter().max().map_or(0, |last| last + 1);
        let mut members = vec![Vec::new(); count];
        let mut place = vec![0; self.numbers.len()];
        for (submission, pool) in of_pools.iter().enumerate() {
            place[submission] = members[*pool].len();
            members[*pool].push(submission);
        }
        let mut units_of = vec![Vec::new(); count];
        for unit in units {
            let pool = of_pools[unit[0].sides[0]];
            let in_pool = |contest: &Contest| {
                Contest::new(contest.sides.map(|side| place[side]), contest.won)
            };
            units_of[pool].push(unit.iter().map(in_pool).collect::<Vec<_>>());
        }
        let rated: Vec<&Rated> = self.numbers.keys().collect();
        members
            .into_iter()
            .zip(units_of)
            // Alone in its pool is who played nobody that this way can tell anything of.
            .filter(|(members, _)| members.len() > 1)
            .map(|(members, units)| {
                if members.len() > MAX_POOL {
                    return Err(RatingError::TooMany(members.len()));
                }
                let rated: Vec<&Rated> = members.iter().map(|member| rated[*member]).collect();
                Ok(rate_pool(&rated, units, by))
            })
            .collect()
    }

    fn contest(&self, game: &PlayedGame, by: RatedBy) -> Option<Contest> {
        let sides = Side::BOTH.map(|side| self.numbers[&Rated::of(game, side)]);
        Some(Contest::new(sides, by.won(game)?)).filter(Contest::is_informative)
    }
}

fn rate_pool(rated: &[&Rated], units: Vec<Vec<Contest>>, by: RatedBy) -> Pool {
    let mut games = vec![0; rated.len()];
    let mut lost_and_won = vec![[false; 2]; rated.len()];
    for contest in units.iter().flatten() {
        for (own, other) in [(0, 1), (1, 0)] {
            let side = contest.sides[own];
            games[side] += 1;
            lost_and_won[side][0] |= contest.won[other] > 0;
            lost_and_won[side][1] |= contest.won[own] > 0;
        }
    }
    let strengths = Model::new(
        rated.len(),
        units.iter().flatten(),
        by.value(),
        PRIOR_SD_STRENGTH,
    )
    .fit(&vec![0.0; rated.len()]);
    let count = u32::try_from(units.len()).expect("a file of games is far shorter");
    let samples = Samples::draw(
        rated.len(),
        units,
        fit_from(&strengths, by.value(), PRIOR_SD_STRENGTH),
    );
    let mut ratings: Vec<Rating> = rated
        .iter()
        .enumerate()
        .map(|(number, rated)| {
            let [lost, won] = lost_and_won[number];
            let interval = samples.interval95(number);
            let end = |end: usize, is_held: bool| {
                interval
                    .filter(|_| is_held)
                    .map(|ends| rating_of(ends[end]))
            };
            Rating {
                rated: (*rated).clone(),
                rating: rating_of(strengths[number]),
                ci95: [end(0, won), end(1, lost)],
                games: games[number],
            }
        })
        .collect();
    // The stable sort leaves equals in the order of names.
    ratings.sort_by(|a, b| b.rating.total_cmp(&a.rating));
    Pool {
        units: count,
        usable_samples: samples.usable,
        ratings,
    }
}
