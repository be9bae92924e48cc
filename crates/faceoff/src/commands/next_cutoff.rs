//! Text about the next *cutoff*, the time at which the active submission of each team is evaluated.

use faceoff_api::views::me::MeView;
use faceoff_types::SubmissionId;

/// When a submission of the team will be evaluated.
pub(super) fn next_cutoff_text(me: &MeView, submission: SubmissionId) -> String {
    match (&me.next_cutoff, me.active_submission) {
        (None, _) => {
            "no further evaluation days: the season or its last stage is closed".to_owned()
        }
        (Some(cutoff), Some(active)) if active == submission => {
            let (at_cutoff, other_stages): (Vec<_>, Vec<_>) = me
                .excluded_by
                .iter()
                .partition(|exclusion| exclusion.stage == cutoff.stage);
            let mut text = match at_cutoff.first() {
                Some(exclusion) => format!(
                    "it is active, but excluded from the next cutoff ({cutoff}): {}",
                    exclusion.reason
                ),
                None => format!("it is active and will be evaluated at the next cutoff: {cutoff}"),
            };
            for exclusion in other_stages {
                text.push_str(&format!(
                    "\nit is excluded from another stage: {}",
                    exclusion.reason
                ));
            }
            text
        }
        (Some(cutoff), _) => format!(
            "another submission is active and will be evaluated at the next cutoff ({cutoff}); to use this one, run: faceoff \
            activate {submission}"
        ),
    }
}
