//! The configuration: defaults, errors, and agreement with the documentation.

use super::*;
use faceoff_types::Magnitude;
use std::{num::NonZeroU32, time::Duration};

/// The error of an invalid configuration.
fn error(text: &str) -> String {
    format!("{:#}", Config::parse(text).unwrap_err())
}

#[test]
fn empty_file_gives_the_defaults() {
    let default = Config::default();
    assert_eq!(Config::parse("").unwrap(), default);
    let written = toml::to_string(&default).unwrap();
    assert_eq!(Config::parse(&written).unwrap(), default);
}

#[test]
fn all_sections_are_read() {
    let config = Config::parse(
        r#"
        [server]
        listen = "0.0.0.0:80"
        data_dir = "/srv/faceoff"
        [season]
        name = "Practice"
        [evaluation]
        profile = "ideal"
        tasks = ["hit"]
        episodes_per_task = 7
        at = "00:30"
        ablation_episodes = 50
        weights = { hit = 1, defend = 0, prepare = 0 }
        tier_bounds = { deployable = 0.25, improvable = 2 }
        perturbations = { tracking_loss = { probability = 0.05 } }
        publishes = "never"
        standings = { mean_of_last = 5 }
        [workers]
        slots = 3
        agent_cpus = [1]
        [limits]
        pids = 9
        [time]
        step_s = 0.5
        [bundle]
        files = 10
        [uploads]
        day_bytes = 7
        [connections]
        exempt = ["10.0.0.1", "fd00::/8"]
        forwarded_header = "Forwarded"
        head_s = 5
        [rates]
        token_per_s = 0
        [webhooks]
        allow_private = ["10.1.0.0/16"]
        [sandbox]
        given_up = ["cgroup-memory"]
        [runtimes.julia]
        read_only_paths = ["/opt/julia"]
        path = "/opt/julia/bin"
        "#,
    )
    .unwrap();
    assert_eq!(config.server.listen.port(), 80);
    let private_address = "10.1.2.3".parse().unwrap();
    assert!(config.webhooks.check_address(private_address).is_ok());
    assert_eq!(config.webhooks.ports, [443, 8443]);
    assert_eq!(config.rates.limits().token, None);
    assert_eq!(
        config
            .rates
            .limits()
            .team_changes_per_day
            .map(NonZeroU32::get),
        Some(2000)
    );
    assert_eq!(config.season.name.as_deref(), Some("Practice"));
    assert_eq!(config.rules().episodes_per_task, 7);
    assert_eq!(config.evaluation.at, Some(jiff::civil::time(0, 30, 0, 0)));
    assert_eq!(config.evaluation.ablation_episodes, 50);
    let variation = config.rules().variation;
    assert_eq!(variation.weights.unwrap().to_string(), "1,0,0");
    assert_eq!(variation.tier_bounds.unwrap().to_string(), "0.25,2");
    let loss = |name| variation.perturbations.get("tracking_loss", name);
    assert_eq!(loss("probability"), Some(Magnitude::Number(0.05)));
    assert_eq!(loss("steps"), Some(Magnitude::Counts([5, 20])));
    let settings = config.settings().unwrap();
    assert_eq!(settings.publishes, Publication::Never);
    assert_eq!(settings.counting_result, CountingResult::MeanOfLast(5));
    assert_eq!(config.slots(), 3);
    assert_eq!(config.limits.pids, 9);
    assert_eq!(config.limits.open_files, Limits::default().open_files);
    assert_eq!(config.bundle.files, 10);
    assert_eq!(config.uploads.limits().upload_quota.day_bytes, 7);
    let connections = config.connections.limits();
    assert_eq!(connections.head_timeout, Duration::from_secs(5));
    let networks = ["10.0.0.1", "fd00::/8"].map(|text| text.parse().unwrap());
    assert_eq!(connections.exempt, networks);
    assert_eq!(connections.forwarded_header, "forwarded");
    let refused = error("[connections]\nforwarded_header = \"X Real IP\"");
    assert!(
        refused.contains("connections.forwarded_header"),
        "{refused}"
    );
    let refused = error("[connections]\nexempt = [\"10.0.0.0/40\"]");
    assert!(refused.contains("a network like 10.0.0.0/8"), "{refused}");
    let environment = config.agent_environment();
    assert_eq!(
        environment.isolation,
        Isolation::Sandboxed {
            disabled_layers: vec![Layer::CgroupMemory]
        }
    );
    assert!(environment.runtimes.contains_key("julia"));
    assert!(environment.runtimes.contains_key("native"));
}

