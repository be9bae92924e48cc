use super::{error::BundleError, node::Node};
use std::collections::BTreeMap;

/// As many links as Linux follows on one path.
const MAX_LINKS: usize = 40;

/// Follows the link at `path` through the tree as the system would. A step above the bundle's
/// folder `root` (a path in the tree, empty for its top) is an escape, even if the path returns.
/// A target that does not exist is harmless as long as it would be inside. `count_bytes` gets the length of each
/// target and of each name that is looked up, and ends a walk that is too long.
pub(super) fn check(
    nodes: &BTreeMap<String, Node>,
    root: &str,
    path: &str,
    target: &str,
    count_bytes: &mut dyn FnMut(usize) -> Result<(), BundleError>,
) -> Result<(), String> {
    let leaves = || format!("is a link that leaves the bundle: {target:?}");
    let inside =
        |path: &[String]| root.is_empty() || path.first().is_some_and(|first| first == root);
    let mut at: Vec<String> = path.split('/').map(str::to_owned).collect();
    at.pop();
    let mut links = 1;
    let mut count = |name: &str| count_bytes(name.len()).map_err(|error| error.to_string());
    count(target)?;
    // The remaining parts of the walk, the next one last.
    let mut todo: Vec<String> = parts(target).ok_or_else(leaves)?;
    while let Some(part) = todo.pop() {
        if part == ".." {
            if at.pop().is_none() || !inside(&at) {
                return Err(leaves());
            }
            continue;
        }
        at.push(part);
        let name = at.join("/");
        count(&name)?;
        if let Some(Node::Link { target: next }) = nodes.get(&name) {
            links += 1;
            if links > MAX_LINKS {
                return Err(format!("is a link that leads in a circle: {target:?}"));
            }
            at.pop();
            count(next)?;
            todo.extend(parts(next).ok_or_else(leaves)?);
        }
    }
    Ok(())
}

/// The parts of a relative path, last first; `None` for an absolute one.
fn parts(path: &str) -> Option<Vec<String>> {
    if path.starts_with('/') {
        return None;
    }
    let part = |part: &str| (!matches!(part, "" | ".")).then(|| part.to_owned());
    Some(path.rsplit('/').filter_map(part).collect())
}

#[cfg(test)]
mod tests {
    use super::*;

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
            "it leaves before it returns"
        );
        assert!(
            !check_all("top", &[("top/a", "..")]),
            "the archive's root is outside"
        );
        assert!(!check_all("top", &[("top/a", "../top/b")]));
    }

    #[test]
    fn link_through_a_link_is_followed() {
        // As text, deep/up/.. is deep; followed, deep/up is the root and its parent is outside.
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
