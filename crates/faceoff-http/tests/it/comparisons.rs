//! Tests of comparisons of two evaluations on the same episodes, and of rank groups, which are statistically tied teams on a
//! board.

use crate::{
    clips,
    html::texts,
    site::{OutcomeFn, Site, outcome},
};
use faceoff_airhockey::{EE, HIT, PREPARE};
use faceoff_store::{Artifacts, EvaluationState};
use faceoff_types::{EpisodeOutcome, EvaluationId, Task};
use serde_json::json;

/// The outcome of an episode: solved or not, and with or without a violation of the end effector's bounds.
fn episode_outcome(task: Task, episode: u32, solved: bool, has_violation: bool) -> EpisodeOutcome {
    EpisodeOutcome {
        success: solved,
        violations: [(EE, has_violation)].into_iter().collect(),
        ..outcome(task, episode, false)
    }
}

fn comparison_path(a: EvaluationId, b: EvaluationId) -> String {
    format!("/api/v1/evaluations/{a}/compare/{b}")
}

#[tokio::test]
async fn evaluations_of_a_day_are_compared_by_episode() {
    let site = Site::start().await;
    let alpha = |task, e| episode_outcome(task, e, e < 60, false);
    let beta = |task, e| episode_outcome(task, e, e < if task == HIT { 40 } else { 60 }, false);
    let [a, b] = site
        .run_day(100, [("Alpha", &alpha), ("Beta", &beta)])
        .await;
    let view = site.get(&comparison_path(a, b), None).await.json(200);
    assert_eq!(
        (&view["a"]["team"], &view["b"]["team"]),
        (&json!("Alpha"), &json!("Beta"))
    );
    assert_eq!(view["day"], "2026-03-01");
    let hit = &view["tasks"]["hit"];
    for (field, value) in [("both", 40), ("only_a", 20), ("only_b", 0), ("neither", 40)] {
        assert_eq!(hit[field], value, "{field}");
    }
    assert_eq!(hit["significant"], true);
    assert_eq!(view["tasks"]["defend"]["p_value"], 1.0);
    assert_eq!(view["overall"]["score_a"], 60.0);
    assert_eq!(view["overall"]["score_b"], 52.0);
    assert!(view.get("episodes").is_none());
    let path = format!("{}?episodes=true", comparison_path(a, b));
    let with_episodes = site.get(&path, None).await.json(200);
    let hit = &with_episodes["episodes"]["hit"];
    assert_eq!(hit["both"], json!((0..40).collect::<Vec<_>>()));
    assert_eq!(hit["only_a"], json!((40..60).collect::<Vec<_>>()));
    assert_eq!(hit["only_b"], json!([]));
    assert_eq!(hit["neither"], json!((60..100).collect::<Vec<_>>()));
    assert_eq!(with_episodes["tasks"], view["tasks"]);
    let swapped = site.get(&comparison_path(b, a), None).await.json(200);
    assert_eq!(swapped["tasks"]["hit"]["only_b"], 20);
    assert_eq!(swapped["overall"]["p_value"], view["overall"]["p_value"]);

    let page = site
        .get(&comparison_path(a, b).replace("/api/v1", ""), None)
        .await;
    let html = page.html(200);
    assert!(!page.body.contains("<script>"));
    for part in [
        "Alpha is ahead",
        "statistically tied",
        "+8.0",
        "+20.0",
        "under 0.001",
    ] {
        assert!(page.body.contains(part), "{part:?} is not in {}", page.body);
    }
    let differing = texts(&html, ".differing dd");
    assert!(differing[0].starts_with("40 41 42"), "{differing:?}");
    assert_eq!(differing[1], "none");
    let evaluation = site.get(&format!("/evaluations/{a}"), None).await;
    let link = format!("/evaluations/{a}/compare/{b}");
    assert!(evaluation.body.contains(&link), "{}", evaluation.body);
}

#[tokio::test]
async fn episode_of_two_teams_is_replayed_side_by_side() {
    let site = Site::start().await;
    let alpha = |task, e| episode_outcome(task, e, e < 60, false);
    let beta = |task, e| episode_outcome(task, e, e >= 1, false);
    let [a, b] = site
        .run_day(100, [("Alpha", &alpha), ("Beta", &beta)])
        .await;
    let pair_page = |episode: u32| format!("/evaluations/{a}/compare/{b}/prepare/{episode}");
    let without_clips = site.get(&pair_page(0), None).await;
    assert_eq!(without_clips.status, 409, "{}", without_clips.body);
    assert!(
        without_clips.body.contains("no replays"),
        "{}",
        without_clips.body
    );

    let folder = tempfile::tempdir().unwrap();
    let pack = clips::record_clips(folder.path());
    for id in [a, b] {
        let EvaluationState::Finished { dataset, .. } =
            site.store.evaluation(id).await.unwrap().state
        else {
            panic!("not finished");
        };
        let key = Artifacts::clips_key(&dataset);
        site.store.artifacts().put_file(&key, &pack).await.unwrap();
    }
    let page = site.get(&pair_page(0), None).await;
    let html = page.html(200);
    let replays = scraper::Selector::parse("section.replay").unwrap();
    let replays: Vec<_> = html.select(&replays).map(|found| found.value()).collect();
    assert_eq!(replays.len(), 2);
    for (replay, id) in replays.iter().zip([a, b]) {
        let motion = format!("/api/v1/evaluations/{id}/episodes/prepare/0/motion");
        assert_eq!(replay.attr("data-motion"), Some(motion.as_str()));
        assert_eq!(
            replay.attr("data-sync-group"),
            Some("both"),
            "both replays are synchronised"
        );
        assert_eq!(
            replay.attr("data-observed"),
            None,
            "observations are not public"
        );
    }
    assert_ne!(replays[0].id(), replays[1].id());
    assert!(
        page.body.contains(&pair_page(60)),
        "a link to the next episode that differs"
    );
    let list = site
        .get(&format!("/evaluations/{a}/compare/{b}"), None)
        .await;
    assert!(list.body.contains(&pair_page(0)), "{}", list.body);
    for missing in [
        pair_page(1000),
        format!("/evaluations/{a}/compare/{b}/swim/0"),
    ] {
        assert_eq!(site.get(&missing, None).await.status, 404, "{missing}");
    }
}

