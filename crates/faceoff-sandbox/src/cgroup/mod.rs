//! One cgroup per agent: memory, processes and CPU time of its whole tree, bounded and measured.
//!
//! Both kernel interfaces occur in the field, also side by side: each controller is looked up on its own
//! and used where it is. Ours live in a folder `faceoff` inside the service's own cgroup, so that limits
//! set on the service hold for its agents too.

mod agent;
mod files;
mod freezer;
mod hierarchy;
mod leaf;
mod stale;

pub(crate) use agent::{AgentCgroup, LimitHit};
pub(crate) use leaf::end_all;
pub(crate) use stale::sweep;
