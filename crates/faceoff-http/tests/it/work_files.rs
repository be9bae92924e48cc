//! Files for workers on other machines: what an order opens, for as long as it is its holder's.

use crate::site::{Answer, GZIP, Site};
use faceoff_store::{Claimed, Work};
use faceoff_types::{BundleRef, PerturbationSettings};
use faceoff_wire::{
    game::GameSpec,
    grant::{Grant, GrantKey, Plays, Writes},
};
use reqwest::Method;
use serde_json::json;

async fn ask(site: &Site, method: Method, path: &str, grant: &str, body: &'static [u8]) -> Answer {
    let request = site
        .request(method, path, None)
        .header("authorization", format!("Grant {grant}"))
        .body(body);
    Answer::of(request.send().await.unwrap()).await
}

#[tokio::test]
async fn an_order_opens_its_bundles_and_the_place_of_its_recording_while_it_is_held() {
    let site = Site::start().await;
    let team = site.team("Alpha").await;
    let submission = site.valid_submission(&team, "hold").await;
    site.evaluate(&team, &submission).await;
    let Claimed { claim, work } = site.claim().await;
    let Work::Shard { bundle, .. } = work else {
        panic!("expected a shard");
    };
    let grant = Grant {
        unit: claim.unit,
        nonce: claim.nonce,
        bundles: vec![bundle.clone()],
        writes: Writes::Folder("runs/of-this/lease".into()),
        plays: Plays::Game(game()),
        program: String::new(),
    };
    let sealed = grant.sealed(&site.grant_key()).unwrap();
    let path_of = |bundle: &BundleRef| format!("/work/bundles/{}", bundle.blake3);

    // What was merely given out opens nothing: many may receive it.
    for (method, path) in [
        (Method::GET, path_of(&bundle)),
        (Method::PUT, "/work/files/game.zip".to_owned()),
    ] {
        let answer = ask(&site, method, &path, &sealed, b"").await;
        answer.problem(403, "forbidden", &["not begun by a worker"]);
    }
    let begin = async |slot: &str| {
        let begins = site.store.hand_over(&claim, slot, 30, site.now());
        assert!(begins.await.unwrap());
    };
    begin("remote/rack-1/slot-0").await;
    let fetched = ask(&site, Method::GET, &path_of(&bundle), &sealed, b"").await;
    assert_eq!(fetched.status, 200, "{}", fetched.body);
    assert_eq!(fetched.header("content-length"), GZIP.len().to_string());
    let another = format!("/work/bundles/{}", "0".repeat(64));
    ask(&site, Method::GET, &another, &sealed, b"")
        .await
        .problem(404, "not-found", &["bundle of this order"]);
    let put = async |name: &str, grant: &str| {
        ask(
            &site,
            Method::PUT,
            &format!("/work/files/{name}"),
            grant,
            b"rows",
        )
        .await
    };
    assert_eq!(put("game.zip", &sealed).await.status, 204);
    let bytes_of = async || {
        let key = "runs/of-this/lease/game.zip";
        site.store.artifacts().bytes_of(key).await.unwrap()
    };
    assert_eq!(bytes_of().await, Some(4));
    for outside in ["..%2Fanother", ".hidden", "a%20b", "steps.parquet"] {
        put(outside, &sealed).await.problem(404, "not-found", &[]);
    }

    // What another server has sealed, what was sealed for something else, and nothing at all.
    let foreign = grant.sealed(&GrantKey::of(&[7; 32])).unwrap();
    let (words, _) = sealed.split_once('.').unwrap();
    let (_, other_seal) = foreign.split_once('.').unwrap();
    for forged in [&foreign, &format!("{words}.{other_seal}"), ""] {
        put("game.zip", forged)
            .await
            .problem(403, "forbidden", &["with the grant of their order"]);
    }
    // Of another lease of the same unit.
    let earlier = Grant {
        nonce: claim.unit,
        ..grant
    };
    let earlier = earlier.sealed(&site.grant_key()).unwrap();
    put("game.zip", &earlier)
        .await
        .problem(403, "forbidden", &["no longer this worker's"]);

    site.store.release(&claim, site.now()).await.unwrap();
    for (method, path) in [
        (Method::GET, path_of(&bundle)),
        (Method::PUT, "/work/files/game.zip".to_owned()),
    ] {
        ask(&site, method, &path, &sealed, b"").await.problem(
            403,
            "forbidden",
            &["no longer this worker's"],
        );
    }
}

