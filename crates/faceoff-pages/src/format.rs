//! Number formats of the pages. Units are stated in the headers of tables.

use faceoff_api::views::task::TaskView;
use faceoff_scoring::TIER_CHANGE_RESAMPLES;
use faceoff_types::{Competition, TaskMap, TaskWeights, Tier, TierBounds, ViolationInfo};
use jiff::Timestamp;

/// A success rate with its interval.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Rate {
    pub(super) percent: String,
    /// Lower and upper bound in percent, one decimal.
    pub(super) low: String,
    pub(super) high: String,
    /// In a bar from 0 to 100: start and width of the interval and position of the rate, in percent.
    pub(super) bar_from: String,
    pub(super) bar_width: String,
    pub(super) bar_rate: String,
}

impl Rate {
    pub(super) fn new(result: &TaskView) -> Self {
        let [low, high] = result
            .success_ci95
            .map(|bound| 100.0 * bound.clamp(0.0, 1.0));
        Self::of_percent(100.0 * result.success_rate, [low, high])
    }

    /// The overall score with its interval.
    pub(super) fn of_score(score: f64, tasks: &TaskMap<TaskView>, weights: &TaskWeights) -> Self {
        Self::of_percent(score, score_interval(score, tasks, weights))
    }

    fn of_percent(percent: f64, [low, high]: [f64; 2]) -> Self {
        Self {
            percent: one_decimal(percent),
            low: one_decimal(low),
            high: one_decimal(high),
            bar_from: one_decimal(low),
            bar_width: one_decimal(high - low),
            bar_rate: one_decimal(percent),
        }
    }
}

