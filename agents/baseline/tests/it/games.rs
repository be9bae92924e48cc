//! Whole games, shortened.

use baseline::Baseline;
use faceoff_types::Profile;
use striker::Agent as Striker;

use crate::support::game::{Player, Tally, game, play};

/// Two minutes.
const STEPS: u32 = 6000;
/// *Deployable*: half a point per window of 500 steps.
const POINTS_MAX: u32 = STEPS / 1000;

fn played(mut players: [Player; 2]) -> Tally {
    let mut game = game(Profile::Evaluation, 2023);
    play(&mut game, &mut players, STEPS, |_, _, _| {})
}

#[test]
fn striker_beats_the_baseline_from_either_side() {
    let tally = played([
        Player::agent(Striker::new, 0),
        Player::agent(Baseline::new, 1),
    ]);
    assert!(tally.score[0] > tally.score[1], "{tally:?}");
    let tally = played([
        Player::agent(Baseline::new, 0),
        Player::agent(Striker::new, 1),
    ]);
    assert!(tally.score[1] > tally.score[0], "{tally:?}");
}

#[test]
fn it_beats_an_arm_that_holds_still_and_stays_deployable() {
    let tally = played([Player::agent(Baseline::new, 0), Player::Hold(None)]);
    assert!(tally.score[0] > tally.score[1], "{tally:?}");
    assert!(tally.goals[0] >= 1, "{tally:?}");
    assert!(tally.points[0] <= POINTS_MAX, "{tally:?}");
}
