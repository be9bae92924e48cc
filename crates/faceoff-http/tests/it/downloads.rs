//! Tests of range requests and conditional requests of downloads.

use crate::site::{ADMIN, Answer, DATASET, GZIP, Site, TestTeam, result};
use reqwest::Method;

/// A finished evaluation, with the paths of two downloads.
struct FinishedEvaluation {
    site: Site,
    team: TestTeam,
    dataset: String,
    bundle: String,
}

impl FinishedEvaluation {
    async fn start() -> Self {
        let site = Site::start().await;
        let (team, submission, path) = site.team_with_evaluation("Alpha", "striker").await;
        site.finish_evaluation(&result([0.5, 0.6, 0.7], 100.0))
            .await;
        Self {
            dataset: format!("{path}/dataset"),
            bundle: format!("{submission}/bundle"),
            site,
            team,
        }
    }

    async fn request(&self, method: Method, path: &str, headers: &[(&str, &str)]) -> Answer {
        let mut request = self.site.request(method, path, Some(&self.team.token));
        for (name, value) in headers {
            request = request.header(*name, *value);
        }
        Answer::read(request.send().await.unwrap()).await
    }

    /// Gets the dataset.
    async fn get(&self, headers: &[(&str, &str)]) -> Answer {
        self.request(Method::GET, &self.dataset, headers).await
    }
}

#[tokio::test]
async fn download_resumes_with_range_requests() {
    let evaluation = FinishedEvaluation::start().await;
    let whole = evaluation.get(&[]).await;
    assert_eq!((whole.status.as_u16(), whole.body.as_str()), (200, DATASET));
    let hash = blake3::hash(DATASET.as_bytes()).to_string();
    let tag = format!("\"blake3-{hash}\"");
    assert_eq!(whole.header("etag"), tag);
    assert_eq!(whole.header("x-content-blake3"), hash);
    assert_eq!(whole.header("accept-ranges"), "bytes");
    assert_eq!(whole.header("cache-control"), "private, no-cache");
    assert_eq!(whole.header("vary"), "authorization, cookie");
    for (range, expected, content_range) in [
        ("bytes=0-0", "P", "bytes 0-0/23"),
        ("bytes=3-5", "the", "bytes 3-5/23"),
        ("bytes=16-", "dataset", "bytes 16-22/23"),
        ("bytes=16-999", "dataset", "bytes 16-22/23"),
        ("bytes=-7", "dataset", "bytes 16-22/23"),
        ("bytes=-999", DATASET, "bytes 0-22/23"),
    ] {
        let part = evaluation
            .get(&[("range", range), ("if-range", &tag)])
            .await;
        assert_eq!(
            (part.status.as_u16(), part.body.as_str()),
            (206, expected),
            "{range}"
        );
        assert_eq!(part.header("content-range"), content_range);
        assert_eq!(part.header("content-length"), expected.len().to_string());
        assert_eq!(part.header("etag"), tag);
        // The hash of the whole file, to check the assembled parts.
        assert_eq!(part.header("x-content-blake3"), hash);
        assert_eq!(
            part.header("content-disposition"),
            whole.header("content-disposition")
        );
    }
    for range in ["bytes=23-", "bytes=99-100", "bytes=-0"] {
        let beyond_end = evaluation.get(&[("range", range)]).await;
        assert_eq!(beyond_end.header("content-range"), "bytes */23", "{range}");
        let problem = beyond_end.problem(416, "range-not-satisfiable", &["within 23 bytes"]);
        assert_eq!(problem["bytes"], 23);
    }
}

#[tokio::test]
async fn invalid_or_outdated_range_gets_the_whole_file() {
    let evaluation = FinishedEvaluation::start().await;
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
        let answer = evaluation.get(&headers).await;
        assert_eq!(
            (answer.status.as_u16(), answer.body.as_str()),
            (200, DATASET),
            "{headers:?}"
        );
    }
}

#[tokio::test]
async fn download_with_known_etag_answers_not_modified() {
    let evaluation = FinishedEvaluation::start().await;
    let tag = evaluation.get(&[]).await.header("etag").to_owned();
    for known_tags in [tag.clone(), format!("\"other\", W/{tag}"), "*".to_owned()] {
        let answer = evaluation.get(&[("if-none-match", &known_tags)]).await;
        assert_eq!((answer.status.as_u16(), answer.body.as_str()), (304, ""));
        assert_eq!(answer.header("etag"), tag);
        assert_eq!(answer.header("cache-control"), "private, no-cache");
    }
    let answer = evaluation.get(&[("if-none-match", "\"other\"")]).await;
    assert_eq!(answer.status, 200);
    // A known ETag gives no access to the file.
    let dataset = evaluation.dataset.as_str();
    let request = evaluation.site.request(Method::GET, dataset, None);
    let visitor = request.header("if-none-match", &tag).send().await.unwrap();
    assert_eq!(visitor.status(), 401);
}

#[tokio::test]
async fn head_request_has_the_headers_of_the_file() {
    let evaluation = FinishedEvaluation::start().await;
    for path in [&evaluation.dataset, &evaluation.bundle] {
        let whole = evaluation.request(Method::GET, path, &[]).await;
        // Ranges apply to GET requests only.
        let headers = [("range", "bytes=3-5")];
        let head = evaluation.request(Method::HEAD, path, &headers).await;
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
    let bundle = evaluation
        .request(Method::GET, &evaluation.bundle, &[])
        .await;
    let hash = blake3::hash(&GZIP).to_string();
    assert_eq!(bundle.header("x-content-blake3"), hash);
    let part = [("range", "bytes=2-2")];
    let part = evaluation
        .request(Method::GET, &evaluation.bundle, &part)
        .await;
    // The third byte of `GZIP`.
    assert_eq!((part.status.as_u16(), part.body.as_str()), (206, "\u{8}"));
    let organiser = evaluation
        .site
        .request(Method::HEAD, &evaluation.dataset, Some(ADMIN));
    assert_eq!(organiser.send().await.unwrap().status(), 200);
}