#[tokio::test]
async fn evaluations_that_cannot_be_compared_are_refused() {
    let site = Site::start().await;
    let every_second = |task, e| episode_outcome(task, e, e % 2 == 0, false);
    let [a] = site.run_day(10, [("Alpha", &every_second)]).await;
    site.next_day();
    let [tomorrow] = site.run_day(10, [("Tomorrow", &every_second)]).await;
    site.next_day();
    let queued = {
        let team = site.team("Queued").await;
        let submission = site.valid_submission(&team, "q").await;
        let path = site.start_evaluation(&team, &submission).await;
        path.rsplit('/').next().unwrap().parse().unwrap()
    };
    let refused = site.get(&comparison_path(a, tomorrow), None).await;
    let problem = refused.problem(409, "not-paired", &["2026-03-01", "2026-03-02"]);
    assert_eq!(problem["field"], "day");
    site.get(&comparison_path(a, queued), None)
        .await
        .problem(409, "conflict", &["no result"]);
    let unknown = EvaluationId::new();
    site.get(&comparison_path(a, unknown), None).await.problem(
        404,
        "not-found",
        &[&unknown.to_string()],
    );
    site.get("/api/v1/evaluations/1/compare/2", None)
        .await
        .problem(404, "not-found", &[]);
    let page = site
        .get(&format!("/evaluations/{a}/compare/{tomorrow}"), None)
        .await;
    assert_eq!(page.status, 409);
    assert!(page.body.contains("Not the same episodes"), "{}", page.body);
}

#[tokio::test]
async fn statistically_tied_teams_share_a_rank_group() {
    let site = Site::start().await;
    // Best, Close and Behind solve 450, 443 and 300 of 3 × 200 episodes. Careless solves as many as Best, but is in another
    // tier by chance: its 36 violations cost 108 points, and the bound is 100.
    let best = |task, e| episode_outcome(task, e, e < 150, false);
    let close = |task, e| {
        let solved = if task == PREPARE { 3 } else { 2 }..150;
        episode_outcome(task, e, solved.contains(&e), false)
    };
    let behind = |task, e| episode_outcome(task, e, e < 100, false);
    let careless = |task, e| episode_outcome(task, e, e < 150, task == HIT && e < 36);
    let teams: [(&str, OutcomeFn<'_>); 4] = [
        ("Best", &best),
        ("Close", &close),
        ("Behind", &behind),
        ("Careless", &careless),
    ];
    let [best, ..] = site.run_day(200, teams).await;
    for path in ["/api/v1/board", "/api/v1/board/hit"] {
        let board = site.get(path, None).await.json(200);
        assert_eq!(board["significance"], 0.05);
        assert_eq!(board["tier_change_resamples"], 2000);
        let rows = board["rows"].as_array().unwrap();
        let column = |name: &str| -> Vec<_> { rows.iter().map(|row| row[name].clone()).collect() };
        assert_eq!(
            column("team"),
            ["Best", "Close", "Behind", "Careless"],
            "{path}"
        );
        let groups = if path.ends_with("hit") {
            [1, 1, 2, 3]
        } else {
            [1, 2, 3, 4]
        };
        assert_eq!(column("rank_group"), groups, "{path}");
        let changes: Vec<f64> = rows
            .iter()
            .map(|row| row["tier_change_probability"].as_f64().unwrap())
            .collect();
        assert_eq!(changes[..3], [0.0; 3]);
        assert!((0.2..0.5).contains(&changes[3]), "{path}: {changes:?}");
    }
    let defend = site.get("/api/v1/board/defend", None).await.json(200);
    assert_eq!(defend["rows"][3]["tier_change_probability"], 0.0);

    let resamples = faceoff_scoring::TIER_CHANGE_RESAMPLES;
    let rules = include_str!("../../../../docs/rules.md");
    assert!(rules.contains(&format!("bootstrap: {resamples} times")));
    let page = site.get("/", None).await.body;
    assert!(page.contains(&format!("bootstrap with {resamples} resamples")));
    let hit_board = site.get("/tasks/hit", None).await.body;
    assert!(
        hit_board.contains("Statistically tied with Best"),
        "{hit_board}"
    );
    // Labels without information are left out: overall all teams differ, and only one tier depends on chance.
    assert!(!page.contains("Statistically tied with"), "{page}");
    assert_eq!(page.matches("other tier by chance:").count(), 1, "{page}");
    let evaluation = site.get(&format!("/evaluations/{best}"), None).await.body;
    assert!(
        evaluation.contains("another tier on other episodes: under 0.05 %"),
        "{evaluation}"
    );
}
