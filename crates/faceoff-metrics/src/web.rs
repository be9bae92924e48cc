use prometheus_client::{
    encoding::EncodeLabelSet,
    metrics::{counter::Counter, family::Family, histogram::Histogram},
    registry::{Registry, Unit},
};
use std::{fmt, time::Duration};

/// Upper bounds, seconds: a board from the cache takes less than the first, a request that is given up 30.
const DURATIONS_S: [f64; 12] = [
    0.001, 0.0025, 0.005, 0.01, 0.025, 0.05, 0.1, 0.25, 0.5, 1.0, 5.0, 30.0,
];

/// Requests, by route: the pattern of the path, so that there are as many as the server has routes.
#[derive(Clone)]
pub struct Web {
    requests: Family<Answered, Counter>,
    durations: Family<OfRoute, Histogram, fn() -> Histogram>,
    refused: Family<Refused, Counter>,
}

#[derive(Debug, Clone, PartialEq, Eq, Hash, EncodeLabelSet)]
struct Answered {
    method: &'static str,
    route: String,
    status: u16,
}

#[derive(Debug, Clone, PartialEq, Eq, Hash, EncodeLabelSet)]
struct OfRoute {
    route: String,
}

#[derive(Debug, Clone, PartialEq, Eq, Hash, EncodeLabelSet)]
struct Refused {
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
            "From a request's head to the head of its answer",
            Unit::Seconds,
            web.durations.clone(),
        );
        all.register(
            "refused",
            "Requests that were refused before their handlers: rate, or too many at once",
            web.refused.clone(),
        );
        web
    }

    /// A request was answered. `route` is the pattern of its path; none: there is no such path. Methods that the server
    /// does not know count as one.
    pub fn answered(&self, method: &str, route: Option<&str>, status: u16, took: Duration) {
        let method = ["GET", "HEAD", "POST", "PUT", "PATCH", "DELETE", "OPTIONS"]
            .into_iter()
            .find(|known| *known == method)
            .unwrap_or("other");
        let route = route.unwrap_or("none").to_owned();
        let of_route = OfRoute {
            route: route.clone(),
        };
        let answered = Answered {
            method,
            route,
            status,
        };
        self.requests.get_or_create(&answered).inc();
        let took_s = took.as_secs_f64();
        self.durations.get_or_create(&of_route).observe(took_s);
    }

    /// A request was refused before its handler saw it: `because` is a word or two for it.
    pub fn refused(&self, because: &'static str) {
        self.refused.get_or_create(&Refused { because }).inc();
    }
}

impl fmt::Debug for Web {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Web").finish_non_exhaustive()
    }
}
