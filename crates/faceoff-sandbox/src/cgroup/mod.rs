//! One cgroup per agent: limits and measurements of memory, processes and CPU time of its whole tree.
//!
//! Hosts have cgroup version 1, version 2, or both, so each controller is looked up separately. Agents' cgroups
//! are in a folder `faceoff` inside the own cgroup of the *service* (the process that starts agents), so that limits
//! set on the service apply to its agents, too.

mod agent;
mod files;
mod freezer;
mod hierarchy;
mod leaf;
mod stale_leaves;

pub(crate) use agent::{AgentCgroup, ExceededLimit};
pub(crate) use leaf::kill_and_thaw;
pub(crate) use stale_leaves::remove_stale_leaves;

/// Beginning of the error if a controller cannot be reached at all; its name follows.
pub(crate) const NOT_MOUNTED: &str = "no mounted cgroup hierarchy has the controller";
/// Part of the error if the service's cgroup may not use a controller; its name follows.
pub(crate) const NOT_OFFERED: &str = "does not offer the controller";
