//! `faceoff replay`: the page and the picture of an episode.

use crate::program::{LONG_TIME_LIMITS, SEED, agent, faceoff, text};
use std::{
    fs,
    path::{Path, PathBuf},
    process::Command,
    sync::OnceLock,
};
use tempfile::TempDir;

/// A scratch folder with an evaluation in its subfolder `out`: two episodes per task. The agent violates limits, and its name must
/// be escaped in HTML.
pub fn scratch_with_evaluation() -> &'static Path {
    static DIR: OnceLock<TempDir> = OnceLock::new();
    let dir = DIR.get_or_init(|| {
        let dir = tempfile::tempdir().unwrap();
        let agents = agent("reckless");
        let bundle = dir.path().join("bundle");
        fs::create_dir(&bundle).unwrap();
        for name in ["agent.py", "protocol.py"] {
            fs::copy(agents.join(name), bundle.join(name)).unwrap();
        }
        let manifest = fs::read_to_string(agents.join("agent.toml")).unwrap();
        let renamed = manifest.replace("\"reckless\"", "\"<b>&reckless\"");
        fs::write(bundle.join("agent.toml"), renamed).unwrap();
        let out = dir.path().join("out");
        let (bundle, out) = (bundle.to_str().unwrap(), out.to_str().unwrap());
        let output = faceoff(&[
            "eval",
            bundle,
            "--out",
            out,
            "--config",
            LONG_TIME_LIMITS,
            "--episodes",
            "2",
            "--seed",
            SEED,
            "--workers",
            "2",
        ]);
        assert!(output.status.success(), "{}", text(&output.stderr));
        dir
    });
    dir.path()
}

/// Draws an episode; returns the output and the file.
fn replay(task: &str, episode: &str, file: &str) -> (String, PathBuf) {
    let dir = scratch_with_evaluation();
    let out = dir.join(file);
    let output = faceoff(&[
        "replay",
        dir.join("out").to_str().unwrap(),
        "--task",
        task,
        "--episode",
        episode,
        "--out",
        out.to_str().unwrap(),
    ]);
    assert!(output.status.success(), "{}", text(&output.stderr));
    (text(&output.stdout), out)
}

#[test]
fn page_is_self_contained_and_explains_the_end() {
    for task in ["hit", "defend", "prepare"] {
        let (stdout, file) = replay(task, "1", &format!("{task}.html"));
        let lines: Vec<&str> = stdout.lines().collect();
        assert_eq!(
            lines[0],
            format!("{task}, episode 1 of <b>&reckless: no success")
        );
        let page = fs::read_to_string(file).unwrap();
        let reason = lines[1].replace('<', "&#60;").replace('\'', "&#39;");
        assert!(page.contains(&reason), "{reason}\n{page:.2000}");
        assert!(
            stdout.contains("3 points: end effector limit violated from step "),
            "{stdout}"
        );
        assert!(!page.contains("<b>"), "the agent's name is escaped");
        // The SVG namespace is the only address; nothing is fetched.
        let rest = page.replace("http://www.w3.org/2000/svg", "");
        for reference in ["http:", "https:", "src=", "@import", "url("] {
            assert!(!rest.contains(reference), "{reference}");
        }
        assert_eq!(page.contains("opponent</span>"), task == "hit");
    }
}

/// An agent that fails at its first step has an episode with a single state.
#[test]
fn fault_is_shown_with_the_agents_error() {
    let dir = tempfile::tempdir().unwrap();
    let bundle = dir.path().join("bundle");
    let created = faceoff(&["new", bundle.to_str().unwrap()]);
    assert!(created.status.success(), "{}", text(&created.stderr));
    let source = fs::read_to_string(bundle.join("agent.py")).unwrap();
    let broken = source.replace(
        "        mallet, puck =",
        "        raise ValueError(7)\n        mallet, puck =",
    );
    fs::write(bundle.join("agent.py"), broken).unwrap();
    let out = dir.path().join("out");
    let page = dir.path().join("look.html");
    let (bundle, out) = (bundle.to_str().unwrap(), out.to_str().unwrap());
    faceoff(&[
        "eval",
        bundle,
        "--out",
        out,
        "--config",
        LONG_TIME_LIMITS,
        "--task",
        "defend",
        "--episodes",
        "1",
    ]);
    let drawn = faceoff(&[
        "replay",
        out,
        "--task",
        "defend",
        "--episode",
        "0",
        "--out",
        page.to_str().unwrap(),
    ]);
    assert!(drawn.status.success(), "{}", text(&drawn.stderr));
    let stdout = text(&drawn.stdout);
    assert!(
        stdout.contains("the agent's fault ended the episode"),
        "{stdout}"
    );
    assert!(
        stdout.contains("ValueError: 7 (agent.py, line "),
        "{stdout}"
    );
    assert!(fs::read_to_string(page).unwrap().contains("ValueError: 7"));
}

#[test]
fn picture_is_well_formed() {
    let (_, file) = replay("hit", "0", "hit.svg");
    let program = "import sys, xml.dom.minidom as x; d = x.parse(sys.argv[1]); \
                   print(len(d.getElementsByTagName('svg')), len(d.getElementsByTagName('polyline')) > 9)";
    let output = Command::new("python3")
        .args(["-c", program])
        .arg(file)
        .output()
        .unwrap();
    assert_eq!(text(&output.stdout), "3 True\n", "{}", text(&output.stderr));
}

#[test]
fn invalid_replay_is_refused_with_a_reason() {
    let dir = scratch_with_evaluation();
    let out = dir.join("out");
    let refused = |dataset: &Path, episode: &str, file: &str| {
        let file = dir.join(file);
        let output = faceoff(&[
            "replay",
            dataset.to_str().unwrap(),
            "--task",
            "hit",
            "--episode",
            episode,
            "--out",
            file.to_str().unwrap(),
        ]);
        assert!(!output.status.success());
        assert!(!file.exists());
        text(&output.stderr)
    };
    let message = refused(&out, "7", "absent.html");
    assert!(
        message.contains("there is no episode 7 of hit: there are 2, from 0"),
        "{message}"
    );
    let message = refused(&out, "0", "look.png");
    assert!(
        message.contains("expected a file that ends in .html or .svg"),
        "{message}"
    );
    let message = refused(&dir.join("bundle"), "0", "none.html");
    assert!(
        message.contains("as the dataset of an evaluation"),
        "{message}"
    );
    let unnamed = |options: &[&str]| {
        let file = dir.join("unnamed.html");
        let (dataset, file) = (out.to_str().unwrap(), file.to_str().unwrap());
        let output = faceoff(&[&["replay", dataset, "--out", file], options].concat());
        assert!(!output.status.success());
        text(&output.stderr)
    };
    let message = unnamed(&[]);
    assert!(
        message.contains("name an episode with --task and --episode (faceoff dataset list"),
        "{message}"
    );
    let message = unnamed(&["--rally", "0"]);
    assert!(message.contains("has no rallies"), "{message}");
}
