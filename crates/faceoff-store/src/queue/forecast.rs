//! Forecast of the order and the times in which waiting jobs will end, if no job is added. It simulates how
//! [`claim_next`](super::claim_next) selects jobs for the slots, with the durations of similar jobs.
//!
//! An account has the jobs of one owner in one lane; a lane is a share of the queue.

use std::{cmp::Ordering, collections::VecDeque};

/// State of the queue from which the forecast starts. Times are milliseconds from now.
#[derive(Debug, Default)]
pub(crate) struct Forecast {
    pub(crate) accounts: Vec<AccountQueue>,
    pub(crate) groups: Vec<JobGroup>,
    /// Running jobs: remaining duration, and group.
    pub(crate) running: Vec<(DurationMs, usize)>,
}

/// An account with its waiting jobs, and the time for which it and its lane were served.
#[derive(Debug)]
pub(crate) struct AccountQueue {
    /// Number of the lane.
    pub(crate) lane: usize,
    /// Lanes with a smaller urgency are always served first.
    pub(crate) urgency: u32,
    /// Of two equally served lanes, the one with the smaller value is served first.
    pub(crate) tie_breaker: u32,
    pub(crate) lane_served_ms: f64,
    pub(crate) served_ms: f64,
    /// By batch, then in queue order.
    pub(crate) waiting: VecDeque<QueuedJob>,
}

/// A waiting job.
#[derive(Debug, Clone, Copy)]
pub(crate) struct QueuedJob {
    /// Within a lane, jobs of a smaller batch are claimed first.
    pub(crate) batch: i64,
    /// Rises with every queued job.
    pub(crate) queue_no: i64,
    /// When it can be claimed; 0: now.
    pub(crate) claimable_in_ms: f64,
    pub(crate) duration: DurationMs,
    /// Index of its group.
    pub(crate) group: usize,
}

/// Jobs of one evaluation, submission or game, which end together.
#[derive(Debug, Clone, Copy)]
pub(crate) struct JobGroup {
    /// Duration of the follow-up job (scoring), which is queued with priority when the last job is done; `None`: there is
    /// no follow-up.
    pub(crate) follow_up: Option<DurationMs>,
}

/// A duration in milliseconds; `None` if no similar job was measured.
pub(crate) type DurationMs = Option<f64>;

/// The end of a job group.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct GroupEnd {
    /// Number of groups that end before it.
    pub(crate) rank: usize,
    /// Time until the end; `None` if it depends on an unknown duration.
    pub(crate) remaining_ms: DurationMs,
}

/// Replaces unknown durations, so that an order can be computed nevertheless.
const NOMINAL_DURATION_MS: f64 = 1000.0;

/// State of a group in the simulation.
#[derive(Debug, Clone, Copy)]
struct GroupProgress {
    open_jobs: usize,
    /// The follow-up, until it is started.
    follow_up: Option<DurationMs>,
    /// End of the last job so far.
    end_ms: f64,
    /// Is the end independent of unknown durations?
    is_known: bool,
}

/// The slots and the groups while the queue is simulated.
struct Simulation {
    groups: Vec<GroupProgress>,
    /// Queued follow-ups: when they can start, and their groups.
    follow_ups: Vec<(f64, usize)>,
    /// When each slot becomes free.
    slot_free_ms: Vec<f64>,
    /// False after a job of unknown duration: the ends of all later jobs are unknown, too.
    is_known: bool,
}

impl Simulation {
    fn complete_job(&mut self, group: usize, end_ms: f64) {
        let Some(progress) = self.groups.get_mut(group) else {
            return;
        };
        progress.open_jobs = progress.open_jobs.saturating_sub(1);
        progress.end_ms = progress.end_ms.max(end_ms);
        progress.is_known &= self.is_known;
        if progress.open_jobs == 0 && progress.follow_up.is_some() {
            self.follow_ups.push((progress.end_ms, group));
        }
    }

    /// Runs a job of a group on a slot.
    fn run(&mut self, slot: usize, duration: DurationMs, group: usize) {
        self.is_known &= duration.is_some();
        self.slot_free_ms[slot] += duration.unwrap_or(NOMINAL_DURATION_MS);
        self.complete_job(group, self.slot_free_ms[slot]);
    }

    /// The follow-up that is due first at `now_ms`.
    fn next_follow_up(&mut self, now_ms: f64) -> Option<(DurationMs, usize)> {
        let follow_ups = self.follow_ups.iter().enumerate();
        let due = follow_ups.filter(|(_, (claimable_in_ms, _))| *claimable_in_ms <= now_ms);
        let (index, _) = due.min_by(|(_, a), (_, b)| a.0.total_cmp(&b.0))?;
        let (_, group) = self.follow_ups.swap_remove(index);
        let duration = self.groups[group].follow_up.take()?;
        self.groups[group].open_jobs = 1;
        Some((duration, group))
    }
}

