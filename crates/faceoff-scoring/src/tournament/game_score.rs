//! The score of one game from its recorded outcome, in the layout of `results.json`. A game is divided into *windows* of 500
//! control steps, in each of which penalty points are counted as in an episode.

use super::{
    game::GameEntry,
    game_result::{ForfeitKind, GameResult, ResultReason},
    penalty_points::{violation_names, violation_points},
    rules::{GameTally, final_score, forfeit_score, judge},
    side::Side,
};
use crate::{
    episode::{COMPUTATION_TIME_MAX_POINTS, computation_time_penalty, violation_counts},
    step_times::StepTimes,
    tier::tier_of,
};
use faceoff_types::{
    ComputationTimeSummary, ForfeitCause, ForfeitScore, GameLimits, GameOutcome, GameWindow,
    Magnitudes, Profile, RoundNumber, Ruleset, Seed, SideOutcome, TeamName, Tier, ViolationCounts,
    WINDOW_STEPS,
};
use serde::{Deserialize, Serialize};

/// The settings of a game, which its score includes.
#[derive(Debug, Clone, PartialEq)]
pub struct GameSettings {
    /// The rules of the game.
    pub ruleset: Ruleset,
    /// The perturbation profile.
    pub profile: Profile,
    /// Magnitudes of the perturbations that the profile enables.
    pub perturbations: Magnitudes,
    /// Limits of faults and time for each side.
    pub limits: GameLimits,
    /// What the game counts after a forfeit.
    pub forfeit_score: ForfeitScore,
    /// Seed of this game.
    pub seed: Seed,
    /// Names of the agents, first side first.
    pub agents: [String; 2],
}

/// The score of one game, in the layout of `results.json`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct GameScore {
    /// The rules of the game.
    pub ruleset: Ruleset,
    /// The perturbation profile.
    pub profile: Profile,
    /// Magnitudes of the perturbations that the profile enables; absent if those of the ruleset.
    #[serde(default, skip_serializing_if = "Magnitudes::is_empty")]
    pub perturbations: Magnitudes,
    /// Limits of faults and time for each side; absent if those of the rules.
    #[serde(default, skip_serializing_if = "is_default_limits")]
    pub limits: GameLimits,
    /// Seed of this game.
    pub seed: Seed,
    /// Number of control steps.
    pub steps: u32,
    /// Number of windows of 500 control steps, including a shorter last one.
    pub windows: u32,
    /// Number of rallies that started.
    pub rallies: u32,
    /// Scores of the sides, first side first.
    pub sides: [SideScore; 2],
    /// Index into `sides`, 0 or 1; `None` is a draw.
    #[serde(with = "side_index")]
    pub winner: Option<Side>,
    /// Why the winner won, or why the game is a draw.
    #[serde(flatten)]
    pub reason: ResultReason,
    /// `played`, `forfeit` or `both_forfeit`.
    pub end: String,
    /// What the game counts after a forfeit; absent: 10 : 0, or a game without a forfeit.
    #[serde(default, skip_serializing_if = "ForfeitScore::is_legacy")]
    pub forfeit_score: ForfeitScore,
}

impl GameScore {
    /// The limit that each side exceeded; `None` if it did not forfeit.
    #[must_use]
    pub fn forfeits(&self) -> [Option<ForfeitKind>; 2] {
        self.sides.each_ref().map(|side| forfeit_kind(side.forfeit))
    }

    /// The game as input of standings and ratings, without submission labels and pair number. A game that was forfeited
    /// before its first step has one window, in which nothing counts.
    #[must_use]
    pub fn game_entry(&self, round: RoundNumber, [home, away]: [TeamName; 2]) -> GameEntry {
        let [first, second] = &self.sides;
        GameEntry {
            round: round.get(),
            home,
            away,
            goals: [first.goals, second.goals],
            fouls: Some([first.fouls, second.fouls]),
            score: None,
            penalty_points: [first.penalty_points, second.penalty_points],
            windows: Some(self.windows.max(1)),
            forfeit: self.forfeits(),
            forfeit_score: self.forfeit_score,
            submissions: None,
            pair: None,
        }
    }

