//! Compatibility of workers with the server. Only the same program gives the same results to the last bit, and agents must
//! find the same runtimes on all machines.

use faceoff_types::{PythonInventory, RuntimeContent};
use faceoff_wire::remote::WorkerCapabilities;

/// The reason why a worker gets no jobs from this server; `None` if it is compatible.
pub(super) fn incompatibility(
    worker: &WorkerCapabilities,
    required: &WorkerCapabilities,
) -> Option<String> {
    if worker.program_blake3 != required.program_blake3 {
        return Some(format!(
            "the worker runs another program (version {}, BLAKE3 {}) than the server (version {}, BLAKE3 {}): only the same program \
             has the same results to the last bit; copy the server's to the worker's machine",
            worker.version, worker.program_blake3, required.version, required.program_blake3
        ));
    }
    let offered = |name: &str| worker.runtimes.iter().find(|runtime| runtime.name == name);
    let missing: Vec<&str> = required
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
    required.runtimes.iter().find_map(|runtime| {
        let difference = runtime_difference(&offered(&runtime.name)?.content, &runtime.content)?;
        Some(format!(
            "the worker's runtime {} is not the server's: {difference}; it must be the same on all machines",
            runtime.name
        ))
    })
}

/// The difference between a worker's and the server's runtime; `None` if there is none. A runtime that is broken on the
/// server is not compared.
fn runtime_difference(worker: &RuntimeContent, required: &RuntimeContent) -> Option<String> {
    let describe =
        |version: Option<&String>| version.map_or_else(|| "none".to_owned(), Clone::clone);
    let libc_difference = |worker: &Option<String>, required: &Option<String>| {
        (worker != required).then(|| {
            format!(
                "its C library is {}, the server's {}",
                describe(worker.as_ref()),
                describe(required.as_ref())
            )
        })
    };
    match (worker, required) {
        (_, RuntimeContent::Failed { .. }) | (RuntimeContent::Image, RuntimeContent::Image) => None,
        (RuntimeContent::Failed { reason }, _) => Some(format!("it does not work there: {reason}")),
        (RuntimeContent::Native { libc: worker }, RuntimeContent::Native { libc: required }) => {
            libc_difference(worker, required)
        }
        (RuntimeContent::Python(worker), RuntimeContent::Python(required)) => {
            let interpreter =
                |python: &PythonInventory| format!("{} {}", python.implementation, python.version);
            if interpreter(worker) != interpreter(required) {
                return Some(format!(
                    "it is {}, the server's {}",
                    interpreter(worker),
                    interpreter(required)
                ));
            }
            let names = worker.packages.keys().chain(required.packages.keys());
            let package = names
                .map(|name| (name, worker.packages.get(name), required.packages.get(name)))
                .find(|(_, worker, required)| worker != required);
            package.map_or_else(
                || libc_difference(&worker.libc, &required.libc),
                |(name, worker, required)| {
                    let (worker, required) = (describe(worker), describe(required));
                    Some(format!(
                        "its package {name} is {worker}, the server's {required}"
                    ))
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

    /// Hashes of the server's program and of another one.
    const SERVER_PROGRAM: &str = "aa";
    const OTHER_PROGRAM: &str = "bb";

    fn python(version: &str, packages: &[(&str, &str)]) -> RuntimeContent {
        let packages = packages.iter();
        RuntimeContent::Python(PythonInventory {
            implementation: "CPython".into(),
            version: version.into(),
            libc: Some("2.36".into()),
            packages: packages
                .map(|(name, version)| ((*name).into(), (*version).into()))
                .collect(),
            unusable_packages: std::collections::BTreeMap::new(),
        })
    }

    fn native(libc: &str) -> RuntimeContent {
        RuntimeContent::Native {
            libc: Some(libc.into()),
        }
    }

    fn capabilities(program: &str, runtimes: &[(&str, RuntimeContent)]) -> WorkerCapabilities {
        let runtimes = runtimes.iter().cloned();
        WorkerCapabilities {
            program_blake3: program.into(),
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
    fn incompatible_worker_gets_the_reason() {
        let numpy = || python("3.11.2", &[("numpy", "2.4.6")]);
        let required = capabilities(
            SERVER_PROGRAM,
            &[("native", native("2.36")), ("python3", numpy())],
        );
        let reason = |program: &str, runtimes: &[(&str, RuntimeContent)]| {
            incompatibility(&capabilities(program, runtimes), &required)
        };
        let native_runtime = ("native", native("2.36"));
        let superset = [
            ("julia", native("2.36")),
            ("python3", numpy()),
            native_runtime.clone(),
        ];
        assert_eq!(reason(SERVER_PROGRAM, &superset), None);
        for (program, runtimes, words) in [
            (
                OTHER_PROGRAM,
                vec![native_runtime.clone(), ("python3", numpy())],
                "another program",
            ),
            (
                SERVER_PROGRAM,
                vec![native_runtime.clone()],
                "lacks runtimes that the server offers to agents: python3",
            ),
            (
                SERVER_PROGRAM,
                vec![("native", native("2.41")), ("python3", numpy())],
                "runtime native is not the server's: its C library is 2.41, the server's 2.36",
            ),
            (
                SERVER_PROGRAM,
                vec![
                    native_runtime.clone(),
                    ("python3", python("3.12.1", &[("numpy", "2.4.6")])),
                ],
                "it is CPython 3.12.1, the server's CPython 3.11.2",
            ),
            (
                SERVER_PROGRAM,
                vec![
                    native_runtime.clone(),
                    ("python3", python("3.11.2", &[("numpy", "1.26.4")])),
                ],
                "its package numpy is 1.26.4, the server's 2.4.6",
            ),
            (
                SERVER_PROGRAM,
                vec![native_runtime.clone(), ("python3", python("3.11.2", &[]))],
                "its package numpy is none, the server's 2.4.6",
            ),
            (
                SERVER_PROGRAM,
                vec![
                    native_runtime.clone(),
                    (
                        "python3",
                        RuntimeContent::Failed {
                            reason: "gone".into(),
                        },
                    ),
                ],
                "it does not work there: gone",
            ),
            (
                SERVER_PROGRAM,
                vec![native_runtime.clone(), ("python3", native("2.36"))],
                "of another kind",
            ),
        ] {
            let reason = reason(program, &runtimes).unwrap_or_default();
            assert!(reason.contains(words), "{reason:?} lacks {words:?}");
        }
        // A runtime that is broken on the server is not required.
        let broken = capabilities(
            SERVER_PROGRAM,
            &[(
                "python3",
                RuntimeContent::Failed {
                    reason: "gone".into(),
                },
            )],
        );
        assert_eq!(
            incompatibility(
                &capabilities(SERVER_PROGRAM, &[("python3", numpy())]),
                &broken
            ),
            None
        );
    }
}
