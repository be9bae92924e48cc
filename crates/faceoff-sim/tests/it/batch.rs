//! A batch (many worlds of one task, stepped at once) plays the same episodes as worlds that are stepped alone.

use faceoff_sim::AirHockeyTask;
use faceoff_sim::{
    ActivePerturbations, Batch, BatchSetup, Episode, Interpolation, PerturbationSettings, Plant,
    golden::scripted_action,
};
use faceoff_types::Seed;

const WORLDS: u32 = 10;

/// Numbers in an action: position and velocity of seven joints.
const ACTION_LEN: usize = 14;

/// A batch with all perturbations.
fn setup(task: AirHockeyTask) -> BatchSetup {
    let settings = PerturbationSettings::default();
    let seed = Seed::from_number(4); // arbitrary
    BatchSetup {
        task,
        interpolation: Interpolation::Cubic,
        active_perturbations: ActivePerturbations::EVALUATION,
        plant: Plant::mismatched(&settings, seed.model_mismatch()),
        settings,
        seed,
        worlds: WORLDS,
    }
}

/// All observations and outcomes of a batch in some steps, as text.
fn play(setup: BatchSetup, threads: usize, steps: u32) -> Vec<String> {
    let pool = rayon::ThreadPoolBuilder::new()
        .num_threads(threads)
        .build()
        .unwrap();
    pool.install(|| {
        let mut batch = Batch::new(setup);
        let mut all = vec![];
        for step in 0..steps {
            let actions: Vec<f64> = batch
                .observations()
                .chunks(batch.observation_len())
                .flat_map(|observation| scripted_action(observation, step))
                .collect();
            let outcomes = format!("{:?}", batch.step(&actions));
            all.push(format!("{outcomes} {:?}", batch.observations()));
        }
        all
    })
}

#[test]
fn worlds_run_the_episodes_of_the_evaluation_in_order() {
    for task in AirHockeyTask::ALL {
        let setup = setup(task);
        let mut batch = Batch::new(setup.clone());
        let start = |number: u32| {
            Episode::new(
                task,
                setup.interpolation,
                setup.active_perturbations,
                &setup.settings,
                &setup.plant,
                setup.seed.episode(task, number),
            )
        };
        let mut alone: Vec<(u32, Episode)> = (0..WORLDS).map(|n| (n, start(n))).collect();
        let mut ended = 0;
        for step in 0..600 {
            let len = batch.observation_len();
            let rows: Vec<Vec<f64>> = batch.observations().chunks(len).map(Vec::from).collect();
            let mut actions = vec![];
            for ((_, episode), row) in alone.iter().zip(&rows) {
                assert_eq!(episode.observation(), row);
                actions.extend(scripted_action(row, step));
            }
            let outcomes = batch.step(&actions).to_vec();
            for (w, outcome) in outcomes.iter().enumerate() {
                let (number, episode) = &mut alone[w];
                let expected = episode.step(&actions[ACTION_LEN * w..ACTION_LEN * (w + 1)]);
                assert_eq!((outcome.episode, outcome.step), (*number, expected));
                assert_eq!(outcome.last_observation()[..len], *episode.observation());
                assert_eq!(outcome.success, episode.success());
                if expected.end.is_some() {
                    ended += 1;
                    *number += WORLDS;
                    *episode = start(*number);
                }
            }
        }
        assert!(ended > WORLDS, "{task}: {ended} episodes");
    }
}

#[test]
fn batch_is_the_same_on_any_number_of_threads() {
    let alone = play(setup(AirHockeyTask::Hit), 1, 120);
    for threads in [2, 5] {
        assert!(
            play(setup(AirHockeyTask::Hit), threads, 120) == alone,
            "{threads} threads"
        );
    }
}

#[test]
#[should_panic(expected = "expected an action of 14 numbers for each of 10 worlds")]
fn missing_action_panics() {
    Batch::new(setup(AirHockeyTask::Defend)).step(&[0.0; 13]);
}