impl Forecast {
    /// The ends of all groups on this number of slots. A group without jobs ends now.
    pub(crate) fn ends(mut self, slots: usize) -> Vec<GroupEnd> {
        let mut simulation = Simulation {
            groups: self
                .groups
                .iter()
                .map(|group| GroupProgress {
                    open_jobs: 0,
                    follow_up: group.follow_up,
                    end_ms: 0.0,
                    is_known: true,
                })
                .collect(),
            follow_ups: Vec::new(),
            slot_free_ms: Vec::new(),
            is_known: true,
        };
        let waiting = self.accounts.iter().flat_map(|account| &account.waiting);
        let waiting = waiting.map(|job| job.group);
        for group in waiting.chain(self.running.iter().map(|(_, group)| *group)) {
            simulation.groups[group].open_jobs += 1;
        }
        let running = std::mem::take(&mut self.running);
        simulation.is_known = running.iter().all(|(remaining, _)| remaining.is_some());
        for (remaining, group) in running {
            let remaining_ms = remaining.unwrap_or(NOMINAL_DURATION_MS);
            simulation.slot_free_ms.push(remaining_ms);
            let are_all_known = std::mem::replace(&mut simulation.is_known, remaining.is_some());
            simulation.complete_job(group, remaining_ms);
            simulation.is_known = are_all_known;
        }
        while simulation.slot_free_ms.len() < slots.max(1) {
            simulation.slot_free_ms.push(0.0);
        }
        while let Some(slot) = first_free(&simulation.slot_free_ms) {
            let now_ms = simulation.slot_free_ms[slot];
            if let Some((duration, group)) = simulation.next_follow_up(now_ms) {
                simulation.run(slot, duration, group);
            } else if let Some(job) = self.claim(now_ms) {
                simulation.run(slot, job.duration, job.group);
            } else if let Some(claimable_in_ms) = self.next_start_ms(&simulation) {
                // The slot stays free until a job can start.
                simulation.slot_free_ms[slot] = now_ms.max(claimable_in_ms);
            } else {
                break;
            }
        }
        group_ends(&simulation.groups)
    }

    /// When the first of the remaining jobs can start; `None` if none is left.
    fn next_start_ms(&self, simulation: &Simulation) -> Option<f64> {
        let follow_ups = simulation
            .follow_ups
            .iter()
            .map(|(claimable_in_ms, _)| *claimable_in_ms);
        let waiting = self.accounts.iter().flat_map(|account| &account.waiting);
        let waiting = waiting.map(|job| job.claimable_in_ms);
        waiting.chain(follow_ups).min_by(f64::total_cmp)
    }

    /// Removes the next job from its queue, and charges its duration to its account and its lane.
    fn claim(&mut self, now_ms: f64) -> Option<QueuedJob> {
        let first_claimable = |account: &AccountQueue| {
            let is_claimable = |job: &QueuedJob| job.claimable_in_ms <= now_ms;
            account.waiting.iter().position(is_claimable)
        };
        let candidates = self.accounts.iter().enumerate();
        let candidates =
            candidates.filter_map(|(index, account)| Some((index, first_claimable(account)?)));
        let (account, job) = candidates.min_by(|a, b| self.compare_priority(*a, *b))?;
        let job = self.accounts[account].waiting.remove(job)?;
        let duration_ms = job.duration.unwrap_or(NOMINAL_DURATION_MS);
        let lane = self.accounts[account].lane;
        self.accounts[account].served_ms += duration_ms;
        for other in self.accounts.iter_mut().filter(|other| other.lane == lane) {
            other.lane_served_ms += duration_ms;
        }
        Some(job)
    }

    /// Compares two jobs, each given by the index of its account and its index in this account's queue.
    fn compare_priority(&self, a: (usize, usize), b: (usize, usize)) -> Ordering {
        let (account_a, account_b) = (&self.accounts[a.0], &self.accounts[b.0]);
        let (job_a, job_b) = (&account_a.waiting[a.1], &account_b.waiting[b.1]);
        account_a
            .urgency
            .cmp(&account_b.urgency)
            .then(
                account_a
                    .lane_served_ms
                    .total_cmp(&account_b.lane_served_ms),
            )
            .then(account_a.tie_breaker.cmp(&account_b.tie_breaker))
            .then(job_a.batch.cmp(&job_b.batch))
            .then(account_a.served_ms.total_cmp(&account_b.served_ms))
            .then(job_a.queue_no.cmp(&job_b.queue_no))
    }
}

/// The slot that becomes free first.
fn first_free(slot_free_ms: &[f64]) -> Option<usize> {
    let slots = slot_free_ms.iter().enumerate();
    let (slot, _) = slots.min_by(|(_, a), (_, b)| a.total_cmp(b))?;
    Some(slot)
}