#[test]
fn error_names_the_field() {
    assert!(error("[server]\nlisten_on = 1").contains("listen_on"));
    assert!(error("[serve]").contains("serve"));
    assert!(error("[evaluation]\nepisodes_per_task = 0").contains("evaluation.episodes_per_task"));
    assert!(error("[evaluation]\ntasks = []").contains("evaluation.tasks"));
    assert!(error("[evaluation]\ntasks = [\"hit\", \"hit\"]").contains("evaluation.tasks"));
    assert!(error("[evaluation]\nprofile = \"easy\"").contains("easy"));
    assert!(
        error("[evaluation]\nablation_episodes = 1000000").contains("evaluation.ablation_episodes")
    );
    let wrong = error("[evaluation]\nweights = { hit = 0.5, defend = 0.5, prepare = 0.5 }");
    assert!(wrong.contains("sum to 1"), "{wrong}");
    let wrong = error("[evaluation]\ntier_bounds = { deployable = 2, improvable = 1 }");
    assert!(wrong.contains("0 < deployable < improvable"), "{wrong}");
    let wrong = error("[evaluation]\nperturbations = { delay = { tilt_m_s2 = -1 } }");
    assert!(
        wrong.contains("evaluation.perturbations.delay.tilt_m_s2"),
        "{wrong}"
    );
    assert!(error("[evaluation]\nperturbations = { noise = {} }").contains("noise"));
    assert!(
        error("[evaluation]\nstandings = { mean_of_last = 0 }")
            .contains("standings: a mean is of 1")
    );
    assert!(error("[evaluation]\npublishes = \"soon\"").contains("soon"));
    assert!(error("[workers]\nslots = 0").contains("workers.slots"));
    assert!(error("[workers]\nlease_s = 1").contains("workers.lease_s"));
    assert!(error("[time]\nstep_s = -1.0").contains("time.step_s"));
    assert!(error("[limits]\npid = 1").contains("pid"));
    assert!(error("[uploads]\nat_once = 0").contains("uploads.at_once"));
    assert!(error("[connections]\nhead_s = 0.0").contains("connections.head_s"));
    assert!(error("[sandbox]\ngiven_up = [\"everything\"]").contains("everything"));
}

#[test]
fn commented_file_has_the_defaults_and_is_documented() {
    // Values without a fixed default are comments in the file.
    assert_eq!(
        Config::parse(COMMENTED_DEFAULTS).unwrap(),
        Config::default()
    );
    let documentation = include_str!("../../../../docs/configuration.md");
    let block = documentation
        .split("```toml\n")
        .nth(1)
        .and_then(|rest| rest.split("```").next());
    assert_eq!(block, Some(COMMENTED_DEFAULTS));
}

#[test]
fn commented_file_explains_all_values() {
    let mut written = toml::Table::try_from(Config::default()).unwrap();
    // Organisers choose the names of runtimes.
    written.remove("runtimes");
    // These have no default in the file.
    for (section, name) in [
        ("season", "name"),
        ("evaluation", "at"),
        ("evaluation", "cron"),
        ("evaluation", "perturbations"),
        ("workers", "slots"),
        ("workers", "scratch_dir"),
    ] {
        let section = written[section].as_table_mut().unwrap();
        let old_value = section.insert(name.to_owned(), toml::Value::Boolean(true));
        assert_eq!(old_value, None, "{name}");
    }
    for (section, values) in &written {
        let (_, rest) = COMMENTED_DEFAULTS
            .split_once(&format!("\n[{section}"))
            .expect(section);
        let lines: Vec<&str> = rest
            .lines()
            .take_while(|line| !line.starts_with('['))
            .collect();
        for name in values.as_table().unwrap().keys() {
            let has_name = |line: &&&str| {
                let line = line.trim_start_matches("# ");
                line.strip_prefix(name.as_str())
                    .is_some_and(|rest| rest.starts_with(" = "))
            };
            let line = lines.iter().find(has_name);
            let line = line.unwrap_or_else(|| panic!("{section}.{name} is missing"));
            let (_, meaning) = line.rsplit_once("  # ").unwrap_or_else(|| panic!("{line}"));
            assert!(meaning.len() > 10, "{line}");
        }
    }
}

