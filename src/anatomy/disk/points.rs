//! `landmarks.csv` and `rims.csv`.

use crate::anatomy::{Found, Landmark, Landmarks, Provenance, Rim, Side};
use crate::geometry::Point;
use serde::{Deserialize, Serialize, de::DeserializeOwned};
use std::collections::BTreeMap;

const FRAME_COMMENT: &str =
    "# World of ct.nii.gz: LPS (x to the patient's left, y posterior, z superior), mm.\n";

#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct LandmarkRow {
    name: String,
    x_lps_mm: f64,
    y_lps_mm: f64,
    z_lps_mm: f64,
    /// Files of before this column leave it and the next out.
    #[serde(default)]
    found: Option<Found>,
    #[serde(default)]
    uncertainty_mm: Option<f64>,
}

#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct RimRow {
    side: Side,
    x_lps_mm: f64,
    y_lps_mm: f64,
    z_lps_mm: f64,
    /// Files of before this column leave it and the next out.
    #[serde(default)]
    found: Option<Found>,
    #[serde(default)]
    uncertainty_mm: Option<f64>,
}

/// Every row that parses, and a line for each that does not. A row may end before the optional columns, as
/// one does that a person adds; a longer one is refused, for it may hold decimal commas.
fn rows<T: DeserializeOwned>(text: &str) -> (Vec<(u64, T)>, Vec<String>) {
    let mut reader = csv::ReaderBuilder::new()
        .comment(Some(b'#'))
        .flexible(true)
        .trim(csv::Trim::All)
        .from_reader(text.as_bytes());
    let (mut good, mut bad) = (Vec::new(), Vec::new());
    let headers = match reader.headers() {
        Ok(headers) => headers.clone(),
        Err(error) => return (good, vec![error.to_string()]),
    };
    for record in reader.records() {
        if let Ok(record) = &record
            && record.len() > headers.len()
        {
            bad.push(format!(
                "line {}: {} cells under {} columns",
                record.position().map_or(0, |p| p.line()),
                record.len(),
                headers.len()
            ));
            continue;
        }
        match record.and_then(|r| {
            let line = r.position().map_or(0, |p| p.line());
            r.deserialize(Some(&headers)).map(|row| (line, row))
        }) {
            Ok(row) => good.push(row),
            Err(error) => bad.push(error.to_string()),
        }
    }
    (good, bad)
}

fn text<T: Serialize>(rows: impl Iterator<Item = T>) -> String {
    let mut writer = csv::Writer::from_writer(FRAME_COMMENT.as_bytes().to_vec());
    for row in rows {
        writer
            .serialize(row)
            .expect("plain rows can be written to memory");
    }
    let bytes = writer.into_inner().expect("memory can be flushed");
    String::from_utf8(bytes).expect("the rows are UTF-8")
}

pub(super) fn landmarks_text(landmarks: &Landmarks) -> String {
    text(landmarks.iter().map(|(landmark, side, p)| {
        let from = landmarks.provenance(landmark, side).unwrap_or_default();
        LandmarkRow {
            name: landmark.key(side),
            x_lps_mm: p.x,
            y_lps_mm: p.y,
            z_lps_mm: p.z,
            found: from.found,
            uncertainty_mm: from.uncertainty_mm,
        }
    }))
}

pub(super) fn parse_landmarks(text: &str) -> (Landmarks, Vec<String>) {
    let known: BTreeMap<String, (Landmark, Side)> = Landmark::ALL
        .into_iter()
        .flat_map(|l| Side::BOTH.map(|s| (l.key(s), (l, s))))
        .collect();
    let (rows, mut bad) = rows::<LandmarkRow>(text);
    let mut landmarks = Landmarks::default();
    for (line, row) in rows {
        let Some(&(landmark, side)) = known.get(&row.name) else {
            let closest = known
                .keys()
                .min_by_key(|key| strsim::damerau_levenshtein(key, &row.name))
                .expect("there are landmarks");
            bad.push(format!(
                "line {line}: '{}' is no landmark; is {closest} meant?",
                row.name
            ));
            continue;
        };
        if landmarks.get(landmark, side).is_some() {
            bad.push(format!("line {line}: {} is there twice", row.name));
        }
        let from = provenance(line, row.found, row.uncertainty_mm, &mut bad);
        let point = Point::new(row.x_lps_mm, row.y_lps_mm, row.z_lps_mm);
        landmarks.set_with(landmark, side, point, from);
    }
    (landmarks, bad)
}

/// A row's provenance; an uncertainty that is none is named in `bad`.
fn provenance(
    line: u64,
    found: Option<Found>,
    uncertainty_mm: Option<f64>,
    bad: &mut Vec<String>,
) -> Provenance {
    if let Some(mm) = uncertainty_mm.filter(|mm| !(mm.is_finite() && *mm >= 0.0)) {
        bad.push(format!(
            "line {line}: uncertainty_mm is {mm}; expected a length in mm, or nothing where it is not known"
        ));
    }
    Provenance {
        found,
        uncertainty_mm,
    }
}

pub(super) fn rims_text(rims: &[Rim; 2]) -> String {
    text(Side::BOTH.into_iter().flat_map(|side| {
        let rim = &rims[side.index()];
        rim.iter().map(move |p| RimRow {
            side,
            x_lps_mm: p.x,
            y_lps_mm: p.y,
            z_lps_mm: p.z,
            found: rim.provenance.found,
            uncertainty_mm: rim.provenance.uncertainty_mm,
        })
    }))
}

