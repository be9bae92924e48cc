//! Creation of metrics. A new metric is registered with its name and help text, and the caller stores the returned clone.

use prometheus_client::registry::{Metric, Registry, Unit};

pub(crate) trait Declare {
    /// Registers a new metric. The returned clone shares its values.
    fn declare<M: Metric + Clone + Default>(&mut self, name: &str, help: &str) -> M;

    /// Like [`Self::declare`]. The unit becomes the last part of the metric's name.
    fn declare_with_unit<M: Metric + Clone>(
        &mut self,
        name: &str,
        help: &str,
        unit: Unit,
        metric: M,
    ) -> M;
}

impl Declare for Registry {
    fn declare<M: Metric + Clone + Default>(&mut self, name: &str, help: &str) -> M {
        let metric = M::default();
        self.register(name, help, metric.clone());
        metric
    }

    fn declare_with_unit<M: Metric + Clone>(
        &mut self,
        name: &str,
        help: &str,
        unit: Unit,
        metric: M,
    ) -> M {
        self.register_with_unit(name, help, unit, metric.clone());
        metric
    }
}
