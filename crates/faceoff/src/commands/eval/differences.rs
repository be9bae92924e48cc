//! Differences between this machine (“locally”) and a server that an agent may notice.

use faceoff_types::{AgentMachine, PythonInventory, RuntimeContent, RuntimeInventory};

/// Number of packages that a sentence names; further ones are only counted.
const MAX_NAMED_PACKAGES: usize = 6;

/// Compares a runtime of this machine with the server's; one sentence per difference.
pub(super) fn compare_runtimes(local: &RuntimeInventory, server: &RuntimeInventory) -> Vec<String> {
    let name = &server.name;
    match (&local.content, &server.content) {
        (RuntimeContent::Python(local), RuntimeContent::Python(server)) => {
            compare_pythons(name, local, server)
        }
        (RuntimeContent::Native { libc: local }, RuntimeContent::Native { libc: server }) => {
            compare_c_libraries(local.as_deref(), server.as_deref())
                .into_iter()
                .collect()
        }
        (RuntimeContent::Image, RuntimeContent::Image) => Vec::new(),
        (RuntimeContent::Failed { reason }, _) => {
            vec![format!("{name} does not work on this machine: {reason}")]
        }
        (_, RuntimeContent::Failed { .. }) => {
            vec![format!("{name} does not work on the server at the moment")]
        }
        (_, RuntimeContent::Image) => {
            vec![format!(
                "{name} is a runtime of this machine, but a container image on the server"
            )]
        }
        (_, RuntimeContent::Python(_)) => {
            vec![format!("{name} has Python on the server, but not locally")]
        }
        (_, RuntimeContent::Native { .. }) => {
            vec![format!("{name} has Python locally, but not on the server")]
        }
    }
}

fn compare_pythons(name: &str, local: &PythonInventory, server: &PythonInventory) -> Vec<String> {
    let mut found = Vec::new();
    let interpreter =
        |python: &PythonInventory| format!("{} {}", python.implementation, python.version);
    if interpreter(local) != interpreter(server) {
        let effect = if local.minor_version() == server.minor_version() {
            ""
        } else {
            ", so compiled packages differ"
        };
        found.push(format!(
            "{name} is {} locally and {} on the server{effect}",
            interpreter(local),
            interpreter(server)
        ));
    }
    found.extend(compare_c_libraries(
        local.libc.as_deref(),
        server.libc.as_deref(),
    ));
    let only_in = |one: &PythonInventory, other: &PythonInventory| -> Vec<String> {
        let packages = one.packages.iter();
        packages
            .filter(|(name, _)| !other.packages.contains_key(*name))
            .map(|(name, version)| format!("{name} {version}"))
            .collect()
    };
    let other_versions = local.packages.iter().filter_map(|(name, version)| {
        let server = server
            .packages
            .get(name)
            .filter(|server| *server != version)?;
        Some(format!("{name} {version} (server: {server})"))
    });
    for (heading, packages) in [
        ("packages missing locally", only_in(server, local)),
        ("packages missing on the server", only_in(local, server)),
        (
            "packages with other versions locally",
            other_versions.collect(),
        ),
    ] {
        if !packages.is_empty() {
            found.push(format!("{heading}: {}", package_list(&packages)));
        }
    }
    found
}

fn compare_c_libraries(local: Option<&str>, server: Option<&str>) -> Option<String> {
    let (local, server) = (local?, server?);
    (local != server).then(|| {
        format!(
            "the C library is {local} locally and {server} on the server: a program built locally may need a newer version \
            than the server's"
        )
    })
}

