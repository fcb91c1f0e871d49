//! What bodies are made like.

use crate::cli::error::Failure;
use pao_sim::study::Config;
use pao_sim::study::config::PopulationSection;
use std::path::PathBuf;

/// What bodies are made like.
#[derive(Debug, clap::Args)]
pub struct Bodies {
    /// Make bodies as this study configuration says ([population.phantom] and
    /// [population.surface_bodies]); without it, as an empty one does
    #[arg(long, value_name = "FILE")]
    config: Option<PathBuf>,
}

impl Bodies {
    /// The configuration's population, or the default one.
    pub fn population(&self) -> Result<PopulationSection, Failure> {
        Ok(match &self.config {
            Some(file) => Config::read(file)?.population,
            None => PopulationSection::default(),
        })
    }
}
