//! `faceoff demo`: a competition day from an empty folder to the board, through the public API.

use crate::{
    client::{Client, Downloaded},
    commands::{board::table, output::print, verify},
};
use anyhow::{Context, bail, ensure};
use clap::Args;
use faceoff_api::requests::BoardQuery;
use faceoff_api::views::{
    board::BoardView,
    evaluation::{EvaluationStatus, EvaluationView},
    submission::{SubmissionStatus, SubmissionView},
};
use faceoff_types::{EvaluationId, MAX_EPISODES_PER_TASK};
use indicatif::{MultiProgress, ProgressBar, ProgressStyle};
use serde::Serialize;
use std::{
    collections::BTreeMap,
    fmt,
    net::{SocketAddr, TcpListener},
    path::{Path, PathBuf},
    process::Stdio,
    time::Duration,
};
use tokio::{
    io::{AsyncBufReadExt as _, BufReader},
    process::{Child, Command},
};

/// How often the demo asks the server for news.
const POLL: Duration = Duration::from_millis(200);
/// How long the server may take to start. Its end is seen at once, so this is for one that hangs, and
/// long enough for a busy machine.
const START_LIMIT: Duration = Duration::from_secs(600);

/// Starts a server on an empty folder, creates a team per bundle, uploads the bundles, runs the day's
/// evaluation, prints the board and downloads a dataset.
#[derive(Debug, Args)]
pub struct DemoCommand {
    /// Bundle to upload, a folder or an archive; one team each
    #[arg(long = "bundle", required = true, value_name = "BUNDLE")]
    bundles: Vec<PathBuf>,
    /// Episodes of each task
    #[arg(long, default_value_t = 50, value_parser = clap::value_parser!(u32).range(1..=i64::from(MAX_EPISODES_PER_TASK)))]
    episodes: u32,
    /// Address of the server; port 0 is any free one
    #[arg(long, default_value = "127.0.0.1:8080")]
    listen: SocketAddr,
    /// Folder for the demo's database and artifacts; the one of an earlier demo is replaced
    #[arg(long, default_value = "demo-data")]
    data_dir: PathBuf,
    /// Stop after the board instead of serving it until Ctrl-C
    #[arg(long)]
    no_serve: bool,
    /// Print the board and what was downloaded as JSON, and the steps to standard error
    #[arg(long)]
    json: bool,
}

/// What is printed with `--json`.
#[derive(Debug, Serialize)]
struct Played<'a> {
    /// Where the board is served, unless with `--no-serve`.
    server: &'a str,
    data_dir: &'a Path,
    board: &'a BoardView,
    dataset: &'a Downloaded,
}

/// Where the steps of the day are told.
#[derive(Debug, Clone, Copy)]
struct Told {
    beside_json: bool,
}

impl Told {
    fn step(self, line: fmt::Arguments<'_>) {
        if self.beside_json {
            eprintln!("{line}");
        } else {
            println!("{line}");
        }
    }
}

impl DemoCommand {
    /// Plays the day.
    ///
    /// # Errors
    /// If any step of the day does not end as it should.
    pub fn run(self) -> anyhow::Result<()> {
        tokio::runtime::Builder::new_multi_thread()
            .enable_all()
            .build()
            .context("starting the async runtime")?
            .block_on(self.play())
    }

