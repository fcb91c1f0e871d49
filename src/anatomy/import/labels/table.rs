//! The table of a label map: which value is which bone.

use crate::anatomy::import::{CtImportError, LabelMeaning};
use crate::volume::nrrd_segment_names;
use std::collections::BTreeMap;
use std::io::Read;
use std::path::Path;

/// No table is longer (bytes).
const MOST_BYTES: u64 = 1 << 20;

/// What the values of a label map stand for. Several values may be parts of one bone; values that
/// are not here are no bone of interest.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct LabelTable {
    meanings: BTreeMap<u8, LabelMeaning>,
}

impl LabelTable {
    /// A table of (value, meaning).
    ///
    /// # Errors
    /// With what contradicts what: a value twice, 0, a bone that two meanings claim, a bone that none
    /// claims.
    pub fn new(entries: impl IntoIterator<Item = (u8, LabelMeaning)>) -> Result<Self, String> {
        let mut meanings: BTreeMap<u8, LabelMeaning> = BTreeMap::new();
        for (value, meaning) in entries {
            if value == 0 {
                return Err(format!("0 is the background, not {}", meaning.name()));
            }
            if let Some(before) = meanings.insert(value, meaning)
                && before != meaning
            {
                return Err(format!(
                    "{value} is {} and {}; expected one",
                    before.name(),
                    meaning.name()
                ));
            }
        }
        let table = Self { meanings };
        table.check()?;
        Ok(table)
    }

    /// Each bone is claimed in one way.
    fn check(&self) -> Result<(), String> {
        let groups = |meaning: LabelMeaning| -> &'static [&'static str] {
            match meaning {
                LabelMeaning::Femora => &["femur_left", "femur_right"],
                LabelMeaning::Hips => &["hip_left", "hip_right"],
                LabelMeaning::Pelvis => &["hip_left", "hip_right", "sacrum"],
                LabelMeaning::One(structure) => match structure.name() {
                    "sacrum" => &["sacrum"],
                    "hip_left" => &["hip_left"],
                    "hip_right" => &["hip_right"],
                    "femur_left" => &["femur_left"],
                    _ => &["femur_right"],
                },
            }
        };
        let mut claims: BTreeMap<&str, LabelMeaning> = BTreeMap::new();
        for &meaning in self.meanings.values() {
            for bone in groups(meaning) {
                if let Some(before) = claims.insert(bone, meaning)
                    && before != meaning
                {
                    return Err(format!(
                        "{bone} belongs to {} and to {}; name it once",
                        before.name(),
                        meaning.name()
                    ));
                }
            }
        }
        let missing: Vec<&str> = groups(LabelMeaning::Pelvis)
            .iter()
            .chain(groups(LabelMeaning::Femora))
            .copied()
            .filter(|bone| !claims.contains_key(bone))
            .collect();
        match missing.as_slice() {
            [] => Ok(()),
            bones => Err(format!(
                "no value is {}; expected all of sacrum, hip_left, hip_right, femur_left and \
                 femur_right, or hips, pelvis and femora for several at once",
                bones.join(" or ")
            )),
        }
    }

    /// (value, meaning) in rising order.
    pub fn iter(&self) -> impl Iterator<Item = (u8, LabelMeaning)> + '_ {
        self.meanings.iter().map(|(&v, &m)| (v, m))
    }
}

/// Reads a table: CSV with the columns `value,structure`, a colour table of 3D Slicer (`.ctbl`, `.txt`:
/// number, name, colour) or a label description of ITK-SNAP (number, colour, ..., name in quotes). In
/// CSV every name must be one of [`LabelMeaning::ALL`]; in the others, which list more, names are
/// recognized as [`LabelMeaning::recognized`] says.
///
/// # Errors
/// When the file cannot be read, a line is none, or the bones are not all there once.
pub fn read_label_table(path: &Path) -> Result<LabelTable, CtImportError> {
    let mut text = String::new();
    std::fs::File::open(path)
        .and_then(|file| file.take(MOST_BYTES).read_to_string(&mut text))
        .map_err(|source| CtImportError::Io {
            path: path.into(),
            source,
        })?;
    entries(&text)
        .and_then(LabelTable::new)
        .map_err(|reason| CtImportError::File {
            path: path.into(),
            reason,
        })
}

/// The table of a label map that is a segmentation by 3D Slicer (`.seg.nrrd`): its segments' names, recognized
/// as [`LabelMeaning::recognized`] says.
///
/// # Errors
/// When the file cannot be read, names no segments, they overlap, or the bones are not all there once.
pub fn label_table_of_segments(path: &Path) -> Result<LabelTable, CtImportError> {
    let problem = |reason: String| CtImportError::File {
        path: path.into(),
        reason,
    };
    let names = nrrd_segment_names(path)?;
    if names.is_empty() {
        return Err(problem(
            "does not name its values, as a segmentation by 3D Slicer (.seg.nrrd) does; give a table of them"
                .into(),
        ));
    }
    let entries = names
        .iter()
        .filter_map(|(label, name)| Some((*label, LabelMeaning::recognized(name)?)));
    LabelTable::new(entries).map_err(|reason| {
        let names: Vec<&str> = names.iter().map(|(_, name)| name.as_str()).collect();
        problem(format!(
            "by the names of its segments ({}) {reason}; rename them in 3D Slicer, or give a table",
            names.join(", ")
        ))
    })
}

