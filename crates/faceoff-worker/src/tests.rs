//! Slots on a real store, with an evaluator that plays what a test tells it to: faults of ours and
//! moments of time that a healthy runner does not offer. The real runner is in `tests/it`.

use crate::{
    clock::Clock,
    evaluator::Evaluator,
    service::{Pace, WorkerConfig, run_with},
};
use faceoff_runner::{
    AgentEnvironment, EvaluationMeta, Observer, PlatformFault, ShardReport, ShardSpec, SmokeReport,
    TimeLimits,
    bundle::{Bundle, BundleError, BundleLimits},
};
use faceoff_sandbox::{Isolation, Limits};
use faceoff_store::*;
use faceoff_types::*;
use jiff::{SignedDuration, Timestamp};
use std::{
    collections::BTreeMap,
    path::{Path, PathBuf},
    sync::{
        Arc, Mutex,
        atomic::{AtomicI64, AtomicU32, Ordering},
    },
    time::Duration,
};
use tokio::task::JoinHandle;
use tokio_util::sync::CancellationToken;

type Play = dyn Fn(&ShardSpec, &mut dyn Observer) -> Result<(), PlatformFault> + Send + Sync;

/// Plays by a test's closure; records which episodes were played and what was assembled.
struct Scripted {
    play: Box<Play>,
    played: Mutex<Vec<(Task, u32)>>,
    assembled: Mutex<Vec<String>>,
}

impl Scripted {
    fn new(
        play: impl Fn(&ShardSpec, &mut dyn Observer) -> Result<(), PlatformFault>
        + Send
        + Sync
        + 'static,
    ) -> Arc<Self> {
        Arc::new(Self {
            play: Box::new(play),
            played: Mutex::default(),
            assembled: Mutex::default(),
        })
    }
}

fn outcome(task: Task, episode: u32) -> EpisodeOutcome {
    EpisodeOutcome {
        task,
        episode,
        steps: 1,
        end: EpisodeEnd::Horizon,
        success: true,
        violations: Violations::default(),
        computation_time: ComputationTime::default(),
        fault: None,
    }
}

impl Evaluator for Scripted {
    fn unpack(
        &self,
        archive: &Path,
        into: &Path,
        _limits: &BundleLimits,
    ) -> Result<Bundle, BundleError> {
        if std::fs::read(archive).unwrap() != b"archive" {
            return Err(BundleError::Invalid("agent.toml is missing".into()));
        }
        let manifest = faceoff_wire::Manifest {
            name: "scripted".into(),
            command: vec!["./agent".into()],
            runtime: "native".into(),
            interpolation: None,
            env: BTreeMap::new(),
        };
        Ok(Bundle {
            dir: into.to_owned(),
            manifest,
        })
    }

    fn smoke(&self, _: &Bundle, _: &AgentEnvironment) -> Result<SmokeReport, PlatformFault> {
        Ok(SmokeReport {
            fault: None,
            log: "smoke\n".into(),
        })
    }

    fn play(
        &self,
        spec: &ShardSpec,
        _bundle: &Bundle,
        _env: &AgentEnvironment,
        out: &Path,
        observer: &mut dyn Observer,
    ) -> Result<ShardReport, PlatformFault> {
        (self.play)(spec, observer)?;
        self.played
            .lock()
            .unwrap()
            .push((spec.task, spec.episodes.start));
        std::fs::write(
            out.join("steps.parquet"),
            format!("{} {}", spec.task, spec.episodes.start),
        )
        .unwrap();
        let outcomes = spec
            .episodes
            .clone()
            .map(|episode| outcome(spec.task, episode))
            .collect();
        Ok(ShardReport {
            outcomes,
            log: String::new(),
            stopped_by_faults: false,
        })
    }

    fn assemble(
        &self,
        meta: &EvaluationMeta,
        recordings: &[PathBuf],
        archive: &Path,
    ) -> Result<EvaluationResult, PlatformFault> {
        let parts = recordings
            .iter()
            .map(|folder| std::fs::read_to_string(folder.join("steps.parquet")).unwrap())
            .collect::<Vec<_>>();
        std::fs::write(archive, parts.join("\n")).unwrap();
        *self.assembled.lock().unwrap() = parts;
        Ok(EvaluationResult {
            ruleset: meta.ruleset.clone(),
            profile: meta.profile,
            seed: meta.seed,
            tasks: BTreeMap::new(),
            score: 50.0,
            penalty_points: 0.0,
            tier: Tier::Deployable,
        })
    }
}