/// A worker may say that it is done while a body of its own is still on its way: what was looked at and counts must not be replaced by it.
#[tokio::test]
async fn a_body_that_arrives_after_its_order_is_over_or_looked_at_changes_nothing() {
    let site = Site::start().await;
    let team = site.team("Alpha").await;
    let submission = site.valid_submission(&team, "hold").await;
    site.evaluate(&team, &submission).await;
    let Claimed { claim, .. } = site.claim().await;
    let slot = "remote/rack-1/slot-0";
    let begins = site.store.hand_over(&claim, slot, 30, site.now());
    assert!(begins.await.unwrap());
    let grant = Grant {
        unit: claim.unit,
        nonce: claim.nonce,
        bundles: Vec::new(),
        writes: Writes::Folder("runs/of-this/lease".into()),
        plays: Plays::Game(game()),
        program: String::new(),
    };
    let sealed = grant.sealed(&site.grant_key()).unwrap();
    let bytes_of = async |name: &str| {
        let key = format!("runs/of-this/lease/{name}");
        site.store.artifacts().bytes_of(&key).await.unwrap()
    };
    // Its headers are taken, and half of it.
    let late = async |name: &'static str| {
        let (rest, body) = tokio::sync::mpsc::channel::<Result<&'static [u8], std::io::Error>>(1);
        rest.send(Ok(b"forged ")).await.unwrap();
        let body = futures::stream::unfold(body, async |mut body| Some((body.recv().await?, body)));
        let request = site
            .request(Method::PUT, &format!("/work/files/{name}"), None)
            .header("authorization", format!("Grant {sealed}"))
            .body(reqwest::Body::wrap_stream(body));
        let answer = tokio::spawn(request.send());
        // It is being received as soon as its folder has a file.
        while std::fs::read_dir(site.folder.path().join("uploads"))
            .unwrap()
            .count()
            == 0
        {
            tokio::time::sleep(std::time::Duration::from_millis(5)).await;
        }
        (rest, answer)
    };
    let (rest, answer) = late("game.zip").await;
    assert!(
        site.store.workers().close_files(claim.nonce),
        "nothing is being stored"
    );
    rest.send(Ok(b"rows")).await.unwrap();
    drop(rest);
    let answer = Answer::of(answer.await.unwrap().unwrap()).await;
    answer.problem(403, "forbidden", &["its files stay what they are"]);
    assert_eq!(bytes_of("game.zip").await, None);

    // Nor when what was looked at is over and forgotten.
    site.store.workers().forget_files(claim.nonce);
    let (rest, answer) = late("game.zip").await;
    site.store.release(&claim, site.now()).await.unwrap();
    rest.send(Ok(b"rows")).await.unwrap();
    drop(rest);
    let answer = Answer::of(answer.await.unwrap().unwrap()).await;
    answer.problem(403, "forbidden", &["no longer this worker's"]);
    assert_eq!(bytes_of("game.zip").await, None);
}

#[tokio::test]
async fn a_banned_worker_reads_and_writes_nothing_more() {
    let site = Site::start().await;
    let team = site.team("Alpha").await;
    let submission = site.valid_submission(&team, "hold").await;
    site.evaluate(&team, &submission).await;
    let Claimed { claim, work } = site.claim().await;
    let Work::Shard { bundle, .. } = work else {
        panic!("expected a shard");
    };
    let grant = Grant {
        unit: claim.unit,
        nonce: claim.nonce,
        bundles: vec![bundle.clone()],
        writes: Writes::Nothing,
        plays: Plays::Nothing,
        program: String::new(),
    };
    let sealed = grant.sealed(&site.grant_key()).unwrap();
    let path = format!("/work/bundles/{}", bundle.blake3);
    let begins = site
        .store
        .hand_over(&claim, "remote/rack-1/slot-0", 30, site.now());
    assert!(begins.await.unwrap());
    assert_eq!(
        ask(&site, Method::GET, &path, &sealed, b"").await.status,
        200
    );
    let banned = [("rack-1".to_owned(), "it lies".to_owned())];
    site.store.workers().set_banned(banned);
    ask(&site, Method::GET, &path, &sealed, b"").await.problem(
        403,
        "forbidden",
        &["takes nothing of this worker"],
    );
}

/// What is played under an order whose files are a game's.
fn game() -> GameSpec {
    let spec = json!({
        "ruleset": "airhockey-2023.3", "steps": 500, "profile": "ideal", "seed": "0".repeat(64),
        "mismatch_seed": "0".repeat(64), "perturbations": PerturbationSettings::default(),
    });
    serde_json::from_value(spec).unwrap()
}
