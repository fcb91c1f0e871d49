//! What the rules for cuts look at.

use super::acetabulum::{Acetabulum, AcetabulumError};
use super::posterior_column::{ColumnError, PosteriorColumn};
use crate::anatomy::Hip;

/// The parts of one hip that cuts have to respect, found once and used for every cut.
#[derive(Clone, Debug)]
pub struct OsteotomySite {
    pub acetabulum: Acetabulum,
    pub column: PosteriorColumn,
}

/// Why a hip's parts are not found.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum SiteError {
    #[error(transparent)]
    Acetabulum(#[from] AcetabulumError),
    #[error(transparent)]
    Column(#[from] ColumnError),
}

impl OsteotomySite {
    /// Finds them on the label map and the rim's trace, in about 0.1 s.
    ///
    /// # Errors
    /// When the rim is missing, or the bone is not what the rules expect.
    pub fn of(hip: &Hip) -> Result<Self, SiteError> {
        let acetabulum = Acetabulum::of(hip)?;
        let column = PosteriorColumn::of(hip, &acetabulum)?;
        Ok(Self { acetabulum, column })
    }
}
