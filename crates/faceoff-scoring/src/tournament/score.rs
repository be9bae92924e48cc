use super::{
    game::GameEntry,
    result::{Forfeit, GameResult, Why},
    rules::{GameFacts, final_score, forfeit_score, judge},
    side::Side,
};
use crate::{
    episode::{COMPUTATION_TIME_MAX_POINTS, computation_time_penalty, violation_points},
    step_times::StepTimes,
    tier::tier_of,
};
use faceoff_types::{
    ComputationTimeSummary, ForfeitCause, GameLimits, GameOutcome, GameWindow,
    PerturbationSettings, Profile, RoundNumber, Ruleset, Seed, SideOutcome, TeamName, Tier,
    ViolationCounts, WINDOW_STEPS,
};
use serde::{Deserialize, Serialize};

/// How a game was played; its score names it.
#[derive(Debug, Clone, PartialEq)]
pub struct PlayedAs {
    /// By which rules.
    pub ruleset: Ruleset,
    /// The perturbation profile.
    pub profile: Profile,
    /// Magnitudes of what the profile switches on.
    pub perturbations: Box<PerturbationSettings>,
    /// What each side was held to.
    pub limits: GameLimits,
    /// The game's own seed.
    pub seed: Seed,
    /// The agents' names, the first side's first.
    pub agents: [String; 2],
}

/// The score of one game; the layout of `results.json`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct GameScore {
    /// The rules it was played by.
    pub ruleset: Ruleset,
    /// The perturbation profile.
    pub profile: Profile,
    /// Magnitudes of what it switches on; absent: the ruleset's.
    #[serde(default, skip_serializing_if = "is_the_rulesets")]
    pub perturbations: Box<PerturbationSettings>,
    /// What each side was held to; absent: the rules' limits.
    #[serde(default, skip_serializing_if = "are_the_rules")]
    pub limits: GameLimits,
    /// The game's own seed.
    pub seed: Seed,
    /// Control steps played.
    pub steps: u32,
    /// Windows of 500 control steps, a last shorter one included.
    pub windows: u32,
    /// Rallies begun.
    pub rallies: u32,
    /// The first side's first.
    pub sides: [SideScore; 2],
    /// 0 or 1, by which `sides` is indexed; `None` is a draw.
    #[serde(with = "index")]
    pub winner: Option<Side>,
    /// Why.
    #[serde(flatten)]
    pub why: Why,
    /// `played`, `forfeit` or `both_forfeit`.
    pub end: String,
}

impl GameScore {
    /// Who forfeited, and by what.
    #[must_use]
    pub fn forfeits(&self) -> [Option<Forfeit>; 2] {
        self.sides.each_ref().map(|side| by(side.forfeit))
    }

    /// The game as standings and ratings read it: one of a round, between these teams, without labels of submissions
    /// and without a pair. One that was forfeited before a step was played has one window there, of which nothing counts.
    #[must_use]
    pub fn entry(&self, round: RoundNumber, [home, away]: [TeamName; 2]) -> GameEntry {
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
            submissions: None,
            pair: None,
        }
    }

    /// Who won, and why.
    #[must_use]
    pub fn result(&self) -> GameResult {
        let [first, second] = &self.sides;
        judge(&GameFacts {
            score: final_score([first.goals, second.goals], [first.fouls, second.fouls]),
            penalty_points: [first.penalty_points, second.penalty_points],
            windows: self.windows,
            forfeits: self.forfeits(),
        })
    }
}

/// What was used up, without the numbers.
fn by(cause: Option<ForfeitCause>) -> Option<Forfeit> {
    cause.map(|cause| match cause {
        ForfeitCause::Faults { .. } => Forfeit::Faults,
        ForfeitCause::Time { .. } => Forfeit::Time,
    })
}

/// What one side of a game scored.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct SideScore {
    /// The agent's name.
    pub agent: String,
    /// Goals scored as played, without points for the opponent's fouls.
    pub goals: u32,
    /// Fouls.
    pub fouls: u32,
    /// What counts: points for the opponent's fouls included, 10 : 0 after a forfeit.
    pub score: u32,
    /// Penalty points over all windows: the deployability score (DS).
    pub penalty_points: f64,
    /// Windows with each violation.
    pub violations: ViolationCounts,
    /// Tier that follows from the penalty points.
    pub tier: Tier,
    /// Faults.
    pub faults: u32,
    /// Answers that came too late to take effect.
    pub late_answers: u32,
    /// Of all answers.
    pub computation_time_s: ComputationTimeSummary,
    /// All answers, start-ups and resets, in seconds.
    pub time_used_s: f64,
    /// What it used up, if it forfeited.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub forfeit: Option<ForfeitCause>,
}

/// Penalty points of one window. As in an episode, a fault costs the full points for computation time.
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

