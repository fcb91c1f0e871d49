//! What people know about a CT and its voxels do not say.

/// What people know about a CT and its voxels do not say.
#[derive(Clone, Debug, PartialEq)]
pub struct CtOrigin {
    /// The importer: `totalseg`, `labels`, `deepfluoro` or `vsd`.
    pub kind: &'static str,
    /// The specimen's name: letters, digits and `-`.
    pub name: String,
    /// `male`, `female` or `unknown`.
    pub sex: String,
    /// Licence of the CT.
    pub licence: String,
    /// Where CT and segmentation come from, for people.
    pub from: String,
}
