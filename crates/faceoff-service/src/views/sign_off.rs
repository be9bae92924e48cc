//! The sign-off of a stage: the organisers' confirmation that its result is final.

use faceoff_api::views::sign_off::SignOffView;
use faceoff_store::SignOff;

pub fn view(sign_off: SignOff) -> SignOffView {
    SignOffView {
        at: sign_off.signed_off_at,
        by: sign_off.actor.to_string(),
    }
}
