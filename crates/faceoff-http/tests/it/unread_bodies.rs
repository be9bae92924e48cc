//! Tests of requests whose body the server does not read, mostly because it refuses them.

use crate::site::*;
use faceoff_http::HttpLimits;
use tokio::{
    io::{AsyncBufReadExt, AsyncReadExt, AsyncWriteExt, BufReader},
    net::TcpStream,
};

/// More bytes than the buffers of a connection hold.
const LARGE_BYTES: usize = 200 << 20;

/// A connection whose client writes and reads when the test says so.
pub struct Connection(BufReader<TcpStream>);

impl Connection {
    pub async fn open(site: &Site) -> Self {
        let address = site.url.trim_start_matches("http://");
        Self(BufReader::new(TcpStream::connect(address).await.unwrap()))
    }

    /// Sends the head of a request with this method, path and other headers.
    pub async fn send_head(&mut self, request: &str, headers: &[&str]) {
        let mut head = format!("{request} HTTP/1.1\r\nHost: faceoff\r\n");
        for header in headers {
            head += &format!("{header}\r\n");
        }
        head += "\r\n";
        self.0.write_all(head.as_bytes()).await.unwrap();
    }

    /// Sends bytes of a body.
    async fn send_body(&mut self, bytes: usize) {
        let chunk = vec![7; 1 << 20];
        let mut left = bytes;
        while left > 0 {
            let sent = self.0.write(&chunk[..left.min(chunk.len())]);
            left -= sent.await.unwrap();
        }
    }

    /// Reads the head of a response.
    pub async fn read_head(&mut self) -> String {
        let mut head = String::new();
        while !head.ends_with("\r\n\r\n") {
            let read = self.0.read_line(&mut head).await.unwrap();
            assert!(read > 0, "the connection was closed after {head:?}");
        }
        head
    }

    /// Reads the head of a response and its body, which must have a `Content-Length`.
    async fn read_response(&mut self) -> String {
        let head = self.read_head().await;
        let length = head
            .lines()
            .find_map(|line| line.strip_prefix("content-length: "));
        let mut body = vec![0; length.unwrap().parse().unwrap()];
        self.0.read_exact(&mut body).await.unwrap();
        head + &String::from_utf8(body).unwrap()
    }

    /// Waits until the server closes the connection. It must not send anything more, or reset the connection.
    async fn expect_end(&mut self) {
        let mut rest = String::new();
        self.0.read_to_string(&mut rest).await.unwrap();
        assert_eq!(rest, "");
    }
}

/// Asserts the status, the kind of the problem and whether the server closes the connection.
#[track_caller]
fn assert_refusal(response: &str, status: u16, slug: &str, is_closing: bool) {
    let status = format!("HTTP/1.1 {status} ");
    assert!(response.starts_with(&status), "{response}");
    assert!(response.contains(&format!("problems#{slug}")), "{response}");
    let closes = response.contains("connection: close\r\n");
    assert_eq!(closes, is_closing, "{response}");
}

#[tokio::test]
async fn small_unread_body_keeps_connection_open() {
    let site = Site::start().await;
    let mut connection = Connection::open(&site).await;
    for (path, status, slug) in [
        ("/api/v1/submissions", 401, "unauthenticated"),
        ("/api/v1/teams", 401, "unauthenticated"),
        ("/api/v1/nothing", 404, "not-found"),
    ] {
        let post = format!("POST {path}");
        connection
            .send_head(&post, &["Content-Length: 100000"])
            .await;
        // The response does not wait for the body.
        let refusal = connection.read_response().await;
        assert_refusal(&refusal, status, slug, false);
        connection.send_body(100_000).await;
        connection.send_head("GET /livez", &[]).await;
        let response = connection.read_response().await;
        assert!(response.starts_with("HTTP/1.1 200 "), "{response}");
    }
}

/// Sends a large body completely before it reads the response, as many clients do.
async fn refuse_large_body(site: &Site, headers: &[&str], status: u16, slug: &str) {
    let mut connection = Connection::open(site).await;
    let length = format!("Content-Length: {LARGE_BYTES}");
    let headers = [headers, &[&*length]].concat();
    connection
        .send_head("POST /api/v1/submissions", &headers)
        .await;
    connection.send_body(LARGE_BYTES).await;
    let refusal = connection.read_response().await;
    assert_refusal(&refusal, status, slug, true);
    connection.expect_end().await;
}

#[tokio::test]
async fn client_that_sends_large_body_first_gets_refusal() {
    let site = Site::start().await;
    let team = site.team("Alpha").await;
    let token = format!("Authorization: Bearer {}", team.token);
    refuse_large_body(&site, &[], 401, "unauthenticated").await;
    refuse_large_body(&site, &[&token], 413, "too-large").await;
    let form = "Content-Type: application/x-www-form-urlencoded";
    refuse_large_body(&site, &[&token, form], 415, "unsupported-media-type").await;
    let limits = HttpLimits {
        requests: 0,
        ..generous_limits()
    };
    let busy = Site::start_with(limits).await;
    refuse_large_body(&busy, &[], 503, "busy").await;
}

#[tokio::test]
async fn body_of_unknown_size_is_discarded_after_its_refusal() {
    let site = Site::start().await;
    let team = site.team("Alpha").await;
    let mut connection = Connection::open(&site).await;
    let token = format!("Authorization: Bearer {}", team.token);
    let headers = [&*token, "Transfer-Encoding: chunked"];
    connection
        .send_head("POST /api/v1/submissions", &headers)
        .await;
    let chunk = [b"100000\r\n", &vec![7; 1 << 20][..], b"\r\n"].concat();
    for _ in 0..200 {
        connection.0.write_all(&chunk).await.unwrap();
    }
    connection.0.write_all(b"0\r\n\r\n").await.unwrap();
    let refusal = connection.read_response().await;
    assert_refusal(&refusal, 415, "unsupported-media-type", true);
    connection.expect_end().await;
}

#[tokio::test]
async fn refused_client_is_not_asked_for_its_body() {
    let site = Site::start().await;
    for length in ["Content-Length: 10", "Content-Length: 200000000"] {
        let mut connection = Connection::open(&site).await;
        let headers = ["Expect: 100-continue", length];
        connection
            .send_head("POST /api/v1/submissions", &headers)
            .await;
        let refusal = connection.read_response().await;
        assert_refusal(&refusal, 401, "unauthenticated", true);
        // The client sends nothing and leaves the connection open; after some seconds the server closes it.
        connection.expect_end().await;
    }
}
