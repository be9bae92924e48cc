//! `faceoff demo`: runs an evaluation day (an evaluation of each team) from an empty folder to the board, through the public API.

use crate::{
    client::{Client, DownloadedFile},
    commands::{board::table, output::print_json, verify},
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

/// Interval between requests for progress.
const POLL_INTERVAL: Duration = Duration::from_millis(200);
/// Time limit for the server's start, long enough for a busy machine. It only matters if the server hangs, because the end of
/// its process is noticed at once.
const START_TIMEOUT: Duration = Duration::from_secs(600);

/// Starts a server on an empty folder, creates a team per bundle, uploads the bundles, runs an evaluation
/// day, prints the board and downloads a dataset.
#[derive(Debug, Args)]
pub struct DemoCommand {
    /// A bundle to upload, a folder or an archive; each gets its own team
    #[arg(long = "bundle", required = true, value_name = "BUNDLE")]
    bundles: Vec<PathBuf>,
    /// Episodes per task
    #[arg(long, default_value_t = 50, value_parser = clap::value_parser!(u32).range(1..=i64::from(MAX_EPISODES_PER_TASK)))]
    episodes: u32,
    /// Address of the server; port 0 chooses a free port
    #[arg(long, default_value = "127.0.0.1:8080")]
    listen: SocketAddr,
    /// Folder for the demo's database and artifacts; the folder of an earlier demo is replaced
    #[arg(long, default_value = "demo-data")]
    data_dir: PathBuf,
    /// Stop after the board instead of serving it until Ctrl-C
    #[arg(long)]
    no_serve: bool,
    /// Print the board and the download as JSON, and progress to standard error
    #[arg(long)]
    json: bool,
}

/// Output of `--json`.
#[derive(Debug, Serialize)]
struct DemoView<'a> {
    /// URL of the server, whose start page is the board. With `--no-serve` the server has ended.
    server: &'a str,
    data_dir: &'a Path,
    board: &'a BoardView,
    dataset: &'a DownloadedFile,
}

/// Prints the steps of the demo.
#[derive(Debug, Clone, Copy)]
struct Progress {
    to_stderr: bool,
}

impl Progress {
    fn step(self, line: fmt::Arguments<'_>) {
        if self.to_stderr {
            eprintln!("{line}");
        } else {
            println!("{line}");
        }
    }
}

impl DemoCommand {
    /// Runs the demo.
    ///
    /// # Errors
    /// If a step fails.
    pub fn run(self) -> anyhow::Result<()> {
        super::block_on_all_cpus(self.run_day())
    }

    async fn run_day(self) -> anyhow::Result<()> {
        // Checked before anything is removed. If another server had this port, the demo would send its requests to that server.
        TcpListener::bind(self.listen).with_context(|| {
            format!(
                "{} is in use; choose another with --listen 127.0.0.1:PORT (with make demo: LISTEN=127.0.0.1:PORT)",
                self.listen
            )
        })?;
        open_folder(&self.data_dir)?;
        let progress = Progress {
            to_stderr: self.json,
        };

        progress.step(format_args!(
            "1. starting the server on {}",
            self.data_dir.display()
        ));
        let log = self.data_dir.join("server.log");
        let mut server = Server::start(self.listen, &self.data_dir, self.episodes, &log)?;
        let organiser = server.wait_until_ready().await.with_context(|| {
            format!(
                "the server did not start; the end of {}:\n{}\n",
                log.display(),
                tail(&log)
            )
        })?;

        progress.step(format_args!(
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
            let verdict = wait_for_validation(client, submission).await?;
            progress.step(format_args!("   {name}: {verdict}"));
        }

        progress.step(format_args!(
            "3. evaluating: hit, defend, prepare × {} episodes",
            self.episodes
        ));
        let day = organiser.start_day(None).await?;
        ensure!(
            day.evaluations.len() == teams.len(),
            "expected an evaluation per team, got {} for {} teams",
            day.evaluations.len(),
            teams.len()
        );
        let evaluations = wait_for_evaluations(&organiser, &day.evaluations).await?;

        progress.step(format_args!("4. the board\n"));
        let board = organiser.board(None, &BoardQuery::default()).await?;
        ensure!(
            board.rows.len() == evaluations.len(),
            "expected {} rows on the board, got {}",
            evaluations.len(),
            board.rows.len()
        );
        progress.step(format_args!("{}", table::board_table(&board)));

        let (name, client, _) = &teams[0];
        let first_evaluation = evaluations
            .iter()
            .find(|evaluation| evaluation.team_name.as_str() == name)
            .context("the first team has no evaluation")?;
        let dataset = self.data_dir.join(format!("{name}-dataset.zip"));
        let hidden_bar = ProgressBar::hidden();
        let downloaded = client
            .download_dataset(first_evaluation.id, &dataset, None, &hidden_bar)
            .await?;
        let bytes = downloaded.bytes;
        ensure!(bytes > 0, "the dataset of {name} is empty");
        progress.step(format_args!(
            "5. dataset of {name}: {} ({:.1} MB)",
            dataset.display(),
            bytes as f64 / 1e6
        ));

        let verification = tokio::task::spawn_blocking(move || verify::verified_line(&dataset));
        let verified = verification.await.context("verifying the dataset")?;
        progress.step(format_args!(
            "   {}",
            verified.context("verifying the dataset")?
        ));

        if self.json {
            let view = DemoView {
                server: &server.url,
                data_dir: &self.data_dir,
                board: &board,
                dataset: &downloaded,
            };
            print_json(&view)?;
        }
        if self.no_serve {
            return server.stop().await;
        }
        progress.step(format_args!(
            "\nThe same board: {}/   (Ctrl-C stops the server)",
            server.url
        ));
        tokio::select! {
            stopped = tokio::signal::ctrl_c() => stopped.context("waiting for Ctrl-C")?,
            ended = server.child.wait() => bail!(
                "the server ended unexpectedly ({}); its log is {}",
                ended.context("waiting for the server")?,
                log.display()
            ),
        }
        server.stop().await
    }
}

/// The last lines of a log.
fn tail(log: &Path) -> String {
    const LINES: usize = 12;
    let text = std::fs::read_to_string(log).unwrap_or_default();
    let lines: Vec<&str> = text.lines().collect();
    lines[lines.len().saturating_sub(LINES)..].join("\n")
}

/// Creates the folder, or empties that of an earlier demo; refuses a folder with other content.
fn open_folder(folder: &Path) -> anyhow::Result<()> {
    /// Marks a folder that a demo may replace.
    const MARKER: &str = ".faceoff-demo";
    if folder.exists() {
        let empty = folder
            .read_dir()
            .with_context(|| format!("reading {}", folder.display()))?
            .next()
            .is_none();
        ensure!(
            empty || folder.join(MARKER).exists(),
            "{} exists and was not made by a demo; choose another folder with --data-dir",
            folder.display()
        );
        std::fs::remove_dir_all(folder)
            .with_context(|| format!("removing {}", folder.display()))?;
    }
    std::fs::create_dir_all(folder).with_context(|| format!("creating {}", folder.display()))?;
    std::fs::write(folder.join(MARKER), "")
        .with_context(|| format!("writing to {}", folder.display()))
}

/// The bundle's folder or file name without its extension.
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
    /// Empty until [`wait_until_ready`](Self::wait_until_ready) returns.
    url: String,
    data_dir: PathBuf,
}

