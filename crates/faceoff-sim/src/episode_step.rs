//! One control step of several episodes at once, in SIMD registers.
//!
//! In an arm's equations each link depends on the previous one, so that a single arm leaves most of a core's
//! arithmetic units idle. Arms of different worlds are independent: four of them share the *lanes* (number slots)
//! of a register and are computed at once, for any tasks, plants (physical properties of the arms) and step numbers.

use crate::{
    dynamics::simd_level::SimdLevel,
    episode::{Episode, StepOutcome},
    world::World,
};

/// Advances each episode by its action, with the same bits as [`Episode::step`]; one outcome per episode. Tasks,
/// plants and step numbers may differ.
///
/// # Panics
/// If the three slices differ in length.
pub fn step_episodes(
    episodes: &mut [&mut Episode],
    actions: &[&[f64]],
    outcomes: &mut [StepOutcome],
) {
    step_episodes_on(SimdLevel::fastest(), episodes, actions, outcomes);
}

/// As [`step_episodes`], with a given instruction set. All of them give the same bits.
///
/// # Panics
/// If the three slices differ in length.
pub fn step_episodes_on(
    simd_level: SimdLevel,
    episodes: &mut [&mut Episode],
    actions: &[&[f64]],
    outcomes: &mut [StepOutcome],
) {
    assert_eq!(
        episodes.len(),
        actions.len(),
        "expected an action for each episode"
    );
    assert_eq!(
        episodes.len(),
        outcomes.len(),
        "expected an outcome for each episode"
    );
    for (episode, action) in episodes.iter_mut().zip(actions) {
        episode.command(action);
    }
    // Worlds with the same number of robots share the lanes, so that only the last group can leave lanes empty.
    for robots in 1..=2 {
        let mut same_robot_count = episodes
            .iter_mut()
            .filter(|episode| episode.world().robots() == robots)
            .peekable();
        while same_robot_count.peek().is_some() {
            let worlds = same_robot_count
                .by_ref()
                .take(simd_level.worlds_at_once(robots));
            World::control_step_all(
                simd_level,
                worlds.map(|episode| episode.world_and_air_force()),
            );
        }
    }
    for (episode, outcome) in episodes.iter_mut().zip(outcomes) {
        *outcome = episode.observe();
    }
}