    async fn play(self) -> anyhow::Result<()> {
        // Before anything is removed: another server's port would make the demo talk to that server.
        TcpListener::bind(self.listen).with_context(|| {
            format!(
                "{} is in use; choose another with LISTEN=127.0.0.1:PORT",
                self.listen
            )
        })?;
        fresh_folder(&self.data_dir)?;
        let told = Told {
            beside_json: self.json,
        };

        told.step(format_args!(
            "1. starting the server on {}",
            self.data_dir.display()
        ));
        let log = self.data_dir.join("server.log");
        let mut server = Server::start(self.listen, &self.data_dir, self.episodes, &log)?;
        let organiser = server.ready().await.with_context(|| {
            format!(
                "the server did not start; the end of {}:\n{}\n",
                log.display(),
                tail(&log)
            )
        })?;

        told.step(format_args!(
            "2. creating {} teams and uploading their agents",
            self.bundles.len()
        ));
        let mut teams = Vec::new();
        for bundle in &self.bundles {
            let name = team_name(bundle)?;
            let team = organiser.create_team(&name).await?;
            let client = organiser.with_token(&team.token);
            let submission = client.upload(bundle).await?;
            teams.push((name, client, submission));
        }
        for (name, client, submission) in &teams {
            let verdict = validated(client, submission).await?;
            told.step(format_args!("   {name}: {verdict}"));
        }

        told.step(format_args!(
            "3. evaluating: hit, defend, prepare × {} episodes",
            self.episodes
        ));
        let day = organiser.start_day(None).await?;
        ensure!(
            day.created.len() == teams.len(),
            "expected an evaluation per team, got {} for {} teams",
            day.created.len(),
            teams.len()
        );
        let evaluations = follow(&organiser, &day.created).await?;

        told.step(format_args!("4. the board\n"));
        let board = organiser.board(None, &BoardQuery::default()).await?;
        ensure!(
            board.rows.len() == evaluations.len(),
            "expected {} rows on the board, got {}",
            evaluations.len(),
            board.rows.len()
        );
        told.step(format_args!("{}", table::render(&board)));

        let (name, client, _) = &teams[0];
        let own = evaluations
            .iter()
            .find(|evaluation| evaluation.team_name.as_str() == name)
            .context("the first team has no evaluation")?;
        let dataset = self.data_dir.join(format!("{name}-dataset.zip"));
        let nobody = ProgressBar::hidden();
        let done = client
            .download_dataset(own.id, &dataset, None, &nobody)
            .await?;
        let bytes = done.bytes;
        ensure!(bytes > 0, "the dataset of {name} is empty");
        told.step(format_args!(
            "5. dataset of {name}: {} ({:.1} MB)",
            dataset.display(),
            bytes as f64 / 1e6
        ));

        let verifying = tokio::task::spawn_blocking(move || verify::verified_line(&dataset));
        let verified = verifying.await.context("verifying the dataset")?;
        told.step(format_args!(
            "   {}",
            verified.context("the dataset is not verified")?
        ));

        if self.json {
            let played = Played {
                server: &server.url,
                data_dir: &self.data_dir,
                board: &board,
                dataset: &done,
            };
            print(true, &played, String::new)?;
        }
        if self.no_serve {
            return server.stop().await;
        }
        told.step(format_args!(
            "\nThe same board: {}/   (Ctrl-C ends the server)",
            server.url
        ));
        tokio::select! {
            stopped = tokio::signal::ctrl_c() => stopped.context("waiting for Ctrl-C")?,
            ended = server.child.wait() => bail!(
                "the server ended by itself ({}); its log is {}",
                ended.context("waiting for the server")?,
                log.display()
            ),
        }
        server.stop().await
    }
}

/// The last lines of a log, as a beginner needs them.
fn tail(log: &Path) -> String {
    const LINES: usize = 12;
    let text = std::fs::read_to_string(log).unwrap_or_default();
    let lines: Vec<&str> = text.lines().collect();
    lines[lines.len().saturating_sub(LINES)..].join("\n")
}

/// Empties the folder of an earlier demo; refuses one that holds something else.
fn fresh_folder(folder: &Path) -> anyhow::Result<()> {
    /// Marks a folder as one that a demo may replace.
    const MARK: &str = ".faceoff-demo";
    if folder.exists() {
        let empty = folder
            .read_dir()
            .with_context(|| format!("reading {}", folder.display()))?
            .next()
            .is_none();
        ensure!(
            empty || folder.join(MARK).exists(),
            "{} exists and was not made by a demo; choose another folder with --data-dir",
            folder.display()
        );
        std::fs::remove_dir_all(folder)
            .with_context(|| format!("removing {}", folder.display()))?;
    }
    std::fs::create_dir_all(folder).with_context(|| format!("making {}", folder.display()))?;
    std::fs::write(folder.join(MARK), "")
        .with_context(|| format!("writing to {}", folder.display()))
}

/// The bundle's folder or file name without its ending.
fn team_name(bundle: &Path) -> anyhow::Result<String> {
    let name = bundle
        .canonicalize()
        .with_context(|| format!("bundle {} cannot be found", bundle.display()))?;
    let name = name.file_name().unwrap_or_default().to_string_lossy();
    Ok(name.split('.').next().unwrap_or_default().to_owned())
}

/// The server as a process of its own, as an organiser would run it.
struct Server {
    child: Child,
    /// Known once it is [`ready`](Self::ready).
    url: String,
    data_dir: PathBuf,
}

