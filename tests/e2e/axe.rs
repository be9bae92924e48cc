//! Defects of a page in a real browser: violations of accessibility rules, which the library axe-core reports, overflowing
//! elements, and errors on the console.

use faceoff_tests::{
    browser::{Page, View},
    repository,
};
use std::fs;

/// JavaScript: lists violations of the rules of WCAG 2.0 to 2.2 (web accessibility), levels A and AA.
const LIST_VIOLATIONS: &str = "axe.run(document, {
    runOnly: ['wcag2a', 'wcag2aa', 'wcag21a', 'wcag21aa', 'wcag22aa'],
    resultTypes: ['violations'],
}).then(found => found.violations.map(rule => rule.id + ': ' + rule.nodes.map(node => node.html).join(' … ').slice(0, 400)))";

/// JavaScript: lists three elements beyond the window's right edge. Tables in a `.wide` element scroll separately and do not
/// count.
const LIST_WIDE_ELEMENTS: &str = "[...document.querySelectorAll('body *')]
    .filter(element => element.getBoundingClientRect().right > innerWidth + 1 && !element.closest('.wide'))
    .map(element => element.outerHTML.slice(0, 120)).slice(-3)";

/// The viewports (sizes of the browser window) and colour schemes in which pages are checked.
const VIEWS: [View; 3] = [View::DESKTOP, View::PHONE.dark(), View::PROJECTOR];

/// Widths of windows in which no page is wider than its window: phones, tablets and laptops, and widths beside those at which the
/// layout changes.
const WIDTHS: [u32; 13] = [
    320, 360, 390, 430, 480, 600, 735, 768, 868, 897, 1024, 1200, 1440,
];

/// The source of axe-core.
pub fn axe_script() -> String {
    let file = repository().join("web/client/node_modules/axe-core/axe.min.js");
    fs::read_to_string(&file).unwrap_or_else(|error| {
        panic!(
            "{}: {error}; `web/client/build.sh test`, a part of `make test`, installs it",
            file.display()
        )
    })
}

/// The defects of an open page in all views; `path` names the page in their descriptions.
pub fn page_defects(page: &Page, axe_script: &str, path: &str) -> Vec<String> {
    let mut defects = Vec::new();
    let _ = page.evaluate(&format!("{axe_script};1"));
    for view in VIEWS {
        page.set_view(view);
        if page.overflow() != 0 {
            let elements = page.evaluate(LIST_WIDE_ELEMENTS);
            let width = view.width;
            defects.push(format!("{path} is wider than {width} pixels: {elements}"));
        }
        // The accessibility rules depend only on the colour scheme and on whether the window is narrow, so not all views are needed.
        if view == View::DESKTOP || view.dark {
            let list = page.evaluate(LIST_VIOLATIONS);
            let list = list.as_array().expect("axe returns a list");
            let violations = list
                .iter()
                .map(|violation| format!("{path} {}: {violation}", view.width));
            defects.extend(violations);
        }
    }
    for width in WIDTHS {
        page.set_view(View {
            width,
            ..View::DESKTOP
        });
        if page.overflow() != 0 {
            let elements = page.evaluate(LIST_WIDE_ELEMENTS);
            defects.push(format!("{path} is wider than {width} pixels: {elements}"));
        }
    }
    defects.extend(page.console_errors());
    defects
}
