//! Files that `faceoff new` writes: paths in the new folder, and texts with the placeholders `{{name}}`, `{{task}}` and
//! `{{version}}`.

use super::example::Example;

type Files = Vec<(&'static str, &'static str)>;

macro_rules! template {
    ($path:literal) => {
        include_str!(concat!(
            env!("CARGO_MANIFEST_DIR"),
            "/templates/new/",
            $path
        ))
    };
}

/// A source file of another crate, included unchanged.
macro_rules! crate_source {
    ($path:literal) => {
        include_str!(concat!(env!("CARGO_MANIFEST_DIR"), "/../", $path))
    };
}

/// The script that builds the runtime `python3-ml`, and its files.
pub fn machine_learning_runtime() -> [(String, String); 3] {
    [
        (
            "runtime-python3-ml/runtime.sh",
            crate_source!("../docker/runtime.sh"),
        ),
        (
            "runtime-python3-ml/python3-ml/requirements.txt",
            crate_source!("../docker/python3-ml/requirements.txt"),
        ),
        (
            "runtime-python3-ml/python3-ml/faceoff_threads.py",
            crate_source!("../docker/python3-ml/faceoff_threads.py"),
        ),
    ]
    .map(|(path, text)| (path.to_owned(), text.to_owned()))
}

pub fn python(example: Example) -> Files {
    let agent = match example {
        Example::Defender => template!("python/defender.py"),
        Example::Hitter => template!("python/hitter.py"),
    };
    vec![
        ("README.md", template!("python/README.md")),
        ("agent.toml", template!("python/agent.toml")),
        ("agent.py", agent),
        ("mallet.py", template!("python/mallet.py")),
        ("puck.py", template!("python/puck.py")),
        ("test_agent.py", template!("python/test_agent.py")),
        (
            "protocol.py",
            crate_source!("faceoff-py/python/faceoff/agent.py"),
        ),
        (
            "kinematics.py",
            crate_source!("faceoff-py/python/faceoff/kinematics/plain.py"),
        ),
    ]
}

/// A crate and its bundle folder.
pub fn rust(example: Example) -> Files {
    let policy = match example {
        Example::Defender => template!("rust/src/defender.rs"),
        Example::Hitter => template!("rust/src/hitter.rs"),
    };
    vec![
        ("README.md", template!("rust/README.md")),
        ("Cargo.toml", template!("rust/Cargo.toml.txt")),
        (".gitignore", template!("rust/gitignore.txt")),
        ("pack.sh", template!("rust/pack.sh")),
        ("bundle/agent.toml", template!("rust/agent.toml")),
        ("src/main.rs", template!("rust/src/main.rs")),
        ("src/policy.rs", policy),
        ("src/mallet.rs", template!("rust/src/mallet.rs")),
        ("src/puck.rs", template!("rust/src/puck.rs")),
        ("src/tests.rs", template!("rust/src/tests.rs")),
        (
            "faceoff-agent/Cargo.toml",
            template!("rust/faceoff-agent.toml.txt"),
        ),
        (
            "faceoff-agent/src/lib.rs",
            crate_source!("faceoff-agent/src/lib.rs"),
        ),
        (
            "faceoff-agent/src/action.rs",
            crate_source!("faceoff-agent/src/action.rs"),
        ),
        (
            "faceoff-agent/src/conversation.rs",
            crate_source!("faceoff-agent/src/conversation.rs"),
        ),
        (
            "faceoff-agent/src/env.rs",
            crate_source!("faceoff-agent/src/env.rs"),
        ),
        (
            "faceoff-agent/src/observation.rs",
            crate_source!("faceoff-agent/src/observation.rs"),
        ),
    ]
}
