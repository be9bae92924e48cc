//! Replays in a real browser, compared with the server's clips.

use crate::{
    CONFIG, Team,
    axe::{axe_script, faults},
    evaluation_path, start_day,
};
use faceoff_replay::Clip;
use faceoff_tests::{
    browser::{Browser, Page, View},
    repository,
    server::Server,
};
use serde_json::Value;
use std::{io::Write, path::Path};

/// A server with a released evaluation, and the path of its page.
pub fn released_evaluation(scratch: &Path) -> (Server, String) {
    let server = Server::start(&scratch.join("data"), CONFIG);
    let team = Team::create(&server, "Alpha");
    let submission = team.submit(&server, &repository().join("agents/hold"));
    let path = evaluation_path(&start_day(&server), &submission);
    let finished = team.wait_until_finished(&server, &path);
    assert_eq!(finished["state"], "finished", "{finished}");
    (server, path.replace("/api/v1", ""))
}

/// Moves the slider to a sample.
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
    // The sample is drawn two frames later.
    let _ = page.evaluate(
        "new Promise(drawn => requestAnimationFrame(() => requestAnimationFrame(() => drawn(1))))",
    );
}

/// Presses the button of this name.
fn press(page: &Page, name: &str) {
    let pressed = page.evaluate(&format!(
        "(() => {{
            const button = [...document.querySelectorAll('#replay button')]
                .find(button => button.textContent.trim() == '{name}');
            button?.click();
            return button !== undefined;
        }})()"
    ));
    assert_eq!(pressed, true, "there is a button {name:?}");
}

