//! Metrics of HTTP requests.

use crate::declaration::Declare;
use prometheus_client::{
    encoding::EncodeLabelSet,
    metrics::{counter::Counter, family::Family, histogram::Histogram},
    registry::{Registry, Unit},
};
use std::{fmt, time::Duration};

/// Bucket bounds, seconds. A cached board takes less than 0.001, and a request times out after 30.
const DURATION_BUCKETS_S: [f64; 12] = [
    0.001, 0.0025, 0.005, 0.01, 0.025, 0.05, 0.1, 0.25, 0.5, 1.0, 5.0, 30.0,
];

/// Metrics of requests by route. A route is the pattern of the path, so that the number of series is bounded.
#[derive(Clone)]
pub struct RequestMetrics {
    requests: Family<ResponseLabels, Counter>,
    durations: Family<RouteLabels, Histogram, fn() -> Histogram>,
    refused: Family<RefusalLabels, Counter>,
}

// The field names of the following structs are the names of labels.

#[derive(Debug, Clone, PartialEq, Eq, Hash, EncodeLabelSet)]
struct ResponseLabels {
    method: &'static str,
    route: String,
    status: u16,
}

#[derive(Debug, Clone, PartialEq, Eq, Hash, EncodeLabelSet)]
struct RouteLabels {
    route: String,
}

#[derive(Debug, Clone, PartialEq, Eq, Hash, EncodeLabelSet)]
struct RefusalLabels {
    because: &'static str,
}

impl RequestMetrics {
    pub(crate) fn new(registry: &mut Registry) -> Self {
        Self {
            requests: registry.declare("requests", "Requests answered"),
            durations: registry.declare_with_unit(
                "request_duration",
                "From the head of a request to the head of its response",
                Unit::Seconds,
                Family::new_with_constructor(|| Histogram::new(DURATION_BUCKETS_S)),
            ),
            refused: registry.declare(
                "refused",
                "Requests that were refused before their handlers: by the rate limit, or too many at once",
            ),
        }
    }

    /// Records a response. `route` is the pattern of the request's path; `None` if there is no such path. All methods
    /// that the server does not know are counted together.
    pub fn record_response(
        &self,
        method: &str,
        route: Option<&str>,
        status: u16,
        duration: Duration,
    ) {
        let method = ["GET", "HEAD", "POST", "PUT", "PATCH", "DELETE", "OPTIONS"]
            .into_iter()
            .find(|candidate| *candidate == method)
            .unwrap_or("other");
        let route = route.unwrap_or("none").to_owned();
        let route_labels = RouteLabels {
            route: route.clone(),
        };
        let response_labels = ResponseLabels {
            method,
            route,
            status,
        };
        self.requests.get_or_create(&response_labels).inc();
        let duration_s = duration.as_secs_f64();
        self.durations
            .get_or_create(&route_labels)
            .observe(duration_s);
    }

    /// Records a request that was refused before its handler was called.
    pub fn record_refusal(&self, reason: &'static str) {
        self.refused
            .get_or_create(&RefusalLabels { because: reason })
            .inc();
    }
}

impl fmt::Debug for RequestMetrics {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("RequestMetrics").finish_non_exhaustive()
    }
}
