use prometheus_client::metrics::gauge::Gauge;
use std::sync::atomic::AtomicU64;

/// A number that is what it was set to last; seconds, mostly.
pub(crate) type Latest = Gauge<f64, AtomicU64>;
