//! `faceoff replay --video`: videos of episodes and games.

use crate::{
    program::{command, faceoff, file_names, text},
    replay::scratch_with_evaluation,
    replay_game::first_game,
};
use serde_json::Value;
use std::{
    fs,
    io::Cursor,
    os::unix::fs::PermissionsExt,
    path::{Path, PathBuf},
    process::Output,
};
use tempfile::TempDir;

const SIZE: [usize; 2] = [960, 606];
/// Copies of a GIF's last frame.
const FINAL_FRAMES: usize = 25;

fn write_episode_video(file: &Path, options: &[&str]) -> Output {
    let dataset = scratch_with_evaluation().join("out");
    let fixed = ["replay", dataset.to_str().unwrap(), "--task", "hit"];
    let fixed = [&fixed[..], &["--episode", "0", "--video"]].concat();
    faceoff(&[&fixed[..], &[file.to_str().unwrap()], options].concat())
}

fn write_game_video(file: &Path, options: &[&str]) -> Output {
    let recording = first_game();
    let fixed = ["replay", recording.to_str().unwrap(), "--video"];
    faceoff(&[&fixed[..], &[file.to_str().unwrap()], options].concat())
}

/// A new folder, and the path of a file in it.
fn target(name: &str) -> (TempDir, PathBuf) {
    let dir = tempfile::tempdir().unwrap();
    let file = dir.path().join(name);
    (dir, file)
}

#[track_caller]
fn assert_refused(output: &Output, words: &[&str]) {
    let message = text(&output.stderr);
    assert!(!output.status.success(), "{}", text(&output.stdout));
    for word in words {
        assert!(message.contains(word), "{word:?} is not in {message}");
    }
}

/// The frames of a GIF, as indices of colours.
fn decode(file: &Path) -> Vec<Vec<u8>> {
    let bytes = fs::read(file).unwrap();
    let mut decoder = gif::DecodeOptions::new().read_info(&bytes[..]).unwrap();
    let size = [decoder.width(), decoder.height()].map(usize::from);
    assert_eq!(size, SIZE);
    let mut screen = vec![0; size[0] * size[1]];
    let mut frames = Vec::new();
    while let Some(frame) = decoder.read_next_frame().unwrap() {
        assert_eq!(frame.delay, 4, "25 frames per second");
        let lines = frame.buffer.chunks(usize::from(frame.width));
        for (line, pixels) in lines.enumerate() {
            let start = (usize::from(frame.top) + line) * size[0] + usize::from(frame.left);
            for (old, new) in screen[start..].iter_mut().zip(pixels) {
                if Some(*new) != frame.transparent {
                    *old = *new;
                }
            }
        }
        frames.push(screen.clone());
    }
    frames
}

/// The control steps of the episode.
fn episode_steps() -> usize {
    let dataset = scratch_with_evaluation().join("out");
    let list = ["dataset", "list", dataset.to_str().unwrap(), "--json"];
    let output = faceoff(&list);
    let rows: Vec<Value> = text(&output.stdout)
        .lines()
        .map(|line| serde_json::from_str(line).unwrap())
        .collect();
    let is_first = |row: &&Value| row["task"] == "hit" && row["episode"] == 0;
    let steps = &rows.iter().find(is_first).unwrap()["steps"];
    usize::try_from(steps.as_u64().unwrap()).unwrap()
}

#[test]
fn video_of_an_episode_shows_all_of_it() {
    let (_dir, file) = target("look.gif");
    let output = write_episode_video(&file, &["--speed", "4"]);
    assert!(output.status.success(), "{}", text(&output.stderr));
    let stdout = text(&output.stdout);
    assert!(stdout.starts_with("hit, episode 0 of "), "{stdout}");
    let frames = decode(&file);
    // Eight control steps per frame.
    let moving = episode_steps().div_ceil(8) + 1;
    assert_eq!(frames.len(), moving + FINAL_FRAMES - 1);
    assert!(frames[0] != frames[moving - 1]);
    assert!(
        frames[moving - 1] == frames[moving + FINAL_FRAMES - 2],
        "the end stays"
    );
}

#[test]
fn part_of_a_game_is_chosen_by_time_rally_and_speed() {
    let frames = |options: &[&str]| {
        let (_dir, file) = target("game.gif");
        let output = write_game_video(&file, options);
        assert!(output.status.success(), "{}", text(&output.stderr));
        decode(&file).len() - FINAL_FRAMES + 1
    };
    // 1 s has 50 control steps, and two of them pass per frame.
    assert_eq!(frames(&["--from", "1", "--to", "2"]), 26);
    assert_eq!(frames(&["--from", "1", "--to", "2", "--speed", "4"]), 8);
    assert_eq!(frames(&["--from", "19.9"]), 4, "the game has 20 s");
    // The rally ends with the foul after 15.02 s, which are 9.4 times 80 control steps; the game would have 14 frames.
    assert_eq!(frames(&["--rally", "0", "--speed", "40"]), 11);
}