/// Compares this machine with the server's; one sentence per difference.
pub(super) fn compare_machines(local: &AgentMachine, server: &AgentMachine) -> Vec<String> {
    let mut found = Vec::new();
    if local.architecture != server.architecture {
        found.push(format!(
            "the architecture is {} locally and {} on the server: compiled programs do not run on both",
            local.architecture, server.architecture
        ));
    }
    let model = |machine: &AgentMachine| {
        machine
            .cpu_model
            .clone()
            .unwrap_or_else(|| "unknown".into())
    };
    if local.cpu_model != server.cpu_model {
        found.push(format!(
            "the CPU is {} locally and {} on the server: computation times differ",
            model(local),
            model(server)
        ));
    }
    if local.cpus_per_agent != server.cpus_per_agent {
        found.push(format!(
            "an agent may use {} CPUs locally and {} on the server",
            local.cpus_per_agent, server.cpus_per_agent
        ));
    }
    found
}

/// The first packages, and the number of the others.
fn package_list(packages: &[String]) -> String {
    let (first, rest) = packages.split_at(packages.len().min(MAX_NAMED_PACKAGES));
    match rest.len() {
        0 => first.join(", "),
        more => format!("{} and {more} more", first.join(", ")),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn python(version: &str, packages: &[(&str, &str)]) -> RuntimeInventory {
        let packages = packages
            .iter()
            .map(|(name, version)| (name.to_string(), version.to_string()));
        RuntimeInventory {
            name: "python3".into(),
            content: RuntimeContent::Python(PythonInventory {
                implementation: "CPython".into(),
                version: version.into(),
                libc: Some("2.36".into()),
                packages: packages.collect(),
                unusable_packages: std::collections::BTreeMap::new(),
            }),
        }
    }

    #[test]
    fn equal_machines_have_no_differences() {
        let one = python("3.11.2", &[("numpy", "2.4.6")]);
        assert_eq!(compare_runtimes(&one, &one), [""; 0]);
        let machine = AgentMachine::default();
        assert_eq!(compare_machines(&machine, &machine), [""; 0]);
    }

    #[test]
    fn interpreter_and_package_versions_are_compared() {
        let local = python("3.12.1", &[("numpy", "2.0"), ("torch", "2.9")]);
        let server = python("3.11.2", &[("numpy", "2.4.6"), ("scipy", "1.17.1")]);
        let found = compare_runtimes(&local, &server);
        assert_eq!(
            found,
            [
                "python3 is CPython 3.12.1 locally and CPython 3.11.2 on the server, so compiled packages differ",
                "packages missing locally: scipy 1.17.1",
                "packages missing on the server: torch 2.9",
                "packages with other versions locally: numpy 2.0 (server: 2.4.6)",
            ]
        );
        let patch = compare_runtimes(&python("3.11.9", &[]), &python("3.11.2", &[]));
        assert_eq!(
            patch,
            ["python3 is CPython 3.11.9 locally and CPython 3.11.2 on the server"]
        );
        let many: Vec<(String, &str)> = (0..9).map(|n| (format!("p{n}"), "1")).collect();
        let many: Vec<(&str, &str)> = many
            .iter()
            .map(|(name, version)| (name.as_str(), *version))
            .collect();
        let found = compare_runtimes(&python("3.11.2", &[]), &python("3.11.2", &many));
        assert!(found[0].ends_with("p5 1 and 3 more"), "{found:?}");
    }

    #[test]
    fn machine_differences_are_those_agents_notice() {
        let machine = |model: &str, cpus_per_agent| AgentMachine {
            architecture: "x86_64".into(),
            cpu_model: Some(model.into()),
            cpus_per_agent,
        };
        let found = compare_machines(&machine("A", 1), &machine("B", 2));
        assert_eq!(found.len(), 2);
        assert!(
            found[0].contains("A locally and B on the server")
                && found[1].contains("1 CPUs locally and 2")
        );
        let broken = RuntimeInventory {
            name: "python3-ml".into(),
            content: RuntimeContent::Failed {
                reason: "x does not exist".into(),
            },
        };
        let found = compare_runtimes(&broken, &python("3.11.2", &[]));
        assert!(found[0].contains("x does not exist"), "{found:?}");
    }
}
