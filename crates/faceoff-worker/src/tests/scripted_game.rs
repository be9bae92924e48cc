//! The files and the report of a scripted game.

use faceoff_runner::{GameArchives, GameCalibration, GameReport, GameSpec};
use faceoff_scoring::tournament::{GameSettings, score_game};
use faceoff_types::{GameEnd, GameOutcome, GameWindow, SideOutcome, SlotTiming};
use faceoff_wire::dataset::FileDigest;
use std::path::Path;

/// Writes the three files of a game, and reports a win of the first side by one goal.
pub(super) fn game_report(spec: &GameSpec, out: &Path) -> GameReport {
    let files = ["game.zip", "side-1.zip", "side-2.zip"].map(|name| {
        std::fs::write(out.join(name), name).unwrap();
        FileDigest {
            bytes: name.len() as u64,
            blake3: blake3::hash(name.as_bytes()).to_string(),
        }
    });
    let side = |goals| SideOutcome {
        goals,
        fouls: 0,
        windows: vec![GameWindow {
            steps: spec.steps,
            ..GameWindow::default()
        }],
        answers: spec.steps,
        late_answers: 0,
        faults: Vec::new(),
        time_used_s: 0.0,
    };
    let outcome = GameOutcome {
        steps: spec.steps,
        rallies: 2,
        end: GameEnd::Played,
        sides: [side(1), side(0)],
    };
    let settings = GameSettings {
        ruleset: spec.ruleset,
        profile: spec.profile,
        perturbations: spec.perturbations.clone(),
        limits: spec.limits.clone(),
        forfeit_score: spec.forfeit_score,
        seed: spec.seed,
        agents: ["first".into(), "second".into()],
    };
    let times = vec![0.001; spec.steps as usize];
    let [game, first, second] = files;
    GameReport {
        archives: GameArchives {
            score: score_game(&settings, &outcome, &[times.clone(), times]),
            outcome,
            game,
            sides: [first, second],
        },
        calibration: GameCalibration {
            sides: [SlotTiming::default(); 2],
        },
        logs: ["first log\n".into(), "second log\n".into()],
    }
}
