//! Games in the simulator under all perturbations, with fixed seeds.

use faceoff_types::Profile;
use striker::Agent;

use crate::support::game::{Player, Tally, game, play};

/// Two and a half minutes.
const STEPS: u32 = 7500;
/// *Deployable*: half a point per window of 500 steps.
const POINTS_MAX: u32 = STEPS / 1000;

fn play_game(profile: Profile, seed: u64, mut players: [Player; 2]) -> Tally {
    play(&mut game(profile, seed), &mut players, STEPS, |_, _, _| {})
}

#[test]
fn striker_beats_hold_from_either_side() {
    for own in [0, 1] {
        let mut players = [Player::Hold(None), Player::Hold(None)];
        players[own] = Player::agent(Agent::new, own);
        let tally = play_game(Profile::Evaluation, 2, players);
        assert!(tally.goals[own] >= 2, "{tally:?}");
        assert_eq!(tally.goals[1 - own], 0, "{tally:?}");
        assert_eq!(tally.fouls[own], 0, "{tally:?}");
        assert!(tally.points[own] <= POINTS_MAX, "{tally:?}");
    }
}

#[test]
fn two_strikers_commit_no_fouls_and_stay_deployable() {
    let players = [Player::agent(Agent::new, 0), Player::agent(Agent::new, 1)];
    let tally = play_game(Profile::Evaluation, 2, players);
    assert_eq!(tally.fouls, [0, 0], "{tally:?}");
    assert!(tally.points.iter().all(|p| *p <= POINTS_MAX), "{tally:?}");
}

#[test]
fn game_is_reproducible() {
    let run = || {
        let mut game = game(Profile::Evaluation, 7);
        let mut players = [Player::agent(Agent::new, 0), Player::agent(Agent::new, 1)];
        let tally = play(&mut game, &mut players, 1000, |_, _, _| {});
        (tally, game.world().puck().pose)
    };
    assert_eq!(run(), run());
}