impl Server {
    /// By a configuration of its own, which says nothing but how many episodes a day has.
    fn start(
        listen: SocketAddr,
        data_dir: &Path,
        episodes: u32,
        log: &Path,
    ) -> anyhow::Result<Self> {
        let config = data_dir.join("faceoff.toml");
        let text = format!("[evaluation]\nepisodes_per_task = {episodes}\n");
        std::fs::write(&config, text).with_context(|| format!("writing {}", config.display()))?;
        let program = std::env::current_exe().context("finding this program")?;
        let log =
            std::fs::File::create(log).with_context(|| format!("making {}", log.display()))?;
        let mut command = Command::new(program);
        command
            .arg("serve")
            .arg("--config")
            .arg(config)
            .arg("--listen")
            .arg(listen.to_string())
            .arg("--data-dir")
            .arg(data_dir)
            .stdin(Stdio::null())
            .stdout(Stdio::piped())
            .stderr(log)
            // A demo that fails half way leaves no server behind.
            .kill_on_drop(true);
        let child = command.spawn().context("starting the server")?;
        Ok(Self {
            child,
            url: String::new(),
            data_dir: data_dir.to_owned(),
        })
    }

    /// Waits until the server tells its address; returns the organiser's client.
    async fn ready(&mut self) -> anyhow::Result<Client> {
        let stdout = self
            .child
            .stdout
            .take()
            .context("its output is not piped")?;
        let mut told = BufReader::new(stdout).lines();
        let url = tokio::time::timeout(START_LIMIT, told.next_line())
            .await
            .with_context(|| format!("no word from it in {START_LIMIT:?}"))?
            .context("reading its address")?;
        let Some(url) = url else {
            bail!(
                "it ended with {}",
                self.child.wait().await.context("waiting for it")?
            )
        };
        self.url = url;
        let visitor = Client::new(&self.url, None, None)?;
        visitor.health().await?;
        let token = std::fs::read_to_string(self.data_dir.join("admin-token"))
            .context("reading the organiser's token")?;
        Ok(visitor.with_token(token.trim()))
    }

    /// Asks the server to end and waits for it.
    async fn stop(mut self) -> anyhow::Result<()> {
        if let Some(id) = self.child.id().and_then(|id| i32::try_from(id).ok())
            && let Some(id) = rustix::process::Pid::from_raw(id)
        {
            // Gone already is fine: it is reaped below either way.
            let _ = rustix::process::kill_process(id, rustix::process::Signal::TERM);
        }
        let status = self
            .child
            .wait()
            .await
            .context("waiting for the server to end")?;
        ensure!(status.success(), "the server ended with {status}");
        Ok(())
    }
}

/// Waits for the verdict of an upload; an error if the agent is not valid.
async fn validated(client: &Client, submission: &SubmissionView) -> anyhow::Result<String> {
    loop {
        let current = client.submission(submission.id).await?;
        match current.status {
            SubmissionStatus::Validating => tokio::time::sleep(POLL).await,
            SubmissionStatus::Valid { .. } => {
                let agent = current.agent_name.unwrap_or_default();
                return Ok(format!("agent “{agent}” starts, answers and keeps time"));
            }
            SubmissionStatus::Invalid { reason, log } => {
                let log = log.unwrap_or_default();
                bail!("{} is not valid: {reason}\n{log}", submission.file_name)
            }
            SubmissionStatus::ValidationError { reason } => {
                bail!("{} could not be validated: {reason}", submission.file_name)
            }
        }
    }
}

/// Shows progress until all evaluations have ended; an error if one did not finish.
async fn follow(
    organiser: &Client,
    created: &[EvaluationView],
) -> anyhow::Result<Vec<EvaluationView>> {
    let bars = MultiProgress::new();
    let style =
        ProgressStyle::with_template("   {prefix:<12} {bar:40} {pos:>5}/{len} episodes  {msg}")
            .context("the progress bar's template")?;
    let bars: BTreeMap<EvaluationId, ProgressBar> = created
        .iter()
        .map(|evaluation| {
            let bar = bars.add(ProgressBar::new(evaluation.progress.episodes_total.into()));
            bar.set_style(style.clone());
            bar.set_prefix(evaluation.team_name.to_string());
            (evaluation.id, bar)
        })
        .collect();
    let mut ended = Vec::new();
    while ended.len() < bars.len() {
        ended.clear();
        for (id, bar) in &bars {
            let evaluation = organiser.evaluation(*id).await?;
            bar.set_position(evaluation.progress.episodes_done.into());
            match &evaluation.status {
                EvaluationStatus::Finished { .. } => bar.finish_with_message("scored"),
                status if status.is_final() => {
                    bail!(
                        "the evaluation of {} failed: {status:#?}",
                        evaluation.team_name
                    )
                }
                _ => continue,
            }
            ended.push(evaluation);
        }
        tokio::time::sleep(POLL).await;
    }
    // The last one's end released the day: all of it is told now.
    ensure!(
        ended
            .iter()
            .any(|evaluation| evaluation.released_at.is_some()),
        "every evaluation has ended, and the day is not released"
    );
    Ok(ended)
}
