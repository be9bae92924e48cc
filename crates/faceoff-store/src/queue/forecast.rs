//! In which order the queue will do what waits in it, and when, if nothing is added: the rule of
//! [`claim_next`](super::claim_next), played through with the durations that such work had.

use std::{cmp::Ordering, collections::VecDeque};

/// What waits, who it is for, and what is under way. Times are milliseconds from now.
#[derive(Debug, Default)]
pub(crate) struct Forecast {
    pub(crate) accounts: Vec<Holder>,
    pub(crate) jobs: Vec<Job>,
    /// Under way: what is left of it, and the job that it is a part of.
    pub(crate) running: Vec<(Duration, usize)>,
}

/// Whoever work is done for in one lane, as both were served until now.
#[derive(Debug)]
pub(crate) struct Holder {
    /// A number that those of one lane have in common.
    pub(crate) lane: usize,
    pub(crate) urgency: u32,
    pub(crate) rank: u32,
    pub(crate) lane_served_ms: f64,
    pub(crate) served_ms: f64,
    /// In the order of batch and queue.
    pub(crate) waiting: VecDeque<Waiting>,
}

/// A unit that waits.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Waiting {
    pub(crate) batch: i64,
    pub(crate) queue_no: i64,
    /// From when it can be claimed.
    pub(crate) from_ms: f64,
    pub(crate) takes: Duration,
    /// The job that it is a part of.
    pub(crate) job: usize,
}

/// Units that are over together.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Job {
    /// What is queued when its last unit is done, before all else.
    pub(crate) then: Option<Duration>,
}

/// How long something takes, milliseconds; `None`: nothing like it was measured.
pub(crate) type Duration = Option<f64>;

/// When a job is over.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct End {
    /// How many jobs are over before it.
    pub(crate) order: usize,
    /// `None` if that depends on what was never measured.
    pub(crate) in_ms: Duration,
}

/// What stands for a duration that nobody knows, so that an order comes out all the same.
const NOMINAL_MS: f64 = 1000.0;

#[derive(Debug, Clone, Copy)]
struct Progress {
    units: usize,
    then: Option<Duration>,
    end_ms: f64,
    is_known: bool,
}

struct Played {
    jobs: Vec<Progress>,
    /// Last units that are done by then: what follows them is queued.
    ended: Vec<(f64, usize)>,
    /// When each slot is free.
    free_ms: Vec<f64>,
    /// Nothing that begins after what nobody can tell the end of has an end that can be told.
    is_known: bool,
}

impl Played {
    fn done(&mut self, job: usize, end_ms: f64) {
        let Some(progress) = self.jobs.get_mut(job) else {
            return;
        };
        progress.units = progress.units.saturating_sub(1);
        progress.end_ms = progress.end_ms.max(end_ms);
        progress.is_known &= self.is_known;
        if progress.units == 0 && progress.then.is_some() {
            self.ended.push((progress.end_ms, job));
        }
    }

    /// The next slot does something of a job.
    fn play(&mut self, slot: usize, takes: Duration, job: usize) {
        self.is_known &= takes.is_some();
        self.free_ms[slot] += takes.unwrap_or(NOMINAL_MS);
        self.done(job, self.free_ms[slot]);
    }

    /// The finalisation that is due first at `now_ms`.
    fn next_ended(&mut self, now_ms: f64) -> Option<(Duration, usize)> {
        let due = self.ended.iter().enumerate();
        let due = due.filter(|(_, (from_ms, _))| *from_ms <= now_ms);
        let (index, _) = due.min_by(|(_, a), (_, b)| a.0.total_cmp(&b.0))?;
        let (_, job) = self.ended.swap_remove(index);
        let takes = self.jobs[job].then.take()?;
        self.jobs[job].units = 1;
        Some((takes, job))
    }
}