#[test]
fn unknown_name_gets_a_suggestion() {
    for (text, suggestion) in [
        ("[server]\nlisten_on = 1", "listen"),
        ("[serve]", "server"),
        ("[evaluation]\nepisodes_pre_task = 1", "episodes_per_task"),
        ("[limits]\npid = 1", "pids"),
        ("[time]\nstep = 1", "step_s"),
    ] {
        let error = error(text);
        assert!(
            error.contains(&format!("did you mean `{suggestion}`?")),
            "{error}"
        );
    }
    let error = error("[server]\nxyzzy = 1");
    assert!(
        error.contains("xyzzy") && !error.contains("did you mean"),
        "{error}"
    );
}

#[test]
fn impossible_value_is_refused() {
    for (section, name, value) in [
        ("limits", "memory_bytes", "10"),
        ("limits", "pids", "0"),
        ("limits", "open_files", "3"),
        ("limits", "file_size_bytes", "1"),
        ("limits", "cpus", "0.0"),
        ("limits", "cpus", "nan"),
        ("bundle", "packed_bytes", "10"),
        ("bundle", "unpacked_bytes", "10"),
        ("bundle", "files", "0"),
        ("uploads", "day_bytes", "0"),
        ("uploads", "stored_bytes", "0"),
        ("time", "mean_s", "1e9"),
    ] {
        let error = error(&format!("[{section}]\n{name} = {value}"));
        assert!(
            error.contains(&format!("{section}.{name}: expected")),
            "{error}"
        );
    }
    // The outcome on a host with the CPUs 0 and 1.
    let on_two_cpus = |text: &str| {
        let config = Config::parse(text).unwrap();
        config
            .check_host(&[0, 1])
            .map_err(|error| error.to_string())
    };
    assert_eq!(on_two_cpus("[workers]\nslots = 2"), Ok(()));
    let error = on_two_cpus("[workers]\nslots = 500").unwrap_err();
    assert!(
        error.contains("workers.slots: expected at most 8"),
        "{error}"
    );
    let error = on_two_cpus("[workers]\nagent_cpus = [7]").unwrap_err();
    assert!(
        error.contains("workers.agent_cpus: expected CPUs of [0, 1], got 7"),
        "{error}"
    );
}