fn group_ends(groups: &[GroupProgress]) -> Vec<GroupEnd> {
    let mut by_end: Vec<usize> = (0..groups.len()).collect();
    by_end.sort_by(|a, b| groups[*a].end_ms.total_cmp(&groups[*b].end_ms));
    let mut ranks = vec![0; groups.len()];
    for (rank, group) in by_end.into_iter().enumerate() {
        ranks[group] = rank;
    }
    let end = |(group, rank): (&GroupProgress, usize)| GroupEnd {
        rank,
        remaining_ms: group.is_known.then_some(group.end_ms),
    };
    groups.iter().zip(ranks).map(end).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// An account with waiting jobs: batch, number in the queue, duration in milliseconds, and index of the group of each.
    fn account(lane: usize, tie_breaker: u32, waiting: &[(i64, i64, f64, usize)]) -> AccountQueue {
        AccountQueue {
            lane,
            urgency: 1,
            tie_breaker,
            lane_served_ms: 0.0,
            served_ms: 0.0,
            waiting: waiting
                .iter()
                .map(|(batch, queue_no, duration_ms, group)| QueuedJob {
                    batch: *batch,
                    queue_no: *queue_no,
                    claimable_in_ms: 0.0,
                    duration: Some(*duration_ms),
                    group: *group,
                })
                .collect(),
        }
    }

    fn groups(count: usize, follow_up: Option<DurationMs>) -> Vec<JobGroup> {
        vec![JobGroup { follow_up }; count]
    }

    fn remaining_ms(ends: &[GroupEnd]) -> Vec<Option<f64>> {
        ends.iter().map(|end| end.remaining_ms).collect()
    }

    #[test]
    fn forecast_alternates_accounts_and_prefers_older_batches() {
        // account a has the jobs of group 0, account b those of group 1
        let forecast = |batch_of_b| Forecast {
            accounts: vec![
                account(0, 0, &[(1, 1, 10.0, 0), (1, 2, 10.0, 0)]),
                account(0, 0, &[(batch_of_b, 3, 30.0, 1), (batch_of_b, 4, 30.0, 1)]),
            ],
            groups: groups(2, None),
            running: Vec::new(),
        };
        // the slot runs a, b, a, b
        let ends = forecast(1).ends(1);
        assert_eq!(remaining_ms(&ends), [Some(50.0), Some(80.0)]);
        assert_eq!([ends[0].rank, ends[1].rank], [0, 1]);
        // b in a later batch: a, a, b, b; in an earlier batch: b, b, a, a
        assert_eq!(remaining_ms(&forecast(2).ends(1)), [Some(20.0), Some(80.0)]);
        assert_eq!(remaining_ms(&forecast(0).ends(1)), [Some(80.0), Some(60.0)]);
        // two slots: the first runs a, a, b; the second b
        assert_eq!(remaining_ms(&forecast(1).ends(2)), [Some(20.0), Some(50.0)]);
    }

    #[test]
    fn forecast_runs_follow_ups_before_waiting_jobs() {
        let forecast = Forecast {
            accounts: vec![
                account(0, 0, &[(1, 1, 10.0, 0)]),
                account(0, 0, &[(1, 2, 10.0, 1)]),
            ],
            groups: groups(2, Some(Some(5.0))),
            running: vec![(Some(3.0), 0)],
        };
        assert_eq!(remaining_ms(&forecast.ends(1)), [Some(18.0), Some(33.0)]);
    }

    #[test]
    fn unknown_duration_hides_later_ends_but_not_ranks() {
        let mut unknown = account(1, 0, &[(0, 2, 1.0, 1)]);
        unknown.waiting[0].duration = None;
        let forecast = Forecast {
            accounts: vec![account(0, 1, &[(1, 1, 10.0, 0), (1, 3, 10.0, 2)]), unknown],
            groups: groups(3, None),
            running: vec![(Some(4.0), 0)],
        };
        let ends = forecast.ends(1);
        assert_eq!(remaining_ms(&ends), [None, None, None]);
        assert_eq!([ends[1].rank, ends[0].rank, ends[2].rank], [0, 1, 2]);
    }

    #[test]
    fn forecast_waits_for_delayed_jobs() {
        let mut delayed = account(0, 0, &[(1, 1, 10.0, 0), (1, 2, 10.0, 1)]);
        delayed.waiting[0].claimable_in_ms = 100.0;
        let forecast = Forecast {
            accounts: vec![delayed],
            groups: groups(2, None),
            running: Vec::new(),
        };
        assert_eq!(remaining_ms(&forecast.ends(1)), [Some(110.0), Some(10.0)]);
    }
}
