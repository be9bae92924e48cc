//! The sandbox of agents on this host: which of its layers the host has, and a copy of the runtimes' files in memory.

use anyhow::bail;
use faceoff_sandbox::{Layer, LayerProbe, MemoryImage, Runtime};
use std::collections::BTreeMap;

/// Refuses a host that lacks a *layer* (one protection) of the sandbox which the configuration does not give up,
/// that is, disable.
pub fn check_sandbox(probes: &[LayerProbe], given_up: &[Layer]) -> anyhow::Result<()> {
    let mut missing = Vec::new();
    for probe in probes.iter().filter(|probe| !probe.available) {
        if given_up.contains(&probe.layer) {
            tracing::warn!(layer = ?probe.layer, found = probe.found, "sandbox layer given up by configuration");
        } else {
            let fix = probe.fix.as_deref().unwrap_or("not known for this host");
            missing.push(format!(
                "{}: {}\n    fix: {fix}",
                layer_name(probe.layer),
                probe.found
            ));
        }
    }
    if missing.is_empty() {
        return Ok(());
    }
    bail!(
        "this host cannot isolate agents sufficiently:\n  {}\n\
        Run `faceoff doctor` for details. To run without a layer, at your own risk, name it in the \
        configuration: [sandbox] given_up = [\"…\"]",
        missing.join("\n  ")
    )
}

/// Copies the runtimes' files to memory for agents, if they fit. Returns the guard of the copy.
pub fn copy_to_memory(
    runtimes: &mut BTreeMap<String, Runtime>,
    limit_bytes: u64,
) -> Option<MemoryImage> {
    faceoff_sandbox::remove_remains_of_dead_services();
    match MemoryImage::make(runtimes, limit_bytes) {
        Ok(image) => {
            tracing::info!(bytes = image.bytes, folder = %image.folder().display(), "runtime files are held in memory");
            Some(image)
        }
        Err(error) => {
            tracing::warn!(
                %error,
                "runtime files are not held in memory, so agents can exchange information through the timing of file \
                accesses; offer smaller runtimes or raise sandbox.resident_bytes"
            );
            None
        }
    }
}

/// The name of a layer in the configuration.
fn layer_name(layer: Layer) -> String {
    serde_json::to_value(layer)
        .ok()
        .and_then(|value| value.as_str().map(str::to_owned))
        .unwrap_or_else(|| format!("{layer:?}"))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn feature(layer: Layer, available: bool) -> LayerProbe {
        LayerProbe {
            layer,
            available,
            found: "no memory controller".into(),
            fix: Some("enable it".into()),
        }
    }

    #[test]
    fn missing_layer_stops_the_start_unless_given_up() {
        let features = [
            feature(Layer::Seccomp, true),
            feature(Layer::CgroupMemory, false),
        ];
        let error = check_sandbox(&features, &[]).unwrap_err().to_string();
        for part in [
            "cgroup-memory",
            "no memory controller",
            "enable it",
            "faceoff doctor",
            "given_up",
        ] {
            assert!(error.contains(part), "{part} is not in: {error}");
        }
        assert!(!error.contains("seccomp"));
        assert!(check_sandbox(&features, &[Layer::Seccomp]).is_err());
        check_sandbox(&features, &[Layer::CgroupMemory]).unwrap();
    }
}
