//! `pao-sim specimen show`: pictures of a specimen.

use super::source::Source;
use crate::cli::args::Common;
use crate::cli::error::{Exit, Failure};
use crate::cli::output::say;
use pao_sim::anatomy::{Hip, Side};
use pao_sim::report::specimen::{HipPlan, Painting, ap_radiograph, hip_picture};
use pao_sim::surgery::{
    CutPlanes, FragmentParameters, NominalCutParameters, SurgeryMap, cut_fragment, nominal_cuts,
};
use pao_sim::xray::AttenuationParameters;
use std::path::PathBuf;
use std::sync::Arc;

/// Draw a specimen: its AP radiograph with landmarks and rims, and for each hip slices and surfaces with
/// the planned cuts and their fragment.
#[derive(Debug, clap::Args)]
pub struct Arguments {
    #[command(flatten)]
    source: Source,
    /// Folder for the pictures; pictures of an earlier call are replaced
    #[arg(long, value_name = "DIR")]
    out: PathBuf,
}

pub fn main(arguments: &Arguments, _common: &Common) -> Result<Exit, Failure> {
    let specimen = Arc::new(arguments.source.specimen()?);
    let ap = ap_radiograph(&specimen, &AttenuationParameters::default());
    let mut pictures = vec![("ap.png".to_owned(), ap)];
    for side in Side::BOTH {
        let hip = Hip::new(specimen.clone(), side).map_err(|cause| refused(side, cause))?;
        pictures.push((format!("{side}_hip.png"), picture(&hip)));
    }
    // All or nothing: no picture of this specimen beside one of another.
    let folder = &arguments.out;
    std::fs::create_dir_all(folder).map_err(|cause| Failure::Io {
        action: format!("create {}", folder.display()),
        cause,
    })?;
    for (name, picture) in pictures {
        let path = folder.join(name);
        picture.write(&path)?;
        say!("{}", path.display());
    }
    Ok(Exit::Complete)
}

fn picture(hip: &Hip) -> Painting {
    match plan(hip) {
        Ok((cuts, map)) => {
            let plan = HipPlan {
                cuts: &cuts,
                map: &map,
            };
            hip_picture(hip, Some(plan))
        }
        Err(reason) => {
            eprintln!("{}: drawn without cuts: {reason}", hip.key());
            hip_picture(hip, None)
        }
    }
}

/// The planned cuts of a hip and what they come to.
pub fn plan(hip: &Hip) -> Result<(CutPlanes, SurgeryMap), String> {
    let cuts = nominal_cuts(hip, &NominalCutParameters::default()).map_err(|e| e.to_string())?;
    let map = cut_fragment(hip, &cuts, &FragmentParameters::default());
    Ok((cuts, map.map_err(|e| e.to_string())?))
}

fn refused(side: Side, cause: impl std::fmt::Display) -> Failure {
    Failure::Work(pao_sim::study::Failure::new(&format!("{side} hip"), cause))
}
