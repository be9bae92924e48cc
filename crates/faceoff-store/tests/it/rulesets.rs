//! Rulesets (versions of the simulation and the scoring): a run keeps the ruleset that it was created with, and no board has
//! results of two rulesets.

use crate::fixture::*;
use faceoff_store::*;
use faceoff_types::*;

/// Shards of [`six_shard_plan`].
const SHARDS: u32 = 6;

/// Rewrites all runs and revisions as if an earlier version had created them.
async fn set_ruleset(f: &TestStore, earlier: Ruleset) {
    let mut connection = f.connection().await;
    for sql in [
        "UPDATE runs SET ruleset = ?",
        "UPDATE stage_revisions SET rules = json_set(rules, '$.ruleset', ?)",
    ] {
        let query = sqlx::query(sql).bind(earlier.as_str());
        let changed = query.execute(&mut connection).await.unwrap();
        assert!(changed.rows_affected() > 0);
    }
}

/// Runs and scores the next evaluation. Returns the ruleset of its shards and its scoring job.
async fn run_evaluation(f: &TestStore, score: f64) -> Ruleset {
    let mut rulesets = Vec::new();
    for _ in 0..SHARDS {
        let (claim, run, shard) = f.claim_shard().await;
        rulesets.push(run.ruleset);
        f.commit_shard(&claim, &shard).await;
    }
    let Some(ClaimedJob {
        claim,
        job: Job::Scoring { run, .. },
    }) = f.claim().await
    else {
        panic!("expected a scoring job");
    };
    assert!(rulesets.iter().all(|ruleset| *ruleset == run.ruleset));
    f.finish_scoring(&claim, score, &format!("{score}")).await;
    run.ruleset
}

/// Teams on the board of a revision of the stage's rules.
async fn board_teams(f: &TestStore, revision: u32) -> Vec<String> {
    let stage = f.store.stages().await.unwrap().remove(0).id;
    let board = f.store.board(stage, revision).await.unwrap();
    board.iter().map(|row| row.team.name.to_string()).collect()
}

/// Revision and ruleset of the newest board.
async fn newest_board(f: &TestStore) -> (u32, Ruleset) {
    let stage = f.store.stages().await.unwrap().remove(0);
    let number = f.store.board_revision(&stage).await.unwrap();
    let revisions = f.store.stage_revisions(stage.id).await.unwrap();
    let revision = revisions
        .into_iter()
        .find(|revision| revision.number == number);
    (number, revision.unwrap().rules.ruleset)
}

#[tokio::test]
async fn runs_started_before_upgrade_keep_their_ruleset() {
    for earlier in faceoff_airhockey::RULESETS {
        if earlier != faceoff_airhockey::RULESET {
            upgrade_from(earlier).await;
        }
    }
}

/// Simulates an upgrade from a version with this ruleset, while an evaluation is queued.
async fn upgrade_from(earlier: Ruleset) {
    let mut f = TestStore::new().await;
    let [alpha, beta] = f.two_valid_submissions().await;
    f.evaluate(alpha.id, &six_shard_plan()).await;
    assert_eq!(newest_board(&f).await, (1, faceoff_airhockey::RULESET));
    set_ruleset(&f, earlier).await;
    assert_eq!(run_evaluation(&f, 10.0).await, earlier);
    assert_eq!(newest_board(&f).await, (1, earlier));

    // The new version starts with the same configuration.
    f.advance_clock_s(24 * 3600);
    f.evaluate(alpha.id, &six_shard_plan()).await;
    assert_eq!(
        newest_board(&f).await,
        (1, earlier),
        "the new revision has no result yet"
    );
    assert_eq!(
        run_evaluation(&f, 20.0).await,
        earlier,
        "Beta's evaluation was queued before the upgrade"
    );
    assert_eq!(run_evaluation(&f, 30.0).await, faceoff_airhockey::RULESET);
    assert_eq!(newest_board(&f).await, (2, faceoff_airhockey::RULESET));
    assert_eq!(board_teams(&f, 1).await, ["Alpha", "Beta"]);
    assert_eq!(board_teams(&f, 2).await, ["Alpha"]);
    assert_eq!(f.board().await[0].result.score, 30.0);
    assert_eq!(beta.team, f.store.submission(beta.id).await.unwrap().team);
}
