//! What an agent finds otherwise on this machine than on a server, in words.

use faceoff_types::{AgentMachine, PythonInventory, RuntimeContent, RuntimeInventory};

/// More packages than these are counted only.
const MOST_NAMED: usize = 6;

/// Of the same runtime here and there, a sentence each.
pub(super) fn of_runtimes(here: &RuntimeInventory, there: &RuntimeInventory) -> Vec<String> {
    let name = &there.name;
    match (&here.content, &there.content) {
        (RuntimeContent::Python(here), RuntimeContent::Python(there)) => {
            of_pythons(name, here, there)
        }
        (RuntimeContent::Native { libc: here }, RuntimeContent::Native { libc: there }) => {
            of_libraries(here.as_deref(), there.as_deref())
                .into_iter()
                .collect()
        }
        (RuntimeContent::Image, RuntimeContent::Image) => Vec::new(),
        (RuntimeContent::Broken { why }, _) => {
            vec![format!("{name} does not work on this machine: {why}")]
        }
        (_, RuntimeContent::Broken { .. }) => {
            vec![format!("{name} does not work on the server at the moment")]
        }
        (_, RuntimeContent::Image) => {
            vec![format!(
                "{name} is a runtime of this machine, and of the server whatever a container image brings"
            )]
        }
        (_, RuntimeContent::Python(_)) => {
            vec![format!("{name} has a Python on the server, and none here")]
        }
        (_, RuntimeContent::Native { .. }) => {
            vec![format!(
                "{name} has no Python on the server, and has one here"
            )]
        }
    }
}

fn of_pythons(name: &str, here: &PythonInventory, there: &PythonInventory) -> Vec<String> {
    let mut found = Vec::new();
    let interpreter =
        |python: &PythonInventory| format!("{} {}", python.implementation, python.version);
    if interpreter(here) != interpreter(there) {
        let weight = if here.minor_version() == there.minor_version() {
            ""
        } else {
            ", for which compiled packages are other ones"
        };
        found.push(format!(
            "{name} is {} here and {} there{weight}",
            interpreter(here),
            interpreter(there)
        ));
    }
    found.extend(of_libraries(here.libc.as_deref(), there.libc.as_deref()));
    let only = |one: &PythonInventory, other: &PythonInventory| -> Vec<String> {
        let lacking = one.packages.iter();
        lacking
            .filter(|(name, _)| !other.packages.contains_key(*name))
            .map(|(name, version)| format!("{name} {version}"))
            .collect()
    };
    let other_versions = here.packages.iter().filter_map(|(name, version)| {
        let there = there.packages.get(name).filter(|there| *there != version)?;
        Some(format!("{name} {version} (there {there})"))
    });
    for (what, packages) in [
        (
            "packages of the server that are missing here",
            only(there, here),
        ),
        (
            "packages of this machine that the server lacks",
            only(here, there),
        ),
        ("packages of other versions here", other_versions.collect()),
    ] {
        if !packages.is_empty() {
            found.push(format!("{what}: {}", named(&packages)));
        }
    }
    found
}

fn of_libraries(here: Option<&str>, there: Option<&str>) -> Option<String> {
    let (here, there) = (here?, there?);
    (here != there).then(|| {
        format!(
            "the C library is {here} here and {there} there: a program built here may need a newer one than the \
             server has"
        )
    })
}

/// Of the machines, a sentence each.
pub(super) fn of_machines(here: &AgentMachine, there: &AgentMachine) -> Vec<String> {
    let mut found = Vec::new();
    if here.architecture != there.architecture {
        found.push(format!(
            "the machine is {} here and {} there: no compiled program of one runs on the other",
            here.architecture, there.architecture
        ));
    }
    let model = |machine: &AgentMachine| {
        machine
            .cpu_model
            .clone()
            .unwrap_or_else(|| "unknown".into())
    };
    if here.cpu_model != there.cpu_model {
        found.push(format!(
            "the CPU is {} here and {} there: computation times are other ones",
            model(here),
            model(there)
        ));
    }
    if here.cpus_per_agent != there.cpus_per_agent {
        found.push(format!(
            "an agent may run on {} CPUs here and {} there",
            here.cpus_per_agent, there.cpus_per_agent
        ));
    }
    found
}

/// The first, and how many more.
fn named(packages: &[String]) -> String {
    let (first, rest) = packages.split_at(packages.len().min(MOST_NAMED));
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
            }),
        }
    }

    #[test]
    fn the_same_is_no_difference() {
        let one = python("3.11.2", &[("numpy", "2.4.6")]);
        assert_eq!(of_runtimes(&one, &one), [""; 0]);
        let machine = AgentMachine::default();
        assert_eq!(of_machines(&machine, &machine), [""; 0]);
    }

    #[test]
    fn interpreter_and_packages_are_told_apart() {
        let here = python("3.12.1", &[("numpy", "2.0"), ("torch", "2.9")]);
        let there = python("3.11.2", &[("numpy", "2.4.6"), ("scipy", "1.17.1")]);
        let told = of_runtimes(&here, &there);
        assert_eq!(
            told,
            [
                "python3 is CPython 3.12.1 here and CPython 3.11.2 there, for which compiled packages are other ones",
                "packages of the server that are missing here: scipy 1.17.1",
                "packages of this machine that the server lacks: torch 2.9",
                "packages of other versions here: numpy 2.0 (there 2.4.6)",
            ]
        );
        let patch = of_runtimes(&python("3.11.9", &[]), &python("3.11.2", &[]));
        assert_eq!(
            patch,
            ["python3 is CPython 3.11.9 here and CPython 3.11.2 there"]
        );
        let many: Vec<(String, &str)> = (0..9).map(|n| (format!("p{n}"), "1")).collect();
        let many: Vec<(&str, &str)> = many
            .iter()
            .map(|(name, one)| (name.as_str(), *one))
            .collect();
        let told = of_runtimes(&python("3.11.2", &[]), &python("3.11.2", &many));
        assert!(told[0].ends_with("p5 1 and 3 more"), "{told:?}");
    }

    #[test]
    fn machines_differ_by_what_agents_notice() {
        let machine = |model: &str, cpus_per_agent| AgentMachine {
            architecture: "x86_64".into(),
            cpu_model: Some(model.into()),
            cpus_per_agent,
        };
        let told = of_machines(&machine("A", 1), &machine("B", 2));
        assert_eq!(told.len(), 2);
        assert!(told[0].contains("A here and B there") && told[1].contains("1 CPUs here and 2"));
        let broken = RuntimeInventory {
            name: "python3-ml".into(),
            content: RuntimeContent::Broken {
                why: "x does not exist".into(),
            },
        };
        let told = of_runtimes(&broken, &python("3.11.2", &[]));
        assert!(told[0].contains("x does not exist"), "{told:?}");
    }
}
