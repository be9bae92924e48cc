//! Whole games, shortened.

use baseline::Baseline;
use faceoff_types::Profile;
use striker::Agent as Striker;

use crate::support::game::{Player, Tally, game, play};

const STEPS: u32 = 6000;
/// *Deployable*: half a point per window of 500 steps.
const POINTS_MAX: u32 = STEPS / 1000;

fn play_game(seed: u64, mut players: [Player; 2]) -> Tally {
    let mut game = game(Profile::Evaluation, seed);
    play(&mut game, &mut players, STEPS, |_, _, _| {})
}

/// Seeds are fixed: a game of two minutes can go either way. Results of full games are in the README.
#[test]
fn striker_beats_baseline_from_either_side() {
    let striker = |own| Player::agent(Striker::new, own);
    let baseline = |own| Player::agent(Baseline::new, own);
    let first = play_game(2, [striker(0), baseline(1)]);
    assert!(first.score[0] > first.score[1], "{first:?}");
    let second = play_game(4, [baseline(0), striker(1)]);
    assert!(second.score[1] > second.score[0], "{second:?}");
}

#[test]
fn baseline_beats_hold_and_stays_deployable() {
    let tally = play_game(2023, [Player::agent(Baseline::new, 0), Player::Hold(None)]);
    assert!(tally.score[0] > tally.score[1], "{tally:?}");
    assert!(tally.goals[0] >= 1, "{tally:?}");
    assert!(tally.points[0] <= POINTS_MAX, "{tally:?}");
}
