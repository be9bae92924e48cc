//! The OpenAPI document of the API, made when it is first needed: most starts of a server need it late or never.

use serde_json::Value;
use std::{
    fmt,
    sync::{Arc, LazyLock},
};

/// The document, shared by the API, which serves it, and the pages that show it.
#[derive(Clone)]
pub struct ApiDocument(Arc<LazyLock<Value, Box<dyn FnOnce() -> Value + Send>>>);

impl ApiDocument {
    /// The document that `make` will return.
    pub fn new(make: impl FnOnce() -> Value + Send + 'static) -> Self {
        Self(Arc::new(LazyLock::new(Box::new(make))))
    }

    #[must_use]
    pub fn value(&self) -> &Value {
        &self.0
    }
}

impl fmt::Debug for ApiDocument {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("ApiDocument").finish_non_exhaustive()
    }
}
