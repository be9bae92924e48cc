//! Scoring. (contract stub)
#![expect(missing_docs, clippy::unimplemented, unused_variables, reason = "contract stub")]
use faceoff_types::*;
use std::collections::BTreeMap;

/// Penalty points of one episode.
pub fn episode_penalty(outcome: &EpisodeOutcome) -> f64 { unimplemented!() }
/// Scores a task. `step_times_s`: computation times of all steps, any order (for mean, p99, max).
pub fn score_task(outcomes: &[EpisodeOutcome], step_times_s: &mut [f64]) -> TaskResult { unimplemented!() }
/// Overall score, DS, tier.
pub fn score_evaluation(profile: Profile, seed: Seed, tasks: BTreeMap<Task, TaskResult>) -> EvaluationResult { unimplemented!() }
/// Wilson 95 %.
pub fn wilson95(successes: u32, episodes: u32) -> [f64; 2] { unimplemented!() }

/// One candidate row of a board.
#[derive(Debug, Clone, PartialEq)]
pub struct BoardEntry<K> { pub key: K, pub result: EvaluationResult, /** earlier submissions first on a full tie */ pub submitted_at_ms: i64 }
/// Sorts the overall board: tiers in order, then score desc, DS asc, earlier submission. Rank counts from 1 over the whole board.
#[derive(Debug, Clone, PartialEq)]
pub struct RankedEntry<K> { pub rank: u32, pub tier: Tier, pub entry: BoardEntry<K> }
pub fn overall_board<K>(entries: Vec<BoardEntry<K>>) -> Vec<RankedEntry<K>> { unimplemented!() }
/// Same by one task's success rate, DS and tier; teams without the task are left out.
pub fn task_board<K>(task: Task, entries: Vec<BoardEntry<K>>) -> Vec<RankedEntry<K>> { unimplemented!() }