/// Scores a game; `answer_times_s` are the computation times of each side's answers in order of play.
///
/// # Panics
/// If there are more or fewer times than answers.
#[must_use]
pub fn score_game(
    played_as: &PlayedAs,
    outcome: &GameOutcome,
    answer_times_s: &[Vec<f64>; 2],
) -> GameScore {
    let windows = outcome.steps.div_ceil(WINDOW_STEPS);
    let [first, second] = &outcome.sides;
    let played_score = final_score([first.goals, second.goals], [first.fouls, second.fouls]);
    let penalty_points = [points(first), points(second)];
    let causes = outcome.end.forfeits();
    let forfeits = causes.map(by);
    let result = judge(&GameFacts {
        score: played_score,
        penalty_points,
        windows,
        forfeits,
    });
    let score = forfeit_score(forfeits).unwrap_or(played_score);
    let side = |i: usize, side: &SideOutcome| SideScore {
        agent: played_as.agents[i].clone(),
        goals: side.goals,
        fouls: side.fouls,
        score: score[i],
        penalty_points: penalty_points[i],
        violations: violations(&side.windows),
        tier: tier_of(penalty_points[i], windows),
        faults: count(side.faults.len()),
        late_answers: side.late_answers,
        computation_time_s: summary(side, &answer_times_s[i]),
        time_used_s: side.time_used_s,
        forfeit: causes[i],
    };
    GameScore {
        ruleset: played_as.ruleset,
        profile: played_as.profile,
        perturbations: played_as.perturbations.clone(),
        limits: played_as.limits.clone(),
        seed: played_as.seed,
        steps: outcome.steps,
        windows,
        rallies: outcome.rallies,
        sides: [side(0, first), side(1, second)],
        winner: result.winner(),
        why: result.into(),
        end: outcome.end.as_str().to_owned(),
    }
}

fn points(side: &SideOutcome) -> f64 {
    // Multiples of one half: the sum is exact in any order.
    side.windows.iter().map(window_penalty).sum()
}

fn violations(windows: &[GameWindow]) -> ViolationCounts {
    let of = |test: fn(&GameWindow) -> bool| count(windows.iter().filter(|w| test(w)).count());
    ViolationCounts {
        ee: of(|window| window.violations.ee),
        link: of(|window| window.violations.link),
        joint_pos: of(|window| window.violations.joint_pos),
        joint_vel: of(|window| window.violations.joint_vel),
        computation_time: of(|window| time_or_fault_points(window) > 0.0),
    }
}

fn summary(side: &SideOutcome, times_s: &[f64]) -> ComputationTimeSummary {
    let mut times = StepTimes::of(u64::from(side.answers));
    times_s.iter().for_each(|time_s| times.add(*time_s));
    times.summary()
}

fn count(number: usize) -> u32 {
    u32::try_from(number).unwrap_or(u32::MAX)
}

fn is_the_rulesets(perturbations: &PerturbationSettings) -> bool {
    *perturbations == PerturbationSettings::default()
}

fn are_the_rules(limits: &GameLimits) -> bool {
    *limits == GameLimits::default()
}

/// A side as the index of its place, 0 or 1.
mod index {
    use super::Side;
    use serde::{Deserialize, Deserializer, Serialize, Serializer, de::Error};

    #[expect(
        clippy::ref_option,
        reason = "serde passes what is serialised by reference"
    )]
    pub fn serialize<S: Serializer>(side: &Option<Side>, to: S) -> Result<S::Ok, S::Error> {
        side.map(|side| side as u32).serialize(to)
    }

    pub fn deserialize<'de, D: Deserializer<'de>>(from: D) -> Result<Option<Side>, D::Error> {
        match Option::<u32>::deserialize(from)? {
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
    use faceoff_types::{ComputationTime, GameEnd, Violations};

    fn window(ee: bool, max_s: f64, faults: u32) -> GameWindow {
        GameWindow {
            steps: WINDOW_STEPS,
            violations: Violations {
                ee,
                ..Violations::default()
            },
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

    fn scored(end: GameEnd, sides: [SideOutcome; 2]) -> GameScore {
        let seed = Seed::from_number(1);
        let played_as = PlayedAs {
            ruleset: Ruleset::CURRENT,
            profile: Profile::Evaluation,
            perturbations: Box::default(),
            limits: GameLimits::default(),
            seed,
            agents: ["a".to_owned(), "b".to_owned()],
        };
        let outcome = GameOutcome {
            steps: 1001,
            rallies: 3,
            end,
            sides,
        };
        score_game(&played_as, &outcome, &[vec![0.1, 0.3], vec![0.2, 0.2]])
    }

    #[test]
    fn a_window_costs_like_an_episode() {
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
    fn the_winner_is_an_index_and_a_shorter_window_counts() {
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
    fn a_forfeit_counts_ten_to_nothing_and_keeps_what_was_played() {
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
    fn an_entry_of_a_game_has_the_result_that_its_score_has() {
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
            let game = PlayedGame::try_from(score.entry(RoundNumber::FIRST, teams())).unwrap();
            assert_eq!(game.result(), score.result());
            assert_eq!(game.score(), [score.sides[0].score, score.sides[1].score]);
        }
        let mut unplayed = scored(forfeit, [side(0, 0, Vec::new()), side(0, 0, Vec::new())]);
        (unplayed.steps, unplayed.windows) = (0, 0);
        let game = PlayedGame::try_from(unplayed.entry(RoundNumber::FIRST, teams())).unwrap();
        assert_eq!((game.score(), game.winner()), ([0, 10], Some(Side::Away)));
    }
}