#[test]
fn schedule_is_a_time_or_an_expression_in_a_zone() {
    let settings = |text: &str| {
        let config = Config::parse(&format!("[evaluation]\n{text}")).unwrap();
        let settings = serde_json::to_value(config.settings().unwrap()).unwrap();
        (
            settings["schedule"].to_string(),
            config.evaluation.zone.to_string(),
        )
    };
    let utc = "UTC".to_owned();
    assert_eq!(settings(""), ("null".into(), utc.clone()));
    let daily = settings("at = \"06:30\"\ndays_off = [\"2026-12-24\"]\nzone = \"Europe/Berlin\"");
    assert_eq!(
        daily,
        (
            r#"{"daily":"06:30:00","days_off":["2026-12-24"]}"#.into(),
            "Europe/Berlin".into()
        )
    );
    let cron = settings("cron = \"0 6 * * 1-5\"");
    assert_eq!(cron, (r#"{"cron":"0 6 * * 1-5"}"#.into(), utc));
    for (text, expected) in [
        (
            "at = \"06:00\"\ncron = \"0 6 * * *\"",
            "evaluation.cron: evaluation.at is also set",
        ),
        (
            "cron = \"6\"",
            "evaluation.cron: \"6\" is no schedule of five fields",
        ),
        ("zone = \"Berlin\"", "Europe/Berlin"),
        ("at = \"25:00\"", "hour"),
        ("days_off = [\"Christmas\"]", "Christmas"),
    ] {
        let error = error(&format!("[evaluation]\n{text}"));
        assert!(error.contains(expected), "{expected:?} is not in {error}");
    }
}

#[test]
fn named_file_must_exist() {
    let missing = Path::new("/nonexistent/faceoff.toml");
    let error = Config::load(Some(missing)).unwrap_err();
    assert!(format!("{error:#}").contains("/nonexistent/faceoff.toml"));
}

#[test]
fn sandbox_page_has_the_default_limits() {
    let page = include_str!("../../../../docs/sandbox.md");
    let Config {
        limits,
        time,
        bundle,
        ..
    } = Config::default();
    let mebibytes = |bytes: u64| format!("{} MiB", bytes >> 20);
    let files = format!("{},{:03}", bundle.files / 1000, bundle.files % 1000);
    for line in [
        format!(
            "| memory, with page cache, `/tmp` and `/dev/shm` | {} |",
            mebibytes(limits.memory_bytes)
        ),
        format!("| CPU time | {} CPU, enforced every 10 ms |", limits.cpus),
        format!("| processes and threads | {} |", limits.pids),
        format!("| open files of a process | {} |", limits.open_files),
        format!("| bundle, packed | {} |", mebibytes(bundle.packed_bytes)),
        format!(
            "| bundle, unpacked | {}, {files} files |",
            mebibytes(bundle.unpacked_bytes)
        ),
        format!(
            "| log that is kept (standard error) | its beginning and its end, {} KiB together |",
            limits.stderr_kept_bytes >> 10
        ),
        format!("| start, until `ready` | {} s |", time.startup_s),
        format!("| answer to `reset` | {} s |", time.reset_s),
        format!("| answer to `step` | {} s |", time.step_s),
        format!(
            "| answer to `step`, mean of the validation run | {} s |",
            time.mean_s
        ),
        format!(
            "`$HOME` and `$TMPDIR` | {} |",
            mebibytes(limits.scratch_bytes)
        ),
        format!("| shared memory | {} |", mebibytes(limits.scratch_bytes)),
        format!(
            "A file may have at most {}",
            mebibytes(limits.file_size_bytes)
        ),
    ] {
        assert!(page.contains(&line), "docs/sandbox.md lacks {line:?}");
    }
}

#[test]
fn runtime_is_a_folder_with_python_or_paths() {
    let config = Config::parse("[runtimes.python3-ml]\nfolder = \"/nowhere\"").unwrap();
    let refused = format!("{:#}", config.check_runtimes().unwrap_err());
    for words in [
        "runtimes.python3-ml",
        "virtual environment in /nowhere",
        "docker/runtime.sh /nowhere",
    ] {
        assert!(refused.contains(words), "{refused}");
    }
    let covered = Config::parse("[runtimes.python3-ml]\nfolder = \"/tmp/ml\"").unwrap();
    let refused = format!("{:#}", covered.check_runtimes().unwrap_err());
    assert!(refused.contains("outside of /tmp"), "{refused}");
    // A missing runtime is not replaced by an existing one.
    let runtime = &config.agent_environment().runtimes["python3-ml"];
    assert_eq!(
        runtime.read_only_paths,
        [std::path::PathBuf::from("/nowhere/bin/python3")]
    );
    let written = toml::to_string(&config).unwrap();
    assert_eq!(Config::parse(&written).unwrap(), config);
    let reserved = error("[runtimes.image]\nfolder = \"/a\"");
    assert!(reserved.contains("choose another name"), "{reserved}");
    for (text, expected) in [
        ("folder = \"here\"", "absolute path"),
        ("folder = \"/a\"\npath = \"/b\"", "either `folder`"),
        ("path = \"/b\"", "either `folder`"),
        ("folders = \"/a\"", "did you mean `folder`?"),
    ] {
        let refused = error(&format!("[runtimes.x]\n{text}"));
        assert!(refused.contains(expected), "{refused}");
    }
}

#[test]
fn public_address_has_no_path() {
    for url in ["https://faceoff.example.org", "http://192.0.2.7:8080"] {
        Config::parse(&format!("[server]\npublic_url = {url:?}")).unwrap();
    }
    for url in [
        "https://example.org/faceoff",
        "https://example.org/",
        "https://example.org?a",
        "https://ann:secret@example.org",
        "example.org",
        "https://",
    ] {
        let refused = error(&format!("[server]\npublic_url = {url:?}"));
        assert!(refused.contains("without a path"), "{refused}");
        assert!(!refused.contains("secret"), "{refused}");
    }
}
