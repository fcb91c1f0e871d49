//! Which specimen a user means, and what bodies are made like.

use crate::cli::error::Failure;
use pao_sim::anatomy::{Specimen, phantom, read_specimen};
use pao_sim::study::Config;
use pao_sim::study::config::PopulationSection;
use std::path::PathBuf;

/// A specimen on the command line.
#[derive(Debug, clap::Args)]
pub struct Source {
    /// A specimen's folder, or phantom-N for the built-in body of that number
    #[arg(value_name = "SPECIMEN")]
    specimen: PathBuf,
    #[command(flatten)]
    bodies: Bodies,
}

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
            Some(file) => Config::read_as_named(file)?.population,
            None => PopulationSection::default(),
        })
    }
}

impl Source {
    /// Reads or makes the specimen.
    pub fn specimen(&self) -> Result<Specimen, Failure> {
        let population = self.bodies.population()?;
        let number = self.specimen.to_str().and_then(|name| {
            let number = name.strip_prefix("phantom-")?;
            number.parse().ok().filter(|number| *number > 0)
        });
        Ok(match number {
            Some(number) => phantom(number, &population.phantom),
            None => read_specimen(&self.specimen)?,
        })
    }
}
