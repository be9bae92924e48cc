//! Success rate of an agent that holds still, compared with the reference's statistics (REFERENCE).

use faceoff_sim::{Episode, Interpolation, PerturbationSettings, Plant, model::INITIAL_Q};
use faceoff_types::{Factors, Seed, Task, Violations};

/// Numbers of successes and of episodes with a violation.
fn hold(task: Task, episodes: u32) -> (u32, u32) {
    let action = Interpolation::Cubic.hold_position(&INITIAL_Q);
    let (mut successes, mut violations) = (0, 0);
    for index in 0..episodes {
        let mut episode = Episode::new(
            task,
            Interpolation::Cubic,
            Factors::NONE,
            &PerturbationSettings::default(),
            &Plant::nominal(),
            Seed::from_number(11).episode(task, index),
        );
        while episode.step(&action[..14]).end.is_none() {}
        successes += u32::from(episode.success());
        violations += u32::from(episode.violations() != Violations::default());
    }
    (successes, violations)
}

#[test]
fn holding_agent_has_the_success_rate_of_the_reference() {
    // Defend: 26.4 % of 500 in the reference; both standard errors are 2 %.
    let (successes, violations) = hold(Task::Defend, 500);
    println!("defend: {successes} of 500");
    assert!((102..=162).contains(&successes), "{successes}");
    assert_eq!(violations, 0);
    assert_eq!(hold(Task::Prepare, 60), (0, 0));
    assert_eq!(hold(Task::Hit, 60), (0, 0));
}
