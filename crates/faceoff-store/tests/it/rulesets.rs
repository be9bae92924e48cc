//! Runs keep the rules that they were begun under, and no board mixes two.

use crate::fixture::*;
use faceoff_store::*;
use faceoff_types::*;

/// Makes all that is there what an earlier program has left.
async fn was_begun_under(f: &Fixture, earlier: Ruleset) {
    let mut connection = f.connection().await;
    for change in [
        "UPDATE runs SET ruleset = ?",
        "UPDATE stage_revisions SET rules = json_set(rules, '$.ruleset', ?)",
    ] {
        let query = sqlx::query(change).bind(earlier.as_str());
        let changed = query.execute(&mut connection).await.unwrap();
        assert!(changed.rows_affected() > 0);
    }
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

async fn teams(f: &Fixture, revision: u32) -> Vec<String> {
    let stage = f.store.stages().await.unwrap().remove(0).id;
    let board = f.store.board(stage, revision).await.unwrap();
    board.iter().map(|row| row.team.name.to_string()).collect()
}

/// By which of the stage's rules the board is, and what they are.
async fn newest(f: &Fixture) -> (u32, Ruleset) {
    let stage = f.store.stages().await.unwrap().remove(0);
    let number = f.store.board_revision(&stage).await.unwrap();
    let revisions = f.store.stage_revisions(stage.id).await.unwrap();
    let found = revisions.into_iter().find(|one| one.number == number);
    (number, found.unwrap().rules.ruleset)
}

#[tokio::test]
async fn what_is_under_way_at_an_upgrade_finishes_by_its_own_rules_on_its_own_board() {
    for earlier in Ruleset::ALL {
        if earlier != Ruleset::CURRENT {
            upgrade_from(earlier).await;
        }
    }
}

async fn upgrade_from(earlier: Ruleset) {
    let mut f = Fixture::new().await;
    let [alpha, beta] = [f.ready_team("Alpha").await, f.ready_team("Beta").await];
    f.evaluate(alpha.id, &plan()).await;
    assert_eq!(newest(&f).await, (1, Ruleset::CURRENT));
    was_begun_under(&f, earlier).await;
    assert_eq!(play(&f, 10.0).await, earlier);
    assert_eq!(newest(&f).await, (1, earlier));

    // The new program starts, with the same configuration.
    f.later(24 * 3600);
    f.evaluate(alpha.id, &plan()).await;
    assert_eq!(newest(&f).await, (1, earlier), "until there is a result");
    assert_eq!(play(&f, 20.0).await, earlier, "Beta's was queued before");
    assert_eq!(play(&f, 30.0).await, Ruleset::CURRENT);
    assert_eq!(newest(&f).await, (2, Ruleset::CURRENT));
    assert_eq!(teams(&f, 1).await, ["Alpha", "Beta"]);
    assert_eq!(teams(&f, 2).await, ["Alpha"]);
    assert_eq!(f.board().await[0].result.score, 30.0);
    assert_eq!(beta.team, f.store.submission(beta.id).await.unwrap().team);
}
