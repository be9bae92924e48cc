//! Builds the view of a recorded decision of the organisers, such as a disqualification: its time and its public reason.

use faceoff_api::views::decision::DecisionView;
use faceoff_store::DecisionRecord;

pub fn view(DecisionRecord { at, reason }: DecisionRecord) -> DecisionView {
    DecisionView { at, reason }
}
