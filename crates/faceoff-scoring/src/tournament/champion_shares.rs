//! Certainty of the champion: how often each team wins if all games of the tournament are played again with the same
//! submissions and new seeds.

use crate::interval::wilson95;
use faceoff_types::TeamName;
use serde::{Deserialize, Serialize};
use std::{cmp::Reverse, collections::BTreeMap};

/// How often a team was the champion in repetitions of the tournament (replays).
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "openapi", derive(utoipa::ToSchema))]
pub struct ChampionShare {
    /// A team with at least one first place.
    pub team: TeamName,
    /// Number of replays with this team as champion.
    pub first_places: u32,
    /// `first_places` as a fraction of all replays.
    pub share: f64,
    /// 95 % Wilson interval of the share, as fractions.
    pub share_ci95: [f64; 2],
}

/// The shares of all teams with at least one first place, largest first, then by name. `champions` has one entry for each
/// complete replay of the tournament. The interval of a missing team is [`wilson95`](crate::wilson95) of 0 successes.
#[must_use]
pub fn compute_champion_shares(champions: &[TeamName]) -> Vec<ChampionShare> {
    let mut counts = BTreeMap::<&TeamName, u32>::new();
    for team in champions {
        *counts.entry(team).or_default() += 1;
    }
    let replays = counts.values().sum();
    let mut shares: Vec<_> = counts
        .into_iter()
        .map(|(team, first_places)| ChampionShare {
            team: team.clone(),
            first_places,
            share: f64::from(first_places) / f64::from(replays),
            share_ci95: wilson95(first_places, replays),
        })
        .collect();
    // The sort is stable: ties stay sorted by name.
    shares.sort_by_key(|share| Reverse(share.first_places));
    shares
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn shares_of_all_replays_are_sorted_descending() {
        let names = [
            "beta", "alpha", "beta", "gamma", "beta", "alpha", "gamma", "beta",
        ];
        let champions = names.map(|name| name.parse().unwrap());
        let shares = compute_champion_shares(&champions);
        let rows: Vec<_> = shares
            .iter()
            .map(|share| (share.team.as_str(), share.first_places, share.share))
            .collect();
        assert_eq!(
            rows,
            [("beta", 4, 0.5), ("alpha", 2, 0.25), ("gamma", 2, 0.25)]
        );
        // Wilson by hand: z² = 3.8415, n = 8, p = 1/2 → 0.5 ± 1.96·√(0.25/8 + z²/256)/(1 + z²/8)
        let [low, high] = shares[0].share_ci95;
        assert!((low - 0.2152).abs() < 1e-4, "{low}");
        assert!((high - 0.7848).abs() < 1e-4, "{high}");
    }

    #[test]
    fn sole_champion_still_has_interval() {
        let champions: Vec<TeamName> = vec!["alpha".parse().unwrap(); 10];
        let [share] = compute_champion_shares(&champions).try_into().unwrap();
        assert_eq!((share.first_places, share.share), (10, 1.0));
        let [low, high] = share.share_ci95;
        assert!((0.7..0.73).contains(&low) && high <= 1.0, "{low} {high}");
        assert_eq!(compute_champion_shares(&[]), []);
    }
}
