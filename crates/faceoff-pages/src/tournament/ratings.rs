//! Ratings of the submissions: estimates of their strength from all games, independent of the standings. A *pool* is a set of submissions
//! that games connect, directly or through others.

use faceoff_scoring::tournament::rating::{Pool, Ratings};
use faceoff_types::TeamName;
use std::collections::BTreeMap;

/// A table of ratings.
pub(super) struct RatingTable {
    pub(super) id: String,
    pub(super) caption: String,
    /// Highest rating first.
    pub(super) rows: Vec<Row>,
}

pub(super) struct Row {
    pub(super) team: TeamName,
    /// The rounds in which the team plays with the rated submission.
    pub(super) rounds: Option<String>,
    pub(super) rating: String,
    pub(super) interval: String,
    pub(super) games: u32,
}

/// Tables by results and by goals; several of each if no chain of games connects all submissions.
pub(super) fn tables(ratings: &Ratings, rounds: &BTreeMap<String, String>) -> Vec<RatingTable> {
    let mut tables = Vec::new();
    for (key, basis, pools) in [
        (
            "results",
            "results; a draw is half a win for each team",
            &ratings.results,
        ),
        ("goals", "goals only", &ratings.goals),
    ] {
        for (number, pool) in (1..).zip(pools) {
            let pool_note = match pools.len() {
                1 => String::new(),
                count => format!(
                    " Pool {number} of {count}: no games between the pools, so their ratings cannot be compared."
                ),
            };
            tables.push(RatingTable {
                id: format!("ratings-by-{key}-{number}"),
                caption: format!("By {basis}.{pool_note}"),
                rows: rows(pool, rounds),
            });
        }
    }
    tables
}

fn rows(pool: &Pool, rounds: &BTreeMap<String, String>) -> Vec<Row> {
    let ratings = pool.ratings.iter();
    ratings
        .map(|rating| {
            let submission = rating.rated.submission.as_ref();
            Row {
                team: rating.rated.team.clone(),
                rounds: submission.and_then(|label| rounds.get(&label.to_string()).cloned()),
                rating: format!("{:.0}", rating.rating),
                interval: interval(rating.ci95),
                games: rating.games,
            }
        })
        .collect()
}

/// The interval as text. An end is `None` if the games do not bound the rating on that side.
fn interval(ends: [Option<f64>; 2]) -> String {
    match ends {
        [Some(low), Some(high)] => format!("{low:.0} – {high:.0}"),
        [Some(low), None] => format!("above {low:.0}"),
        [None, Some(high)] => format!("below {high:.0}"),
        [None, None] => "none: too few games".to_owned(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn open_interval_ends_are_described() {
        assert_eq!(interval([Some(1400.4), Some(1600.0)]), "1400 – 1600");
        assert_eq!(interval([Some(1870.0), None]), "above 1870");
        assert_eq!(interval([None, Some(1180.0)]), "below 1180");
        assert_eq!(interval([None, None]), "none: too few games");
    }
}
