//! A control step of several episodes at once.
//!
//! An arm's equations are a chain in which each link needs the one before, so that an arm alone leaves most
//! of a core's arithmetic idle. Arms of different worlds have nothing to do with each other: four of them
//! sit in the lanes of a register and are moved at once, whatever their tasks, plants and steps played.

use crate::{
    dynamics::path::LanePath,
    episode::{Episode, StepOutcome},
    world::World,
};

/// Advances each episode by its action, as [`Episode::step`] does, and with the same bits; one outcome per
/// episode. Nothing needs to be common to them: tasks, plants and steps played may differ.
///
/// # Panics
/// If the three slices differ in length.
pub fn step_together(
    episodes: &mut [&mut Episode],
    actions: &[&[f64]],
    outcomes: &mut [StepOutcome],
) {
    step_together_by(LanePath::fastest(), episodes, actions, outcomes);
}

/// As [`step_together`], by a given path: all give the same bits.
///
/// # Panics
/// If the three slices differ in length.
pub fn step_together_by(
    path: LanePath,
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
        "expected room for each episode's outcome"
    );
    for (episode, action) in episodes.iter_mut().zip(actions) {
        episode.command(action);
    }
    // Worlds of as many robots share the lanes, so that none are left over but at the end.
    for robots in 1..=2 {
        let mut alike = episodes
            .iter_mut()
            .filter(|episode| episode.world().robots() == robots)
            .peekable();
        while alike.peek().is_some() {
            let worlds = alike.by_ref().take(path.worlds_at_once(robots));
            World::control_step_together(path, worlds.map(|episode| episode.moving()));
        }
    }
    for (episode, outcome) in episodes.iter_mut().zip(outcomes) {
        *outcome = episode.observe();
    }
}
