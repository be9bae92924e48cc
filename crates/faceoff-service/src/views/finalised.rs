//! A result that is signed off.

use faceoff_api::views::finalised::FinalisedView;
use faceoff_store::Finalised;

/// Who has signed off, and when.
pub fn of(finalised: Finalised) -> FinalisedView {
    FinalisedView {
        at: finalised.at,
        by: finalised.by.to_string(),
    }
}
