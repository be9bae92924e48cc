//! A fake slot (the place of a worker in which one job runs) for tests: it claims games and commits made-up results with files,
//! without running agents.

use crate::site::{LEASE_S, Site};
use faceoff_airhockey::{EE, EVALUATION, competition};
use faceoff_scoring::{
    tier_of,
    tournament::{ForfeitKind, GameScore, GameTally, SideScore, final_score, judge},
};
use faceoff_store::{
    ClaimedJob, CommitOutcome, Game, GameCommit, GamePurpose, GameRecording, Job, JobClaim,
};
use faceoff_types::{ComputationTimeSummary, ForfeitCause, GameLimits, Seed};
use serde_json::Value;

/// The outcome of a game. In pairs the home side is first.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct GameOutcome {
    pub goals: [u32; 2],
    pub fouls: [u32; 2],
    pub penalty_points: [f64; 2],
    /// Length of the game in windows of 500 control steps, by which penalty points are divided for the tier; 90 in a whole game.
    pub windows: u32,
    pub forfeits: [bool; 2],
}

impl GameOutcome {
    /// A game with these goals, and without fouls and forfeits.
    pub fn goals(home: u32, away: u32) -> Self {
        Self {
            goals: [home, away],
            fouls: [0; 2],
            penalty_points: [10.0, 20.0],
            windows: 90,
            forfeits: [false; 2],
        }
    }

    /// The same outcome with home and away swapped.
    pub fn swapped(mut self) -> Self {
        self.goals.reverse();
        self.fouls.reverse();
        self.penalty_points.reverse();
        self.forfeits.reverse();
        self
    }

    /// The score as a slot commits it. Numbers that do not follow from the outcome are arbitrary.
    pub fn score(self, agents: [&str; 2], seed: Seed) -> Value {
        let windows = self.windows;
        let forfeits = self
            .forfeits
            .map(|forfeits| forfeits.then_some(ForfeitKind::Faults));
        let played = final_score(self.goals, self.fouls);
        let result = judge(&GameTally {
            score: played,
            penalty_points: self.penalty_points,
            windows,
            forfeits,
        });
        let score = match self.forfeits {
            [false, false] => played,
            [true, false] => [0, 10],
            [false, true] => [10, 0],
            [true, true] => [0, 0],
        };
        let side = |side: usize| SideScore {
            agent: agents[side].to_owned(),
            goals: self.goals[side],
            fouls: self.fouls[side],
            score: score[side],
            penalty_points: self.penalty_points[side],
            violations: competition().violation_counts(&[(EE, 3)]),
            tier: tier_of(self.penalty_points[side], windows),
            faults: if self.forfeits[side] { 11 } else { 0 },
            late_answers: 2,
            computation_time_s: ComputationTimeSummary {
                mean: 1e-4,
                p99: 1e-3,
                max: 5e-3,
            },
            time_used_s: 12.5,
            forfeit: self.forfeits[side].then_some(ForfeitCause::Faults {
                count: 11,
                allowed: 10,
            }),
        };
        let score = GameScore {
            ruleset: faceoff_airhockey::RULESET,
            profile: EVALUATION,
            perturbations: Default::default(),
            limits: GameLimits::default(),
            seed,
            steps: windows * 500,
            windows,
            rallies: 17,
            sides: [side(0), side(1)],
            winner: result.winner(),
            reason: result.into(),
            end: "played".to_owned(),
            forfeit_score: Default::default(),
        };
        serde_json::to_value(score).unwrap()
    }
}

/// Claims the next game; `None` if no game is queued.
pub async fn claim(site: &Site) -> Option<(JobClaim, Game, Seed)> {
    let claimed = site.store.claim("slot 0", LEASE_S, site.now()).await;
    let ClaimedJob { claim, job } = claimed.unwrap()?;
    let Job::Game { game, seeds, .. } = job else {
        panic!("expected a game, claimed {job:?}");
    };
    let game = site.store.game(game).await.unwrap();
    Some((claim, game, seeds.episodes))
}

/// The names of both teams of a game.
pub async fn names(site: &Site, game: &Game) -> [String; 2] {
    let mut names = Vec::new();
    for team in game.teams {
        names.push(site.store.team(team).await.unwrap().name.to_string());
    }
    names.try_into().unwrap()
}

/// Commits the result of a game with its files.
pub async fn commit(
    site: &Site,
    (claim, game, seed): (&JobClaim, &Game, Seed),
    outcome: GameOutcome,
) {
    let team_names = names(site, game).await;
    let recording = match game.purpose {
        GamePurpose::ScheduleReplay { .. } => None,
        _ => Some(store_files(site, claim, game).await),
    };
    let commit = GameCommit {
        results: outcome.score([&team_names[0], &team_names[1]], seed),
        recording,
        logs: team_names.map(|name| format!("{name} was here\n")),
    };
    let now = site.now();
    let committed = site.store.commit_game(claim, &commit, now).await;
    assert_eq!(committed.unwrap(), CommitOutcome::Stored);
}

/// Stores the recordings of a game: of both sides, and of each side.
async fn store_files(site: &Site, claim: &JobClaim, game: &Game) -> GameRecording {
    let key = format!("games/{}/{}", game.id, claim.nonce);
    let mut hashes = Vec::new();
    for file in ["game.zip", "side-1.zip", "side-2.zip"] {
        let bytes = format!("PK {file} of {}", game.id);
        let local = site.folder.path().join(file);
        std::fs::write(&local, &bytes).unwrap();
        let artifacts = site.store.artifacts();
        let file_key = format!("{key}/{file}");
        artifacts.put_file(&file_key, &local).await.unwrap();
        hashes.push(blake3::hash(bytes.as_bytes()).to_string());
    }
    let [game_blake3, home, away] = hashes.try_into().unwrap();
    GameRecording {
        key,
        game_blake3,
        side_blake3: [home, away],
    }
}

/// Plays the next game; `None` if no game is queued.
pub async fn play_next(
    site: &Site,
    outcome: impl Fn(&Game, [&str; 2]) -> GameOutcome,
) -> Option<Game> {
    let (claim, game, seed) = claim(site).await?;
    let [home, away] = names(site, &game).await;
    let outcome = outcome(&game, [&home, &away]);
    commit(site, (&claim, &game, seed), outcome).await;
    Some(game)
}
