//! Checks of values that are invalid on any server or on this host.

use super::Config;
use crate::competition::{competition, simulator};
use anyhow::{Context as _, anyhow, bail, ensure};
use faceoff_sandbox::affinity;
use faceoff_types::{IMAGE_RUNTIME, Seed, url_without_password};
use reqwest::header::HeaderName;
use std::{collections::HashSet, str::FromStr as _};

/// With more slots per CPU than this, evaluations would hardly progress.
const MAX_SLOTS_PER_CPU: usize = 4;

impl Config {
    /// Refuses settings that are impossible on this host.
    pub(super) fn check_this_host(&self) -> anyhow::Result<()> {
        let cpus = affinity::allowed_cpus().context("reading the CPU affinity of this process")?;
        self.check_host(&cpus)
    }

    /// Refuses settings that are impossible on a host with these CPUs.
    pub(super) fn check_host(&self, cpus: &[usize]) -> anyhow::Result<()> {
        let max_slots = MAX_SLOTS_PER_CPU * cpus.len();
        ensure!(
            self.slots() <= max_slots,
            "workers.slots: expected at most {max_slots} on a host with {} CPUs, got {}; the default is {}",
            cpus.len(),
            self.slots(),
            Self::slots_on(cpus.len())
        );
        if let Some(cpu) = self
            .workers
            .agent_cpus
            .iter()
            .find(|cpu| !cpus.contains(cpu))
        {
            bail!("workers.agent_cpus: expected CPUs of {cpus:?}, got {cpu}");
        }
        Ok(())
    }

    /// Checks the folders of all runtimes.
    ///
    /// # Errors
    /// The first folder without a runtime, and how to create it.
    pub fn check_runtimes(&self) -> anyhow::Result<()> {
        let mut names = self.runtimes.keys();
        names.try_for_each(|name| self.check_runtime(name))
    }

    /// Checks the folder of one runtime.
    ///
    /// # Errors
    /// If the folder has no runtime.
    pub fn check_runtime(&self, name: &str) -> anyhow::Result<()> {
        match self.runtimes.get(name) {
            Some(runtime) => runtime
                .check()
                .with_context(|| format!("the configuration: runtimes.{name}")),
            None => Ok(()),
        }
    }

    /// Refuses magnitudes of perturbations with which the robot of a season with this mismatch seed cannot be simulated.
    pub fn check_season_magnitudes(&self, mismatch_seed: Seed) -> anyhow::Result<()> {
        let magnitudes = self.rules().variation.perturbations;
        simulator()
            .check_season_magnitudes(&magnitudes, mismatch_seed)
            .map_err(|problem| anyhow!("evaluation.perturbations.{problem}"))
    }

    /// Checks the conditions that the types do not express.
    pub(super) fn check(&self) -> anyhow::Result<()> {
        self.nats.check()?;
        self.check_public_url()?;
        self.check_source_url()?;
        let header = &self.connections.forwarded_header;
        ensure!(
            HeaderName::from_str(header).is_ok(),
            "connections.forwarded_header: expected the name of a header, such as x-forwarded-for, forwarded or x-real-ip, got {header:?}"
        );
        ensure!(
            !self.runtimes.contains_key(IMAGE_RUNTIME),
            "runtimes.{IMAGE_RUNTIME}: this name is reserved for container images; choose another name"
        );
        self.check_evaluation()?;
        self.check_workers()?;
        self.check_season_name()?;
        self.check_minimums()?;
        self.check_durations()?;
        ensure!(
            (0.01..=1024.0).contains(&self.limits.cpus),
            "limits.cpus: expected 0.01 to 1024, got {}",
            self.limits.cpus
        );
        Ok(())
    }

    fn check_public_url(&self) -> anyhow::Result<()> {
        let Some(url) = &self.server.public_url else {
            return Ok(());
        };
        let rest = url
            .strip_prefix("https://")
            .or_else(|| url.strip_prefix("http://"));
        let is_address = rest.is_some_and(|rest| {
            // Pages and API are at the root: they have no place below a path. Everybody sees the address, and so a password in it.
            !rest.is_empty()
                && !rest.contains(|char: char| char.is_whitespace() || "/?#@".contains(char))
        });
        ensure!(
            is_address,
            "server.public_url: expected an address like https://faceoff.example.org, without a path, a trailing slash \
            and a password, got {:?}",
            url_without_password(url)
        );
        Ok(())
    }

