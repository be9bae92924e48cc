//! A receiver of webhook deliveries on a real port, for tests. It records the requests, and can be made to fail.

use crate::site::string;
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

/// A delivery: its headers `webhook-id`, `webhook-timestamp` and `webhook-signature`, and its body.
#[derive(Debug, Clone)]
pub struct ReceivedRequest {
    pub id: String,
    pub timestamp: String,
    pub signature: String,
    pub body: String,
}

impl ReceivedRequest {
    pub fn json(&self) -> Value {
        serde_json::from_str(&self.body).unwrap()
    }

    /// Whether the request is signed with this secret. The signature is computed here, from the specification of Standard
    /// Webhooks, and not by the code under test.
    pub fn is_signed_by(&self, secret: &str) -> bool {
        let key = STANDARD
            .decode(secret.strip_prefix("whsec_").unwrap())
            .unwrap();
        let mut mac = Hmac::<sha2::Sha256>::new_from_slice(&key).unwrap();
        mac.update(format!("{}.{}.{}", self.id, self.timestamp, self.body).as_bytes());
        let expected = format!("v1,{}", STANDARD.encode(mac.finalize().into_bytes()));
        self.signature
            .split(' ')
            .any(|signature| signature == expected)
    }
}

/// How the receiver answers its next request. By default it answers 204.
#[derive(Debug, Clone, Copy)]
pub enum Behaviour {
    /// Answers with this status.
    Respond(u16),
    /// Redirects to another path of the receiver.
    Redirect,
    /// Never answers.
    Hang,
}

#[derive(Clone)]
struct ReceiverState {
    /// All received requests.
    requests: watch::Sender<Vec<ReceivedRequest>>,
    /// Behaviour for the next requests, one each.
    behaviours: Arc<Mutex<VecDeque<Behaviour>>>,
}

pub struct Receiver {
    pub url: String,
    pub port: u16,
    state: ReceiverState,
    server: JoinHandle<()>,
}

impl Drop for Receiver {
    fn drop(&mut self) {
        self.server.abort();
    }
}

async fn receive(
    State(state): State<ReceiverState>,
    uri: Uri,
    headers: HeaderMap,
    body: Bytes,
) -> Response {
    assert_eq!(uri.path(), "/hook", "no other path is requested");
    assert_eq!(headers[header::CONTENT_TYPE], "application/json");
    let header_text = |name: &str| headers[name].to_str().unwrap().to_owned();
    let request = ReceivedRequest {
        id: header_text("webhook-id"),
        timestamp: header_text("webhook-timestamp"),
        signature: header_text("webhook-signature"),
        body: String::from_utf8(body.to_vec()).unwrap(),
    };
    state
        .requests
        .send_modify(|requests| requests.push(request));
    let behaviour = state.behaviours.lock().unwrap().pop_front();
    match behaviour {
        None => StatusCode::NO_CONTENT.into_response(),
        Some(Behaviour::Respond(status)) => {
            let body = "secret response of the receiver";
            (StatusCode::from_u16(status).unwrap(), body).into_response()
        }
        Some(Behaviour::Redirect) => {
            (StatusCode::FOUND, [(header::LOCATION, "/other")]).into_response()
        }
        Some(Behaviour::Hang) => std::future::pending().await,
    }
}

impl Receiver {
    pub async fn start() -> Self {
        let listener = TcpListener::bind("127.0.0.1:0").await.unwrap();
        let port = listener.local_addr().unwrap().port();
        let state = ReceiverState {
            requests: watch::Sender::new(Vec::new()),
            behaviours: Arc::default(),
        };
        let router = Router::new().fallback(receive).with_state(state.clone());
        let server = tokio::spawn(async move { axum::serve(listener, router).await.unwrap() });
        Self {
            url: format!("http://127.0.0.1:{port}/hook"),
            port,
            state,
            server,
        }
    }

    /// Sets how the next requests are answered, after those whose behaviour is already set.
    pub fn add_behaviours(&self, behaviours: &[Behaviour]) {
        self.state.behaviours.lock().unwrap().extend(behaviours);
    }

    pub fn requests(&self) -> Vec<ReceivedRequest> {
        self.state.requests.borrow().clone()
    }

    /// Waits until at least `count` requests have arrived.
    pub async fn wait_for(&self, count: usize) -> Vec<ReceivedRequest> {
        let mut requests = self.state.requests.subscribe();
        requests
            .wait_for(|requests| requests.len() >= count)
            .await
            .unwrap()
            .clone()
    }

    /// The field `type` (the kind of the event) of each request.
    pub fn types(&self) -> Vec<String> {
        let requests = self.requests();
        requests
            .iter()
            .map(|request| string(&request.json()["type"]))
            .collect()
    }
}
