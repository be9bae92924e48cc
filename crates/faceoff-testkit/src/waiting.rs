//! Waiting for changes of a store, without sleeping.

use faceoff_store::{EvaluationState, Store, Submission};
use faceoff_types::{EvaluationId, SubmissionId};

/// Waits until `check` returns a value. It is called again after each event of the store.
pub async fn wait_for<T>(store: &Store, check: impl AsyncFn() -> Option<T>) -> T {
    let mut events = store.events();
    loop {
        if let Some(value) = check().await {
            return value;
        }
        // Any event may be due to the change; after a lag, too, the state is checked again.
        let _ = events.recv().await;
    }
}

/// Waits for the end of a validation run.
pub async fn wait_for_validation(store: &Store, id: SubmissionId) -> Submission {
    wait_for(store, async || {
        let submission = store.submission(id).await.unwrap();
        submission.state.validation_is_over().then_some(submission)
    })
    .await
}

/// Waits for the end of an evaluation.
pub async fn wait_for_evaluation(store: &Store, id: EvaluationId) -> EvaluationState {
    wait_for(store, async || {
        let state = store.evaluation(id).await.unwrap().state;
        state.is_over().then_some(state)
    })
    .await
}
