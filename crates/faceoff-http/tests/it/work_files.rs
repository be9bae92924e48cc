//! Files for workers on other machines: what an order opens, for as long as it is its holder's.

use crate::site::{Answer, GZIP, Site};
use faceoff_store::{Claimed, Work};
use faceoff_types::BundleRef;
use faceoff_wire::grant::{Grant, GrantKey, Plays, Writes};
use reqwest::Method;

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
        plays: Plays::Nothing,
    };
    let sealed = grant.sealed(&site.grant_key()).unwrap();
    let path_of = |bundle: &BundleRef| format!("/work/bundles/{}", bundle.blake3);

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
    assert_eq!(put("steps.parquet", &sealed).await.status, 204);
    let stored = site
        .store
        .artifacts()
        .bytes_of("runs/of-this/lease/steps.parquet");
    assert_eq!(stored.await.unwrap(), Some(4));
    for outside in ["..%2Fanother", ".hidden", "a%20b"] {
        put(outside, &sealed).await.problem(404, "not-found", &[]);
    }

    // What another server has sealed, what was sealed for something else, and nothing at all.
    let foreign = grant.sealed(&GrantKey::of(&[7; 32])).unwrap();
    let (words, _) = sealed.split_once('.').unwrap();
    let (_, other_seal) = foreign.split_once('.').unwrap();
    for forged in [&foreign, &format!("{words}.{other_seal}"), ""] {
        put("steps.parquet", forged).await.problem(
            403,
            "forbidden",
            &["with the grant of their order"],
        );
    }
    // Of another lease of the same unit.
    let earlier = Grant {
        nonce: claim.unit,
        ..grant
    };
    let earlier = earlier.sealed(&site.grant_key()).unwrap();
    put("steps.parquet", &earlier)
        .await
        .problem(403, "forbidden", &["no longer this worker's"]);

    site.store.release(&claim, site.now()).await.unwrap();
    for (method, path) in [
        (Method::GET, path_of(&bundle)),
        (Method::PUT, "/work/files/steps.parquet".to_owned()),
    ] {
        ask(&site, method, &path, &sealed, b"").await.problem(
            403,
            "forbidden",
            &["no longer this worker's"],
        );
    }
}