/// A store with one team's valid submission, and a clock that tests turn forward.
struct Server {
    store: Store,
    folder: tempfile::TempDir,
    ahead_s: Arc<AtomicI64>,
}

const LEASE_S: u32 = 30;

impl Server {
    async fn new() -> Self {
        let folder = tempfile::tempdir().unwrap();
        let store = Store::open(folder.path()).await.unwrap();
        Self {
            store,
            folder,
            ahead_s: Arc::default(),
        }
    }

    fn clock(&self) -> Clock {
        let ahead_s = Arc::clone(&self.ahead_s);
        Clock::of(move || {
            Timestamp::now() + SignedDuration::from_secs(ahead_s.load(Ordering::SeqCst))
        })
    }

    fn now(&self) -> Timestamp {
        self.clock().now()
    }

    async fn upload(&self, team: &str, content: &[u8]) -> Submission {
        let archive = self.folder.path().join("upload");
        std::fs::write(&archive, content).unwrap();
        self.store
            .artifacts()
            .put_file(&format!("bundles/{team}"), &archive)
            .await
            .unwrap();
        let bundle = BundleRef {
            key: format!("bundles/{team}"),
            bytes: content.len() as u64,
            blake3: blake3::hash(content).to_string(),
            file_name: "agent.tar.gz".into(),
        };
        let token_hash = *blake3::hash(team.as_bytes()).as_bytes();
        let now = self.now();
        let team = self
            .store
            .create_team(&team.parse().unwrap(), token_hash, now)
            .await
            .unwrap();
        self.store
            .create_submission(team.id, bundle, now)
            .await
            .unwrap()
    }

    /// An evaluation of six shards, all of them queued.
    async fn evaluation(&self) -> EvaluationId {
        let submission = self.upload("Alpha", b"archive").await;
        let Some(Work::Smoke { claim, .. }) =
            self.store.claim("test", LEASE_S, self.now()).await.unwrap()
        else {
            panic!("a smoke run is queued")
        };
        let outcome = SmokeOutcome::Valid {
            agent_name: "scripted".into(),
            log: String::new(),
        };
        self.store
            .commit_smoke(&claim, outcome, self.now())
            .await
            .unwrap();
        let plan = EvaluationPlan {
            profile: Profile::Evaluation,
            tasks: Task::ALL.to_vec(),
            episodes_per_task: 4,
            episodes_per_shard: 2,
            max_faults: 10,
        };
        self.store
            .create_evaluation(submission.id, &plan, self.now())
            .await
            .unwrap()
            .id
    }

    fn work(&self, slots: usize, evaluator: &Arc<Scripted>) -> Running {
        let config = WorkerConfig {
            slots,
            lease_s: LEASE_S,
            scratch_dir: self.folder.path().join("scratch"),
            agent: AgentEnvironment {
                limits: limits(),
                time: TimeLimits {
                    startup_s: 1.0,
                    reset_s: 1.0,
                    step_s: 1.0,
                    bye_s: 1.0,
                },
                isolation: Isolation::None,
                runtimes: BTreeMap::new(),
                agent_cpus: vec![0],
            },
            bundle_limits: BundleLimits {
                packed_bytes: 1,
                unpacked_bytes: 1,
                files: 1,
            },
        };
        let pace = Pace {
            clock: self.clock(),
            poll: Duration::from_millis(20),
            tidy_every: Duration::from_millis(20),
            ..Pace::default()
        };
        let shutdown = CancellationToken::new();
        let evaluator = Arc::clone(evaluator) as Arc<dyn Evaluator>;
        let task = tokio::spawn(run_with(
            self.store.clone(),
            config,
            shutdown.clone(),
            evaluator,
            pace,
        ));
        Running { shutdown, task }
    }

