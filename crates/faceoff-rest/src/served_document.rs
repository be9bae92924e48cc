//! `/api/v1/openapi.json`: the OpenAPI document, serialised and compressed once. It does not change while the server runs.

use axum::{
    body::Bytes,
    http::{HeaderMap, HeaderValue, header},
    response::{IntoResponse, Response},
};
use faceoff_service::{
    api_document::ApiDocument,
    content_negotiation::accepts_gzip,
    request_preconditions::{ETag, RequestPreconditions},
};
use flate2::{Compression, write::GzEncoder};
use serde_json::Value;
use std::{
    io::Write,
    sync::{Arc, LazyLock},
};

/// The document as it is sent.
#[derive(Clone)]
pub(super) struct ServedDocument(Arc<LazyLock<Encoded, Box<dyn FnOnce() -> Encoded + Send>>>);

struct Encoded {
    tag: ETag,
    json: Bytes,
    gzip: Bytes,
}

impl ServedDocument {
    /// The document will be serialised when it is first requested.
    pub(super) fn new(document: &ApiDocument) -> Self {
        let document = document.clone();
        let encode = move || Encoded::new(document.value());
        Self(Arc::new(LazyLock::new(Box::new(encode))))
    }

    /// Sends the document, unless the client already has it.
    pub(super) fn respond(
        &self,
        conditions: &RequestPreconditions,
        headers: &HeaderMap,
    ) -> Response {
        let Encoded { tag, json, gzip } = &**self.0;
        if let Some(response) = conditions.not_modified(tag) {
            return response;
        }
        let fields = [
            (header::ETAG, tag.header()),
            (
                header::CONTENT_TYPE,
                HeaderValue::from_static("application/json"),
            ),
            (header::VARY, HeaderValue::from_static("accept-encoding")),
        ];
        if accepts_gzip(headers) {
            let encoding = [(header::CONTENT_ENCODING, HeaderValue::from_static("gzip"))];
            (fields, encoding, gzip.clone()).into_response()
        } else {
            (fields, json.clone()).into_response()
        }
    }
}

impl Encoded {
    fn new(document: &Value) -> Self {
        let json = document.to_string();
        let mut encoder = GzEncoder::new(Vec::new(), Compression::default());
        let gzip = encoder
            .write_all(json.as_bytes())
            .and_then(|()| encoder.finish())
            .expect("writing to memory succeeds");
        Self {
            tag: ETag::new("openapi", &[&json]),
            json: json.into(),
            gzip: gzip.into(),
        }
    }
}
