//! The check that symbolic links of a bundle do not lead out of it. They are followed in memory, before any is created.

use super::{error::BundleError, node::Node};
use std::collections::BTreeMap;

/// As many links as Linux follows on one path.
const MAX_LINKS: usize = 40;

/// Follows the link at `path` through the tree as the system would. A step above the bundle's
/// folder `root` (a path in the tree, empty for its top) is an escape, even if the path returns.
/// A target that does not exist is harmless as long as it would be inside. `count_bytes` gets the length of each
/// target and of each name that is looked up, and returns an error if there are too many.
pub(super) fn check(
    nodes: &BTreeMap<String, Node>,
    root: &str,
    path: &str,
    target: &str,
    count_bytes: &mut dyn FnMut(usize) -> Result<(), BundleError>,
) -> Result<(), String> {
    let escape_error = || format!("is a link that leaves the bundle: {target:?}");
    let is_inside =
        |path: &[String]| root.is_empty() || path.first().is_some_and(|first| first == root);
    let mut current: Vec<String> = path.split('/').map(str::to_owned).collect();
    current.pop();
    let mut links = 1;
    let mut count = |name: &str| count_bytes(name.len()).map_err(|error| error.to_string());
    count(target)?;
    // The parts that are still to be followed, the next one last.
    let mut pending: Vec<String> = reversed_parts(target).ok_or_else(escape_error)?;
    while let Some(part) = pending.pop() {
        if part == ".." {
            if current.pop().is_none() || !is_inside(&current) {
                return Err(escape_error());
            }
            continue;
        }
        current.push(part);
        let name = current.join("/");
        count(&name)?;
        if let Some(Node::Link { target: next }) = nodes.get(&name) {
            links += 1;
            if links > MAX_LINKS {
                return Err(format!("is a link that leads in a circle: {target:?}"));
            }
            current.pop();
            count(next)?;
            pending.extend(reversed_parts(next).ok_or_else(escape_error)?);
        }
    }
    Ok(())
}

/// The parts of a relative path, the last one first; `None` for an absolute path.
fn reversed_parts(path: &str) -> Option<Vec<String>> {
    if path.starts_with('/') {
        return None;
    }
    let part = |part: &str| (!matches!(part, "" | ".")).then(|| part.to_owned());
    Some(path.rsplit('/').filter_map(part).collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A tree of links: path and target.
    fn tree(links: &[(&str, &str)]) -> BTreeMap<String, Node> {
        links
            .iter()
            .map(|(path, target)| {
                (
                    (*path).to_owned(),
                    Node::Link {
                        target: (*target).to_owned(),
                    },
                )
            })
            .collect()
    }

    fn check_all(root: &str, links: &[(&str, &str)]) -> bool {
        let nodes = tree(links);
        links
            .iter()
            .all(|(path, target)| check(&nodes, root, path, target, &mut |_| Ok(())).is_ok())
    }

    #[test]
    fn links_inside_are_accepted() {
        assert!(check_all(
            "",
            &[
                ("a/b", "../c"),
                ("c", "d/e"),
                ("x", "missing"),
                ("y/z", "..")
            ]
        ));
        assert!(check_all("top", &[("top/a", "b"), ("top/d/e", "../b")]));
    }

    #[test]
    fn links_outside_are_refused() {
        assert!(!check_all("", &[("a", "/etc/passwd")]));
        assert!(!check_all("", &[("a", "..")]));
        assert!(!check_all("", &[("a/b", "../../c")]));
        assert!(
            !check_all("", &[("a/b", "../../a/c")]),
            "the link leaves before it returns"
        );
        assert!(
            !check_all("top", &[("top/a", "..")]),
            "the archive's root is outside"
        );
        assert!(!check_all("top", &[("top/a", "../top/b")]));
    }

    #[test]
    fn link_through_a_link_is_followed() {
        // As a text, deep/up/.. is deep. But the link deep/up leads to the root, whose parent is outside.
        assert!(!check_all(
            "",
            &[("deep/up", ".."), ("escape", "deep/up/../x")]
        ));
        assert!(check_all("", &[("deep/up", "."), ("fine", "deep/up/../x")]));
    }

    #[test]
    fn link_cycles_are_refused() {
        assert!(!check_all("", &[("a", "b"), ("b", "a")]));
        assert!(!check_all("", &[("a", "a/x")]));
    }
}
