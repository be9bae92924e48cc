//! Runs keep the rules that they were begun under, and no board mixes two.

use crate::fixture::*;
use faceoff_store::*;
use faceoff_types::*;

/// Makes all that is there what an earlier program has left.
async fn was_begun_under_the_first(f: &Fixture) {
    let mut connection = f.connection().await;
    sqlx::query("UPDATE runs SET ruleset = 'airhockey-2023.1'")
        .execute(&mut connection)
        .await
        .unwrap();
}

/// Plays and scores the evaluation that comes next; under which rules its shards and its score were ordered.
async fn play(f: &Fixture, score: f64) -> Ruleset {
    let mut rulesets = Vec::new();
    for _ in 0..6 {
        let (claim, run, shard) = f.claim_shard().await;
        rulesets.push(run.ruleset);
        f.play(&claim, &shard, 0).await;
    }
    let Some(Claimed {
        claim,
        work: Work::Finalise { run, .. },
    }) = f.claim().await
    else {
        panic!("expected a finalisation");
    };
    assert!(rulesets.iter().all(|ruleset| *ruleset == run.ruleset));
    f.finish(&claim, score, &format!("{score}")).await;
    run.ruleset
}

async fn teams(f: &Fixture, ruleset: Ruleset) -> Vec<String> {
    let board = f.store.board(ruleset).await.unwrap();
    board.iter().map(|row| row.team.name.to_string()).collect()
}

#[tokio::test]
async fn what_is_under_way_at_an_upgrade_finishes_by_its_own_rules_on_its_own_board() {
    let mut f = Fixture::new().await;
    assert_eq!(f.store.board_ruleset().await.unwrap(), Ruleset::CURRENT);
    let [alpha, beta] = [f.ready_team("Alpha").await, f.ready_team("Beta").await];
    f.evaluate(alpha.id, &plan()).await;
    f.evaluate(beta.id, &plan()).await;
    was_begun_under_the_first(&f).await;
    assert_eq!(play(&f, 10.0).await, Ruleset::First);
    assert_eq!(f.store.board_ruleset().await.unwrap(), Ruleset::First);

    f.later(24 * 3600);
    f.evaluate(alpha.id, &plan()).await;
    assert_eq!(
        play(&f, 20.0).await,
        Ruleset::First,
        "Beta's was queued before"
    );
    assert_eq!(play(&f, 30.0).await, Ruleset::Second);
    assert_eq!(f.store.board_ruleset().await.unwrap(), Ruleset::Second);
    assert_eq!(teams(&f, Ruleset::First).await, ["Alpha", "Beta"]);
    assert_eq!(teams(&f, Ruleset::Second).await, ["Alpha"]);
    let scores: Vec<_> = f.store.board(Ruleset::First).await.unwrap();
    assert_eq!(
        scores
            .iter()
            .map(|row| row.result.score)
            .collect::<Vec<_>>(),
        [10.0, 20.0]
    );
}
