//! Rulings: decisions of the organisers, with time and reason.

use faceoff_api::views::ruling::RulingView;
use faceoff_store::Ruling;

/// A ruling of the organisers.
pub fn view(Ruling { at, reason }: Ruling) -> RulingView {
    RulingView { at, reason }
}
