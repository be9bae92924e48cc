//! Takes the pictures of pages for README and documentation: `make pictures`.

use crate::{Team, evaluation_path, replay::PREFERS_REDUCED_MOTION, start_day};
use faceoff_replay::ContactWith;
use faceoff_tests::{
    browser::{Browser, Page, View},
    bundle, repository,
    server::Server,
};
use serde_json::Value;
use std::{io::Write, path::PathBuf};

/// As many episodes as in the demo season (`faceoff demo`).
const CONFIG: &str = concat!(
    include_str!("../long_time_limits.toml"),
    "
[season]
name = \"Air hockey 2026\"
[evaluation]
episodes_per_task = 50
"
);

fn picture_path(name: &str) -> PathBuf {
    repository().join("docs/images").join(name)
}

/// Saves a picture of what a window of this size shows.
fn save_picture(page: &Page, view: View, name: &str) {
    page.set_view(view);
    page.screenshot_window(&picture_path(name));
}

#[test]
#[ignore = "it writes docs/images; `make pictures` runs it"]
fn pictures_of_pages_are_taken() {
    let scratch = tempfile::tempdir().expect("a scratch folder can be made");
    let server = Server::start(&scratch.path().join("data"), CONFIG);
    let mut contestants = Vec::new();
    for name in ["hold", "striker", "reckless"] {
        let team = Team::create(&server, name);
        let submission = team.submit(&server, &bundle::example_agent(name, scratch.path()));
        assert_eq!(submission["state"], "valid", "{submission:#}");
        contestants.push((team, submission));
    }
    let day = start_day(&server);
    for (team, submission) in &contestants {
        let finished = team.wait_until_finished(&server, &evaluation_path(&day, submission));
        assert_eq!(finished["state"], "finished", "{finished}");
    }
    let browser = Browser::start(scratch.path());
    let board = browser.open(&format!("{}/", server.url));
    let view = View {
        height: 1240,
        ..View::DESKTOP
    };
    save_picture(&board, view, "board.png");

    // The replay of the striker's first goal, at the moment of the strike.
    let (_, striker) = &contestants[1];
    let api = evaluation_path(&day, striker);
    let episodes: Value = server
        .get(&format!("{api}/episodes"), None)
        .json()
        .expect("the API speaks JSON");
    let episodes = episodes["episodes"].as_array().expect("a list of episodes");
    let goal = episodes
        .iter()
        .find(|episode| episode["task"] == "hit" && episode["success"] == true);
    let number = &goal.expect("the striker hits a goal")["episode"];
    let path = format!("{api}/episodes/hit/{number}");
    let bytes = server.get(&format!("{path}/motion"), None).bytes();
    // The HTTP client has decompressed the clip; its reader expects it compressed.
    let mut compressed = flate2::write::GzEncoder::new(Vec::new(), flate2::Compression::fast());
    compressed
        .write_all(&bytes.expect("the clip comes whole"))
        .expect("memory can be written");
    let clip = faceoff_replay::Clip::read(&compressed.finish().expect("memory can be written"));
    let clip = clip.expect("it is a clip");
    let mut contacts = clip.header.contacts.iter();
    let strike = contacts.rfind(|contact| contact.body == ContactWith::Mallet);
    // The address of a replay names its control step and its camera.
    let step = (strike.expect("a goal was struck").t / clip.header.step_s).ceil();
    let page = path.replace("/api/v1", "");
    let replay = browser.open(&format!("{}/", server.url));
    // A link to a moment plays from there, except for visitors who prefer reduced motion.
    replay.before_scripts(PREFERS_REDUCED_MOTION);
    replay.go_to(&format!("{}{page}#t={step}&cam=corner", server.url));
    replay.wait_for("#replay[data-state=ready]");
    replay.wait_until(&format!(
        "document.querySelector('#replay').dataset.step == '{step}'"
    ));
    let view = View {
        width: 1440,
        height: 1100,
        ..View::DESKTOP
    };
    save_picture(&replay, view, "replay-page.png");
}