/// A rim is as its first row says: detected, given or picked as a whole.
pub(super) fn parse_rims(text: &str) -> ([Rim; 2], Vec<String>) {
    let (rows, mut bad) = rows::<RimRow>(text);
    let mut rims = [Rim::default(), Rim::default()];
    for (line, row) in rows {
        let rim = &mut rims[row.side.index()];
        let from = provenance(line, row.found, row.uncertainty_mm, &mut bad);
        if rim.is_empty() {
            rim.provenance = from;
        }
        rim.push(Point::new(row.x_lps_mm, row.y_lps_mm, row.z_lps_mm));
    }
    (rims, bad)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn points_survive_to_the_last_bit() {
        let mut landmarks = Landmarks::default();
        landmarks.set(
            Landmark::Mof,
            Side::Right,
            Point::new(-1.0 / 3.0, 1e-17, 1e9 + 0.1),
        );
        let (left, point) = (Side::Left, Point::new(1.0, 2.0, 3.0));
        landmarks.set_with(Landmark::Gsn, left, point, Provenance::detected(0.1 + 0.2));
        landmarks.set_with(Landmark::Iof, left, point, Provenance::default());
        let written = landmarks_text(&landmarks);
        assert!(
            written.starts_with("# World of ct.nii.gz: LPS"),
            "{written}"
        );
        assert_eq!(parse_landmarks(&written), (landmarks, vec![]));
        let rims = [
            Rim::new(
                vec![Point::new(0.1, 0.2, 0.3), Point::new(4.0, 5.0, 6.0)],
                Provenance::detected(1.0 / 3.0),
            ),
            vec![Point::new(-7.0, 8.0, 9.0)].into(),
        ];
        assert_eq!(parse_rims(&rims_text(&rims)), (rims, vec![]));
    }

    #[test]
    fn every_bad_row_is_named() {
        let text =
            "name,x_lps_mm,y_lps_mm,z_lps_mm\nASIS_1,1,2,3\nFH_l,1,2,3\nFH_l,1,x,3\nFH_l,1,2,3\n";
        let (landmarks, bad) = parse_landmarks(text);
        assert!(landmarks.get(Landmark::Fh, Side::Left).is_some());
        assert_eq!(bad.len(), 3, "{bad:?}");
        assert!(bad[0].contains("line: 4"), "{bad:?}");
        assert!(
            bad[1].contains("'ASIS_1' is no landmark; is ASIS_l meant?"),
            "{bad:?}"
        );
        assert!(bad[2].contains("line 5: FH_l is there twice"), "{bad:?}");
        let (_, bad) = parse_rims("side,x_lps_mm,y_lps_mm,z_lps_mm\nmiddle,1,2,3\n");
        assert!(bad[0].contains("middle"), "{bad:?}");
        // Columns of another frame are not taken for LPS.
        assert!(!parse_landmarks("name,x,y,z\nFH_l,1,2,3\n").1.is_empty());
    }
    #[test]
    fn files_without_provenance_are_read_and_nonsense_in_it_is_named() {
        let row = "name,x_lps_mm,y_lps_mm,z_lps_mm\nFH_l,1,2,3\n";
        let (landmarks, bad) = parse_landmarks(row);
        assert!(bad.is_empty(), "{bad:?}");
        let from = landmarks.provenance(Landmark::Fh, Side::Left);
        assert_eq!(from, Some(Provenance::default()));
        let (rims, bad) = parse_rims("side,x_lps_mm,y_lps_mm,z_lps_mm\nleft,1,2,3\n");
        assert!(bad.is_empty(), "{bad:?}");
        assert_eq!(rims[0].provenance, Provenance::default());
        let head = "name,x_lps_mm,y_lps_mm,z_lps_mm,found,uncertainty_mm\n";
        let (landmarks, bad) = parse_landmarks(&format!("{head}FH_l,1,2,3,picked,\n"));
        assert!(bad.is_empty(), "{bad:?}");
        let from = landmarks.provenance(Landmark::Fh, Side::Left).unwrap();
        assert_eq!(
            (from.found, from.uncertainty_mm),
            (Some(Found::Picked), None)
        );
        let (landmarks, bad) = parse_landmarks(&format!("{head}FH_l,1,2,3\nFH_r,1,2,3,given\n"));
        assert!(bad.is_empty(), "{bad:?}");
        let from = landmarks.provenance(Landmark::Fh, Side::Right);
        assert_eq!(from, Some(Provenance::GIVEN));
        let (_, bad) = parse_landmarks(&format!("{head}FH_l,1,5,2,5,3,5\nFH_r,1,2\n"));
        assert!(
            bad[0].contains("line 2: 7 cells under 6 columns"),
            "{bad:?}"
        );
        assert!(bad[1].contains("line: 3"), "{bad:?}");
        for (cells, part) in [
            ("guessed,1", "guessed"),
            ("given,-1", "uncertainty_mm is -1"),
        ] {
            let (_, bad) = parse_landmarks(&format!("{head}FH_l,1,2,3,{cells}\n"));
            assert!(bad.join("").contains(part), "{cells}: {bad:?}");
        }
    }
}
