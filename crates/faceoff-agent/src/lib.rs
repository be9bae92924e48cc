//! The agent's side of the protocol, for agents in Rust: the evaluator's messages, the agent's answers and the loop between them.
//!
//! An agent implements [`Agent`] and calls [`run`] in its `main`. `faceoff new --lang rust` copies this crate into
//! the new project, so it depends on no other crate of Faceoff. It has no policy, no kinematics and no clock.
//!
//! ```no_run
//! use faceoff_agent::{Action, Agent, AgentInfo, Failure, Interpolation, Observation, run};
//!
//! /// Holds the joint positions of the first observation, in rad.
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
//!     let info = AgentInfo { name: "hold", version: "1.0", interpolation: Interpolation::Cubic };
//!     run(info, |_hello| Hold(None))
//! }
//! ```

#![warn(missing_docs)]

mod action;
mod conversation;
mod env;
mod observation;

pub use action::{Action, Interpolation};
pub use conversation::{Agent, AgentInfo, ConversationError, Failure, Hello, Task, run, serve};
pub use env::{BaseFrame, Env, JOINTS, RadiusInfo, RobotInfo, TableInfo};
pub use observation::{Observation, WrongLength};