    /// Winner and reason.
    #[must_use]
    pub fn result(&self) -> GameResult {
        let [first, second] = &self.sides;
        judge(&GameTally {
            score: final_score([first.goals, second.goals], [first.fouls, second.fouls]),
            penalty_points: [first.penalty_points, second.penalty_points],
            windows: self.windows,
            forfeits: self.forfeits(),
        })
    }
}

/// The cause of a forfeit without its numbers.
fn forfeit_kind(cause: Option<ForfeitCause>) -> Option<ForfeitKind> {
    cause.map(|cause| match cause {
        ForfeitCause::Faults { .. } => ForfeitKind::Faults,
        ForfeitCause::Time { .. } => ForfeitKind::Time,
    })
}

/// Results of one side of a game.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct SideScore {
    /// Name of the agent.
    pub agent: String,
    /// Goals scored, without points for the opponent's fouls.
    pub goals: u32,
    /// Number of fouls.
    pub fouls: u32,
    /// The score that counts, including points for the opponent's fouls; after a forfeit 10 : 0, or the opponent's larger lead.
    pub score: u32,
    /// Penalty points over all windows: the deployability score (DS).
    pub penalty_points: f64,
    /// Number of windows with each kind of violation.
    pub violations: ViolationCounts,
    /// Tier that follows from the penalty points.
    pub tier: Tier,
    /// Number of agent faults, such as missing or invalid answers.
    pub faults: u32,
    /// Number of answers that were too late to take effect.
    pub late_answers: u32,
    /// Computation times of all answers, in seconds.
    pub computation_time_s: ComputationTimeSummary,
    /// Total time of answers, start-ups and resets, in seconds.
    pub time_used_s: f64,
    /// The exceeded limit; absent if the side did not forfeit.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub forfeit: Option<ForfeitCause>,
}

/// Penalty points of one window. As in an episode, an agent fault gives the highest penalty for computation time.
#[must_use]
pub fn window_penalty(window: &GameWindow) -> f64 {
    violation_points(&window.violations) + time_or_fault_points(window)
}

fn time_or_fault_points(window: &GameWindow) -> f64 {
    if window.faults > 0 {
        COMPUTATION_TIME_MAX_POINTS
    } else {
        computation_time_penalty(&window.computation_time)
    }
}

/// Scores a game; `answer_times_s` are the computation times of each side's answers, in the sequence of the steps.
///
/// # Panics
/// If there are more or fewer times than answers.
#[must_use]
pub fn score_game(
    settings: &GameSettings,
    outcome: &GameOutcome,
    answer_times_s: &[Vec<f64>; 2],
) -> GameScore {
    let windows = outcome.steps.div_ceil(WINDOW_STEPS);
    let [first, second] = &outcome.sides;
    let played_score = final_score([first.goals, second.goals], [first.fouls, second.fouls]);
    let penalty_points = [total_penalty(first), total_penalty(second)];
    let causes = outcome.end.forfeits();
    let forfeits = causes.map(forfeit_kind);
    let result = judge(&GameTally {
        score: played_score,
        penalty_points,
        windows,
        forfeits,
    });
    let counted = forfeit_score(settings.forfeit_score, forfeits, played_score);
    let score = counted.unwrap_or(played_score);
    let side = |i: usize, side: &SideOutcome| SideScore {
        agent: settings.agents[i].clone(),
        goals: side.goals,
        fouls: side.fouls,
        score: score[i],
        penalty_points: penalty_points[i],
        violations: count_violations(&side.windows),
        tier: tier_of(penalty_points[i], windows),
        faults: count(side.faults.len()),
        late_answers: side.late_answers,
        computation_time_s: summarize_times(side, &answer_times_s[i]),
        time_used_s: side.time_used_s,
        forfeit: causes[i],
    };
    GameScore {
        ruleset: settings.ruleset,
        profile: settings.profile,
        perturbations: settings.perturbations.clone(),
        limits: settings.limits.clone(),
        seed: settings.seed,
        steps: outcome.steps,
        windows,
        rallies: outcome.rallies,
        sides: [side(0, first), side(1, second)],
        winner: result.winner(),
        reason: result.into(),
        end: outcome.end.as_str().to_owned(),
        // Games without a forfeit do not state the rule.
        forfeit_score: counted.map_or_else(ForfeitScore::default, |_| settings.forfeit_score),
    }
}

