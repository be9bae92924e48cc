//! A control step of several episodes at once.

use crate::episode::{Episode, StepOutcome};

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
    for ((episode, action), outcome) in episodes.iter_mut().zip(actions).zip(outcomes) {
        *outcome = episode.step(action);
    }
}
