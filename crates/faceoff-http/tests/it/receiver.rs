//! Somebody who is told by webhooks, on a real port.

use crate::site::text;
use axum::{
    Router,
    body::Bytes,
    extract::State,
    http::{HeaderMap, StatusCode, Uri, header},
    response::{IntoResponse, Response},
};
use base64::{Engine as _, engine::general_purpose::STANDARD};
use hmac::{Hmac, KeyInit as _, Mac as _};
use serde_json::Value;
use std::{
    collections::VecDeque,
    sync::{Arc, Mutex},
};
use tokio::{net::TcpListener, sync::watch, task::JoinHandle};

#[derive(Debug, Clone)]
pub struct Got {
    pub id: String,
    pub timestamp: String,
    pub signature: String,
    pub body: String,
}

impl Got {
    pub fn json(&self) -> Value {
        serde_json::from_str(&self.body).unwrap()
    }

    /// Is it signed by this secret? By the conventions, and not by our own code.
    pub fn is_signed_by(&self, secret: &str) -> bool {
        let key = STANDARD
            .decode(secret.strip_prefix("whsec_").unwrap())
            .unwrap();
        let mut mac = Hmac::<sha2::Sha256>::new_from_slice(&key).unwrap();
        mac.update(format!("{}.{}.{}", self.id, self.timestamp, self.body).as_bytes());
        let expected = format!("v1,{}", STANDARD.encode(mac.finalize().into_bytes()));
        self.signature.split(' ').any(|one| one == expected)
    }
}

/// How the receiver behaves next; it takes everything else.
#[derive(Debug, Clone, Copy)]
pub enum Behaves {
    Answers(u16),
    /// With a redirect to itself.
    Redirects,
    Hangs,
}

#[derive(Clone)]
struct Desk {
    got: watch::Sender<Vec<Got>>,
    behaves: Arc<Mutex<VecDeque<Behaves>>>,
}

pub struct Receiver {
    pub url: String,
    pub port: u16,
    desk: Desk,
    server: JoinHandle<()>,
}

impl Drop for Receiver {
    fn drop(&mut self) {
        self.server.abort();
    }
}

async fn take(State(desk): State<Desk>, uri: Uri, headers: HeaderMap, body: Bytes) -> Response {
    assert_eq!(uri.path(), "/hook", "nothing else is asked for");
    assert_eq!(headers[header::CONTENT_TYPE], "application/json");
    let text = |name: &str| headers[name].to_str().unwrap().to_owned();
    let got = Got {
        id: text("webhook-id"),
        timestamp: text("webhook-timestamp"),
        signature: text("webhook-signature"),
        body: String::from_utf8(body.to_vec()).unwrap(),
    };
    desk.got.send_modify(|all| all.push(got));
    let behaves = desk.behaves.lock().unwrap().pop_front();
    match behaves {
        None => StatusCode::NO_CONTENT.into_response(),
        Some(Behaves::Answers(status)) => {
            let words = "what is told here is shown to nobody";
            (StatusCode::from_u16(status).unwrap(), words).into_response()
        }
        Some(Behaves::Redirects) => {
            (StatusCode::FOUND, [(header::LOCATION, "/elsewhere")]).into_response()
        }
        Some(Behaves::Hangs) => std::future::pending().await,
    }
}

impl Receiver {
    pub async fn start() -> Self {
        let listener = TcpListener::bind("127.0.0.1:0").await.unwrap();
        let port = listener.local_addr().unwrap().port();
        let desk = Desk {
            got: watch::Sender::new(Vec::new()),
            behaves: Arc::default(),
        };
        let router = Router::new().fallback(take).with_state(desk.clone());
        let server = tokio::spawn(async move { axum::serve(listener, router).await.unwrap() });
        Self {
            url: format!("http://127.0.0.1:{port}/hook"),
            port,
            desk,
            server,
        }
    }

    pub fn behaves(&self, next: &[Behaves]) {
        self.desk.behaves.lock().unwrap().extend(next);
    }

    pub fn got(&self) -> Vec<Got> {
        self.desk.got.borrow().clone()
    }

    /// Waits until so much has come.
    pub async fn comes(&self, count: usize) -> Vec<Got> {
        let mut got = self.desk.got.subscribe();
        got.wait_for(|all| all.len() >= count)
            .await
            .unwrap()
            .clone()
    }

    pub fn types(&self) -> Vec<String> {
        let got = self.got();
        got.iter().map(|one| text(&one.json()["type"])).collect()
    }
}
