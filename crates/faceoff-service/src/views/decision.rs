//! Builds the view of a recorded decision.

use faceoff_api::views::decision::DecisionView;
use faceoff_store::DecisionRecord;

pub fn view(DecisionRecord { at, reason }: DecisionRecord) -> DecisionView {
    DecisionView { at, reason }
}
