//! Tests of ablations, which evaluate a submission without perturbations of the simulator, with each alone, and with all (six
//! *profiles*). Organisers start them, public pages show them, and they affect neither evaluations nor the board.

use crate::{
    clips,
    site::{ADMIN, GZIP, Site, TestTeam, outcome, string},
};
use faceoff_airhockey::{ABLATION_PROFILES, IDEAL, TRACKING_LOSS};
use faceoff_scoring::EpisodeSummary;
use faceoff_store::Artifacts;
use faceoff_testkit::{shard_commit, shard_outcomes};
use faceoff_types::{EpisodeOutcome, SubmissionId};
use scraper::Selector;
use serde_json::json;

/// Pairs of a task and a profile; an ablation has a result for each.
const TASK_PROFILES: u32 = 3 * 6;

/// Runs `shards` shards of the next ablation. All episodes succeed in `ideal`, none with tracking loss, and every second
/// one in the other profiles.
async fn run_shards(site: &Site, shards: u32) {
    for _ in 0..shards {
        let (claim, run, shard) = site.claim_shard().await;
        let outcomes = shard_outcomes(&shard, |task, episode| {
            let success = match run.plan.profile {
                IDEAL => true,
                TRACKING_LOSS => false,
                _ => episode % 2 == 0,
            };
            EpisodeOutcome {
                success,
                ..outcome(task, episode, false)
            }
        });
        let commit = shard_commit(outcomes, None);
        site.store
            .commit_shard(&claim, commit, site.now())
            .await
            .unwrap();
    }
}

/// A team with a valid submission. Returns also the path of the submission's ablation in the API, and that of its page.
async fn team_with_submission(site: &Site) -> (TestTeam, String, String) {
    let team = site.team("Alpha").await;
    let submission = site.valid_submission(&team, "striker").await;
    let api = format!("{submission}/ablation");
    let page = api.replace("/api/v1", "");
    (team, api, page)
}

#[tokio::test]
async fn ablation_results_are_shown_to_team_and_visitors() {
    let site = Site::start().await;
    let (team, api, page) = team_with_submission(&site).await;
    site.get(&api, Some(&team.token))
        .await
        .problem(404, "not-found", &["ablation"]);
    assert_eq!(site.get(&page, None).await.status.as_u16(), 404);

    let request = json!({ "episodes_per_task": 8 });
    let started = site.post(&api, Some(ADMIN), &request).await.json(201);
    assert_eq!(started["state"], "open");
    assert_eq!(
        started["progress"],
        json!({ "episodes_done": 0, "episodes_total": 8 * TASK_PROFILES })
    );
    site.post(&api, Some(ADMIN), &request)
        .await
        .problem(409, "conflict", &["running"]);
    assert!(
        site.get(&page, None)
            .await
            .body
            .contains("0 of 144 episodes")
    );

    run_shards(&site, 2 * TASK_PROFILES).await;
    let view = site.get(&api, Some(&team.token)).await.json(200);
    assert_eq!(view["state"], "finished");
    let hit = view["tasks"]["hit"].as_array().unwrap();
    assert_eq!((hit.len(), &hit[0]["profile"]), (6, &json!("ideal")));
    let tracking_loss = &hit[4];
    assert_eq!(tracking_loss["profile"], "tracking_loss");
    // `lost` counts the episodes that succeed in `ideal` only.
    assert_eq!(
        (&tracking_loss["difference"], &tracking_loss["lost"]),
        (&json!(-1.0), &json!(8))
    );
    // Eight paired episodes with the same difference: twice the probability 1/2^8.
    let p_value = tracking_loss["p_value"].as_f64().unwrap();
    assert!((p_value - 2.0 / 256.0).abs() < 1e-12);

    let html = site.get(&page, None).await.html(200);
    let count = |selector: &str| html.select(&Selector::parse(selector).unwrap()).count();
    assert_eq!(count("svg rect.fill"), 18);
    assert_eq!(count("svg line.whisker"), 18);
    assert_eq!(count("table tbody tr"), 18);
    assert_eq!(count("table th:not([scope])"), 0);
    let rows = Selector::parse("table tbody tr").unwrap();
    let row: String = html.select(&rows).nth(4).unwrap().text().collect();
    for part in [
        "hit",
        "T · tracking_loss",
        "0 of 8",
        "−100.0",
        "0.008",
        "significant",
    ] {
        assert!(row.contains(part), "{part:?} is not in {row:?}");
    }
    let table = site.get(&format!("{page}.csv"), None).await;
    assert_eq!(table.body.lines().count(), 1 + 18, "{}", table.body);
    let line = table.body.lines().nth(5).unwrap();
    assert!(line.starts_with("hit,tracking_loss,8,0,0,"), "{line}");
}

#[tokio::test]
async fn ablation_is_started_by_organiser_and_hidden_from_other_teams() {
    let site = Site::start().await;
    let (team, api, _) = team_with_submission(&site).await;
    let refused = site.post(&api, Some(&team.token), &json!({})).await;
    assert_eq!(refused.status.as_u16(), 403);
    site.post(&api, Some(ADMIN), &json!({ "episodes_per_task": 0 }))
        .await
        .problem(422, "invalid-content", &["episodes_per_task"]);
    let started = site.post(&api, Some(ADMIN), &json!({})).await.json(201);
    assert_eq!(started["episodes_per_task"], 100);
    let other_team = site.team("Beta").await;
    site.get(&api, Some(&other_team.token))
        .await
        .problem(404, "not-found", &[]);
    let validating = site.upload(&other_team.token, GZIP.to_vec()).await;
    let id = string(&validating.json(201)["id"]);
    site.post(
        &format!("/api/v1/submissions/{id}/ablation"),
        Some(ADMIN),
        &json!({}),
    )
    .await
    .problem(409, "conflict", &["only a valid submission"]);
}

