//! Text output of `faceoff doctor`. A *layer* is one protection of the sandbox, which the configuration may *give up*; a *fix*
//! says how to solve a problem.

use super::{Findings, LayerReport};
use faceoff_sandbox::LayerProbe;
use std::io::Write;

impl LayerReport {
    const fn status(&self) -> &'static str {
        match (self.probe.available, self.given_up) {
            (_, true) => "given up",
            (true, false) => "ok",
            (false, false) => "MISSING",
        }
    }
}

impl Findings {
    pub(super) fn print(&self, out: &mut impl Write) -> std::io::Result<()> {
        writeln!(out, "Sandbox")?;
        let mut layers = self.layers.iter().peekable();
        while let Some(layer) = layers.next() {
            let LayerProbe {
                layer: name,
                found,
                fix,
                ..
            } = &layer.probe;
            writeln!(out, "  {:<9} {:<14} {found}", layer.status(), name.as_str())?;
            // A fix of several layers in a row is printed once, below the last.
            if layers.peek().is_none_or(|next| next.probe.fix != *fix) {
                print_fix(out, fix.as_deref())?;
            }
        }
        writeln!(out, "Runtimes")?;
        for runtime in &self.runtimes {
            let status = if runtime.available { "ok" } else { "none" };
            writeln!(out, "  {status:<9} {:<14} {}", runtime.name, runtime.found)?;
            print_fix(out, runtime.fix.as_deref())?;
            for link in &runtime.hidden_targets {
                writeln!(out, "  {:<9}    links out: {link}", "")?;
            }
        }
        let memory = &self.in_memory;
        let status = if memory.available { "ok" } else { "none" };
        writeln!(out, "  {status:<9} {:<14} {}", "in memory", memory.found)?;
        print_fix(out, memory.fix.as_deref())?;
        let cpus = &self.cpus;
        writeln!(out, "CPUs")?;
        let bound = match cpus.agent_cpus.as_slice() {
            [] if cpus.usable >= 2 * cpus.slots => "separate CPUs for each slot".to_owned(),
            [] => "all CPUs of the server".to_owned(),
            list => format!("CPUs {list:?}"),
        };
        writeln!(
            out,
            "  {} usable, {} worker slot(s), agents on: {bound}",
            cpus.usable, cpus.slots
        )?;
        print_fix(out, cpus.advice.as_deref())?;
        writeln!(out, "Descriptors")?;
        writeln!(out, "  {}", self.descriptors.found)?;
        print_fix(out, self.descriptors.fix.as_deref())?;
        writeln!(out, "Disks")?;
        for disk in &self.disks {
            writeln!(out, "  {}: {}", disk.folder.display(), disk.found)?;
            print_fix(out, disk.fix.as_deref())?;
        }
        writeln!(out, "Host")?;
        for checked in &self.host {
            writeln!(out, "  {}: {}", checked.name, checked.found)?;
            print_fix(out, checked.fix.as_deref())?;
        }
        if !self.nats.is_empty() {
            writeln!(out, "Remote worker")?;
        }
        for checked in &self.nats {
            writeln!(out, "  {}: {}", checked.name, checked.found)?;
            print_fix(out, checked.fix.as_deref())?;
        }
        Ok(())
    }
}

fn print_fix(out: &mut impl Write, fix: Option<&str>) -> std::io::Result<()> {
    match fix {
        Some(fix) => writeln!(out, "  {:<9} -> {fix}", ""),
        None => Ok(()),
    }
}
