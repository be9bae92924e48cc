//! How sure a champion is: the schedule played again and again, with the same submissions and fresh seeds.

use crate::interval::wilson95;
use faceoff_types::TeamName;
use serde::{Deserialize, Serialize};
use std::{cmp::Reverse, collections::BTreeMap};

/// How often a team came first when the schedule was played again.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "openapi", derive(utoipa::ToSchema))]
pub struct ChampionShare {
    /// Which.
    pub team: TeamName,
    /// Of the replays.
    pub first_places: u32,
    /// The same as a fraction of all replays.
    pub share: f64,
    /// 95 % Wilson interval of the share, as fractions.
    pub share_ci95: [f64; 2],
}

/// The shares of all teams that came first at least once, the largest first, then by name; `first_places` has one
/// team per replay that was played to its end. A team that is not in it has [`wilson95`](crate::wilson95) of none.
#[must_use]
pub fn champions(first_places: &[TeamName]) -> Vec<ChampionShare> {
    let mut times = BTreeMap::<&TeamName, u32>::new();
    for team in first_places {
        *times.entry(team).or_default() += 1;
    }
    let replays = times.values().sum();
    let mut shares: Vec<_> = times
        .into_iter()
        .map(|(team, first_places)| ChampionShare {
            team: team.clone(),
            first_places,
            share: f64::from(first_places) / f64::from(replays),
            share_ci95: wilson95(first_places, replays),
        })
        .collect();
    // A stable sort: names stay in order.
    shares.sort_by_key(|share| Reverse(share.first_places));
    shares
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn shares_are_of_all_replays_and_the_most_frequent_champion_is_first() {
        let names = [
            "beta", "alpha", "beta", "gamma", "beta", "alpha", "gamma", "beta",
        ];
        let all = names.map(|name| name.parse().unwrap());
        let shares = champions(&all);
        let told: Vec<_> = shares
            .iter()
            .map(|share| (share.team.as_str(), share.first_places, share.share))
            .collect();
        assert_eq!(
            told,
            [("beta", 4, 0.5), ("alpha", 2, 0.25), ("gamma", 2, 0.25)]
        );
        // Wilson by hand: z² = 3.8415, n = 8, p = 1/2 → 0.5 ± 1.96·√(0.25/8 + z²/256)/(1 + z²/8)
        let [low, high] = shares[0].share_ci95;
        assert!((low - 0.2152).abs() < 1e-4, "{low}");
        assert!((high - 0.7848).abs() < 1e-4, "{high}");
    }

    #[test]
    fn one_who_always_comes_first_is_not_certain_and_of_no_replays_nothing_is_told() {
        let ten: Vec<TeamName> = vec!["alpha".parse().unwrap(); 10];
        let [share] = champions(&ten).try_into().unwrap();
        assert_eq!((share.first_places, share.share), (10, 1.0));
        let [low, high] = share.share_ci95;
        assert!((0.7..0.73).contains(&low) && high <= 1.0, "{low} {high}");
        assert_eq!(champions(&[]), []);
    }
}