#[test]
fn frames_are_numbered_in_an_empty_folder() {
    let (dir, folder) = target("frames/");
    let span = ["--from", "0", "--to", "0.1"];
    let output = write_game_video(&folder, &span);
    assert!(output.status.success(), "{}", text(&output.stderr));
    assert_eq!(
        file_names(&folder),
        [
            "frame-00001.png",
            "frame-00002.png",
            "frame-00003.png",
            "frame-00004.png"
        ]
    );
    for name in file_names(&folder) {
        let bytes = fs::read(folder.join(name)).unwrap();
        let info = png::Decoder::new(Cursor::new(bytes)).read_info().unwrap();
        let size = [info.info().width, info.info().height];
        assert_eq!(size.map(|side| side as usize), SIZE);
    }
    assert_refused(
        &write_game_video(&folder, &span),
        &["is not empty", "a new or an empty folder"],
    );
    let empty = dir.path().join("empty");
    fs::create_dir(&empty).unwrap();
    assert!(
        write_game_video(&empty, &span).status.success(),
        "it exists and is empty"
    );
    assert_eq!(file_names(&empty).len(), 4);
}

/// Runs the program with only the given folder of programs.
fn game_with_path(file: &Path, programs: &Path) -> Output {
    let recording = first_game();
    command(&[
        "replay",
        recording.to_str().unwrap(),
        "--from",
        "19.8",
        "--video",
    ])
    .arg(file)
    .env("PATH", programs)
    .output()
    .unwrap()
}

#[test]
fn mpeg4_needs_ffmpeg_and_says_so() {
    let (dir, file) = target("game.mp4");
    let output = game_with_path(&file, dir.path());
    assert_refused(
        &output,
        &["ffmpeg", "not installed", "apt install ffmpeg", "game.gif"],
    );
    assert!(file_names(dir.path()).is_empty());
}

#[test]
fn ffmpeg_gets_the_pixels_of_all_frames() {
    let (dir, file) = target("game.mp4");
    let program = dir.path().join("ffmpeg");
    let write_program = |script: &str| {
        fs::write(&program, format!("#!/bin/sh\n{script}\n")).unwrap();
        fs::set_permissions(&program, fs::Permissions::from_mode(0o755)).unwrap();
    };
    // Its last argument is the file.
    write_program(
        "for last; do :; done; echo \"$@\" > \"${last#file:}\"; /usr/bin/wc -c >> \"${last#file:}\"",
    );
    let output = game_with_path(&file, dir.path());
    assert!(output.status.success(), "{}", text(&output.stderr));
    let written = fs::read_to_string(&file).unwrap();
    let (arguments, bytes) = written.trim().split_once('\n').unwrap();
    assert!(
        arguments.contains("-video_size 960x606 -framerate 25"),
        "{arguments}"
    );
    let frames = 6 + FINAL_FRAMES - 1;
    assert_eq!(bytes.parse(), Ok(SIZE[0] * SIZE[1] * 3 * frames));

    write_program(
        "for last; do :; done; echo half > \"${last#file:}\"; echo 'no such codec' >&2; exit 3",
    );
    assert_refused(
        &game_with_path(&file, dir.path()),
        &["ffmpeg ended with", "no such codec"],
    );
    let kept = fs::read_to_string(&file).unwrap();
    assert_eq!(kept, written, "the earlier video stays");
    assert_eq!(file_names(dir.path()), ["ffmpeg", "game.mp4"]);
}

#[test]
fn unsuitable_video_is_refused_with_a_reason() {
    let (dir, file) = target("game.webm");
    assert_refused(
        &write_game_video(&file, &[]),
        &["ends in .gif or .mp4", "game.webm"],
    );
    let file = dir.path().join("game.gif");
    for (options, words) in [
        (
            &["--from", "25"][..],
            &["--from", "ends after 20.00 s", "25.00 s"][..],
        ),
        (&["--from", "5", "--to", "4"], &["--to", "5.00 s", "4.00 s"]),
        (&["--from=-1"], &["number of seconds"]),
        (&["--speed", "0"], &["from 0.1 to 100"]),
        (
            &["--speed", "0.1"],
            &["5001 frames", "--from SECONDS and --to SECONDS", "--rally"],
        ),
        (&["--rally", "0", "--from", "1"], &["cannot be used with"]),
    ] {
        assert_refused(&write_game_video(&file, options), words);
        assert!(!file.exists(), "{options:?}");
    }
    let recording = first_game();
    let recording = recording.to_str().unwrap();
    assert_refused(&faceoff(&["replay", recording]), &["--out <FILE>"]);
    for (name, options, words) in [
        ("a.html", &["--from", "1"][..], "--out <FILE>"),
        ("a.gif", &[], "videos are written by --video"),
    ] {
        let file = dir.path().join(name);
        let fixed = ["replay", recording, "--out", file.to_str().unwrap()];
        assert_refused(&faceoff(&[&fixed[..], options].concat()), &[words]);
        assert!(!file.exists(), "{name}");
    }
}
