//! Replays of episodes in a real browser, compared with the server's *clips*. A clip is the recorded motion of an episode, in
//! *samples* at equal intervals.

use crate::{evaluate_bundle, shared_folder::start_prepared};
use faceoff_replay::Clip;
use faceoff_tests::{
    browser::{Browser, Page, View},
    repository,
    server::Server,
};
use serde_json::{Value, json};
use std::{io::Write, path::Path};

/// Starts a server and waits for an evaluation whose results are public. Returns the server and the path of the evaluation's
/// page.
pub fn released_evaluation(scratch: &Path) -> (Server, String) {
    start_prepared("released-evaluation", scratch, |server, _| {
        evaluate_bundle(server, &repository().join("agents/hold")).replace("/api/v1", "")
    })
}

/// Moves the replay's slider to a sample, and waits until the sample is drawn.
pub fn show_sample(page: &Page, sample: usize) {
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
    // The browser draws the sample at most two frames later.
    let _ = page.evaluate(
        "new Promise(drawn => requestAnimationFrame(() => requestAnimationFrame(() => drawn(1))))",
    );
}

/// Presses the button with this text.
pub fn press(page: &Page, name: &str) {
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

/// Runs before the scripts of a page: the visitor prefers reduced motion.
pub const PREFERS_REDUCED_MOTION: &str = "
    const original = window.matchMedia;
    window.matchMedia = query => query.includes('prefers-reduced-motion')
        ? { matches: true, addEventListener() {} }
        : original.call(window, query);
";

/// The pixels with the puck's colour in the flat view: x and y of their centre (pixels), and their number.
fn puck_pixels(page: &Page) -> [f64; 3] {
    let found = page.evaluate(
        "(() => {
            const canvases = [...document.querySelectorAll('#replay canvas')];
            const canvas = canvases.find(canvas => canvas.checkVisibility() && canvas.getContext('2d') !== null && canvas.width > 300);
            const { data, width, height } = canvas.getContext('2d').getImageData(0, 0, canvas.width, canvas.height);
            const coloured = document.createElement('i');
            coloured.style.color = 'var(--rp-puck)';
            document.querySelector('#replay').append(coloured);
            const colour = getComputedStyle(coloured).color.match(/\\d+/g).map(Number);
            coloured.remove();
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
    let mut compressed = flate2::write::GzEncoder::new(Vec::new(), flate2::Compression::fast());
    compressed.write_all(&bytes).expect("memory can be written");
    let clip = Clip::read(&compressed.finish().expect("memory can be written"));
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
    show_sample(&page, 0);
    page.screenshot(&first);
    show_sample(&page, positions.len() - 1);
    page.screenshot(&second);
    let [first, second] = [first, second].map(|file| std::fs::read(file).expect("it was written"));
    assert!(
        first != second && first.len() > 20_000,
        "{} bytes",
        first.len()
    );
    let draw_calls = page.evaluate("Number(document.querySelector('#replay').dataset.drawCalls)");
    let draw_calls = draw_calls
        .as_f64()
        .expect("the replay reports its draw calls");
    assert!(
        (5.0..=50.0).contains(&draw_calls),
        "{draw_calls} draw calls"
    );

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
    let drawn: Vec<[f64; 3]> = samples
        .iter()
        .map(|sample| {
            show_sample(&page, *sample);
            puck_pixels(&page)
        })
        .collect();
    // The first sample and the one farthest from it give the scale from metres to pixels. It is equal for both axes; y points
    // upwards.
    let farthest = (0..samples.len()).max_by(|a, b| {
        let from_start = |i: &usize| (positions[samples[*i]][0] - positions[0][0]).abs();
        from_start(a).total_cmp(&from_start(b))
    });
    let farthest = farthest.expect("there are samples");
    let scale =
        (drawn[farthest][0] - drawn[0][0]) / (positions[samples[farthest]][0] - positions[0][0]);
    assert!(scale > 100.0, "{scale} pixels per metre: {drawn:?}");
    for (sample, [x, y, count]) in samples.iter().zip(&drawn) {
        let expected_x = drawn[0][0] + scale * (positions[*sample][0] - positions[0][0]);
        let expected_y = drawn[0][1] - scale * (positions[*sample][1] - positions[0][1]);
        assert!(*count > 20.0, "the puck is drawn at sample {sample}");
        assert!(
            (x - expected_x).abs() < 3.0 && (y - expected_y).abs() < 3.0,
            "at sample {sample} the puck is drawn at {x}, {y}, expected {expected_x}, {expected_y}"
        );
    }
    assert_eq!(page.console_errors(), [""; 0]);

    // No page is wider than its window.
    for view in [View::PHONE, View::PHONE.dark(), View::DESKTOP.dark()] {
        for path in [path.clone(), format!("{path}/embed")] {
            let page = browser.open_in(view, &format!("{}{path}", server.url));
            page.wait_for("#replay[data-state=ready]");
            assert_eq!(page.overflow(), 0, "{path} in {view:?}");
            assert_eq!(page.console_errors(), [""; 0], "{path} in {view:?}");
        }
    }
    // Without scripts the page shows the whole episode as one picture.
    let page_without_scripts = browser.open_in(
        View::PHONE.without_scripts(),
        &format!("{}{path}", server.url),
    );
    let curve = page_without_scripts
        .evaluate("document.querySelector('.still .trajectory.puck').getAttribute('d')");
    let points = curve
        .as_str()
        .map_or(0, |curve| curve.matches(['M', 'L']).count());
    assert_eq!(points, positions.len());
    assert_eq!(page_without_scripts.overflow(), 0);
}

#[test]
fn picture_and_its_controls_fit_the_window() {
    let scratch = tempfile::tempdir().expect("a scratch folder can be made");
    let (server, evaluation) = released_evaluation(scratch.path());
    let browser = Browser::start(scratch.path());
    let url = format!("{}{evaluation}/episodes/defend/0", server.url);
    for (width, height) in [(1440, 900), (1280, 640), (768, 1024), (390, 844)] {
        let view = View {
            width,
            height,
            ..View::DESKTOP
        };
        let page = browser.open_in(view, &url);
        page.wait_for("#replay[data-state=ready]");
        let found = page.evaluate(
            "(() => {
                document.querySelector('#replay .stage').scrollIntoView();
                const box = selector => document.querySelector(selector).getBoundingClientRect();
                const [screen, controls, details] = ['.screen', '.controls', '.details'].map(box);
                return {
                    fits: screen.top >= 0 && screen.bottom <= innerHeight && screen.right <= innerWidth,
                    controls: controls.bottom <= screen.bottom + 1 && controls.top >= screen.top,
                    beside: details.left >= screen.right,
                };
            })()",
        );
        let expected = json!({ "fits": true, "controls": true, "beside": width >= 1200 });
        assert_eq!(found, expected, "{width} x {height}");
        assert_eq!(page.overflow(), 0, "{width} x {height}");
    }
    let frame = View {
        width: 640,
        height: 360,
        ..View::DESKTOP
    };
    let page = browser.open_in(frame, &format!("{url}/embed"));
    page.wait_for("#replay[data-state=ready]");
    let height = page.evaluate("document.documentElement.scrollHeight");
    assert_eq!(height, 360, "an embedded replay does not scroll");
    let picture_height = page.evaluate(
        "document.querySelector('.controls').getBoundingClientRect().top >= 180
            && document.querySelector('.controls').getBoundingClientRect().bottom <= innerHeight",
    );
    assert_eq!(picture_height, true);
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
    let missing_page = browser.open(&format!("{}{evaluation}/episodes/prepare/99", server.url));
    assert!(
        missing_page.text("h1").contains("Not found"),
        "{}",
        missing_page.text("h1")
    );
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
    show_sample(&page, 3);
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
        show_sample(&page, 20);
        show_sample(&page, 0);
        heap_bytes.push(page.script_bytes());
    }
    let max = |samples: &[f64]| samples.iter().copied().fold(0.0, f64::max);
    let (first, last) = (max(&heap_bytes[..10]), max(&heap_bytes[10..]));
    assert!(last < 1.2 * first, "bytes used by scripts: {heap_bytes:?}");
    assert_eq!(page.console_errors(), [""; 0]);
}
