//! How strong submissions are, from their games: Bradley–Terry ratings from results and from goals.
//!
//! They stand beside the standings and never in their place: standings count points of all games alike,
//! ratings ask against whom they were won. What is rated is a submission, since a team's next one may
//! be another agent.

mod bootstrap;
mod bradley_terry;
mod contest;
mod pools;
mod ratings;
mod scale;
mod units;

pub use bootstrap::{MIN_USABLE_SAMPLES, RESAMPLES};
pub use ratings::{Pool, Prior, Rated, Rating, RatingError, Ratings, rate};
pub use scale::{CENTRE, POINTS_PER_TENFOLD, PRIOR_SD, expected_score};
pub use units::InvalidPair;
pub(super) use units::units;
