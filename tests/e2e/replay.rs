//! A replay in a real browser, against the clips that the server sends.

use crate::{
    CONFIG, Team,
    axe::{axe, faults},
    path_of, start_day,
};
use faceoff_replay::Clip;
use faceoff_tests::{
    browser::{Browser, Page, View},
    repository,
    server::Server,
};
use serde_json::Value;
use std::{io::Write, path::Path};

/// A server with an evaluation that is released: its pages' path.
pub fn released(scratch: &Path) -> (Server, String) {
    let server = Server::start(&scratch.join("data"), CONFIG);
    let team = Team::create(&server, "Alpha");
    let submission = team.submit(&server, &repository().join("agents/hold"));
    let path = path_of(&start_day(&server), &submission);
    let finished = team.finished(&server, &path);
    assert_eq!(finished["state"], "finished", "{finished}");
    (server, path.replace("/api/v1", ""))
}

/// Goes to a sample, as somebody does who moves the slider.
fn scrub(page: &Page, sample: usize) {
    let _ = page.evaluate(&format!(
        "(() => {{
            const slider = document.querySelector('#replay input[type=range]');
            slider.value = {sample};
            slider.dispatchEvent(new Event('input', {{ bubbles: true }}));
        }})()"
    ));
    page.wait_until(&format!(
        "document.querySelector('#replay').dataset.step == '{sample}'"
    ));
    // Two frames later it is drawn.
    let _ = page.evaluate(
        "new Promise(drawn => requestAnimationFrame(() => requestAnimationFrame(() => drawn(1))))",
    );
}

/// Presses the button of this name.
fn press(page: &Page, name: &str) {
    let pressed = page.evaluate(&format!(
        "(() => {{
            const button = [...document.querySelectorAll('#replay button')]
                .find(one => one.textContent.trim() == '{name}');
            button?.click();
            return button !== undefined;
        }})()"
    ));
    assert_eq!(pressed, true, "there is a button {name:?}");
}

/// The middle of what has the puck's colour in the flat view, in the canvas's pixels, and how much has it.
fn puck_in_pixels(page: &Page) -> [f64; 3] {
    let found = page.evaluate(
        "(() => {
            const canvases = [...document.querySelectorAll('#replay canvas')];
            const canvas = canvases.find(one => one.checkVisibility() && one.getContext('2d') !== null && one.width > 300);
            const { data, width, height } = canvas.getContext('2d').getImageData(0, 0, canvas.width, canvas.height);
            const probe = document.createElement('i');
            probe.style.color = 'var(--rp-puck)';
            document.querySelector('#replay').append(probe);
            const colour = getComputedStyle(probe).color.match(/\\d+/g).map(Number);
            probe.remove();
            let [x, y, count] = [0, 0, 0];
            for (let i = 0; i < width * height; i++) {
                if (colour.every((part, k) => Math.abs(part - data[4 * i + k]) < 12)) {
                    x += i % width; y += Math.floor(i / width); count++;
                }
            }
            return [x / count, y / count, count];
        })()",
    );
    let number = |index: usize| found[index].as_f64().expect("the puck's colour is there");
    [number(0), number(1), number(2)]
}

