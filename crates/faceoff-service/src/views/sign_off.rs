//! The sign-off of a stage's result.

use faceoff_api::views::sign_off::SignOffView;
use faceoff_store::SignOff;

pub fn view(finalised: SignOff) -> SignOffView {
    SignOffView {
        at: finalised.signed_off_at,
        by: finalised.actor.to_string(),
    }
}
