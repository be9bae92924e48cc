//! `faceoff sim export`: writes the ideal model for other programs. The *plant* is the simulated robot; the controller has its own
//! model of it.

use anyhow::{Context as _, Result, ensure};
use clap::{Args, ValueEnum};
use faceoff_sim::export;
use std::{io::Write as _, path::PathBuf};

/// Writes the ideal model of robot, table and puck for other programs.
#[derive(Debug, Args)]
pub struct ExportArgs {
    /// urdf: the arm. mjcf: arm, table and puck. python: a module with the model's numbers. svg: a drawing.
    #[arg(long)]
    format: Format,
    /// plant: the simulated robot, with universal joint and mallet. controller: seven joints, no mallet.
    #[arg(long, default_value = "plant")]
    model: Model,
    /// File to write [default: standard output].
    #[arg(long)]
    out: Option<PathBuf>,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
enum Format {
    Urdf,
    Mjcf,
    Python,
    Svg,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
enum Model {
    Plant,
    Controller,
}

impl ExportArgs {
    /// Writes the model.
    pub fn run(&self) -> Result<()> {
        let model = match self.model {
            Model::Plant => export::ExportedModel::Plant,
            Model::Controller => export::ExportedModel::Controller,
        };
        ensure!(
            self.model == Model::Plant || matches!(self.format, Format::Urdf | Format::Mjcf),
            "--model controller: expected --format urdf or mjcf; the other formats contain both models"
        );
        let text = match self.format {
            Format::Urdf => export::urdf(model),
            Format::Mjcf => export::mjcf(model),
            Format::Python => export::python(),
            Format::Svg => export::drawing(),
        };
        match &self.out {
            Some(path) => std::fs::write(path, text)
                .with_context(|| format!("--out {}: the file cannot be written", path.display())),
            None => std::io::stdout()
                .write_all(text.as_bytes())
                .context("standard output"),
        }
    }
}