    fn check_source_url(&self) -> anyhow::Result<()> {
        let Some(url) = &self.server.source_url else {
            return Ok(());
        };
        let parsed = reqwest::Url::parse(url);
        ensure!(
            parsed.is_ok_and(|url| matches!(url.scheme(), "http" | "https")),
            "server.source_url: expected an address like https://git.example.org/faceoff, got {url:?}"
        );
        Ok(())
    }

    fn check_evaluation(&self) -> anyhow::Result<()> {
        let evaluation = &self.evaluation;
        if evaluation.at.is_some() && evaluation.cron.is_some() {
            bail!("evaluation.cron: evaluation.at is also set; remove one of them");
        }
        let settings = self.settings().context("evaluation.cron")?;
        ensure!(
            !evaluation.tasks.is_empty(),
            "evaluation.tasks: expected at least one task"
        );
        let mut rules = self.rules();
        let mut seen = HashSet::new();
        if let Some(duplicate) = evaluation.tasks.iter().find(|task| !seen.insert(**task)) {
            bail!("evaluation.tasks: {duplicate} is listed twice");
        }
        let checked = competition().check_and_normalise_rules(&mut rules);
        let checked = checked.and_then(|()| settings.check());
        checked.map_err(|error| anyhow!("evaluation.{error}"))
    }

    fn check_workers(&self) -> anyhow::Result<()> {
        ensure!(
            self.workers.slots != Some(0),
            "workers.slots: expected at least 1, got 0"
        );
        ensure!(
            (5..=3600).contains(&self.workers.lease_s),
            "workers.lease_s: expected 5 to 3600 seconds, got {}",
            self.workers.lease_s
        );
        Ok(())
    }

    fn check_season_name(&self) -> anyhow::Result<()> {
        if let Some(name) = &self.season.name {
            let chars = name.chars().count();
            ensure!(
                (1..=80).contains(&chars),
                "season.name: expected 1 to 80 characters, got {chars}"
            );
        }
        Ok(())
    }

    fn check_minimums(&self) -> anyhow::Result<()> {
        for (name, least, value) in [
            ("uploads.at_once", 1, self.uploads.at_once as u64),
            (
                "uploads.least_bytes_per_s",
                1,
                self.uploads.least_bytes_per_s,
            ),
            ("connections.most", 1, self.connections.most as u64),
            (
                "connections.per_address",
                1,
                self.connections.per_address as u64,
            ),
            (
                "connections.least_bytes_per_s",
                1,
                self.connections.least_bytes_per_s,
            ),
            ("bundle.unpack_s", 1, self.bundle.unpack_s.into()),
            ("bundle.files", 1, self.bundle.files),
            ("uploads.day_bytes", 1, self.uploads.day_bytes),
            ("uploads.stored_bytes", 1, self.uploads.stored_bytes),
            // With smaller values, no agent starts or no bundle fits.
            ("limits.memory_bytes", 16 << 20, self.limits.memory_bytes),
            ("limits.pids", 2, self.limits.pids.into()),
            ("limits.open_files", 16, self.limits.open_files.into()),
            ("limits.file_size_bytes", 4096, self.limits.file_size_bytes),
            ("bundle.packed_bytes", 1024, self.bundle.packed_bytes),
            ("bundle.unpacked_bytes", 1024, self.bundle.unpacked_bytes),
        ] {
            ensure!(
                value >= least,
                "{name}: expected at least {least}, got {value}"
            );
        }
        Ok(())
    }

    fn check_durations(&self) -> anyhow::Result<()> {
        for (name, seconds) in [
            ("uploads.grace_s", self.uploads.grace_s),
            ("connections.head_s", self.connections.head_s),
            ("connections.grace_s", self.connections.grace_s),
            ("time.startup_s", self.time.startup_s),
            ("time.reset_s", self.time.reset_s),
            ("time.step_s", self.time.step_s),
            ("time.bye_s", self.time.bye_s),
            ("time.mean_s", self.time.mean_s),
            (
                "time.episode_control_times",
                self.time.episode_control_time_factor,
            ),
            ("time.episode_extra_s", self.time.episode_extra_s),
            ("time.reset_mean_s", self.time.reset_mean_s),
            ("time.resets_extra_s", self.time.resets_extra_s),
        ] {
            ensure!(
                seconds.is_finite() && seconds > 0.0 && seconds <= 3600.0,
                "{name}: expected more than 0 and at most 3600, got {seconds}"
            );
        }
        Ok(())
    }
}
