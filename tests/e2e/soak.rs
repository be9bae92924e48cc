//! All of it at once, for as long as one likes: evaluations, uploads good and bad, readers, a disk that fills
//! up and has room again, and `kill -9`. At the end every result is the one of an undisturbed run, every
//! upload has the verdict that it deserves, and nothing is left over.
#![expect(clippy::print_stdout, reason = "it says what it has done in its hour")]

use crate::{
    Team, dataset, entry, growth::BOUND_BYTES, kills::draw, path_of, scored_locally, start_day,
    upgrade, without_times,
};
use faceoff_tests::{
    bundle::{packed, python_agent, python_bundle, reference},
    server::{Server, http},
    small_disk::{Full, LogTo, SmallDisk},
};
use reqwest::blocking::{Client, RequestBuilder};
use serde_json::Value;
use std::{
    collections::{BTreeMap, BTreeSet},
    env, fs,
    path::{Path, PathBuf},
    sync::{Mutex, MutexGuard},
    thread,
    time::{Duration, Instant},
};

/// What a team's agent does in each step.
const HOLD: &str = "say(hold)";
/// Swings one joint to and fro, too fast now and then.
const SWING: &str = "import math\n\
     p = list(held)\n\
     p[0] += 0.3 * math.sin(0.02 * message['step'] * (1 + message['step'] / 200))\n\
     say({'type': 'act', 'step': message['step'], 'action': [p, [0.0] * 7]})";
/// Before that it sleeps, once an episode, so that evaluations last as long as the disturbance.
const PACE: &str = "if message['step'] == 0:\n    time.sleep(1)\n";

/// A number from the environment.
fn setting(name: &str, otherwise: u64) -> u64 {
    env::var(name).map_or(otherwise, |text| text.parse().expect("a number"))
}

/// Draws, each another: the number of the next.
struct Draws(u64);

impl Draws {
    fn of_seed(seed: u64) -> Self {
        Self(seed << 32)
    }

    /// Below `most`.
    fn below(&mut self, most: u64) -> u64 {
        self.0 += 1;
        (draw(self.0) * most as f64) as u64
    }

    fn millis(&mut self, most: u64) -> Duration {
        Duration::from_millis(self.below(most))
    }
}

/// What was done and how it was answered, counted.
#[derive(Debug, Default)]
struct Tally(Mutex<BTreeMap<String, u64>>);

impl Tally {
    fn add(&self, what: impl Into<String>) {
        *lock(&self.0).entry(what.into()).or_default() += 1;
    }
}

fn lock<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().expect("nobody panics with it")
}

/// What all threads share.
struct Soak {
    /// Where the server is now.
    url: Mutex<String>,
    ends: Instant,
    tally: Tally,
    client: Client,
}

impl Soak {
    fn is_over(&self) -> bool {
        Instant::now() >= self.ends
    }

    /// The status of the answer, if there was one, and its body.
    fn ask(
        &self,
        what: &str,
        request: impl Fn(&Client, &str) -> RequestBuilder,
    ) -> Option<(u16, String)> {
        let url = lock(&self.url).clone();
        let answer = request(&self.client, &url).send();
        let answer = answer.and_then(|answer| {
            let status = answer.status().as_u16();
            Ok((status, answer.text()?))
        });
        match answer {
            Ok((status, body)) => {
                self.tally.add(format!("{what} {status}"));
                Some((status, body))
            }
            // The server was killed.
            Err(_) => {
                self.tally.add(format!("{what} broken off"));
                None
            }
        }
    }

    /// Reads pages until it is over.
    fn read(&self, pages: &[String]) {
        for page in pages.iter().cycle() {
            if self.is_over() {
                return;
            }
            self.ask("page", |client, url| client.get(format!("{url}{page}")));
            thread::sleep(Duration::from_millis(50));
        }
    }

