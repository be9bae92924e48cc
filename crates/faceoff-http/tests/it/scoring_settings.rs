//! Tests of a stage's scoring settings: weights of the tasks, bounds of the tiers (deployable, improvable), and magnitudes of
//! the simulator's perturbations.

use crate::site::{ADMIN, Site, outcome};
use faceoff_airhockey::{HIT, JOINT_VEL};
use faceoff_types::{EpisodeOutcome, Task};
use serde_json::json;

#[tokio::test]
async fn scoring_settings_are_rules_and_apply_to_the_board() {
    let site = Site::start().await;
    let team = site.team("Alpha").await;
    site.valid_submission(&team, "a").await;
    let settings = json!({
        "weights": { "hit": 0.75, "defend": 0.25, "prepare": 0 },
        "tier_bounds": { "deployable": 0.1, "improvable": 1.6 },
        "perturbations": { "tracking_loss": { "probability": 0.5 } },
    });
    site.change_first_stage(settings.clone()).await.problem(
        409,
        "not-confirmed",
        &["revision 2", "empty board"],
    );
    let mut confirmed = settings;
    confirmed["confirm"] = json!("Qualifying");
    let changed = site.change_first_stage(confirmed).await.json(200);
    assert_eq!(changed["revision"], 2);
    assert_eq!(
        changed["weights"],
        json!({ "hit": 0.75, "defend": 0.25, "prepare": 0.0 })
    );
    assert_eq!(
        changed["perturbations"]["tracking_loss"],
        json!({ "probability": 0.5, "steps": [5, 20] })
    );
    assert_eq!(
        changed["revisions"][0].get("weights"),
        None,
        "revision 1 has the weights of the ruleset"
    );

    site.start_day().await;
    // The agent solves half of the four episodes of `hit`, and exceeds the joint velocity limits in each of them.
    let outcome_fn = |task: Task, episode| EpisodeOutcome {
        success: task == HIT && episode < 2,
        violations: [(JOINT_VEL, task == HIT)].into_iter().collect(),
        ..outcome(task, episode, false)
    };
    let id = site.run_evaluation(outcome_fn).await;
    let board = site.get("/api/v1/board", None).await.json(200);
    assert_eq!(board["revision"], 2);
    assert_eq!(board["weights"]["hit"], 0.75);
    assert_eq!(
        board["tier_bounds"],
        json!({ "deployable": 0.1, "improvable": 1.6 })
    );
    assert_eq!(board["perturbations"]["tracking_loss"]["probability"], 0.5);
    let row = &board["rows"][0];
    assert_eq!(
        (&row["score"], &row["tier"]),
        (&json!(37.5), &json!("improvable"))
    );
    let evaluation = site
        .get(&format!("/api/v1/evaluations/{id}"), Some(&team.token))
        .await
        .json(200);
    assert_eq!(evaluation["result"]["weights"]["defend"], 0.25);
    let page = site.get("/", None).await.body;
    for words in [
        "0.75 × hit + 0.25 × defend + 0 × prepare",
        "more than 0.1, at most 1.6 penalty points per episode",
        "its own perturbation magnitudes",
    ] {
        assert!(
            page.contains(words) || page.contains(&words.replace("&#39;", "'")),
            "{words} is not in {page}"
        );
    }
    let page = site.get(&format!("/evaluations/{id}"), None).await.body;
    assert!(page.contains("more than 0.1, at most 1.6"), "{page}");

    // An empty object restores the default magnitudes. Settings that the request does not name do not change.
    let default_magnitudes = json!({ "perturbations": {}, "confirm": "Qualifying" });
    let changed = site.change_first_stage(default_magnitudes).await.json(200);
    assert_eq!(
        (changed.get("perturbations"), &changed["weights"]["hit"]),
        (None, &json!(0.75))
    );
    // A new stage copies the settings of the open one.
    let copied = site
        .post("/api/v1/stages", Some(ADMIN), &json!({ "name": "Next" }))
        .await
        .json(201);
    assert_eq!(
        copied["tier_bounds"],
        json!({ "deployable": 0.1, "improvable": 1.6 })
    );
}

#[tokio::test]
async fn board_without_settings_shows_those_of_the_ruleset() {
    let site = Site::start().await;
    let board = site.get("/api/v1/board", None).await.json(200);
    assert_eq!(
        board["weights"],
        json!({ "hit": 0.4, "defend": 0.4, "prepare": 0.2 })
    );
    assert_eq!(
        board["tier_bounds"],
        json!({ "deployable": 0.5, "improvable": 1.5 })
    );
    assert_eq!(board.get("perturbations"), None);
    let page = site.get("/", None).await.body;
    assert_eq!(page.matches("40&nbsp;% of the score").count(), 2, "{page}");
    assert_eq!(page.matches("20&nbsp;% of the score").count(), 1, "{page}");
    assert!(!page.contains("own perturbation magnitudes"), "{page}");
}

#[tokio::test]
async fn invalid_scoring_settings_are_refused_by_name() {
    let site = Site::start().await;
    let before = site.get("/api/v1/stages", None).await.json(200);
    for (body, words) in [
        (
            json!({ "weights": { "hit": 0.5, "defend": 0.5, "prepare": 0.5 } }),
            &["weights", "sum to 1"][..],
        ),
        (
            json!({ "weights": { "hit": 1.5, "defend": -0.5, "prepare": 0 } }),
            &["weights", "-0.5"],
        ),
        (json!({ "weights": { "hit": 1 } }), &["weights", "defend"]),
        (
            json!({ "tier_bounds": { "deployable": 0, "improvable": 1 } }),
            &["tier_bounds", "0 < deployable"],
        ),
        (
            json!({ "tier_bounds": { "deployable": 2, "improvable": 1 } }),
            &["tier_bounds", "deployable < improvable"],
        ),
        (
            json!({ "perturbations": { "wind": {} } }),
            &["perturbations", "wind"],
        ),
        (
            json!({ "perturbations": { "tracking_loss": { "probability": 1.5 } } }),
            &["tracking_loss.probability", "0 to 1", "1.5"],
        ),
        (
            json!({ "perturbations": { "disturbance": { "correlation_time_s": 0 } } }),
            &["correlation_time_s"],
        ),
        (
            json!({ "perturbations": { "model_mismatch": { "static_error_m": [0.9, 1] } } }),
            &["model_mismatch", "300 robots", "0.9 to 1 m"],
        ),
    ] {
        let mut body = body;
        body["confirm"] = json!("Qualifying");
        site.change_first_stage(body)
            .await
            .problem(422, "invalid-content", words);
    }
    assert_eq!(
        site.get("/api/v1/stages", None).await.json(200),
        before,
        "nothing was done"
    );
}
