//! Numbers as the pages write them. The pages' units are stated in the tables' heads.

use faceoff_api::views::task::TaskView;
use faceoff_scoring::TIER_CHANGE_RESAMPLES;
use faceoff_types::{Task, TaskWeights, Tier, TierBounds};
use jiff::Timestamp;
use std::collections::BTreeMap;

/// A success rate with its interval.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Rate {
    pub(super) percent: String,
    /// Lower and upper bound in percent, one decimal.
    pub(super) low: String,
    pub(super) high: String,
    /// Where the interval begins, how wide it is and where the rate lies, in hundredths of the bar.
    pub(super) bar_from: String,
    pub(super) bar_width: String,
    pub(super) bar_at: String,
}

impl Rate {
    pub(super) fn of(result: &TaskView) -> Self {
        let [low, high] = result
            .success_ci95
            .map(|bound| 100.0 * bound.clamp(0.0, 1.0));
        Self::of_percent(100.0 * result.success_rate, [low, high])
    }

    /// The overall score, as a rate.
    pub(super) fn of_score(
        score: f64,
        tasks: &BTreeMap<Task, TaskView>,
        weights: &TaskWeights,
    ) -> Self {
        Self::of_percent(score, score_interval(score, tasks, weights))
    }

    fn of_percent(percent: f64, [low, high]: [f64; 2]) -> Self {
        Self {
            percent: one(percent),
            low: one(low),
            high: one(high),
            bar_from: one(low),
            bar_width: one(high - low),
            bar_at: one(percent),
        }
    }
}

/// A 95 % interval of the score in percent. Tasks are independent of each other, so that the distances from the rates
/// to the ends of their intervals add up as squares, each side by itself (Zou and Donner, Statistics in Medicine 2008).
pub(super) fn score_interval(
    score: f64,
    tasks: &BTreeMap<Task, TaskView>,
    weights: &TaskWeights,
) -> [f64; 2] {
    let distances = tasks.iter().map(|(task, result)| {
        let weight = weights.of(*task).as_f64();
        result
            .success_ci95
            .map(|end| 100.0 * weight * (end - result.success_rate))
    });
    let [below, above] = distances.fold([0.0, 0.0], |sums: [f64; 2], ends| {
        [sums[0] + ends[0] * ends[0], sums[1] + ends[1] * ends[1]]
    });
    [
        (score - below.sqrt()).max(0.0),
        (score + above.sqrt()).min(100.0),
    ]
}

/// A moment to the minute.
pub(super) fn minute(at: Timestamp) -> String {
    at.strftime("%Y-%m-%d %H:%M UTC").to_string()
}

/// Two significant digits of what is not negative.
pub(super) fn significant(value: f64) -> String {
    let decimals = match value {
        _ if value >= 10.0 => 0,
        _ if value >= 1.0 => 1,
        _ if value >= 0.1 => 2,
        _ => 3,
    };
    format!("{value:.decimals$}")
}

/// One decimal; never “-0.0”.
pub(super) fn one(value: f64) -> String {
    format!("{:.1}", value + 0.0)
}

/// A probability from a bootstrap, in percent. None of the resamples is not the same as never.
pub(super) fn chance(probability: f64) -> String {
    if probability * f64::from(TIER_CHANGE_RESAMPLES) < 0.5 {
        format!("under {} %", 100.0 / f64::from(TIER_CHANGE_RESAMPLES))
    } else {
        format!("{} %", one(100.0 * probability))
    }
}

/// The p-value of a test.
pub(super) fn p_value(p: f64) -> String {
    if p < 0.001 {
        "under 0.001".to_owned()
    } else {
        format!("{p:.3}")
    }
}

/// A difference with its sign, one decimal.
pub(super) fn signed(value: f64) -> String {
    let text = one(value.abs());
    match value {
        _ if text == "0.0" => text,
        value if value > 0.0 => format!("+{text}"),
        _ => format!("−{text}"),
    }
}

