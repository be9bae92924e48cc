//! Assertions about refusals.

use faceoff_store::StoreError;
use std::fmt::{Debug, Display};

/// Expects that the text contains these phrases.
#[track_caller]
pub fn assert_contains(text: &(impl Display + ?Sized), phrases: &[&str]) {
    let text = text.to_string();
    for phrase in phrases {
        assert!(text.contains(phrase), "{phrase:?} is not in {text:?}");
    }
}

/// Expects that the result is a conflict whose reason contains these phrases.
#[track_caller]
pub fn assert_conflict<T: Debug>(result: Result<T, StoreError>, phrases: &[&str]) {
    let Err(StoreError::Conflict(reason)) = result else {
        panic!("expected a conflict with {phrases:?}: {result:?}");
    };
    assert_contains(&reason, phrases);
}
