//! The annotated landmarks.

use super::contents::{Named, Source};
use super::image::read_numbers;
use crate::anatomy::import::{CtImportError, Note};
use crate::anatomy::{Landmark, Landmarks, Side};
use crate::geometry::Point;

/// Reads `FH-l` and so on (LPS mm). Names that are no landmark of ours are told.
pub(super) fn read_landmarks(
    source: &Source,
    (name, group): Named,
) -> Result<(Landmarks, Vec<Note>), CtImportError> {
    let mut landmarks = Landmarks::default();
    let mut others = Vec::new();
    let mut parts = source.parts(group.datasets(), &name)?;
    parts.sort();
    for part in parts {
        let Some((landmark, side)) = known(&part) else {
            others.push(part);
            continue;
        };
        let name = format!("{name}/{part}");
        let data = source.parts(group.dataset(&part), &name)?;
        let p = read_numbers(source, &name, &data, 3)?;
        landmarks.set(landmark, side, Point::new(p[0], p[1], p[2]));
    }
    let note = || Note::Reader(format!("{name}: no use is made of {}", others.join(", ")));
    let notes = (!others.is_empty()).then(note).into_iter().collect();
    Ok((landmarks, notes))
}

/// `ASIS-l` is ours with the side behind a hyphen.
fn known(name: &str) -> Option<(Landmark, Side)> {
    let (landmark, side) = name.rsplit_once('-')?;
    let side = match side {
        "l" => Side::Left,
        "r" => Side::Right,
        _ => return None,
    };
    landmark.parse().ok().map(|landmark| (landmark, side))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_are_mapped() {
        assert_eq!(known("FH-l"), Some((Landmark::Fh, Side::Left)));
        assert_eq!(known("GSN-r"), Some((Landmark::Gsn, Side::Right)));
        assert_eq!(known("FH-m"), None);
        assert_eq!(known("L5"), None);
    }
}
