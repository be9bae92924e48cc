//! The type of gauges whose value is not a whole number.

use prometheus_client::metrics::gauge::Gauge;
use std::sync::atomic::AtomicU64;

/// A gauge with a fractional value, mostly seconds.
pub(crate) type FloatGauge = Gauge<f64, AtomicU64>;