/// The centre of the pixels with the puck's colour in the flat view, and their number.
fn puck_pixels(page: &Page) -> [f64; 3] {
    let found = page.evaluate(
        "(() => {
            const canvases = [...document.querySelectorAll('#replay canvas')];
            const canvas = canvases.find(canvas => canvas.checkVisibility() && canvas.getContext('2d') !== null && canvas.width > 300);
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
fn replay_shows_recorded_positions_in_3d_and_flat_view() {
    let scratch = tempfile::tempdir().expect("a scratch folder can be made");
    let (server, evaluation) = released_evaluation(scratch.path());
    let browser = Browser::start(scratch.path());
    let path = format!("{evaluation}/episodes/defend/0");
    let bytes = server
        .get(&format!("/api/v1{path}/motion"), None)
        .bytes()
        .expect("the clip comes whole");
    // The HTTP client has decompressed the clip; its reader expects it compressed.
    let mut packed = flate2::write::GzEncoder::new(Vec::new(), flate2::Compression::fast());
    packed.write_all(&bytes).expect("memory can be written");
    let clip = Clip::read(&packed.finish().expect("memory can be written"));
    let positions = clip.expect("it is a clip").puck_positions();
    assert!(
        positions.len() > 20,
        "an episode of {} samples",
        positions.len()
    );

    let page = browser.open(&format!("{}{path}", server.url));
    page.wait_for("#replay[data-state=ready]");
    assert_eq!(
        page.evaluate("document.querySelector('#replay').dataset.view"),
        "3d",
        "the view is three-dimensional"
    );
    // The picture changes with the sample and is not a single colour.
    let [first, second] = ["first.png", "second.png"].map(|name| scratch.path().join(name));
    scrub(&page, 0);
    page.screenshot(&first);
    scrub(&page, positions.len() - 1);
    page.screenshot(&second);
    let [first, second] = [first, second].map(|file| std::fs::read(file).expect("it was written"));
    assert!(
        first != second && first.len() > 20_000,
        "{} bytes",
        first.len()
    );
    let calls = page.evaluate("Number(document.querySelector('#replay').dataset.drawCalls)");
    let calls = calls.as_f64().expect("the replay reports its draw calls");
    assert!((5.0..=50.0).contains(&calls), "{calls} draw calls");

    press(&page, "Flat");
    page.wait_for("#replay[data-view=flat]");
    // Hides the trails, which have nearly the puck's colour.
    let _ = page.evaluate(
        "document.querySelectorAll('#replay input[type=checkbox]:checked').forEach(box => box.click())",
    );
    let samples = [
        0,
        positions.len() / 3,
        2 * positions.len() / 3,
        positions.len() - 1,
    ];
    let seen: Vec<[f64; 3]> = samples
        .iter()
        .map(|sample| {
            scrub(&page, *sample);
            puck_pixels(&page)
        })
        .collect();
    // Two samples give the scale from metres to pixels: equal for both axes, y upwards.
    let far = (0..4).max_by(|a, b| {
        let from_start = |i: &usize| (positions[samples[*i]][0] - positions[0][0]).abs();
        from_start(a).total_cmp(&from_start(b))
    });
    let far = far.expect("there are four samples");
    let scale = (seen[far][0] - seen[0][0]) / (positions[samples[far]][0] - positions[0][0]);
    assert!(scale > 100.0, "{scale} pixels per metre: {seen:?}");
    for (sample, [x, y, count]) in samples.iter().zip(&seen) {
        let expected_x = seen[0][0] + scale * (positions[*sample][0] - positions[0][0]);
        let expected_y = seen[0][1] - scale * (positions[*sample][1] - positions[0][1]);
        assert!(*count > 20.0, "the puck is drawn at sample {sample}");
        assert!(
            (x - expected_x).abs() < 3.0 && (y - expected_y).abs() < 3.0,
            "at sample {sample} the puck is drawn at {x}, {y}, expected {expected_x}, {expected_y}"
        );
    }
    assert_eq!(page.console_errors(), [""; 0]);

    // A link opens a sample and a view.
    let linked = browser.open(&format!("{}{path}#t=7&flat=1", server.url));
    linked.wait_for("#replay[data-state=ready][data-view=flat]");
    linked.wait_until("document.querySelector('#replay').dataset.step == '7'");
    // No page overflows, in any window.
    for view in [View::PHONE, View::PHONE.dark(), View::DESKTOP.dark()] {
        for path in [path.clone(), format!("{path}/embed")] {
            let page = browser.open_in(view, &format!("{}{path}", server.url));
            page.wait_for("#replay[data-state=ready]");
            assert_eq!(page.overflow(), 0, "{path} in {view:?}");
            assert_eq!(page.console_errors(), [""; 0], "{path} in {view:?}");
        }
    }
    // Without scripts the page shows the whole episode as one picture.
    let still = browser.open_in(
        View::PHONE.without_scripts(),
        &format!("{}{path}", server.url),
    );
    let path_data =
        still.evaluate("document.querySelector('.still .trajectory.puck').getAttribute('d')");
    let points = path_data
        .as_str()
        .map_or(0, |path| path.matches(['M', 'L']).count());
    assert_eq!(points, positions.len());
    assert_eq!(still.overflow(), 0);
}

#[test]
fn missing_episode_is_reported_as_not_found() {
    let scratch = tempfile::tempdir().expect("a scratch folder can be made");
    let (server, evaluation) = released_evaluation(scratch.path());
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
fn compared_replays_run_in_step() {
    let scratch = tempfile::tempdir().expect("a scratch folder can be made");
    let server = Server::start(&scratch.path().join("data"), CONFIG);
    let teams = ["Alpha", "Beta"].map(|name| Team::create(&server, name));
    let submissions = teams
        .each_ref()
        .map(|team| team.submit(&server, &repository().join("agents/hold")));
    let day = start_day(&server);
    let [a, b] = [0, 1].map(|index: usize| {
        let path = evaluation_path(&day, &submissions[index]);
        let finished = teams[index].wait_until_finished(&server, &path);
        assert_eq!(finished["state"], "finished", "{finished}");
        path.replace("/api/v1", "")
    });
    let other = b.rsplit('/').next().expect("the path ends with the id");
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
    let axe = axe_script();
    let mut found = faults(&page, &axe, "an episode twice");
    page.set_view(View::DESKTOP);
    page.go_to(&format!("{}{a}/compare/{other}", server.url));
    found.extend(faults(&page, &axe, "a comparison"));
    assert!(found.is_empty(), "{}", found.join("\n"));
}

#[test]
fn replay_without_webgl_shows_flat_view_with_reason() {
    let scratch = tempfile::tempdir().expect("a scratch folder can be made");
    let (server, evaluation) = released_evaluation(scratch.path());
    let browser = Browser::start(scratch.path());
    let page = browser.open(&format!("{}/", server.url));
    page.before_scripts(
        "const original = HTMLCanvasElement.prototype.getContext;
        HTMLCanvasElement.prototype.getContext = function (kind, ...rest) {
            return kind.startsWith('webgl') ? null : original.call(this, kind, ...rest);
        };",
    );
    page.go_to(&format!("{}{evaluation}/episodes/hit/0", server.url));
    page.wait_for("#replay[data-state=ready][data-view=flat]");
    assert!(page.text("#replay").contains("has no 3-D support"));
    scrub(&page, 3);
    let [_, _, count] = puck_pixels(&page);
    assert!(count > 20.0, "the puck is drawn");
}

#[test]
fn repeatedly_opened_replays_leak_no_memory() {
    let scratch = tempfile::tempdir().expect("a scratch folder can be made");
    let (server, evaluation) = released_evaluation(scratch.path());
    let browser = Browser::start(scratch.path());
    let page = browser.open(&format!("{}/", server.url));
    let mut heap_bytes = Vec::new();
    for cycle in 0..20 {
        let number = cycle % 2;
        page.go_to(&format!(
            "{}{evaluation}/episodes/defend/{number}",
            server.url
        ));
        page.wait_for("#replay[data-state=ready]");
        scrub(&page, 20);
        scrub(&page, 0);
        heap_bytes.push(page.script_bytes());
    }
    let max = |samples: &[f64]| samples.iter().copied().fold(0.0, f64::max);
    let (first, last) = (max(&heap_bytes[..10]), max(&heap_bytes[10..]));
    assert!(last < 1.2 * first, "bytes used by scripts: {heap_bytes:?}");
    assert_eq!(page.console_errors(), [""; 0]);
}

/// Script CPU time per frame that 19 of 20 frames may take, in ms.
const FRAME_MS: f64 = 4.0;

#[test]
#[ignore = "its verdict depends on the speed of the machine; `make frames` runs it"]
#[expect(clippy::print_stdout, reason = "it prints its measurements")]
fn frames_need_little_script_time() {
    let scratch = tempfile::tempdir().expect("a scratch folder can be made");
    let (server, evaluation) = released_evaluation(scratch.path());
    let browser = Browser::start(scratch.path());
    let page = browser.open(&format!("{}{evaluation}/episodes/defend/0", server.url));
    page.wait_for("#replay[data-state=ready]");
    let samples = page.evaluate("document.querySelector('#replay input[type=range]').max");
    let samples = samples.as_str().and_then(|text| text.parse().ok());
    let samples: usize = samples.expect("the slider has an end");
    // The first pass creates cached objects and is not measured.
    let mut frames = Vec::new();
    for pass in 0..2 {
        for sample in (0..samples).rev() {
            let before = page.script_cpu_s();
            scrub(&page, sample);
            if pass > 0 {
                frames.push(1e3 * (page.script_cpu_s() - before));
            }
        }
    }
    frames.sort_by(f64::total_cmp);
    let percentile = |percent: usize| frames[(frames.len() - 1) * percent / 100];
    println!(
        "script per frame, ms of CPU: median {:.2}, 95th percentile {:.2}, of {} frames",
        percentile(50),
        percentile(95),
        frames.len()
    );
    assert!(percentile(95) <= FRAME_MS, "{frames:?}");
}
