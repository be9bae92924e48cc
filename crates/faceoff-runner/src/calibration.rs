//! The *noise floor* of a worker's slot: the time of a round trip (question and answer) with an agent that computes
//! nothing. This *calibration agent* is no agent of a team, but a thread of this process on the agent's CPUs, which answers
//! at once, with messages as long as those of a step. While the real agent runs, the thread waits in a read and uses no CPU time.

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
const ROUND_TRIPS_BEFORE: u32 = 200;
/// Round trips after each episode.
const ROUND_TRIPS_BETWEEN_EPISODES: u32 = 10;
/// Length of an answer with 2 × 7 numbers of full precision.
const ANSWER_BYTES: usize = 320;

/// The calibration agent; its thread ends on drop.
#[derive(Debug)]
struct CalibrationAgent {
    question: Vec<u8>,
    answer: Vec<u8>,
    /// `None` only while it is being dropped.
    to_agent: Option<UnixStream>,
    from_agent: UnixStream,
    thread: Option<JoinHandle<()>>,
}

impl CalibrationAgent {
    /// Starts the thread on the agent's CPUs; if the list is empty, with the affinity of the calling thread.
    ///
    /// # Errors
    /// When the host has no socket or thread left.
    pub fn start(agent_cpus: &[usize]) -> Result<Self, PlatformFault> {
        let failed = || PlatformFault::io("starting the calibration agent");
        // Two socket pairs, for questions and answers, as an agent has.
        let (questions, to_agent) = UnixStream::pair().map_err(failed())?;
        let (from_agent, answers) = UnixStream::pair().map_err(failed())?;
        let mut question = Vec::new();
        // An observation of 23 numbers of full precision.
        Message::step(0, &[-std::f64::consts::FRAC_1_PI; 23]).write_line(&mut question);
        let (cpus, question_bytes) = (agent_cpus.to_vec(), question.len());
        let thread = thread::Builder::new()
            .name("calibration".to_owned())
            .spawn(move || answer(&cpus, question_bytes, questions, answers))
            .map_err(failed())?;
        Ok(Self {
            question,
            answer: vec![0; ANSWER_BYTES],
            to_agent: Some(to_agent),
            from_agent,
            thread: Some(thread),
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
            // Measured as for an agent: from the first attempt to write to the last byte read.
            let asked_at = Instant::now();
            to_agent
                .write_all(&self.question)
                .map_err(PlatformFault::io("writing to the calibration agent"))?;
            self.from_agent
                .read_exact(&mut self.answer)
                .map_err(PlatformFault::io("reading from the calibration agent"))?;
            times_s.push(asked_at.elapsed().as_secs_f64());
        }
        Ok(())
    }
}

impl Drop for CalibrationAgent {
    fn drop(&mut self) {
        self.to_agent = None;
        // With the channel closed, the thread ends.
        if let Some(thread) = self.thread.take()
            && thread.join().is_err()
        {
            tracing::error!("the calibration agent panicked");
        }
    }
}

/// The noise floor of one agent's CPUs, measured while a slot runs a job.
#[derive(Debug)]
pub(crate) struct Calibration {
    agent: CalibrationAgent,
    times_before_s: Vec<f64>,
    times_between_s: Vec<f64>,
}

impl Calibration {
    /// Measures before the first episode or rally.
    pub fn start(agent_cpus: &[usize]) -> Result<Self, PlatformFault> {
        let mut agent = CalibrationAgent::start(agent_cpus)?;
        let mut before_s = Vec::new();
        agent.measure(ROUND_TRIPS_BEFORE, &mut before_s)?;
        Ok(Self {
            agent,
            times_before_s: before_s,
            times_between_s: Vec::new(),
        })
    }

    /// Measures between two episodes or rallies.
    pub fn measure_between_episodes(&mut self) -> Result<(), PlatformFault> {
        self.agent
            .measure(ROUND_TRIPS_BETWEEN_EPISODES, &mut self.times_between_s)
    }

    pub fn finish(
        mut self,
        max_host_interference_s: f64,
        host_interference_reruns: u32,
        platform_retries: u32,
    ) -> SlotTiming {
        SlotTiming {
            before_s: summarise(&mut self.times_before_s),
            during_s: summarise(&mut self.times_between_s),
            max_host_interference_s,
            host_interference_reruns,
            platform_retries,
        }
    }
}

/// Answers until the question channel is closed.
fn answer(
    cpus: &[usize],
    question_bytes: usize,
    mut questions: UnixStream,
    mut answers: UnixStream,
) {
    if let Err(error) = pin_current_thread(cpus) {
        tracing::warn!(%error, "the calibration agent cannot be pinned to the agent's CPUs");
    }
    let mut question = vec![0; question_bytes];
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
    let percentile = |percent: usize| times_s[(times_s.len() * percent).div_ceil(100).max(1) - 1];
    if times_s.is_empty() {
        return RoundTrips::default();
    }
    RoundTrips {
        count: u32::try_from(times_s.len()).unwrap_or(u32::MAX),
        p50: percentile(50),
        p99: percentile(99),
        max: percentile(100),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn percentiles_are_nearest_ranks() {
        let mut hundred: Vec<f64> = (1..=100).rev().map(f64::from).collect();
        let round_trips = |count, p50, p99, max| RoundTrips {
            count,
            p50,
            p99,
            max,
        };
        assert_eq!(summarise(&mut hundred), round_trips(100, 50.0, 99.0, 100.0));
        assert_eq!(summarise(&mut [0.5]), round_trips(1, 0.5, 0.5, 0.5));
        assert_eq!(summarise(&mut []), RoundTrips::default());
    }

    #[test]
    fn round_trips_are_measured() {
        let mut agent = CalibrationAgent::start(&[]).unwrap();
        let mut times_s = Vec::new();
        agent.measure(5, &mut times_s).unwrap();
        agent.measure(2, &mut times_s).unwrap();
        assert_eq!(times_s.len(), 7);
        assert!(times_s.iter().all(|time| *time > 0.0), "{times_s:?}");
    }
}