/// A 95 % interval of the score in percent. The tasks are independent, so the squared distances from the rates to the ends of
/// their intervals add up on each side (Zou and Donner, Statistics in Medicine 2008).
pub(super) fn score_interval(
    score: f64,
    tasks: &TaskMap<TaskView>,
    weights: &TaskWeights,
) -> [f64; 2] {
    let distances = tasks.iter().map(|(task, result)| {
        let weight = weights.weight(*task).as_f64();
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

/// A count for running text: up to ten in words.
pub(super) fn in_words(number: usize) -> String {
    const WORDS: [&str; 11] = [
        "no", "one", "two", "three", "four", "five", "six", "seven", "eight", "nine", "ten",
    ];
    WORDS
        .get(number)
        .map_or_else(|| number.to_string(), |word| (*word).to_owned())
}

/// Time in UTC, to the minute.
pub(super) fn utc_minute(instant: Timestamp) -> String {
    instant.strftime("%Y-%m-%d %H:%M UTC").to_string()
}

/// [`utc_minute`] for templates, which pass references.
pub(super) fn timestamp(instant: &Timestamp) -> String {
    utc_minute(*instant)
}

/// The state of something that can be revoked and can expire; `None` if it is valid without an expiry.
pub(super) fn expiry_state(
    revoked_at: Option<Timestamp>,
    expires_at: Option<Timestamp>,
    now: Timestamp,
) -> Option<String> {
    let (state, at) = match (revoked_at, expires_at) {
        (Some(revoked_at), _) => ("revoked", revoked_at),
        (None, Some(expires_at)) if expires_at <= now => ("expired", expires_at),
        (None, Some(expires_at)) => ("valid until", expires_at),
        (None, None) => return None,
    };
    Some(format!("{state} {}", utc_minute(at)))
}

/// The detail of an error as sentences, with a capital letter and a full stop. A field's name keeps its spelling, as in “closes_at: …”.
pub(super) fn sentence(detail: &str) -> String {
    let first_word = detail.split(' ').next().unwrap_or_default();
    if first_word.ends_with(':') {
        return format!("{detail}.");
    }
    format!("{}.", capitalised(detail))
}

/// A non-negative value with two significant digits.
pub(super) fn two_significant_digits(value: f64) -> String {
    let decimals = match value {
        _ if value >= 10.0 => 0,
        _ if value >= 1.0 => 1,
        _ if value >= 0.1 => 2,
        _ => 3,
    };
    format!("{value:.decimals$}")
}

/// One decimal; zero has no sign.
pub(super) fn one_decimal(value: f64) -> String {
    format!("{:.1}", value + 0.0)
}

/// A probability from a bootstrap, in percent. A count of zero is shown as an upper bound, since rare cases may be missed.
pub(super) fn probability(probability: f64) -> String {
    if probability * f64::from(TIER_CHANGE_RESAMPLES) < 0.5 {
        format!("under {} %", 100.0 / f64::from(TIER_CHANGE_RESAMPLES))
    } else {
        format!("{} %", one_decimal(100.0 * probability))
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
    let text = one_decimal(value.abs());
    match value {
        _ if text == "0.0" => text,
        value if value > 0.0 => format!("+{text}"),
        _ => format!("−{text}"),
    }
}

/// Seconds as milliseconds: two decimals below 10 ms, none above.
pub(super) fn milliseconds(seconds: f64) -> String {
    let ms = seconds * 1e3;
    if ms < 10.0 {
        format!("{ms:.2}")
    } else {
        format!("{ms:.0}")
    }
}

/// Seconds as milliseconds with three decimals, for times far below a control step.
pub(super) fn precise_milliseconds(seconds: f64) -> String {
    format!("{:.3}", seconds * 1e3)
}

/// Penalty points per episode, which decide the tier.
pub(super) fn points_per_episode(points: f64, episodes: u32) -> String {
    format!("{:.2}", points / f64::from(episodes.max(1)))
}

/// A count with its share of the episodes in percent.
pub(super) fn count_with_share(count: u32, episodes: u32) -> String {
    if count == 0 {
        return "0".to_owned();
    }
    let percent = 100.0 * f64::from(count) / f64::from(episodes.max(1));
    format!("{count} ({percent:.0} %)")
}

/// A share in percent, without decimals.
pub(super) fn percent(part: usize, whole: usize) -> String {
    let count = |count: usize| u32::try_from(count).map_or(f64::INFINITY, f64::from);
    format!("{:.0} %", 100.0 * count(part) / count(whole.max(1)))
}

/// Symbol beside the name of a tier: colour alone must not carry the meaning.
pub(super) const fn tier_symbol(tier: &Tier) -> &'static str {
    match tier {
        Tier::Deployable => "✓",
        Tier::Improvable => "▲",
        Tier::NonDeployable => "✕",
    }
}

/// Definition of a tier, for the legend and the group headers of tables.
fn tier_bounds(tier: Tier, bounds: &TierBounds) -> String {
    let (deployable, improvable) = (bounds.deployable(), bounds.improvable());
    match tier {
        Tier::Deployable => format!("at most {deployable} penalty points per episode"),
        Tier::Improvable => {
            format!("more than {deployable}, at most {improvable} penalty points per episode")
        }
        Tier::NonDeployable => format!("more than {improvable} penalty points per episode"),
    }
}

/// A tier with its definition.
pub(super) struct TierLabel {
    pub(super) tier: Tier,
    pub(super) bounds: String,
}

impl TierLabel {
    pub(super) fn new(tier: Tier, bounds: &TierBounds) -> Self {
        Self {
            tier,
            bounds: tier_bounds(tier, bounds),
        }
    }
}

/// The head of a column of violations.
pub(super) struct ViolationHeader {
    pub(super) title: String,
    pub(super) points: String,
}

/// The column headers of all kinds of violations.
pub(super) fn violation_headers(competition: &Competition) -> Vec<ViolationHeader> {
    let head = |info: &ViolationInfo| ViolationHeader {
        title: capitalised(&info.column_heading),
        points: info.points_with_unit(),
    };
    competition.violations.iter().map(head).collect()
}

/// The text with a capital letter.
pub(super) fn capitalised(text: &str) -> String {
    let mut letters = text.chars();
    let first = letters.next().into_iter().flat_map(char::to_uppercase);
    first.chain(letters).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use faceoff_scoring::{
        DEPLOYABLE_POINTS_PER_EPISODE, IMPROVABLE_POINTS_PER_EPISODE, TIER_BOUNDS,
    };

    #[test]
    fn tier_bounds_match_the_scoring_constants() {
        let deployable = DEPLOYABLE_POINTS_PER_EPISODE.to_string();
        let improvable = IMPROVABLE_POINTS_PER_EPISODE.to_string();
        let text = |tier| tier_bounds(tier, &TIER_BOUNDS);
        assert!(text(Tier::Deployable).contains(&deployable));
        assert!(text(Tier::Improvable).contains(&deployable));
        assert!(text(Tier::Improvable).contains(&improvable));
        assert!(text(Tier::NonDeployable).contains(&improvable));
    }

    #[test]
    fn sentence_keeps_the_spelling_of_field_names() {
        assert_eq!(sentence("no team has it"), "No team has it.");
        assert_eq!(
            sentence("closes_at: expected a time"),
            "closes_at: expected a time."
        );
    }

    #[test]
    fn numbers_are_formatted_as_in_the_paper() {
        assert_eq!(one_decimal(54.94), "54.9");
        assert_eq!(one_decimal(-0.0), "0.0");
        assert_eq!(milliseconds(0.000_212), "0.21");
        assert_eq!(milliseconds(0.0204), "20");
        assert_eq!(precise_milliseconds(0.000_021_4), "0.021");
        assert_eq!(points_per_episode(327.5, 1000), "0.33");
        assert_eq!(probability(0.0), "under 0.05 %");
        assert_eq!(probability(0.0005), "0.1 %");
        assert_eq!(probability(0.4025), "40.2 %");
        assert_eq!(p_value(0.0004), "under 0.001");
        assert_eq!(p_value(0.0494), "0.049");
        assert_eq!(signed(12.24), "+12.2");
        assert_eq!(signed(-0.3), "−0.3");
        assert_eq!(signed(-0.01), "0.0");
        assert_eq!(count_with_share(0, 50), "0");
        assert_eq!(count_with_share(5, 50), "5 (10 %)");
    }
}