impl Forecast {
    /// The ends of all jobs on so many slots. A job without units is over now.
    pub(crate) fn ends(mut self, slots: usize) -> Vec<End> {
        let mut played = Played {
            jobs: self
                .jobs
                .iter()
                .map(|job| Progress {
                    units: 0,
                    then: job.then,
                    end_ms: 0.0,
                    is_known: true,
                })
                .collect(),
            ended: Vec::new(),
            free_ms: Vec::new(),
            is_known: true,
        };
        let waiting = self.accounts.iter().flat_map(|account| &account.waiting);
        let waiting = waiting.map(|unit| unit.job);
        for job in waiting.chain(self.running.iter().map(|(_, job)| *job)) {
            played.jobs[job].units += 1;
        }
        let of_running = std::mem::take(&mut self.running);
        played.is_known = of_running.iter().all(|(left, _)| left.is_some());
        for (left, job) in of_running {
            let left_ms = left.unwrap_or(NOMINAL_MS);
            played.free_ms.push(left_ms);
            let all_known = std::mem::replace(&mut played.is_known, left.is_some());
            played.done(job, left_ms);
            played.is_known = all_known;
        }
        while played.free_ms.len() < slots.max(1) {
            played.free_ms.push(0.0);
        }
        while let Some(slot) = first_free(&played.free_ms) {
            let now_ms = played.free_ms[slot];
            if let Some((takes, job)) = played.next_ended(now_ms) {
                played.play(slot, takes, job);
            } else if let Some(unit) = self.claim(now_ms) {
                played.play(slot, unit.takes, unit.job);
            } else if let Some(from_ms) = self.next_from_ms(&played) {
                // Nothing can be begun before that.
                played.free_ms[slot] = now_ms.max(from_ms);
            } else {
                break;
            }
        }
        ends(&played.jobs)
    }

    /// When something of what is left can be begun first; `None` if nothing is left.
    fn next_from_ms(&self, played: &Played) -> Option<f64> {
        let ended = played.ended.iter().map(|(from_ms, _)| *from_ms);
        let waiting = self.accounts.iter().flat_map(|account| &account.waiting);
        let waiting = waiting.map(|unit| unit.from_ms);
        waiting.chain(ended).min_by(f64::total_cmp)
    }

    /// Takes out the unit whose turn it is, and charges it.
    fn claim(&mut self, now_ms: f64) -> Option<Waiting> {
        let first = |holder: &Holder| {
            let ready = |unit: &Waiting| unit.from_ms <= now_ms;
            holder.waiting.iter().position(ready)
        };
        let candidates = self.accounts.iter().enumerate();
        let candidates = candidates.filter_map(|(index, holder)| Some((index, first(holder)?)));
        let (account, unit) = candidates.min_by(|a, b| self.by_turn(*a, *b))?;
        let unit = self.accounts[account].waiting.remove(unit)?;
        let takes_ms = unit.takes.unwrap_or(NOMINAL_MS);
        let lane = self.accounts[account].lane;
        self.accounts[account].served_ms += takes_ms;
        for holder in self.accounts.iter_mut().filter(|other| other.lane == lane) {
            holder.lane_served_ms += takes_ms;
        }
        Some(unit)
    }

    fn by_turn(&self, a: (usize, usize), b: (usize, usize)) -> Ordering {
        let (of_a, of_b) = (&self.accounts[a.0], &self.accounts[b.0]);
        let (unit_a, unit_b) = (&of_a.waiting[a.1], &of_b.waiting[b.1]);
        of_a.urgency
            .cmp(&of_b.urgency)
            .then(of_a.lane_served_ms.total_cmp(&of_b.lane_served_ms))
            .then(of_a.rank.cmp(&of_b.rank))
            .then(unit_a.batch.cmp(&unit_b.batch))
            .then(of_a.served_ms.total_cmp(&of_b.served_ms))
            .then(unit_a.queue_no.cmp(&unit_b.queue_no))
    }
}

fn first_free(free_ms: &[f64]) -> Option<usize> {
    let slots = free_ms.iter().enumerate();
    let (slot, _) = slots.min_by(|(_, a), (_, b)| a.total_cmp(b))?;
    Some(slot)
}