    /// Waits for an evaluation's end by the store's events.
    async fn over(&self, id: EvaluationId) -> EvaluationState {
        let mut events = self.store.events();
        loop {
            let state = self.store.evaluation(id).await.unwrap().state;
            if state.is_over() {
                return state;
            }
            // a lagging receiver has missed something: look again
            let _ = events.recv().await;
        }
    }
}

fn limits() -> Limits {
    Limits {
        memory_bytes: 1 << 30,
        pids: 64,
        scratch_bytes: 1 << 20,
        open_files: 64,
        file_size_bytes: 1 << 20,
        cpus: 1.0,
        stderr_tail_bytes: 1 << 16,
    }
}

struct Running {
    shutdown: CancellationToken,
    task: JoinHandle<anyhow::Result<()>>,
}

impl Running {
    async fn stop(self) {
        self.shutdown.cancel();
        self.task.await.unwrap().unwrap();
    }
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn slots_play_every_shard_once_and_publish_the_dataset() {
    let server = Server::new().await;
    let id = server.evaluation().await;
    let evaluator = Scripted::new(|spec, observer| {
        for episode in spec.episodes.clone() {
            observer.episode_done(&outcome(spec.task, episode));
        }
        Ok(())
    });
    let running = server.work(3, &evaluator);
    let EvaluationState::Finished {
        result, dataset, ..
    } = server.over(id).await
    else {
        panic!("it finishes")
    };
    let mut played = evaluator.played.lock().unwrap().clone();
    played.sort_unstable();
    let all: Vec<_> = Task::ALL
        .into_iter()
        .flat_map(|task| [(task, 0), (task, 2)])
        .collect();
    assert_eq!(played, all);
    let in_order: Vec<_> = all
        .iter()
        .map(|(task, first)| format!("{task} {first}"))
        .collect();
    assert_eq!(
        *evaluator.assembled.lock().unwrap(),
        in_order,
        "recordings in order of play"
    );
    let file = server.folder.path().join("dataset");
    server
        .store
        .artifacts()
        .get_to_file(&dataset, &file)
        .await
        .unwrap();
    assert_eq!(std::fs::read_to_string(&file).unwrap(), in_order.join("\n"));
    let season = server.store.season().await.unwrap();
    let day = server.store.evaluation(id).await.unwrap().day;
    assert_eq!(result.seed, season.secret.day(day));
    running.stop().await;
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn an_upload_is_checked_by_an_idle_worker() {
    let server = Server::new().await;
    let running = server.work(1, &Scripted::new(|_, _| Ok(())));
    let mut events = server.store.events();
    let good = server.upload("Alpha", b"archive").await.id;
    let bad = server.upload("Beta", b"no archive").await.id;
    let state = async |id, events: &mut tokio::sync::broadcast::Receiver<Event>| loop {
        let state = server.store.submission(id).await.unwrap().state;
        if state.is_settled() {
            break state;
        }
        let _ = events.recv().await;
    };
    assert_eq!(
        state(good, &mut events).await,
        SubmissionState::Valid {
            log: "smoke\n".into()
        }
    );
    let reason = "agent.toml is missing".to_owned();
    let invalid = SubmissionState::Invalid {
        reason,
        log: String::new(),
    };
    assert_eq!(state(bad, &mut events).await, invalid);
    running.stop().await;
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_panic_and_a_fault_of_ours_cost_nothing_but_time() {
    let server = Server::new().await;
    let id = server.evaluation().await;
    let (calls, ahead_s) = (AtomicU32::new(0), Arc::clone(&server.ahead_s));
    let evaluator = Scripted::new(move |_, _| {
        match calls.fetch_add(1, Ordering::SeqCst) {
            0 => panic!("a defect of ours"),
            1 => {
                let source = std::io::Error::other("disk full");
                Err(PlatformFault::Io {
                    what: "writing".into(),
                    source,
                })
            }
            // the pause after a failure passes
            _ => {
                ahead_s.fetch_add(10, Ordering::SeqCst);
                Ok(())
            }
        }
    });
    let running = server.work(1, &evaluator);
    assert!(matches!(
        server.over(id).await,
        EvaluationState::Finished { .. }
    ));
    assert_eq!(evaluator.played.lock().unwrap().len(), 6);
    running.stop().await;
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_lasting_fault_of_ours_gives_the_turn_back() {
    let server = Server::new().await;
    let id = server.evaluation().await;
    let ahead_s = Arc::clone(&server.ahead_s);
    let evaluator = Scripted::new(move |_, _| {
        ahead_s.fetch_add(61, Ordering::SeqCst);
        Err(PlatformFault::Recording("no space left".into()))
    });
    let running = server.work(1, &evaluator);
    let state = server.over(id).await;
    let EvaluationState::PlatformFailed { reason, .. } = &state else {
        panic!("{state:?}")
    };
    assert!(
        reason.starts_with("the recording could not be made"),
        "{reason}"
    );
    assert!(
        !reason.contains("no space left"),
        "the cause is for the log: {reason}"
    );
    assert!(!state.takes_turn());
    running.stop().await;
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_shutdown_gives_the_unit_back_and_the_next_worker_finishes() {
    let server = Server::new().await;
    let id = server.evaluation().await;
    let (begun, mut begins) = tokio::sync::mpsc::unbounded_channel();
    let hanging = Scripted::new(move |_, observer| {
        begun.send(()).unwrap();
        while !observer.cancelled() {
            std::thread::yield_now();
        }
        Err(PlatformFault::Cancelled)
    });
    let running = server.work(2, &hanging);
    begins.recv().await.unwrap();
    begins.recv().await.unwrap();
    running.stop().await;
    assert!(hanging.played.lock().unwrap().is_empty());

    let healthy = Scripted::new(|_, _| Ok(()));
    let running = server.work(1, &healthy);
    assert!(matches!(
        server.over(id).await,
        EvaluationState::Finished { .. }
    ));
    assert_eq!(healthy.played.lock().unwrap().len(), 6);
    running.stop().await;
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_cancelled_evaluation_stops_its_slots() {
    let server = Server::new().await;
    let id = server.evaluation().await;
    let (begun, mut begins) = tokio::sync::mpsc::unbounded_channel();
    let (stopped, mut stops) = tokio::sync::mpsc::unbounded_channel();
    let hanging = Scripted::new(move |spec, observer| {
        // progress makes the next look at the lease a matter of a second
        observer.episode_done(&outcome(spec.task, spec.episodes.start));
        begun.send(()).unwrap();
        while !observer.cancelled() {
            std::thread::yield_now();
        }
        stopped.send(()).unwrap();
        Err(PlatformFault::Cancelled)
    });
    let running = server.work(1, &hanging);
    begins.recv().await.unwrap();
    server
        .store
        .cancel_evaluation(id, "rain", server.now())
        .await
        .unwrap();
    stops.recv().await.unwrap();
    running.stop().await;
    assert!(matches!(
        server.over(id).await,
        EvaluationState::Cancelled { .. }
    ));
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn what_was_played_under_a_lost_lease_is_thrown_away() {
    let server = Server::new().await;
    let id = server.evaluation().await;
    let (handle, clock) = (tokio::runtime::Handle::current(), server.clock());
    let (store, ahead_s) = (server.store.clone(), Arc::clone(&server.ahead_s));
    let stolen = Arc::new(Mutex::new(None));
    let thief = Arc::clone(&stolen);
    let evaluator = Scripted::new(move |spec, _| {
        if thief.lock().unwrap().is_none() {
            // the slot stalls until its lease is over, and another worker takes and plays the shard
            ahead_s.fetch_add(i64::from(LEASE_S) + 1, Ordering::SeqCst);
            let work = handle
                .block_on(store.claim("thief", LEASE_S, clock.now()))
                .unwrap();
            let Some(Work::Shard { claim, shard, .. }) = work else {
                panic!("{work:?}")
            };
            assert_eq!(
                (shard.task, shard.first_episode),
                (spec.task, spec.episodes.start)
            );
            *thief.lock().unwrap() = Some(claim);
        }
        Ok(())
    });
    let running = server.work(1, &evaluator);
    let mut events = server.store.events();
    while evaluator.played.lock().unwrap().len() < 6 {
        let _ = events.recv().await;
    }
    let claim = stolen.lock().unwrap().clone().unwrap();
    let scratch = tempfile::tempdir().unwrap();
    std::fs::write(scratch.path().join("steps.parquet"), "by the thief").unwrap();
    let recording = claim.recording_key(id);
    server
        .store
        .artifacts()
        .put_folder(&recording, scratch.path())
        .await
        .unwrap();
    let recordings = server
        .folder
        .path()
        .join("artifacts/recordings")
        .join(id.to_string());
    let of_the_shard = std::fs::read_dir(recordings.join(claim.unit.to_string())).unwrap();
    assert_eq!(
        of_the_shard.count(),
        1,
        "the stalled slot has removed its own"
    );
    let shard = server.store.shards(id).await.unwrap().remove(0);
    let outcomes = (0..2).map(|episode| outcome(shard.task, episode)).collect();
    let commit = ShardCommit {
        outcomes,
        log: String::new(),
        stopped_by_faults: false,
        recording,
    };
    let committed = server
        .store
        .commit_shard(&claim, commit, server.now())
        .await
        .unwrap();
    assert_eq!(committed, Committed::Now);
    assert!(matches!(
        server.over(id).await,
        EvaluationState::Finished { .. }
    ));
    assert_eq!(evaluator.assembled.lock().unwrap()[0], "by the thief");
    running.stop().await;
    server
        .store
        .remove_old_recordings(server.now())
        .await
        .unwrap();
    assert!(!recordings.exists() || std::fs::read_dir(&recordings).unwrap().next().is_none());
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_new_life_takes_over_what_the_last_one_held() {
    let server = Server::new().await;
    let id = server.evaluation().await;
    // a life that ended without a word: its scratch folder tells who it was
    let scratch = crate::scratch::Scratch::take(&server.folder.path().join("scratch")).unwrap();
    let worker = format!("{}/slot-0", scratch.worker());
    server
        .store
        .claim(&worker, 100_000, server.now())
        .await
        .unwrap()
        .unwrap();
    drop(scratch);
    let running = server.work(1, &Scripted::new(|_, _| Ok(())));
    assert!(matches!(
        server.over(id).await,
        EvaluationState::Finished { .. }
    ));
    running.stop().await;
}

#[tokio::test]
async fn two_processes_cannot_share_a_scratch_folder() {
    let server = Server::new().await;
    let _other = crate::scratch::Scratch::take(&server.folder.path().join("scratch")).unwrap();
    let running = server.work(1, &Scripted::new(|_, _| Ok(())));
    let error = running.task.await.unwrap().unwrap_err();
    assert!(error.to_string().contains("another process"), "{error}");
}

#[tokio::test]
async fn the_schedule_starts_a_missed_day_once() {
    let server = Server::new().await;
    let submission = server.upload("Alpha", b"archive").await;
    let work = server
        .store
        .claim("test", LEASE_S, server.now())
        .await
        .unwrap()
        .unwrap();
    let outcome = SmokeOutcome::Valid {
        agent_name: "a".into(),
        log: String::new(),
    };
    server
        .store
        .commit_smoke(work.claim(), outcome, server.now())
        .await
        .unwrap();
    let plan = EvaluationPlan {
        profile: Profile::Ideal,
        tasks: vec![Task::Hit],
        episodes_per_task: 1,
        episodes_per_shard: 1,
        max_faults: 0,
    };
    for _ in 0..2 {
        let mut events = server.store.events();
        let shutdown = CancellationToken::new();
        let at = jiff::civil::Time::midnight();
        let schedule =
            crate::run_schedule(server.store.clone(), plan.clone(), at, shutdown.clone());
        let schedule = tokio::spawn(schedule);
        if server.store.last_scheduled_day().await.unwrap().is_none() {
            let event = events.recv().await.unwrap();
            assert!(matches!(event, Event::Evaluation(_)));
        }
        shutdown.cancel();
        schedule.await.unwrap().unwrap();
        assert_eq!(
            server
                .store
                .evaluations_of(submission.team)
                .await
                .unwrap()
                .len(),
            1
        );
    }
}