impl Server {
    /// Starts the server with a configuration that only sets the number of episodes.
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
            std::fs::File::create(log).with_context(|| format!("creating {}", log.display()))?;
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
            // A failed demo leaves no server behind.
            .kill_on_drop(true);
        let child = command.spawn().context("starting the server")?;
        Ok(Self {
            child,
            url: String::new(),
            data_dir: data_dir.to_owned(),
        })
    }

    /// Waits until the server prints its address; returns the organiser's client.
    async fn wait_until_ready(&mut self) -> anyhow::Result<Client> {
        let stdout = self
            .child
            .stdout
            .take()
            .context("the server's output is not piped")?;
        let mut output = BufReader::new(stdout).lines();
        let url = tokio::time::timeout(START_TIMEOUT, output.next_line())
            .await
            .with_context(|| format!("the server did not start within {START_TIMEOUT:?}"))?
            .context("reading the server's address")?;
        let Some(url) = url else {
            bail!(
                "the server ended with {}",
                self.child
                    .wait()
                    .await
                    .context("waiting for the server to end")?
            )
        };
        self.url = url;
        let visitor = Client::new(&self.url, None, None)?;
        visitor.health().await?;
        let token = std::fs::read_to_string(self.data_dir.join("admin-token"))
            .context("reading the operator's token")?;
        Ok(visitor.with_token(token.trim()))
    }

    /// Terminates the server and waits for its end.
    async fn stop(mut self) -> anyhow::Result<()> {
        if let Some(id) = self.child.id().and_then(|id| i32::try_from(id).ok())
            && let Some(id) = rustix::process::Pid::from_raw(id)
        {
            // If the process has already ended, it is still reaped below.
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

/// Waits for the validation of a submission and returns its verdict.
///
/// # Errors
/// If the agent is not valid.
async fn wait_for_validation(
    client: &Client,
    submission: &SubmissionView,
) -> anyhow::Result<String> {
    loop {
        let current = client.submission(submission.id).await?;
        match current.status {
            SubmissionStatus::Validating => tokio::time::sleep(POLL_INTERVAL).await,
            SubmissionStatus::Valid { .. } => {
                let agent = current.agent_name.unwrap_or_default();
                return Ok(format!(
                    "agent “{agent}” starts, responds and meets the time limits"
                ));
            }
            SubmissionStatus::Invalid { reason, log } => {
                let log = log.unwrap_or_default();
                bail!("{} is not valid: {reason}\n{log}", submission.file_name)
            }
            SubmissionStatus::PlatformFailed { reason } => {
                bail!("{} could not be validated: {reason}", submission.file_name)
            }
        }
    }
}

/// Shows progress until all evaluations have ended.
///
/// # Errors
/// If an evaluation fails.
async fn wait_for_evaluations(
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
        tokio::time::sleep(POLL_INTERVAL).await;
    }
    // A day is released with its last evaluation.
    ensure!(
        ended
            .iter()
            .any(|evaluation| evaluation.released_at.is_some()),
        "every evaluation has ended, but the day is not released"
    );
    Ok(ended)
}