fn ends(jobs: &[Progress]) -> Vec<End> {
    let mut by_end: Vec<usize> = (0..jobs.len()).collect();
    by_end.sort_by(|a, b| jobs[*a].end_ms.total_cmp(&jobs[*b].end_ms));
    let mut order = vec![0; jobs.len()];
    for (place, job) in by_end.into_iter().enumerate() {
        order[job] = place;
    }
    let end = |(job, order): (&Progress, usize)| End {
        order,
        in_ms: job.is_known.then_some(job.end_ms),
    };
    jobs.iter().zip(order).map(end).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn holder(lane: usize, rank: u32, waiting: &[(i64, i64, f64, usize)]) -> Holder {
        Holder {
            lane,
            urgency: 1,
            rank,
            lane_served_ms: 0.0,
            served_ms: 0.0,
            waiting: waiting
                .iter()
                .map(|(batch, queue_no, takes_ms, job)| Waiting {
                    batch: *batch,
                    queue_no: *queue_no,
                    from_ms: 0.0,
                    takes: Some(*takes_ms),
                    job: *job,
                })
                .collect(),
        }
    }

    fn jobs(count: usize, then: Option<Duration>) -> Vec<Job> {
        vec![Job { then }; count]
    }

    fn in_ms(ends: &[End]) -> Vec<Option<f64>> {
        ends.iter().map(|end| end.in_ms).collect()
    }

    #[test]
    fn teams_take_turns_by_slot_time_and_older_batches_come_first() {
        let forecast = |batch_of_b| Forecast {
            accounts: vec![
                holder(0, 0, &[(1, 1, 10.0, 0), (1, 2, 10.0, 0)]),
                holder(0, 0, &[(batch_of_b, 3, 30.0, 1), (batch_of_b, 4, 30.0, 1)]),
            ],
            jobs: jobs(2, None),
            running: Vec::new(),
        };
        // a, b, a, b
        let ends = forecast(1).ends(1);
        assert_eq!(in_ms(&ends), [Some(50.0), Some(80.0)]);
        assert_eq!([ends[0].order, ends[1].order], [0, 1]);
        // b has another day: a, a, b, b, and the other way round
        assert_eq!(in_ms(&forecast(2).ends(1)), [Some(20.0), Some(80.0)]);
        assert_eq!(in_ms(&forecast(0).ends(1)), [Some(80.0), Some(60.0)]);
        // on two slots, a, b | a on the first
        assert_eq!(in_ms(&forecast(1).ends(2)), [Some(20.0), Some(50.0)]);
    }

    #[test]
    fn what_follows_a_job_comes_before_all_that_waits() {
        let forecast = Forecast {
            accounts: vec![
                holder(0, 0, &[(1, 1, 10.0, 0)]),
                holder(0, 0, &[(1, 2, 10.0, 1)]),
            ],
            jobs: jobs(2, Some(Some(5.0))),
            running: vec![(Some(3.0), 0)],
        };
        assert_eq!(in_ms(&forecast.ends(1)), [Some(18.0), Some(33.0)]);
    }

    #[test]
    fn what_was_never_measured_hides_every_end_after_it_and_no_place() {
        let mut unknown = holder(1, 0, &[(0, 2, 1.0, 1)]);
        unknown.waiting[0].takes = None;
        let forecast = Forecast {
            accounts: vec![holder(0, 1, &[(1, 1, 10.0, 0), (1, 3, 10.0, 2)]), unknown],
            jobs: jobs(3, None),
            running: vec![(Some(4.0), 0)],
        };
        let ends = forecast.ends(1);
        assert_eq!(in_ms(&ends), [None, None, None]);
        assert_eq!([ends[1].order, ends[0].order, ends[2].order], [0, 1, 2]);
    }

    #[test]
    fn what_rests_is_waited_for() {
        let mut resting = holder(0, 0, &[(1, 1, 10.0, 0), (1, 2, 10.0, 1)]);
        resting.waiting[0].from_ms = 100.0;
        let forecast = Forecast {
            accounts: vec![resting],
            jobs: jobs(2, None),
            running: Vec::new(),
        };
        assert_eq!(in_ms(&forecast.ends(1)), [Some(110.0), Some(10.0)]);
    }
}
