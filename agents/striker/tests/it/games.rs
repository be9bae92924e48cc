//! Games in the simulator under all perturbations, with fixed seeds.

use faceoff_sim::AirHockeyProfile;
use striker::Agent;

use crate::support::game::{Player, ROBOT_1, ROBOT_2, Tally, new_game, play};

/// Two and a half minutes, in control steps.
const STEPS: u32 = 7500;
/// Penalty points up to which the rules call an agent *deployable*: half a point per window of 500 steps.
const DEPLOYABLE_POINTS_MAX: u32 = STEPS / 1000;

fn play_game(profile: AirHockeyProfile, seed: u64, mut players: [Player; 2]) -> Tally {
    play(
        &mut new_game(profile, seed),
        &mut players,
        STEPS,
        |_, _, _| {},
    )
}

#[test]
fn striker_beats_hold_from_either_side() {
    for robot_index in [ROBOT_1, ROBOT_2] {
        let mut players = [Player::hold(), Player::hold()];
        players[robot_index] = Player::agent(Agent::new, robot_index);
        let tally = play_game(AirHockeyProfile::Evaluation, 2, players);
        assert!(tally.goals[robot_index] >= 2, "{tally:?}");
        assert_eq!(tally.goals[1 - robot_index], 0, "{tally:?}");
        assert_eq!(tally.fouls[robot_index], 0, "{tally:?}");
        assert!(
            tally.penalty_points[robot_index] <= DEPLOYABLE_POINTS_MAX,
            "{tally:?}"
        );
    }
}

#[test]
fn two_strikers_commit_no_fouls_and_stay_deployable() {
    let players = [
        Player::agent(Agent::new, ROBOT_1),
        Player::agent(Agent::new, ROBOT_2),
    ];
    let tally = play_game(AirHockeyProfile::Evaluation, 2, players);
    assert_eq!(tally.fouls, [0, 0], "{tally:?}");
    assert!(
        tally
            .penalty_points
            .iter()
            .all(|points| *points <= DEPLOYABLE_POINTS_MAX),
        "{tally:?}"
    );
}

#[test]
fn game_is_reproducible() {
    let run = || {
        let mut game = new_game(AirHockeyProfile::Evaluation, 7);
        let mut players = [
            Player::agent(Agent::new, ROBOT_1),
            Player::agent(Agent::new, ROBOT_2),
        ];
        let tally = play(&mut game, &mut players, 1000, |_, _, _| {});
        (tally, game.world().puck().pose)
    };
    assert_eq!(run(), run());
}
