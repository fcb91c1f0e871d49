//! `landmarks.csv` and `rims.csv`.

use crate::anatomy::{Landmark, Landmarks, Side};
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
}

#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct RimRow {
    side: Side,
    x_lps_mm: f64,
    y_lps_mm: f64,
    z_lps_mm: f64,
}

/// Every row that parses, and a line for each that does not.
fn rows<T: DeserializeOwned>(text: &str) -> (Vec<(u64, T)>, Vec<String>) {
    let mut reader = csv::ReaderBuilder::new()
        .comment(Some(b'#'))
        .trim(csv::Trim::All)
        .from_reader(text.as_bytes());
    let (mut good, mut bad) = (Vec::new(), Vec::new());
    let headers = match reader.headers() {
        Ok(headers) => headers.clone(),
        Err(error) => return (good, vec![error.to_string()]),
    };
    for record in reader.records() {
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
    text(landmarks.iter().map(|(landmark, side, p)| LandmarkRow {
        name: landmark.key(side),
        x_lps_mm: p.x,
        y_lps_mm: p.y,
        z_lps_mm: p.z,
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
        landmarks.set(
            landmark,
            side,
            Point::new(row.x_lps_mm, row.y_lps_mm, row.z_lps_mm),
        );
    }
    (landmarks, bad)
}

pub(super) fn rims_text(rims: &[Vec<Point>; 2]) -> String {
    text(Side::BOTH.into_iter().flat_map(|side| {
        rims[side.index()].iter().map(move |p| RimRow {
            side,
            x_lps_mm: p.x,
            y_lps_mm: p.y,
            z_lps_mm: p.z,
        })
    }))
}

pub(super) fn parse_rims(text: &str) -> ([Vec<Point>; 2], Vec<String>) {
    let (rows, bad) = rows::<RimRow>(text);
    let mut rims = [Vec::new(), Vec::new()];
    for (_, row) in rows {
        rims[row.side.index()].push(Point::new(row.x_lps_mm, row.y_lps_mm, row.z_lps_mm));
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
        let written = landmarks_text(&landmarks);
        assert!(
            written.starts_with("# World of ct.nii.gz: LPS"),
            "{written}"
        );
        assert_eq!(parse_landmarks(&written), (landmarks, vec![]));
        let rims = [
            vec![Point::new(0.1, 0.2, 0.3), Point::new(4.0, 5.0, 6.0)],
            vec![Point::new(-7.0, 8.0, 9.0)],
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
}
