//! Control steps allocate no memory: it is allocated when an episode, or a rally of a game, is created.

use faceoff_sim::AirHockeyTask;
use faceoff_sim::{
    ActivePerturbations, Command, Episode, Game, GameSetup, Interpolation, PerturbationSettings,
    Plant, golden::scripted_action, model::INITIAL_Q,
};
use faceoff_types::Seed;

#[test]
fn control_steps_allocate_nothing() {
    let settings = PerturbationSettings::default();
    let seed = Seed::from_number(1);
    let plant = Plant::mismatched(&settings, seed.model_mismatch());
    for task in AirHockeyTask::ALL {
        let mut episode = Episode::new(
            task,
            Interpolation::Cubic,
            ActivePerturbations::EVALUATION,
            &settings,
            &plant,
            seed.episode(task, 0),
        );
        let before = *episode.world().puck();
        let mut is_puck_moved = false;
        let allocations_of_step = |episode: &mut Episode, is_puck_moved: &mut bool| {
            allocation_counter::measure(|| {
                let action = scripted_action(episode.observation(), episode.steps());
                episode.step(&action);
                *is_puck_moved |= episode.world().puck().velocity != before.velocity;
            })
            .count_total
        };
        let mut total = 0;
        while episode.steps() < 150 {
            total += allocations_of_step(&mut episode, &mut is_puck_moved);
        }
        assert_eq!(total, 0, "{task}");
        assert!(is_puck_moved, "{task}: the puck was never touched");
    }
}

#[test]
fn game_allocates_only_at_the_start_of_a_rally() {
    let mut game = Game::new(GameSetup {
        interpolation: [Interpolation::Cubic; 2],
        active_perturbations: ActivePerturbations::EVALUATION,
        settings: PerturbationSettings::default(),
        plant: Plant::nominal(),
        seed: Seed::from_number(1),
    });
    let hold = Interpolation::Cubic.hold_position(&INITIAL_Q);
    let mut steps_within_rallies = 0;
    for _ in 0..1000 {
        let mut new_rally = false;
        let allocated = allocation_counter::measure(|| {
            new_rally = game
                .step([Command::Act(&hold[..14]), Command::Late])
                .rally_end
                .is_some();
        });
        if !new_rally {
            assert_eq!(allocated.count_total, 0);
            steps_within_rallies += 1;
        }
    }
    assert!(steps_within_rallies > 990);
}
