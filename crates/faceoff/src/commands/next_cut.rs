use faceoff_api::views::me::MeView;
use faceoff_types::SubmissionId;

/// When a submission of the team's plays.
pub(super) fn next_cut(me: &MeView, submission: SubmissionId) -> String {
    match (&me.next_cut, me.active_submission) {
        (None, _) => "no day comes any more: the season or its last stage is closed".to_owned(),
        (Some(cut), Some(active)) if active == submission => {
            let (here, elsewhere): (Vec<_>, Vec<_>) =
                me.not_taken.iter().partition(|one| one.stage == cut.stage);
            let mut told = match here.first() {
                Some(one) => format!(
                    "it is active and does not play at the next cut ({cut}): {}",
                    one.reason
                ),
                None => format!("it is active and plays at the next cut: {cut}"),
            };
            for one in elsewhere {
                told.push_str(&format!("\nit plays no day of one stage: {}", one.reason));
            }
            told
        }
        (Some(cut), _) => format!(
            "another submission is active and plays at the next cut ({cut}); to choose this one: faceoff \
             activate {submission}"
        ),
    }
}