#[test]
fn a_replay_shows_in_space_and_flat_what_was_recorded() {
    let scratch = tempfile::tempdir().expect("a scratch folder can be made");
    let (server, evaluation) = released(scratch.path());
    let browser = Browser::start(scratch.path());
    let path = format!("{evaluation}/episodes/defend/0");
    let bytes = server
        .get(&format!("/api/v1{path}/motion"), None)
        .bytes()
        .expect("the clip comes whole");
    // Whether it came compressed was the client's to undo.
    let mut packed = flate2::write::GzEncoder::new(Vec::new(), flate2::Compression::fast());
    packed.write_all(&bytes).expect("memory can be written");
    let clip = Clip::read(&packed.finish().expect("memory can be written"));
    let places = clip.expect("it is a clip").puck_places();
    assert!(places.len() > 20, "an episode of {} samples", places.len());

    let page = browser.open(&format!("{}{path}", server.url));
    page.wait_for("#replay[data-state=ready]");
    assert_eq!(
        page.evaluate("document.querySelector('#replay').dataset.view"),
        "3d",
        "it draws in space"
    );
    // What it draws changes with the sample, and is more than one colour.
    let [first, second] = ["first.png", "second.png"].map(|name| scratch.path().join(name));
    scrub(&page, 0);
    page.screenshot(&first);
    scrub(&page, places.len() - 1);
    page.screenshot(&second);
    let [first, second] = [first, second].map(|file| std::fs::read(file).expect("it was written"));
    assert!(
        first != second && first.len() > 20_000,
        "{} bytes",
        first.len()
    );
    let calls = page.evaluate("Number(document.querySelector('#replay').dataset.drawCalls)");
    let calls = calls.as_f64().expect("it counts its calls");
    assert!((5.0..=50.0).contains(&calls), "{calls} draw calls");

    press(&page, "Flat");
    page.wait_for("#replay[data-view=flat]");
    // Paths have nearly the puck's colour.
    let _ = page.evaluate(
        "document.querySelectorAll('#replay input[type=checkbox]:checked').forEach(box => box.click())",
    );
    let samples = [0, places.len() / 3, 2 * places.len() / 3, places.len() - 1];
    let seen: Vec<[f64; 3]> = samples
        .iter()
        .map(|sample| {
            scrub(&page, *sample);
            puck_in_pixels(&page)
        })
        .collect();
    // From metres to pixels by two of them: one scale for both axes, y up the page.
    let far = (0..4).max_by(|a, b| {
        let from_start = |i: &usize| (places[samples[*i]][0] - places[0][0]).abs();
        from_start(a).total_cmp(&from_start(b))
    });
    let far = far.expect("there are four");
    let scale = (seen[far][0] - seen[0][0]) / (places[samples[far]][0] - places[0][0]);
    assert!(scale > 100.0, "{scale} pixels per metre: {seen:?}");
    for (sample, [x, y, count]) in samples.iter().zip(&seen) {
        let expected_x = seen[0][0] + scale * (places[*sample][0] - places[0][0]);
        let expected_y = seen[0][1] - scale * (places[*sample][1] - places[0][1]);
        assert!(*count > 20.0, "the puck is drawn at sample {sample}");
        assert!(
            (x - expected_x).abs() < 3.0 && (y - expected_y).abs() < 3.0,
            "at sample {sample} the puck is drawn at {x}, {y}, and it was at {expected_x}, {expected_y}"
        );
    }
    assert_eq!(page.console_errors(), [""; 0]);

    // A link leads to a sample and a view; by keys it goes on.
    let linked = browser.open(&format!("{}{path}#t=7&flat=1", server.url));
    linked.wait_for("#replay[data-state=ready][data-view=flat]");
    linked.wait_until("document.querySelector('#replay').dataset.step == '7'");
    // Wherever it is shown, nothing is wider than the page.
    for view in [View::PHONE, View::PHONE.dark(), View::DESK.dark()] {
        for path in [path.clone(), format!("{path}/embed")] {
            let page = browser.open_in(view, &format!("{}{path}", server.url));
            page.wait_for("#replay[data-state=ready]");
            assert_eq!(page.overflow(), 0, "{path} in {view:?}");
            assert_eq!(page.console_errors(), [""; 0], "{path} in {view:?}");
        }
    }
    // Without scripts there is the whole episode as one picture.
    let still = browser.open_in(
        View::PHONE.without_scripts(),
        &format!("{}{path}", server.url),
    );
    let way = still.evaluate("document.querySelector('.still .way.puck').getAttribute('d')");
    let points = way
        .as_str()
        .map_or(0, |way| way.matches(['M', 'L']).count());
    assert_eq!(points, places.len());
    assert_eq!(still.overflow(), 0);
}

#[test]
fn a_replay_that_cannot_be_loaded_says_so() {
    let scratch = tempfile::tempdir().expect("a scratch folder can be made");
    let (server, evaluation) = released(scratch.path());
    let browser = Browser::start(scratch.path());
    let page = browser.open(&format!("{}{evaluation}/episodes/prepare/1", server.url));
    page.wait_for("#replay[data-state=ready]");
    let answer: Value = page.evaluate(&format!(
        "fetch('/api/v1{evaluation}/episodes/prepare/99/motion').then(answer => answer.status)"
    ));
    assert_eq!(answer, 404);
    let absent = browser.open(&format!("{}{evaluation}/episodes/prepare/99", server.url));
    assert!(
        absent.text("h1").contains("Not found"),
        "{}",
        absent.text("h1")
    );
}

