//! Short games of the baseline against `striker`, the strong reference agent, and against `hold`, which does not move.

use baseline::Baseline;
use faceoff_sim::AirHockeyProfile;
use striker::Agent as Striker;

use crate::support::game::{Player, ROBOT_1, ROBOT_2, Tally, new_game, play};

/// Two minutes, in control steps.
const STEPS: u32 = 6000;
/// Penalty points up to which the rules call an agent *deployable*: half a point per window of 500 steps.
const DEPLOYABLE_POINTS_MAX: u32 = STEPS / 1000;

fn play_game(seed: u64, mut players: [Player; 2]) -> Tally {
    let mut game = new_game(AirHockeyProfile::Evaluation, seed);
    play(&mut game, &mut players, STEPS, |_, _, _| {})
}

/// The seeds are fixed because `striker` may lose a game as short as two minutes. Results of full games are in the README.
#[test]
fn striker_beats_baseline_from_either_side() {
    let striker = |robot_index| Player::agent(Striker::new, robot_index);
    let baseline = |robot_index| Player::agent(Baseline::new, robot_index);
    let striker_first = play_game(2, [striker(ROBOT_1), baseline(ROBOT_2)]);
    assert!(
        striker_first.score[0] > striker_first.score[1],
        "{striker_first:?}"
    );
    let striker_second = play_game(4, [baseline(ROBOT_1), striker(ROBOT_2)]);
    assert!(
        striker_second.score[1] > striker_second.score[0],
        "{striker_second:?}"
    );
}

#[test]
fn baseline_beats_hold_and_stays_deployable() {
    let baseline = Player::agent(Baseline::new, ROBOT_1);
    let tally = play_game(2023, [baseline, Player::hold()]);
    assert!(tally.score[0] > tally.score[1], "{tally:?}");
    assert!(tally.goals[0] >= 1, "{tally:?}");
    assert!(
        tally.penalty_points[0] <= DEPLOYABLE_POINTS_MAX,
        "{tally:?}"
    );
}
