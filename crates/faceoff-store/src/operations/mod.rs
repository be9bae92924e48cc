//! What people and workers do: transactions over the tables and the queue, each with its events.

mod activate;
pub(crate) mod cancel;
pub(crate) mod claim;
pub(crate) mod commit;
pub(crate) mod ends;
mod enter;
mod finish;
pub(crate) mod give_back;
mod heartbeat;
mod open;
mod order_ablation;
mod pause;
pub(crate) mod purpose;
mod release_day;
pub(crate) mod rerun;
mod rulings;
pub(crate) mod runs;
mod season;
pub(crate) mod smoke;
pub(crate) mod stages;
mod start_day;
mod submit;
mod summaries;
mod teams;
pub(crate) mod tidy;
mod withdraw;
