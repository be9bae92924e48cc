use crate::{
    bundle::Bundle, config::AgentEnvironment, fault::PlatformFault, host_watch::StallWatch,
    log::Log, player::Player,
};
use faceoff_episode::{Arena, Nowhere};
use faceoff_types::{AgentFault, Profile, Seed, Task};
use serde::{Deserialize, Serialize};

/// Control steps of each smoke episode, at most.
pub const SMOKE_STEPS: u32 = 50;

/// What the smoke run of an upload found.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct SmokeReport {
    /// The first fault, if there was one.
    pub fault: Option<AgentFault>,
    /// The end of the agent's standard error.
    pub log: String,
}

/// Does the agent start, answer and keep time? One short episode of each task, in the same sandbox
/// and with the same limits as an evaluation; ends with the first fault.
///
/// The seed is fixed and public: a smoke run must tell the same about the same bundle, and nothing
/// about the season.
///
/// # Errors
/// The platform's alone; the agent's fault is in the report. [`PlatformFault::Cancelled`] when
/// `cancelled`, which is asked before each step, said so.
pub fn smoke(
    bundle: &Bundle,
    env: &AgentEnvironment,
    cancelled: &dyn Fn() -> bool,
) -> Result<SmokeReport, PlatformFault> {
    let watch = StallWatch::start(&env.agent_cpus)?;
    let seed = Seed::from_number(0);
    let mut log = Log::new(env.limits.stderr_tail_bytes);
    for task in Task::ALL {
        let mut player = Player::new(
            bundle,
            env,
            task,
            Arena::new(Profile::Evaluation, seed, seed.model_mismatch()),
            &watch,
        );
        let outcome = player.play(0, SMOKE_STEPS, &mut Nowhere, cancelled)?;
        log.add(&player.close()?, None);
        if let Some(fault) = outcome.fault {
            return Ok(SmokeReport {
                fault: Some(fault),
                log: log.into_text(),
            });
        }
    }
    Ok(SmokeReport {
        fault: None,
        log: log.into_text(),
    })
}
