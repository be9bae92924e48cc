//! The slot's noise floor: round trips to a calibration agent, a thread of our own that sits on the
//! agent's CPUs and answers at once, in messages as long as those of a step. It waits in a read and
//! uses nothing while the agent plays.

use crate::fault::PlatformFault;
use faceoff_sandbox::affinity::pin_current_thread;
use faceoff_types::{RoundTrips, SlotTiming};
use faceoff_wire::Message;
use std::{
    io::{Read as _, Write as _},
    os::unix::net::UnixStream,
    thread::{self, JoinHandle},
    time::Instant,
};

/// Round trips before the first episode.
const BEFORE: u32 = 200;
/// Round trips after each episode.
const BETWEEN: u32 = 10;
/// Bytes of an answer with two times seven numbers of full length.
const ANSWER_BYTES: usize = 320;

/// The calibration agent. It ends with this.
#[derive(Debug)]
struct CalibrationAgent {
    question: Vec<u8>,
    answer: Vec<u8>,
    /// `None` only while it is being dropped.
    to_agent: Option<UnixStream>,
    from_agent: UnixStream,
    agent: Option<JoinHandle<()>>,
}

impl CalibrationAgent {
    /// Starts the thread, on the agent's CPUs; without any, wherever the calling thread may run.
    ///
    /// # Errors
    /// When the host has no socket or thread left.
    pub fn start(agent_cpus: &[usize]) -> Result<Self, PlatformFault> {
        let failed = || PlatformFault::io("starting the calibration agent");
        // Two pairs, as an agent has.
        let (questions, to_agent) = UnixStream::pair().map_err(failed())?;
        let (from_agent, answers) = UnixStream::pair().map_err(failed())?;
        let mut question = Vec::new();
        Message::step(0, &[-std::f64::consts::FRAC_1_PI; 23]).write_line(&mut question);
        let (cpus, length) = (agent_cpus.to_vec(), question.len());
        let agent = thread::Builder::new()
            .name("calibration".to_owned())
            .spawn(move || answer(&cpus, length, questions, answers))
            .map_err(failed())?;
        Ok(Self {
            question,
            answer: vec![0; ANSWER_BYTES],
            to_agent: Some(to_agent),
            from_agent,
            agent: Some(agent),
        })
    }

    /// Adds `count` round trips to `times_s`, in seconds.
    ///
    /// # Errors
    /// When a socket fails.
    pub fn measure(&mut self, count: u32, times_s: &mut Vec<f64>) -> Result<(), PlatformFault> {
        let Some(to_agent) = &mut self.to_agent else {
            return Ok(());
        };
        for _ in 0..count {
            // As for an agent: from the first attempt to write to the last byte read.
            let asked = Instant::now();
            to_agent
                .write_all(&self.question)
                .map_err(PlatformFault::io("asking the calibration agent"))?;
            self.from_agent
                .read_exact(&mut self.answer)
                .map_err(PlatformFault::io("hearing the calibration agent"))?;
            times_s.push(asked.elapsed().as_secs_f64());
        }
        Ok(())
    }
}

impl Drop for CalibrationAgent {
    fn drop(&mut self) {
        self.to_agent = None;
        if let Some(agent) = self.agent.take()
            && agent.join().is_err()
        {
            tracing::error!("the calibration agent panicked");
        }
    }
}

/// The noise floor of one agent's CPUs, measured while a slot plays.
#[derive(Debug)]
pub(crate) struct Calibration {
    agent: CalibrationAgent,
    before_s: Vec<f64>,
    during_s: Vec<f64>,
}

impl Calibration {
    /// Measures before the first episode or rally.
    pub fn start(agent_cpus: &[usize]) -> Result<Self, PlatformFault> {
        let mut agent = CalibrationAgent::start(agent_cpus)?;
        let mut before_s = Vec::new();
        agent.measure(BEFORE, &mut before_s)?;
        Ok(Self {
            agent,
            before_s,
            during_s: Vec::new(),
        })
    }

    /// Measures between two of them.
    pub fn between_episodes(&mut self) -> Result<(), PlatformFault> {
        self.agent.measure(BETWEEN, &mut self.during_s)
    }

    pub fn finish(
        mut self,
        longest_stall_s: f64,
        host_noise_reruns: u32,
        platform_retries: u32,
    ) -> SlotTiming {
        SlotTiming {
            before_s: summarise(&mut self.before_s),
            during_s: summarise(&mut self.during_s),
            longest_stall_s,
            host_noise_reruns,
            platform_retries,
        }
    }
}

/// Answers until no question can come.
fn answer(cpus: &[usize], length: usize, mut questions: UnixStream, mut answers: UnixStream) {
    if let Err(error) = pin_current_thread(cpus) {
        tracing::warn!(%error, "the calibration agent cannot be pinned to the agent's CPUs");
    }
    let mut question = vec![0; length];
    let answer = [b'0'; ANSWER_BYTES];
    while questions.read_exact(&mut question).is_ok() {
        if answers.write_all(&answer).is_err() {
            return;
        }
    }
}

/// Median, 99th percentile (both nearest rank) and maximum; zeros without a round trip.
fn summarise(times_s: &mut [f64]) -> RoundTrips {
    times_s.sort_unstable_by(f64::total_cmp);
    let rank = |percent: usize| times_s[(times_s.len() * percent).div_ceil(100).max(1) - 1];
    if times_s.is_empty() {
        return RoundTrips::default();
    }
    RoundTrips {
        count: u32::try_from(times_s.len()).unwrap_or(u32::MAX),
        p50: rank(50),
        p99: rank(99),
        max: rank(100),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn percentiles_are_nearest_ranks() {
        let mut hundred: Vec<f64> = (1..=100).rev().map(f64::from).collect();
        let trips = |count, p50, p99, max| RoundTrips {
            count,
            p50,
            p99,
            max,
        };
        assert_eq!(summarise(&mut hundred), trips(100, 50.0, 99.0, 100.0));
        assert_eq!(summarise(&mut [0.5]), trips(1, 0.5, 0.5, 0.5));
        assert_eq!(summarise(&mut []), RoundTrips::default());
    }

    #[test]
    fn every_question_is_answered_and_timed() {
        let mut agent = CalibrationAgent::start(&[]).unwrap();
        let mut times_s = Vec::new();
        agent.measure(5, &mut times_s).unwrap();
        agent.measure(2, &mut times_s).unwrap();
        assert_eq!(times_s.len(), 7);
        assert!(times_s.iter().all(|time| *time > 0.0), "{times_s:?}");
    }
}
