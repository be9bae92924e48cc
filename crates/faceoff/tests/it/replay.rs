//! What `faceoff replay` draws and says.

use crate::PATIENT;
use std::{
    fs,
    path::{Path, PathBuf},
    process::{Command, Output},
    sync::OnceLock,
};
use tempfile::TempDir;

fn faceoff(args: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_faceoff"))
        .args(args)
        .output()
        .unwrap()
}

fn text(bytes: &[u8]) -> String {
    String::from_utf8_lossy(bytes).into_owned()
}

/// Two episodes of each task by an agent that breaks limits; its name is to be escaped.
fn evaluated() -> &'static Path {
    static DIR: OnceLock<TempDir> = OnceLock::new();
    let dir = DIR.get_or_init(|| {
        let dir = tempfile::tempdir().unwrap();
        let agents = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../agents/reckless");
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
            PATIENT,
            "--episodes",
            "2",
            "--seed",
            "5",
            "--workers",
            "2",
        ]);
        assert!(output.status.success(), "{}", text(&output.stderr));
        dir
    });
    dir.path()
}

/// What is printed, and where it was drawn.
fn replayed(task: &str, episode: &str, file: &str) -> (String, PathBuf) {
    let dir = evaluated();
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
fn a_page_is_complete_by_itself_and_says_why() {
    for task in ["hit", "defend", "prepare"] {
        let (told, file) = replayed(task, "1", &format!("{task}.html"));
        let lines: Vec<&str> = told.lines().collect();
        assert_eq!(
            lines[0],
            format!("{task}, episode 1 of <b>&reckless: no success")
        );
        let page = fs::read_to_string(file).unwrap();
        let why = lines[1].replace('<', "&#60;").replace('\'', "&#39;");
        assert!(page.contains(&why), "{why}\n{page:.2000}");
        assert!(
            told.contains("3 points: end effector limit broken from step "),
            "{told}"
        );
        assert!(!page.contains("<b>"), "an agent's name is text");
        // The name of SVG's vocabulary is the only address; nothing is fetched.
        let rest = page.replace("http://www.w3.org/2000/svg", "");
        for outside in ["http:", "https:", "src=", "@import", "url("] {
            assert!(!rest.contains(outside), "{outside}");
        }
        assert_eq!(page.contains("opponent</span>"), task == "hit");
    }
}

/// An agent that fails at its first step leaves an episode of one state.
#[test]
fn a_fault_is_told_with_the_line_that_the_agent_left() {
    let dir = tempfile::tempdir().unwrap();
    let bundle = dir.path().join("bundle");
    let made = faceoff(&["new", bundle.to_str().unwrap()]);
    assert!(made.status.success(), "{}", text(&made.stderr));
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
        PATIENT,
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
    let told = text(&drawn.stdout);
    assert!(
        told.contains("the agent's fault ended the episode"),
        "{told}"
    );
    assert!(told.contains("ValueError: 7 (agent.py, line "), "{told}");
    assert!(fs::read_to_string(page).unwrap().contains("ValueError: 7"));
}

#[test]
fn a_picture_is_well_formed() {
    let (_, file) = replayed("hit", "0", "hit.svg");
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
fn what_cannot_be_drawn_is_said() {
    let dir = evaluated();
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
    let words = refused(&out, "7", "absent.html");
    assert!(
        words.contains("there is no episode 7 of hit: there are 2, from 0"),
        "{words}"
    );
    let words = refused(&out, "0", "look.png");
    assert!(
        words.contains("expected a file that ends in .html or .svg"),
        "{words}"
    );
    let words = refused(&dir.join("bundle"), "0", "none.html");
    assert!(words.contains("as the dataset of an evaluation"), "{words}");
}