fn total_penalty(side: &SideOutcome) -> f64 {
    // Points are multiples of one half: the sum is exact in any order.
    side.windows.iter().map(window_penalty).sum()
}

fn count_violations(windows: &[GameWindow]) -> ViolationCounts {
    let windows = windows.iter().map(|window| {
        let is_late = time_or_fault_points(window) > 0.0;
        (&window.violations, is_late)
    });
    violation_counts(violation_names(), windows)
}

fn summarize_times(side: &SideOutcome, times_s: &[f64]) -> ComputationTimeSummary {
    let mut times = StepTimes::for_steps(u64::from(side.answers));
    times_s.iter().for_each(|time_s| times.add(*time_s));
    times.summary()
}

fn count(number: usize) -> u32 {
    u32::try_from(number).unwrap_or(u32::MAX)
}

fn is_default_limits(limits: &GameLimits) -> bool {
    *limits == GameLimits::default()
}

/// A side, serialised as its index 0 or 1.
mod side_index {
    use super::Side;
    use serde::{Deserialize, Deserializer, Serialize, Serializer, de::Error};

    #[expect(
        clippy::ref_option,
        reason = "serde passes the serialised value by reference"
    )]
    pub fn serialize<S: Serializer>(side: &Option<Side>, serializer: S) -> Result<S::Ok, S::Error> {
        side.map(|side| side as u32).serialize(serializer)
    }

    pub fn deserialize<'de, D: Deserializer<'de>>(
        deserializer: D,
    ) -> Result<Option<Side>, D::Error> {
        match Option::<u32>::deserialize(deserializer)? {
            None => Ok(None),
            Some(0) => Ok(Some(Side::Home)),
            Some(1) => Ok(Some(Side::Away)),
            Some(other) => Err(D::Error::custom(format!(
                "expected 0, 1 or null, got {other}"
            ))),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::{super::game::PlayedGame, *};
    use faceoff_airhockey::EE;
    use faceoff_types::{ComputationTime, GameEnd};

    fn window(ee: bool, max_s: f64, faults: u32) -> GameWindow {
        GameWindow {
            steps: WINDOW_STEPS,
            violations: [(EE, ee)].into_iter().collect(),
            computation_time: ComputationTime { mean_s: 0.0, max_s },
            faults,
        }
    }

    fn side(goals: u32, fouls: u32, windows: Vec<GameWindow>) -> SideOutcome {
        SideOutcome {
            goals,
            fouls,
            windows,
            answers: 2,
            late_answers: 0,
            faults: Vec::new(),
            time_used_s: 1.0,
        }
    }

    /// The score of a game of three windows, the last of which has one step.
    fn scored(end: GameEnd, sides: [SideOutcome; 2]) -> GameScore {
        let seed = Seed::from_number(1);
        let settings = GameSettings {
            ruleset: faceoff_airhockey::RULESET,
            profile: faceoff_airhockey::EVALUATION,
            perturbations: Magnitudes::default(),
            limits: GameLimits::default(),
            forfeit_score: ForfeitScore::TenOrLead,
            seed,
            agents: ["a".to_owned(), "b".to_owned()],
        };
        let outcome = GameOutcome {
            steps: 1001,
            rallies: 3,
            end,
            sides,
        };
        score_game(&settings, &outcome, &[vec![0.1, 0.3], vec![0.2, 0.2]])
    }

    #[test]
    fn window_penalty_equals_that_of_an_episode() {
        for (points, ee, max_s, faults) in [
            (0.0, false, 0.02, 0),
            (0.5, false, 0.021, 0),
            (3.0, true, 0.0, 0),
            (2.0, false, 0.0, 1),
            (5.0, true, 0.3, 2),
        ] {
            assert_eq!(window_penalty(&window(ee, max_s, faults)), points);
        }
    }

    #[test]
    fn winner_is_an_index_and_shorter_window_counts() {
        let clean = || vec![window(false, 0.0, 0); 3];
        let score = scored(GameEnd::Played, [side(1, 0, clean()), side(2, 3, clean())]);
        assert_eq!((score.windows, score.winner), (3, None));
        assert_eq!([score.sides[0].score, score.sides[1].score], [2, 2]);
        let unsafe_windows = vec![window(true, 0.0, 0); 3];
        let score = scored(
            GameEnd::Played,
            [side(9, 0, unsafe_windows), side(0, 0, clean())],
        );
        let json = serde_json::to_value(&score).unwrap();
        assert_eq!(json["winner"], 1);
        assert_eq!(
            (&json["won_by"], &json["winner_led"]),
            (&"tier".into(), &false.into())
        );
        assert_eq!(json["sides"][0]["violations"]["ee"], 3);
        assert_eq!(json["sides"][0]["computation_time_s"]["max"], 0.3);
        assert_eq!(score.result().winner(), score.winner);
        assert_eq!(serde_json::from_value::<GameScore>(json).unwrap(), score);
    }

    #[test]
    fn forfeit_counts_ten_to_zero_and_keeps_goals() {
        let cause = ForfeitCause::Faults {
            count: 11,
            allowed: 10,
        };
        let end = GameEnd::Forfeit {
            by: faceoff_types::Side::First,
            cause,
        };
        let unsafe_windows = vec![window(true, 0.0, 0); 3];
        let sides = || [side(4, 0, Vec::new()), side(1, 0, unsafe_windows.clone())];
        let score = scored(end, sides());
        assert_eq!(score.winner, Some(Side::Away));
        assert_eq!([score.sides[0].score, score.sides[1].score], [0, 10]);
        assert_eq!([score.sides[0].goals, score.sides[1].goals], [4, 1]);
        let both = GameEnd::BothForfeit { causes: [cause; 2] };
        let score = scored(both, sides());
        assert_eq!((score.winner, score.sides[0].score), (None, 0));
        assert_eq!(score.end, "both_forfeit");
    }

    #[test]
    fn entry_of_game_has_result_of_its_score() {
        let cause = ForfeitCause::Time {
            used_s: 3601.0,
            allowed_s: 3600.0,
        };
        let clean = || vec![window(false, 0.0, 0); 3];
        let unsafe_windows = vec![window(true, 0.0, 0); 3];
        let teams = || ["h", "a"].map(|name| name.parse().unwrap());
        let forfeit = GameEnd::Forfeit {
            by: faceoff_types::Side::First,
            cause,
        };
        for (end, first) in [
            (GameEnd::Played, side(1, 3, clean())),
            (GameEnd::Played, side(9, 0, unsafe_windows)),
            (forfeit.clone(), side(9, 0, clean())),
        ] {
            let score = scored(end, [first, side(1, 0, clean())]);
            let game = PlayedGame::try_from(score.game_entry(RoundNumber::FIRST, teams())).unwrap();
            assert_eq!(game.result(), score.result());
            assert_eq!(game.score(), [score.sides[0].score, score.sides[1].score]);
        }
        let mut unplayed = scored(forfeit, [side(0, 0, Vec::new()), side(0, 0, Vec::new())]);
        (unplayed.steps, unplayed.windows) = (0, 0);
        let game = PlayedGame::try_from(unplayed.game_entry(RoundNumber::FIRST, teams())).unwrap();
        assert_eq!((game.score(), game.winner()), ([0, 10], Some(Side::Away)));
    }
}
