//! What this server offers to agents, as far as it does not stand in the store.

use faceoff_types::{AgentLimits, AgentMachine, RuntimeInventory};
use std::sync::Arc;
use tokio::sync::watch;

/// What agents run on and are held to here.
#[derive(Debug, Clone)]
pub struct Offer {
    /// By the server's configuration; stages and tournaments may have others.
    pub limits: AgentLimits,
    /// Whose CPUs they use.
    pub machine: AgentMachine,
    inventories: watch::Receiver<Option<Arc<Vec<RuntimeInventory>>>>,
}

/// Whoever looks into the runtimes tells what was found by this, once.
#[derive(Debug)]
pub struct InventoryTeller(watch::Sender<Option<Arc<Vec<RuntimeInventory>>>>);

impl InventoryTeller {
    /// From now on the server knows.
    pub fn tell(self, inventories: Vec<RuntimeInventory>) {
        self.0.send_replace(Some(Arc::new(inventories)));
    }
}

impl Offer {
    /// An offer whose runtimes are still being looked into.
    #[must_use]
    pub fn new(limits: AgentLimits, machine: AgentMachine) -> (Self, InventoryTeller) {
        let (teller, inventories) = watch::channel(None);
        let offer = Self {
            limits,
            machine,
            inventories,
        };
        (offer, InventoryTeller(teller))
    }

    /// Of a server that runs no agent.
    #[must_use]
    pub fn nothing() -> Self {
        Self::of(AgentLimits::default(), AgentMachine::default(), Vec::new())
    }

    /// An offer whose runtimes are known.
    #[must_use]
    pub fn of(
        limits: AgentLimits,
        machine: AgentMachine,
        inventories: Vec<RuntimeInventory>,
    ) -> Self {
        let (offer, teller) = Self::new(limits, machine);
        teller.tell(inventories);
        offer
    }

    /// What the runtimes hold, by name; waits until that is known. `None`: whoever looked gave up.
    pub(crate) async fn inventories(&self) -> Option<Arc<Vec<RuntimeInventory>>> {
        let mut inventories = self.inventories.clone();
        let known = inventories.wait_for(Option::is_some).await;
        known.ok()?.clone()
    }
}