#[test]
fn two_replays_of_one_start_run_in_step() {
    let scratch = tempfile::tempdir().expect("a scratch folder can be made");
    let server = Server::start(&scratch.path().join("data"), CONFIG);
    let teams = ["Alpha", "Beta"].map(|name| Team::create(&server, name));
    let submissions = teams
        .each_ref()
        .map(|team| team.submit(&server, &repository().join("agents/hold")));
    let day = start_day(&server);
    let [a, b] = [0, 1].map(|index: usize| {
        let path = path_of(&day, &submissions[index]);
        let finished = teams[index].finished(&server, &path);
        assert_eq!(finished["state"], "finished", "{finished}");
        path.replace("/api/v1", "")
    });
    let other = b.rsplit('/').next().expect("a path has an end");
    let browser = Browser::start(scratch.path());
    let page = browser.open(&format!("{}{a}/compare/{other}/defend/1", server.url));
    page.wait_until("document.querySelectorAll('.replay[data-state=ready]').length == 2");
    let _ = page.evaluate(
        "(() => {
            const slider = document.querySelector('#replay-a input[type=range]');
            slider.value = 12;
            slider.dispatchEvent(new Event('input', { bubbles: true }));
        })()",
    );
    page.wait_until(
        "[...document.querySelectorAll('.replay')].every(replay => replay.dataset.step == '12')",
    );
    let axe = axe();
    let mut broken = faults(&page, &axe, "an episode twice");
    page.look_through(View::DESK);
    page.go(&format!("{}{a}/compare/{other}", server.url));
    broken.extend(faults(&page, &axe, "a comparison"));
    assert!(broken.is_empty(), "{}", broken.join("\n"));
}

#[test]
fn without_webgl_the_flat_view_is_shown_and_says_why() {
    let scratch = tempfile::tempdir().expect("a scratch folder can be made");
    let (server, evaluation) = released(scratch.path());
    let browser = Browser::start(scratch.path());
    let page = browser.open(&format!("{}/", server.url));
    page.before_scripts(
        "const whole = HTMLCanvasElement.prototype.getContext;
        HTMLCanvasElement.prototype.getContext = function (kind, ...rest) {
            return kind.startsWith('webgl') ? null : whole.call(this, kind, ...rest);
        };",
    );
    page.go(&format!("{}{evaluation}/episodes/hit/0", server.url));
    page.wait_for("#replay[data-state=ready][data-view=flat]");
    assert!(page.text("#replay").contains("offers no 3-D drawing"));
    scrub(&page, 3);
    let [_, _, count] = puck_in_pixels(&page);
    assert!(count > 20.0, "the puck is drawn");
}

#[test]
fn replays_that_are_opened_again_and_again_leave_nothing_behind() {
    let scratch = tempfile::tempdir().expect("a scratch folder can be made");
    let (server, evaluation) = released(scratch.path());
    let browser = Browser::start(scratch.path());
    let page = browser.open(&format!("{}/", server.url));
    let mut held = Vec::new();
    for cycle in 0..20 {
        let number = cycle % 2;
        page.go(&format!(
            "{}{evaluation}/episodes/defend/{number}",
            server.url
        ));
        page.wait_for("#replay[data-state=ready]");
        scrub(&page, 20);
        scrub(&page, 0);
        held.push(page.script_bytes());
    }
    let most = |of: &[f64]| of.iter().copied().fold(0.0, f64::max);
    let (first, last) = (most(&held[..10]), most(&held[10..]));
    assert!(last < 1.2 * first, "bytes held by scripts: {held:?}");
    assert_eq!(page.console_errors(), [""; 0]);
}

/// How much CPU time a frame may take its script, ms, in 19 of 20.
const FRAME_MS: f64 = 4.0;

#[test]
#[ignore = "how fast a machine is, is the machine's; `make frames` runs it"]
#[expect(
    clippy::print_stdout,
    reason = "what it measures is what it is run for"
)]
fn a_frame_takes_its_script_little_time() {
    let scratch = tempfile::tempdir().expect("a scratch folder can be made");
    let (server, evaluation) = released(scratch.path());
    let browser = Browser::start(scratch.path());
    let page = browser.open(&format!("{}{evaluation}/episodes/defend/0", server.url));
    page.wait_for("#replay[data-state=ready]");
    let samples = page.evaluate("document.querySelector('#replay input[type=range]').max");
    let samples = samples.as_str().and_then(|text| text.parse().ok());
    let samples: usize = samples.expect("the slider has an end");
    // First all of it once: what is made when it is needed first is no frame's.
    let mut frames = Vec::new();
    for turn in 0..2 {
        for sample in (0..samples).rev() {
            let before = page.script_s();
            scrub(&page, sample);
            if turn > 0 {
                frames.push(1e3 * (page.script_s() - before));
            }
        }
    }
    frames.sort_by(f64::total_cmp);
    let share = |percent: usize| frames[(frames.len() - 1) * percent / 100];
    println!(
        "script per frame, ms of CPU: median {:.2}, 95th percentile {:.2}, of {} frames",
        share(50),
        share(95),
        frames.len()
    );
    assert!(share(95) <= FRAME_MS, "{frames:?}");
}
