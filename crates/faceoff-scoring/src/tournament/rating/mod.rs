//! Bradley–Terry ratings of submissions, from results and from goals.
//!
//! Ratings supplement the standings and do not replace them: standings count all games equally, ratings consider the
//! strength of the opponents. Submissions are rated, not teams, since a team's next submission may be another agent.

mod bootstrap;
mod bradley_terry;
mod pools;
mod ratings;
mod sampling_units;
mod scale;
mod trial_counts;

pub use bootstrap::{MIN_USABLE_SAMPLES, RESAMPLES};
pub use ratings::{Pool, Prior, RatedSubmission, Rating, RatingError, Ratings, rate};
pub use sampling_units::InvalidPair;
pub(super) use sampling_units::sampling_units;
pub use scale::{MEAN_RATING, POINTS_PER_TENFOLD, PRIOR_SD, expected_score};