fn entries(text: &str) -> Result<Vec<(u8, LabelMeaning)>, String> {
    let lines = || {
        let numbered = text
            .lines()
            .enumerate()
            .map(|(n, line)| (n + 1, line.trim()));
        numbered.filter(|(_, line)| !line.is_empty() && !line.starts_with('#'))
    };
    let Some((_, first)) = lines().next() else {
        return Err("is empty; expected a line value,structure and one for each value".into());
    };
    match first.contains(',') {
        true => csv_entries(text),
        false => colour_entries(lines()),
    }
}

fn csv_entries(text: &str) -> Result<Vec<(u8, LabelMeaning)>, String> {
    let mut reader = csv::ReaderBuilder::new()
        .comment(Some(b'#'))
        .trim(csv::Trim::All)
        .from_reader(text.as_bytes());
    let headers = reader.headers().map_err(|e| e.to_string())?;
    if headers != vec!["value", "structure"] {
        let found: Vec<&str> = headers.iter().collect();
        return Err(format!(
            "has the columns {}; expected value,structure",
            found.join(",")
        ));
    }
    let mut list = Vec::new();
    for record in reader.records() {
        let record = record.map_err(|e| e.to_string())?;
        let line = record.position().map_or(0, |p| p.line());
        let value: u8 = record[0].parse().map_err(|_| {
            format!(
                "line {line}: the value is '{}'; expected 1 to 255",
                &record[0]
            )
        })?;
        let meaning = LabelMeaning::parse(&record[1]).ok_or_else(|| {
            let distance = |m: &LabelMeaning| strsim::damerau_levenshtein(m.name(), &record[1]);
            let closest = LabelMeaning::ALL
                .into_iter()
                .min_by_key(distance)
                .map_or("sacrum", LabelMeaning::name);
            format!(
                "line {line}: '{}' is no structure; is {closest} meant? Expected one of {}; leave other values out",
                &record[1],
                LabelMeaning::ALL.map(LabelMeaning::name).join(", ")
            )
        })?;
        list.push((value, meaning));
    }
    Ok(list)
}

/// Number first; the name in quotes, or the second word.
fn colour_entries<'a>(
    lines: impl Iterator<Item = (usize, &'a str)>,
) -> Result<Vec<(u8, LabelMeaning)>, String> {
    let mut list = Vec::new();
    for (number, line) in lines {
        let mut words = line.split_whitespace();
        let value: Option<i64> = words.next().and_then(|word| word.parse().ok());
        let quoted = line.split('"').nth(1);
        let (Some(value), Some(name)) = (value, quoted.or(words.next())) else {
            return Err(format!(
                "line {number}: '{line}' is no entry; expected number, name and colour as 3D Slicer or \
                 ITK-SNAP writes them, or a CSV file with the columns value,structure"
            ));
        };
        if let Some(meaning) = LabelMeaning::recognized(name) {
            let value = u8::try_from(value)
                .map_err(|_| format!("line {number}: the value is {value}; expected 1 to 255"))?;
            list.push((value, meaning));
        }
    }
    Ok(list)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::anatomy::{Side, Structure};

    fn pairs(text: &str) -> Result<Vec<(u8, &'static str)>, String> {
        let table = LabelTable::new(entries(text)?)?;
        Ok(table.iter().map(|(v, m)| (v, m.name())).collect())
    }

    #[test]
    fn all_three_kinds_are_read() {
        let csv = "# ours\nvalue,structure\n1, hips\n4,sacrum\n7,sacrum\n2,femora\n";
        let expected = [(1, "hips"), (2, "femora"), (4, "sacrum"), (7, "sacrum")];
        assert_eq!(pairs(csv).unwrap(), expected);
        let slicer = "# Color table file\n0 Background 0 0 0 0\n1 Pelvis 128 174 128 255\n\
            2 Femur_L 241 214 145 255\n3 Femur_R 177 122 101 255\n9 gluteus_left 1 2 3 255\n";
        let expected = [(1, "pelvis"), (2, "femur_left"), (3, "femur_right")];
        assert_eq!(pairs(slicer).unwrap(), expected);
        let snap = "################\n    0     0    0    0        0  0  0    \"Clear Label\"\n\
            \x20   1   255    0    0        1  1  1    \"left hip\"\n    2     0  255    0        1  1  1    \"right hip\"\n\
            \x20   3     0    0  255        1  1  1    \"Sacrum\"\n    5     9    9  255        1  1  1    \"femora\"\n";
        let expected = [
            (1, "hip_left"),
            (2, "hip_right"),
            (3, "sacrum"),
            (5, "femora"),
        ];
        assert_eq!(pairs(snap).unwrap(), expected);
    }

    #[test]
    fn what_contradicts_itself_is_refused() {
        let says = |text: &str, part: &str| {
            let message = pairs(text).unwrap_err();
            assert!(message.contains(part), "expected '{part}' in: {message}");
        };
        let with = |rows: &str| format!("value,structure\n{rows}");
        says("", "is empty");
        says("number,name\n1,hips\n", "columns number,name");
        says(&with("1,hip\n"), "'hip' is no structure; is hips meant?");
        says(&with("300,hips\n"), "'300'");
        says(&with("0,hips\n"), "0 is the background");
        says(&with("1,pelvis\n1,femora\n"), "1 is pelvis and femora");
        says(
            &with("1,pelvis\n2,hip_left\n3,femora\n"),
            "hip_left belongs to",
        );
        says(&with("1,hips\n3,femora\n"), "no value is sacrum");
        says(
            "one Sacrum 1 2 3\n",
            "line 1: 'one Sacrum 1 2 3' is no entry",
        );
        says(&with("1,hips\n2,femora,3\n"), "fields");
    }

    #[test]
    fn structures_by_name() {
        let left = LabelMeaning::One(Structure::Femur(Side::Left));
        assert_eq!(LabelMeaning::parse("femur_left"), Some(left));
    }
}
