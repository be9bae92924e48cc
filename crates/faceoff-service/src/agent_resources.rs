//! What this server offers to agents: resource limits, CPUs, and runtimes. A *runtime* is an environment in which an agent
//! runs, for example Python with its packages; its *inventory* lists what is installed in it.

use faceoff_types::{AgentLimits, AgentMachine, RuntimeInventory};
use std::sync::Arc;
use tokio::sync::watch;

/// Resource limits, machine and runtimes of agents on this server.
#[derive(Debug, Clone)]
pub struct AgentResources {
    /// From the server's configuration; stages and tournaments may override them.
    pub limits: AgentLimits,
    /// CPUs of the machines that run agents.
    pub machine: AgentMachine,
    inventories: watch::Receiver<Option<Arc<Vec<RuntimeInventory>>>>,
}

/// Publishes the inventories of the runtimes once they have been inspected.
#[derive(Debug)]
pub struct InventoryPublisher(watch::Sender<Option<Arc<Vec<RuntimeInventory>>>>);

impl InventoryPublisher {
    /// Makes the inventories available to all requests.
    pub fn publish(self, inventories: Vec<RuntimeInventory>) {
        self.0.send_replace(Some(Arc::new(inventories)));
    }
}

impl AgentResources {
    /// Resources whose runtimes are still being inspected.
    #[must_use]
    pub fn new(limits: AgentLimits, machine: AgentMachine) -> (Self, InventoryPublisher) {
        let (publisher, inventories) = watch::channel(None);
        let resources = Self {
            limits,
            machine,
            inventories,
        };
        (resources, InventoryPublisher(publisher))
    }

    /// Resources of a server that runs no agents.
    #[must_use]
    pub fn none() -> Self {
        Self::with_inventories(AgentLimits::default(), AgentMachine::default(), Vec::new())
    }

    /// Resources whose runtimes have been inspected.
    #[must_use]
    pub fn with_inventories(
        limits: AgentLimits,
        machine: AgentMachine,
        inventories: Vec<RuntimeInventory>,
    ) -> Self {
        let (resources, publisher) = Self::new(limits, machine);
        publisher.publish(inventories);
        resources
    }

    /// The inventories of all runtimes; waits until they are published. `None` if the inspection was aborted.
    pub(crate) async fn inventories(&self) -> Option<Arc<Vec<RuntimeInventory>>> {
        let mut inventories = self.inventories.clone();
        let published = inventories.wait_for(Option::is_some).await;
        published.ok()?.clone()
    }
}
