use prometheus_client::{
    encoding::EncodeLabelSet,
    metrics::{counter::Counter, family::Family, histogram::Histogram},
    registry::{Registry, Unit},
};
use std::{fmt, time::Duration};

/// Bucket bounds, seconds: a cached board takes less than the first, a request that times out 30.
const DURATIONS_S: [f64; 12] = [
    0.001, 0.0025, 0.005, 0.01, 0.025, 0.05, 0.1, 0.25, 0.5, 1.0, 5.0, 30.0,
];

/// Metrics of requests by route. A route is the pattern of the path, so that the number of series is bounded.
#[derive(Clone)]
pub struct Web {
    requests: Family<ResponseLabels, Counter>,
    durations: Family<RouteLabels, Histogram, fn() -> Histogram>,
    refused: Family<RefusalLabels, Counter>,
}

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

impl Web {
    pub(crate) fn new(all: &mut Registry) -> Self {
        let web = Self {
            requests: Family::default(),
            durations: Family::new_with_constructor(|| Histogram::new(DURATIONS_S)),
            refused: Family::default(),
        };
        all.register("requests", "Requests answered", web.requests.clone());
        all.register_with_unit(
            "request_duration",
            "From the head of a request to the head of its response",
            Unit::Seconds,
            web.durations.clone(),
        );
        all.register(
            "refused",
            "Requests that were refused before their handlers: by the rate limit, or too many at once",
            web.refused.clone(),
        );
        web
    }

    /// Records a response. `route` is the pattern of the request's path; `None` if there is no such path. All methods
    /// that the server does not know are counted together.
    pub fn record_response(&self, method: &str, route: Option<&str>, status: u16, took: Duration) {
        let method = ["GET", "HEAD", "POST", "PUT", "PATCH", "DELETE", "OPTIONS"]
            .into_iter()
            .find(|known| *known == method)
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
        let took_s = took.as_secs_f64();
        self.durations.get_or_create(&route_labels).observe(took_s);
    }

    /// Records a request that was refused before its handler was called; `because` is the value of the label.
    pub fn record_refusal(&self, because: &'static str) {
        self.refused.get_or_create(&RefusalLabels { because }).inc();
    }
}

impl fmt::Debug for Web {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Web").finish_non_exhaustive()
    }
}
