//! Announcements of organisers, and questions of teams.

use crate::fixture::*;
use faceoff_store::*;

#[tokio::test]
async fn announcements_and_questions_are_stored() {
    let mut f = TestStore::new().await;
    let alpha = f.create_team("Alpha").await;
    for title in ["first", "second"] {
        f.store
            .announce(Actor::Operator, title, "text", f.now)
            .await
            .unwrap();
        f.advance_clock_s(1);
    }
    let newest = f.store.announcements(1).await.unwrap();
    assert_eq!((newest.len(), newest[0].title.as_str()), (1, "second"));

    let ask = async || {
        f.store
            .ask(
                Actor::Team(alpha.id),
                alpha.id,
                "When does the day start?",
                f.now,
            )
            .await
    };
    let question = ask().await.unwrap();
    for _ in 1..MAX_OPEN_QUESTIONS {
        ask().await.unwrap();
    }
    assert_contains(&ask().await.unwrap_err(), &["which is the limit"]);
    for is_public in [false, true] {
        let answered = f
            .store
            .answer(Actor::Operator, question.id, "At 10:00.", is_public, f.now)
            .await
            .unwrap();
        let answer = answered.answer.unwrap();
        assert_eq!(
            (answer.text.as_str(), answer.is_public),
            ("At 10:00.", is_public)
        );
    }
    ask().await.unwrap();
}
