//! A worker must be like the server: only the same program has the same results to the last bit, and agents are to find the same runtimes
//! everywhere.

use faceoff_types::{PythonInventory, RuntimeContent};
use faceoff_wire::remote::Introduction;

/// Why a worker may not work for this server.
pub(super) fn differs(own: &Introduction, like: &Introduction) -> Option<String> {
    if own.program != like.program {
        return Some(format!(
            "the worker runs another program (version {}, BLAKE3 {}) than the server (version {}, BLAKE3 {}): only the same program \
             has the same results to the last bit; copy the server's to the worker's machine",
            own.version, own.program, like.version, like.program
        ));
    }
    let offered = |name: &str| own.runtimes.iter().find(|runtime| runtime.name == name);
    let missing: Vec<&str> = like
        .runtimes
        .iter()
        .map(|runtime| &*runtime.name)
        .filter(|name| offered(name).is_none())
        .collect();
    if !missing.is_empty() {
        return Some(format!(
            "the worker lacks runtimes that the server offers to agents: {}; set them up in the worker's configuration",
            missing.join(", ")
        ));
    }
    like.runtimes.iter().find_map(|runtime| {
        let other = runtime_differs(&offered(&runtime.name)?.content, &runtime.content)?;
        Some(format!(
            "the worker's runtime {} is not the server's: {other}; agents are to find the same everywhere",
            runtime.name
        ))
    })
}

/// What a worker's runtime has otherwise than the server's. One that does not work on the server plays nowhere.
fn runtime_differs(own: &RuntimeContent, like: &RuntimeContent) -> Option<String> {
    let shown = |version: Option<&String>| version.map_or_else(|| "none".to_owned(), Clone::clone);
    let libc = |own: &Option<String>, like: &Option<String>| {
        let differs = own != like;
        differs.then(|| {
            format!(
                "its C library is {}, the server's {}",
                shown(own.as_ref()),
                shown(like.as_ref())
            )
        })
    };
    match (own, like) {
        (_, RuntimeContent::Broken { .. }) | (RuntimeContent::Image, RuntimeContent::Image) => None,
        (RuntimeContent::Broken { why }, _) => Some(format!("it does not work there: {why}")),
        (RuntimeContent::Native { libc: own }, RuntimeContent::Native { libc: like }) => {
            libc(own, like)
        }
        (RuntimeContent::Python(own), RuntimeContent::Python(like)) => {
            let python = |of: &PythonInventory| format!("{} {}", of.implementation, of.version);
            if python(own) != python(like) {
                return Some(format!(
                    "it is {}, the server's {}",
                    python(own),
                    python(like)
                ));
            }
            let names = own.packages.keys().chain(like.packages.keys());
            let package = names
                .map(|name| (name, own.packages.get(name), like.packages.get(name)))
                .find(|(_, own, like)| own != like);
            package.map_or_else(
                || libc(&own.libc, &like.libc),
                |(name, own, like)| {
                    let (own, like) = (shown(own), shown(like));
                    Some(format!("its package {name} is {own}, the server's {like}"))
                },
            )
        }
        _ => Some("it is of another kind".to_owned()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use faceoff_types::RuntimeInventory;

    fn python(version: &str, packages: &[(&str, &str)]) -> RuntimeContent {
        let packages = packages.iter();
        RuntimeContent::Python(PythonInventory {
            implementation: "CPython".into(),
            version: version.into(),
            libc: Some("2.36".into()),
            packages: packages
                .map(|(name, version)| ((*name).into(), (*version).into()))
                .collect(),
        })
    }

    fn native(libc: &str) -> RuntimeContent {
        RuntimeContent::Native {
            libc: Some(libc.into()),
        }
    }

    fn introduced(program: &str, runtimes: &[(&str, RuntimeContent)]) -> Introduction {
        let runtimes = runtimes.iter().cloned();
        Introduction {
            program: program.into(),
            version: "1".into(),
            runtimes: runtimes
                .map(|(name, content)| RuntimeInventory {
                    name: name.into(),
                    content,
                })
                .collect(),
            slots: 4,
            labels: Vec::new(),
        }
    }

    #[test]
    fn a_worker_is_like_the_server_or_is_told_why_not() {
        let numpy = || python("3.11.2", &[("numpy", "2.4.6")]);
        let like = introduced("aa", &[("native", native("2.36")), ("python3", numpy())]);
        let told = |program: &str, runtimes: &[(&str, RuntimeContent)]| {
            differs(&introduced(program, runtimes), &like)
        };
        let native_here = ("native", native("2.36"));
        let more = [
            ("julia", native("2.36")),
            ("python3", numpy()),
            native_here.clone(),
        ];
        assert_eq!(told("aa", &more), None);
        for (program, runtimes, words) in [
            (
                "bb",
                vec![native_here.clone(), ("python3", numpy())],
                "another program",
            ),
            (
                "aa",
                vec![native_here.clone()],
                "lacks runtimes that the server offers to agents: python3",
            ),
            (
                "aa",
                vec![("native", native("2.41")), ("python3", numpy())],
                "runtime native is not the server's: its C library is 2.41, the server's 2.36",
            ),
            (
                "aa",
                vec![
                    native_here.clone(),
                    ("python3", python("3.12.1", &[("numpy", "2.4.6")])),
                ],
                "it is CPython 3.12.1, the server's CPython 3.11.2",
            ),
            (
                "aa",
                vec![
                    native_here.clone(),
                    ("python3", python("3.11.2", &[("numpy", "1.26.4")])),
                ],
                "its package numpy is 1.26.4, the server's 2.4.6",
            ),
            (
                "aa",
                vec![native_here.clone(), ("python3", python("3.11.2", &[]))],
                "its package numpy is none, the server's 2.4.6",
            ),
            (
                "aa",
                vec![
                    native_here.clone(),
                    ("python3", RuntimeContent::Broken { why: "gone".into() }),
                ],
                "it does not work there: gone",
            ),
            (
                "aa",
                vec![native_here.clone(), ("python3", native("2.36"))],
                "of another kind",
            ),
        ] {
            let found = told(program, &runtimes).unwrap_or_default();
            assert!(found.contains(words), "{found:?} lacks {words:?}");
        }
        // What does not work on the server is asked of nobody else.
        let broken = introduced(
            "aa",
            &[("python3", RuntimeContent::Broken { why: "gone".into() })],
        );
        assert_eq!(
            differs(&introduced("aa", &[("python3", numpy())]), &broken),
            None
        );
    }
}