/// Seconds as milliseconds, with three significant places where that matters.
pub(super) fn milliseconds(seconds: f64) -> String {
    let ms = seconds * 1e3;
    if ms < 10.0 {
        format!("{ms:.2}")
    } else {
        format!("{ms:.0}")
    }
}

/// Seconds as milliseconds to the microsecond, for times far below a control step.
pub(super) fn fine_milliseconds(seconds: f64) -> String {
    format!("{:.3}", seconds * 1e3)
}

/// Points per episode, by which the tiers are drawn.
pub(super) fn per_episode(points: f64, episodes: u32) -> String {
    format!("{:.2}", points / f64::from(episodes.max(1)))
}

/// A count with its share of the episodes in percent.
pub(super) fn share(count: u32, episodes: u32) -> String {
    if count == 0 {
        return "0".to_owned();
    }
    let percent = 100.0 * f64::from(count) / f64::from(episodes.max(1));
    format!("{count} ({percent:.0} %)")
}

/// Some of all, in percent without decimals.
pub(super) fn percent(some: usize, all: usize) -> String {
    let count = |count: usize| u32::try_from(count).map_or(f64::INFINITY, f64::from);
    format!("{:.0} %", 100.0 * count(some) / count(all.max(1)))
}

/// A sign beside the tier's name, since colour alone must not carry it.
pub(super) const fn tier_sign(tier: Tier) -> &'static str {
    match tier {
        Tier::Deployable => "✓",
        Tier::Improvable => "▲",
        Tier::NonDeployable => "✕",
    }
}

/// What a tier means, as the legend and the tables' group heads say it.
pub(super) fn tier_bounds(tier: Tier, bounds: &TierBounds) -> String {
    let (deployable, improvable) = (bounds.deployable(), bounds.improvable());
    match tier {
        Tier::Deployable => format!("at most {deployable} penalty points per episode"),
        Tier::Improvable => {
            format!("more than {deployable}, at most {improvable} penalty points per episode")
        }
        Tier::NonDeployable => format!("more than {improvable} penalty points per episode"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use faceoff_scoring::{DEPLOYABLE_POINTS_PER_EPISODE, IMPROVABLE_POINTS_PER_EPISODE};

    #[test]
    fn the_tiers_bounds_are_the_scorings() {
        let deployable = DEPLOYABLE_POINTS_PER_EPISODE.to_string();
        let improvable = IMPROVABLE_POINTS_PER_EPISODE.to_string();
        let told = |tier| tier_bounds(tier, &TierBounds::default());
        assert!(told(Tier::Deployable).contains(&deployable));
        assert!(told(Tier::Improvable).contains(&deployable));
        assert!(told(Tier::Improvable).contains(&improvable));
        assert!(told(Tier::NonDeployable).contains(&improvable));
    }

    #[test]
    fn figures_read_as_in_the_paper() {
        assert_eq!(one(54.94), "54.9");
        assert_eq!(one(-0.0), "0.0");
        assert_eq!(milliseconds(0.000_212), "0.21");
        assert_eq!(milliseconds(0.0204), "20");
        assert_eq!(fine_milliseconds(0.000_021_4), "0.021");
        assert_eq!(per_episode(327.5, 1000), "0.33");
        assert_eq!(chance(0.0), "under 0.05 %");
        assert_eq!(chance(0.0005), "0.1 %");
        assert_eq!(chance(0.4025), "40.2 %");
        assert_eq!(p_value(0.0004), "under 0.001");
        assert_eq!(p_value(0.0494), "0.049");
        assert_eq!(signed(12.24), "+12.2");
        assert_eq!(signed(-0.3), "−0.3");
        assert_eq!(signed(-0.01), "0.0");
        assert_eq!(share(0, 50), "0");
        assert_eq!(share(5, 50), "5 (10 %)");
    }
}
