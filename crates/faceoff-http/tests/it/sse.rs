//! A client of server-sent events for tests: it opens a stream and reads it event by event.

use crate::site::Site;
use reqwest::{Method, Response};
use serde_json::Value;

/// One event of a stream.
#[derive(Debug, Clone, PartialEq)]
pub struct Event {
    pub name: String,
    pub id: Option<String>,
    pub data: Value,
}

/// An open stream that is read event by event.
pub struct Stream {
    response: Response,
    /// Received text that is not parsed yet.
    unread: String,
}

impl Stream {
    /// Opens a stream; `last_event_id` is the id of the last event that a client received before it reconnects.
    pub async fn open(
        site: &Site,
        path: &str,
        token: Option<&str>,
        last_event_id: Option<&str>,
    ) -> Self {
        let mut request = site.request(Method::GET, path, token);
        if let Some(last_event_id) = last_event_id {
            request = request.header("last-event-id", last_event_id);
        }
        let response = request.send().await.unwrap();
        assert_eq!(response.status(), 200);
        let header = |name: &str| response.headers()[name].to_str().unwrap();
        assert!(header("content-type").starts_with("text/event-stream"));
        assert_eq!(header("x-accel-buffering"), "no");
        Self {
            response,
            unread: String::new(),
        }
    }

    /// The next event, or `None` at the end of the stream.
    pub async fn next(&mut self) -> Option<Event> {
        loop {
            if let Some((block, rest)) = self.unread.split_once("\n\n") {
                let (block, rest) = (block.to_owned(), rest.to_owned());
                self.unread = rest;
                match parse(&block) {
                    Some(event) => return Some(event),
                    None => continue,
                }
            }
            let bytes = self.response.chunk().await.unwrap()?;
            self.unread += std::str::from_utf8(&bytes).unwrap();
        }
    }
}

/// The event of a block, or `None` for a comment that keeps the connection open.
fn parse(block: &str) -> Option<Event> {
    let field = |name: &str| {
        block
            .lines()
            .find_map(|line| line.strip_prefix(&format!("{name}: ")))
    };
    Some(Event {
        name: field("event")?.to_owned(),
        id: field("id").map(str::to_owned),
        data: serde_json::from_str(field("data")?).unwrap(),
    })
}
