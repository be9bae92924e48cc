//! Faults of a page in a real browser: violations that axe reports, overflowing elements, errors on the console.

use faceoff_tests::{
    browser::{Page, View},
    repository,
};
use std::fs;

/// Rules of WCAG 2.0 to 2.2, levels A and AA.
const RUN: &str = "axe.run(document, {
    runOnly: ['wcag2a', 'wcag2aa', 'wcag21a', 'wcag21aa', 'wcag22aa'],
    resultTypes: ['violations'],
}).then(found => found.violations.map(one => one.id + ': ' + one.nodes.map(node => node.html).join(' … ').slice(0, 400)))";

/// Elements beyond the window's edge, without those in tables that scroll separately.
const WIDEST: &str = "[...document.querySelectorAll('body *')]
    .filter(one => one.getBoundingClientRect().right > innerWidth + 1 && !one.closest('.wide'))
    .map(one => one.outerHTML.slice(0, 120)).slice(-3)";

/// The windows and colour schemes in which pages are checked.
const VIEWS: [View; 4] = [
    View::DESKTOP,
    View::PHONE.dark(),
    View {
        width: 400,
        ..View::PHONE
    },
    View::PROJECTOR,
];

pub fn axe() -> String {
    let axe = repository().join("web/client/node_modules/axe-core/axe.min.js");
    fs::read_to_string(&axe).unwrap_or_else(|error| {
        panic!(
            "{}: {error}; `web/client/build.sh test`, a part of `make test`, installs it",
            axe.display()
        )
    })
}

/// The faults of an open page in all views.
pub fn faults(page: &Page, axe: &str, path: &str) -> Vec<String> {
    let mut faults = Vec::new();
    let _ = page.evaluate(&format!("{axe};1"));
    for view in VIEWS {
        page.set_view(view);
        if page.overflow() != 0 {
            let widest = page.evaluate(WIDEST);
            let width = view.width;
            faults.push(format!("{path} is wider than {width} pixels: {widest}"));
        }
        // The rules depend only on the colour scheme and on narrow windows.
        if view == View::DESKTOP || view.dark {
            let found = page.evaluate(RUN);
            let found = found.as_array().expect("axe returns a list");
            let violations = found
                .iter()
                .map(|one| format!("{path} {}: {one}", view.width));
            faults.extend(violations);
        }
    }
    faults.extend(page.console_errors());
    faults
}