#[tokio::test]
async fn ablation_is_no_evaluation_but_is_linked_from_it() {
    let site = Site::start().await;
    let (team, api, page) = team_with_submission(&site).await;
    site.post(&api, Some(ADMIN), &json!({ "episodes_per_task": 1 }))
        .await
        .json(201);
    run_shards(&site, TASK_PROFILES).await;
    let board = site.get("/api/v1/board", None).await.json(200);
    assert_eq!(board["rows"], json!([]));
    let submission = api.replace("/ablation", "");
    let evaluation = site.start_evaluation(&team, &submission).await;
    let evaluation_page = site.get(&evaluation.replace("/api/v1", ""), None).await;
    assert!(evaluation_page.body.contains(&format!("href=\"{page}\"")));
}

/// The stored summary is changed to one success more than the outcomes have. A response that shows it was made from the
/// summary, not from the outcomes.
#[tokio::test]
async fn viewing_an_ablation_stores_nothing_and_reads_the_summary() {
    let mut site = Site::start().await;
    let (_, api, page) = team_with_submission(&site).await;
    site.post(&api, Some(ADMIN), &json!({ "episodes_per_task": 4 }))
        .await
        .json(201);
    run_shards(&site, TASK_PROFILES).await;
    let first_view = site.get(&api, Some(ADMIN)).await.json(200);
    assert_eq!(first_view["tasks"]["hit"][4]["successes"], 0);

    let submission: SubmissionId = api.split('/').nth(4).unwrap().parse().unwrap();
    let ablation = site.store.newest_ablation(submission).await.unwrap();
    let runs = ablation.unwrap().runs;
    let ids: Vec<_> = runs.values().copied().collect();
    let version = EpisodeSummary::VERSION;
    let read_stored = async || site.store.episode_summaries(&ids, version).await.unwrap();
    assert!(read_stored().await.is_empty());
    faceoff_worker::clean_up(
        &site.store,
        faceoff_airhockey::simulator().competition(),
        &site.clock(),
    )
    .await;
    let stored = read_stored().await;
    assert_eq!(stored.len(), ABLATION_PROFILES.len());
    let run = runs[&TRACKING_LOSS];
    // `words` are the bits of the episodes' successes.
    let marked = stored[&run].replacen(r#""words":[0]"#, r#""words":[1]"#, 1);
    assert_ne!(marked, stored[&run]);
    let stored_summary = site
        .store
        .store_episode_summary(run, version, &marked, site.now());
    stored_summary.await.unwrap();

    let again = site.get(&api, Some(ADMIN)).await.json(200);
    assert_eq!(
        again, first_view,
        "the cached summary is not read from the database again"
    );
    site.restart().await;
    let restarted = site.get(&api, Some(ADMIN)).await.json(200);
    assert_eq!(restarted["tasks"]["hit"][4]["successes"], 1);
    let page = site.get(&page, None).await;
    assert!(page.body.contains("1 of 4"), "{}", page.body);
}

#[tokio::test]
async fn perturbed_episode_is_shown_beside_the_ideal_one() {
    let site = Site::start().await;
    let (team, api, page) = team_with_submission(&site).await;
    let request = json!({ "episodes_per_task": 1 });
    site.post(&api, Some(ADMIN), &request).await.json(201);
    run_shards(&site, TASK_PROFILES).await;
    let page_without_clips = site.get(&page, None).await;
    assert!(
        !page_without_clips
            .body
            .contains("Episodes with another outcome"),
        "{}",
        page_without_clips.body
    );

    let submission = api.split('/').nth(4).unwrap().parse().unwrap();
    let ablation = site.store.newest_ablation(submission).await.unwrap();
    let folder = tempfile::tempdir().unwrap();
    let pack = clips::record_clips(folder.path());
    for profile in [IDEAL, TRACKING_LOSS] {
        let key = Artifacts::ablation_clips_key(ablation.as_ref().unwrap().id, profile);
        site.store.artifacts().put_file(&key, &pack).await.unwrap();
    }
    let pair_page = format!("{page}/tracking_loss/prepare/0");
    let answer = site.get(&page, None).await;
    assert!(answer.body.contains(&pair_page), "{}", answer.body);
    assert!(!answer.body.contains("/noise/"), "{}", answer.body);

    let answer = site.get(&pair_page, None).await;
    let html = answer.html(200);
    let replays = Selector::parse("section.replay").unwrap();
    let motions: Vec<_> = html
        .select(&replays)
        .map(|replay| replay.attr("data-motion").unwrap().to_owned())
        .collect();
    let expected =
        ["ideal", "tracking_loss"].map(|profile| format!("{api}/{profile}/prepare/0/motion"));
    assert_eq!(motions, expected);
    for motion in &motions {
        assert_eq!(site.get(motion, None).await.status, 200, "{motion}");
        let observed = motion.replace("/motion", "/observed");
        assert_eq!(site.get(&observed, None).await.status, 401);
        let other_team = site.team(&format!("Beta {}", motion.len())).await;
        assert_eq!(
            site.get(&observed, Some(&other_team.token)).await.status,
            403
        );
        for token in [&*team.token, ADMIN] {
            assert_eq!(site.get(&observed, Some(token)).await.status, 200);
        }
    }
    for missing in [
        format!("{page}/disturbance/prepare/0"),
        format!("{page}/tracking_loss/hit/0"),
        format!("{page}/wind/hit/0"),
        format!("{api}/tracking_loss/prepare/99/motion"),
    ] {
        assert_eq!(site.get(&missing, None).await.status, 404, "{missing}");
    }
}