    /// Uploads one after the other until it is over; returns which were taken, and the verdict due to each.
    fn upload(
        &self,
        token: &str,
        archives: &[(Vec<u8>, &'static str)],
    ) -> Vec<(String, &'static str)> {
        let mut taken = Vec::new();
        for (archive, verdict) in archives.iter().cycle() {
            if self.is_over() {
                return taken;
            }
            let answer = self.ask("upload", |client, url| {
                client
                    .post(format!("{url}/api/v1/submissions"))
                    .bearer_auth(token)
                    .body(archive.clone())
            });
            if let Some((201, body)) = answer {
                let body: Value = serde_json::from_str(&body).expect("the API speaks JSON");
                let id = body["id"].as_str().expect("a submission has an id");
                taken.push((id.to_owned(), *verdict));
            }
            thread::sleep(Duration::from_secs(6));
        }
        taken
    }
}

/// A team that is evaluated: what it uploaded, and the same without pauses.
struct Contestant {
    team: Team,
    submission: Value,
    unhurried: PathBuf,
}

impl Contestant {
    fn enter(server: &Server, name: &str, bundle: &Path, unhurried: PathBuf) -> Self {
        let team = Team::create(server, name);
        let submission = team.submit(server, bundle);
        assert_eq!(submission["state"], "valid", "{submission:#}");
        Self {
            team,
            submission,
            unhurried,
        }
    }

    fn python(server: &Server, folder: &Path, name: &str, on_step: &str) -> Self {
        let bundle =
            |name: &str, on_step: &str| python_bundle(folder, name, &python_agent(on_step));
        let paced = bundle(&format!("paced-{name}"), &format!("{PACE}{on_step}"));
        Self::enter(server, name, &paced, bundle(name, on_step))
    }
}

/// What is wrong with a log, if anything is that no disturbance explains.
fn assert_calm(log: &str) {
    for word in ["panicked", "begin_with", "poisoned"] {
        assert!(!log.contains(word), "{word}: {log}");
    }
}

/// Fills, kills and restarts until it is over.
fn disturb(disk: &mut SmallDisk, soak: &Soak, draws: &mut Draws) {
    while !soak.is_over() {
        thread::sleep(Duration::from_secs(4) + draws.millis(20_000));
        let kind = draws.below(3);
        let full = (kind != 0).then(|| {
            soak.tally.add("disk filled");
            let full = Full::of(&disk.data_dir);
            thread::sleep(draws.millis(12_000));
            full
        });
        if kind != 1 {
            soak.tally.add("server killed");
            assert_calm(&disk.server.log());
            let pause = draws.millis(3000);
            disk.kill_and_restart(|| {
                drop(full);
                thread::sleep(pause);
            });
            lock(&soak.url).clone_from(&disk.server.url);
        }
    }
}

#[test]
#[ignore = "takes as long as it is told to; `make soak` runs it alone, for an hour"]
fn everything_at_once_ends_as_if_nothing_had_been() {
    let minutes = setting("SOAK_MINUTES", 60);
    let mut draws = Draws::of_seed(setting("SOAK_SEED", 2026));
    let scratch = tempfile::tempdir().expect("a scratch folder can be made");
    let folder = scratch.path();
    // Of each task; two teams take more than a second for each.
    let episodes = u32::try_from(4 * minutes).expect("some hours") + 6;
    let config = format!(
        "{}\n[server]\nmin_free_bytes = {}\n[evaluation]\nepisodes_per_task = {episodes}\n\
         episodes_per_shard = 3\n[workers]\nslots = 1\nlease_s = 5\n",
        include_str!("../patient.toml"),
        8 << 20,
    );
    let mut disk = SmallDisk::start(folder, (256 + 24 * minutes) << 20, &config, LogTo::Test);
    let server = &disk.server;
    let striker = reference("striker", folder);
    let contestants = [
        Contestant::python(server, folder, "holds", HOLD),
        Contestant::python(server, folder, "swings", SWING),
        Contestant::enter(server, "strikes", &striker, striker.clone()),
    ];
    let day = start_day(server);
    let evaluations: Vec<String> = contestants
        .iter()
        .map(|one| path_of(&day, &one.submission))
        .collect();
    let uploaders: Vec<Team> = ["Ann", "Bob"].map(|name| Team::create(server, name)).into();
    let unknown_runtime = python_bundle(folder, "unknown", &python_agent(HOLD));
    let manifest = "name = \"unknown\"\ncommand = [\"python3\"]\nruntime = \"none\"\n";
    fs::write(unknown_runtime.join("agent.toml"), manifest).expect("a scratch file can be written");
    let good = packed(&python_bundle(folder, "good", &python_agent(HOLD)));
    let cut_off = good[..good.len() / 2].to_vec();
    let archives = [
        (good, "valid"),
        (b"no archive at all".to_vec(), "refused at once"),
        (cut_off, "invalid"),
        (packed(&unknown_runtime), "invalid"),
        (
            packed(&python_bundle(folder, "bad", &python_agent("say({})"))),
            "invalid",
        ),
    ];
    let mut pages = [
        "/",
        "/season",
        "/tasks/hit",
        "/api/v1/board",
        "/api/v1/season",
    ]
    .map(str::to_owned)
    .to_vec();
    pages.extend(evaluations.iter().map(|path| path.replace("/api/v1", "")));

    let soak = Soak {
        url: Mutex::new(server.url.clone()),
        ends: Instant::now() + Duration::from_secs(60 * minutes),
        tally: Tally::default(),
        client: http()
            .timeout(Duration::from_secs(60))
            .build()
            .expect("a client needs nothing"),
    };
    let taken: Vec<(usize, String, &str)> = thread::scope(|scope| {
        for _ in 0..3 {
            scope.spawn(|| soak.read(&pages));
        }
        let uploading: Vec<_> = uploaders
            .iter()
            .map(|team| scope.spawn(|| soak.upload(&team.token, &archives)))
            .collect();
        disturb(&mut disk, &soak, &mut draws);
        let taken = uploading.into_iter().enumerate();
        taken
            .flat_map(|(team, thread)| {
                let taken = thread.join().expect("an uploader fails by itself");
                taken.into_iter().map(move |(id, due)| (team, id, due))
            })
            .collect()
    });

    let server = &disk.server;
    for (team, id, due) in &taken {
        let verdict = uploaders[*team].verdict(server, id);
        assert_eq!(verdict["state"], *due, "{verdict:#}");
    }
    for (contestant, evaluation) in contestants.iter().zip(&evaluations) {
        let token = &contestant.team.token;
        let finished = contestant.team.finished(server, evaluation);
        assert_eq!(finished["state"], "finished", "{finished:#}");
        println!(
            "from {} to {}",
            finished["created_at"], finished["finished_at"]
        );
        assert!(finished["rerun_of"].is_null(), "{finished:#}");
        let out = tempfile::tempdir().expect("a scratch folder can be made");
        // The last one to finish releases the day.
        let _ = server.poll(evaluation, token, |answer| !answer["released_at"].is_null());
        upgrade::verify(server, evaluation, token, out.path());
        let manifest = entry(&mut dataset(server, evaluation, token), "manifest.json");
        let bundle = &contestant.unhurried;
        let local = scored_locally(bundle, &manifest, episodes, &out.path().join("local"));
        let finished = contestant.team.finished(server, evaluation);
        assert_eq!(without_times(&finished["result"]), without_times(&local));
    }
    assert_eq!(server.get("/api/v1/health", None).status(), 200);
    assert_calm(&server.log());
    let log = fs::metadata(disk.data_dir.join("faceoff.sqlite3-wal")).map_or(0, |file| file.len());
    assert!(log < BOUND_BYTES, "{log} bytes");
    let tally = lock(&soak.tally.0).clone();
    println!(
        "{minutes} minutes: {tally:#?}; {} uploads taken, {episodes} episodes of each task",
        taken.len()
    );
    let answers: BTreeSet<&str> = tally.keys().map(String::as_str).collect();
    let expected = BTreeSet::from([
        "disk filled",
        "server killed",
        "page 200",
        "page 503",
        "page broken off",
        "upload 201",
        "upload 415",
        "upload 429",
        "upload 503",
        "upload 507",
        "upload broken off",
    ]);
    assert!(answers.is_subset(&expected), "{answers:?}");
    assert!(tally.contains_key("upload 201"), "{answers:?}");
}
