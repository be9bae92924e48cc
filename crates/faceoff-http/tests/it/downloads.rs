//! Downloads in part, and downloads of what the client has.

use crate::site::{ADMIN, Answer, GZIP, Site, TestTeam, result};
use reqwest::Method;

const FILE: &str = "PK the recorded dataset";

struct Recorded {
    site: Site,
    team: TestTeam,
    dataset: String,
    archive: String,
}

impl Recorded {
    async fn one() -> Self {
        let site = Site::start().await;
        let team = site.team("Alpha").await;
        let submission = site.valid_submission(&team, "striker").await;
        let path = site.evaluate(&team, &submission).await;
        site.finish(&result([0.5, 0.6, 0.7], 100.0)).await;
        Self {
            dataset: format!("{path}/dataset"),
            archive: format!("{submission}/archive"),
            site,
            team,
        }
    }

    async fn ask(&self, method: Method, path: &str, headers: &[(&str, &str)]) -> Answer {
        let mut request = self.site.request(method, path, Some(&self.team.token));
        for (name, value) in headers {
            request = request.header(*name, *value);
        }
        Answer::of(request.send().await.unwrap()).await
    }

    async fn get(&self, headers: &[(&str, &str)]) -> Answer {
        self.ask(Method::GET, &self.dataset, headers).await
    }
}

#[tokio::test]
async fn a_download_goes_on_where_it_was_broken_off() {
    let recorded = Recorded::one().await;
    let whole = recorded.get(&[]).await;
    assert_eq!((whole.status.as_u16(), whole.body.as_str()), (200, FILE));
    let hash = blake3::hash(FILE.as_bytes()).to_string();
    let tag = format!("\"blake3-{hash}\"");
    assert_eq!(whole.header("etag"), tag);
    assert_eq!(whole.header("x-content-blake3"), hash);
    assert_eq!(whole.header("accept-ranges"), "bytes");
    assert_eq!(whole.header("cache-control"), "private, no-cache");
    assert_eq!(whole.header("vary"), "authorization, cookie");
    for (range, expected, told) in [
        ("bytes=0-0", "P", "bytes 0-0/23"),
        ("bytes=3-5", "the", "bytes 3-5/23"),
        ("bytes=16-", "dataset", "bytes 16-22/23"),
        ("bytes=16-999", "dataset", "bytes 16-22/23"),
        ("bytes=-7", "dataset", "bytes 16-22/23"),
        ("bytes=-999", FILE, "bytes 0-22/23"),
    ] {
        let part = recorded.get(&[("range", range), ("if-range", &tag)]).await;
        assert_eq!(
            (part.status.as_u16(), part.body.as_str()),
            (206, expected),
            "{range}"
        );
        assert_eq!(part.header("content-range"), told);
        assert_eq!(part.header("content-length"), expected.len().to_string());
        assert_eq!(part.header("etag"), tag);
        // Of the whole file, to be held against what the parts make.
        assert_eq!(part.header("x-content-blake3"), hash);
        assert_eq!(
            part.header("content-disposition"),
            whole.header("content-disposition")
        );
    }
    for range in ["bytes=23-", "bytes=99-100", "bytes=-0"] {
        let behind = recorded.get(&[("range", range)]).await;
        assert_eq!(behind.header("content-range"), "bytes */23", "{range}");
        let problem = behind.problem(416, "range-not-satisfiable", &["has 23 bytes"]);
        assert_eq!(problem["bytes"], 23);
    }
}

#[tokio::test]
async fn what_is_no_single_range_of_this_file_is_answered_with_all_of_it() {
    let recorded = Recorded::one().await;
    for headers in [
        [("range", "bytes=0-1,4-5"), ("accept", "*/*")],
        [("range", "bytes=5-2"), ("accept", "*/*")],
        [("range", "bytes=one-two"), ("accept", "*/*")],
        [("range", "lines=1-2"), ("accept", "*/*")],
        [("range", "bytes=3-5"), ("if-range", "\"blake3-00\"")],
        [
            ("range", "bytes=3-5"),
            ("if-range", "Sun, 01 Mar 2026 10:00:00 GMT"),
        ],
    ] {
        let answer = recorded.get(&headers).await;
        assert_eq!(
            (answer.status.as_u16(), answer.body.as_str()),
            (200, FILE),
            "{headers:?}"
        );
    }
}

#[tokio::test]
async fn who_has_the_file_is_sent_nothing() {
    let recorded = Recorded::one().await;
    let tag = recorded.get(&[]).await.header("etag").to_owned();
    for known in [tag.clone(), format!("\"other\", W/{tag}"), "*".to_owned()] {
        let answer = recorded.get(&[("if-none-match", &known)]).await;
        assert_eq!((answer.status.as_u16(), answer.body.as_str()), (304, ""));
        assert_eq!(answer.header("etag"), tag);
        assert_eq!(answer.header("cache-control"), "private, no-cache");
    }
    let answer = recorded.get(&[("if-none-match", "\"other\"")]).await;
    assert_eq!(answer.status, 200);
    // Nobody learns by a tag what is not theirs to have.
    let dataset = recorded.dataset.as_str();
    let request = recorded.site.request(Method::GET, dataset, None);
    let visitor = request.header("if-none-match", &tag).send().await.unwrap();
    assert_eq!(visitor.status(), 401);
}

#[tokio::test]
async fn the_headers_alone_are_those_of_the_file() {
    let recorded = Recorded::one().await;
    for path in [&recorded.dataset, &recorded.archive] {
        let whole = recorded.ask(Method::GET, path, &[]).await;
        // A range is of a GET alone.
        let headers = [("range", "bytes=3-5")];
        let head = recorded.ask(Method::HEAD, path, &headers).await;
        assert_eq!((head.status.as_u16(), head.body.as_str()), (200, ""));
        for name in [
            "content-length",
            "content-type",
            "content-disposition",
            "etag",
            "accept-ranges",
            "x-content-blake3",
        ] {
            assert_eq!(head.header(name), whole.header(name), "{name}");
        }
        assert_eq!(
            head.header("content-length"),
            whole.headers["content-length"].to_str().unwrap()
        );
    }
    let archive = recorded.ask(Method::GET, &recorded.archive, &[]).await;
    let hash = blake3::hash(&GZIP).to_string();
    assert_eq!(archive.header("x-content-blake3"), hash);
    let part = [("range", "bytes=2-2")];
    let part = recorded.ask(Method::GET, &recorded.archive, &part).await;
    assert_eq!((part.status.as_u16(), part.body.as_str()), (206, "\u{8}"));
    let host = recorded
        .site
        .request(Method::HEAD, &recorded.dataset, Some(ADMIN));
    assert_eq!(host.send().await.unwrap().status(), 200);
}
