//! The agent's side of the protocol, for agents in Rust: messages, answers, and the loop between them.
//!
//! An agent implements [`Agent`] and calls [`run`] in its `main`. `faceoff new --lang rust` copies this crate into
//! the new project, so it depends on nothing of Faceoff. It decides nothing: no policy, no kinematics, no clock.
//!
//! ```no_run
//! use faceoff_agent::{About, Action, Agent, Failure, Interpolation, Observation, run};
//!
//! struct Hold(Option<[f64; 7]>);
//!
//! impl Agent for Hold {
//!     fn reset(&mut self) {
//!         self.0 = None;
//!     }
//!
//!     fn act(&mut self, observation: &Observation) -> Result<Action, Failure> {
//!         let pose = *self.0.get_or_insert(observation.joint_positions());
//!         Ok(Action::PositionVelocity([pose, [0.0; 7]]))
//!     }
//! }
//!
//! fn main() -> std::process::ExitCode {
//!     let about = About { name: "hold", version: "1.0", interpolation: Interpolation::Cubic };
//!     run(about, |_hello| Hold(None))
//! }
//! ```

#![warn(missing_docs)]

mod action;
mod conversation;
mod env;
mod observation;

pub use action::{Action, Interpolation};
pub use conversation::{About, Agent, ConversationError, Failure, Hello, Task, run, serve};
pub use env::{BaseFrame, Env, JOINTS, RadiusInfo, RobotInfo, TableInfo};
pub use observation::{Observation, WrongLength};
