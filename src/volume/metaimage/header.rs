//! The text header: `Key = value` lines up to `ElementDataFile`.

use super::FORMAT;
use crate::volume::VolumeFileError;
use crate::volume::header_fields::HeaderFields;
use crate::volume::samples::SampleType;
use crate::volume::source::HeaderLines;
use std::io::BufRead;
use std::path::Path;

/// The keys that are read. Keys in one line mean the same.
const KEYS: [&[&str]; 18] = [
    &["ObjectType"],
    &["NDims"],
    &["DimSize"],
    &["ElementType"],
    &["ElementNumberOfChannels"],
    &["ElementSpacing"],
    &["ElementSize"],
    &["TransformMatrix", "Rotation", "Orientation"],
    &["Offset", "Origin", "Position"],
    &["AnatomicalOrientation"],
    &["DistanceUnits"],
    &["BinaryData"],
    &["BinaryDataByteOrderMSB", "ElementByteOrderMSB"],
    &["CompressedData"],
    &["HeaderSize"],
    &["ElementToIntensityFunctionSlope"],
    &["ElementToIntensityFunctionOffset"],
    &["ElementDataFile"],
];

/// The first of the keys that mean the same, if the key is one that is read.
fn known(key: &str) -> Option<&'static str> {
    let names = KEYS.iter().find(|names| names.contains(&key));
    names.map(|names| names[0])
}

/// True when a line gives one of a MetaImage's keys a value.
pub(super) fn is_header_line(line: &str) -> bool {
    line.split_once('=')
        .is_some_and(|(key, _)| known(key.trim()).is_some())
}

/// A header as it is written.
#[derive(Debug)]
pub(super) struct Header<'a> {
    pub fields: HeaderFields<'a>,
}

impl<'a> Header<'a> {
    /// Reads a header to its last line: voxels follow in the stream when `ElementDataFile` is `LOCAL`.
    ///
    /// # Errors
    /// When a line is none, keys contradict each other, or there is no `ElementDataFile`.
    pub fn read(stream: &mut dyn BufRead, path: &'a Path) -> Result<Self, VolumeFileError> {
        let mut header = Self {
            fields: HeaderFields::new(path, FORMAT),
        };
        let mut lines = HeaderLines::new(path, FORMAT);
        while let Some(line) = lines.next(stream)? {
            if line.trim().is_empty() {
                continue;
            }
            let Some((key, value)) = line.split_once('=') else {
                let start: String = line.chars().take(60).collect();
                return Err(header
                    .fields
                    .wrong(format!("its header's line '{start}' is not Key = value")));
            };
            let (key, value) = (key.trim(), value.trim());
            if let Some(first) = known(key) {
                let before = header.fields.insert(first, value);
                if before.is_some_and(|before| before != value) {
                    return Err(header
                        .fields
                        .wrong(format!("its header gives two values of '{first}'")));
                }
            }
            // The voxels may follow at once.
            if key == "ElementDataFile" {
                return Ok(header);
            }
        }
        Err(header
            .fields
            .wrong("its header has no 'ElementDataFile'".into()))
    }

    /// A key's value read as yes or no, or `default` where it is missing.
    pub fn flag(&self, key: &'static str, default: bool) -> Result<bool, VolumeFileError> {
        let Some(text) = self.fields.get(key) else {
            return Ok(default);
        };
        match text.to_ascii_lowercase().as_str() {
            "true" | "t" | "1" => Ok(true),
            "false" | "f" | "0" => Ok(false),
            _ => Err(self
                .fields
                .wrong(format!("its '{key}' is '{text}'; expected True or False"))),
        }
    }

    /// Voxels along every axis.
    ///
    /// # Errors
    /// When there are not three axes of more than one voxel.
    pub fn dims(&self) -> Result<[usize; 3], VolumeFileError> {
        let sizes = self.fields.sizes("NDims", "DimSize")?;
        let dims: Option<Vec<usize>> = sizes
            .iter()
            .map(|&d| usize::try_from(d).ok().filter(|&d| d > 1))
            .collect();
        dims.and_then(|dims| dims.try_into().ok())
            .ok_or_else(|| self.fields.dimensions(sizes))
    }

    /// The type of the voxels' values.
    pub fn sample_type(&self) -> Result<SampleType, VolumeFileError> {
        Ok(match self.fields.needed("ElementType")? {
            "MET_CHAR" | "MET_ASCII_CHAR" => SampleType::I8,
            "MET_UCHAR" => SampleType::U8,
            "MET_SHORT" => SampleType::I16,
            "MET_USHORT" => SampleType::U16,
            // The format's long has 4 bytes on every machine.
            "MET_INT" | "MET_LONG" => SampleType::I32,
            "MET_UINT" | "MET_ULONG" => SampleType::U32,
            "MET_LONG_LONG" => SampleType::I64,
            "MET_ULONG_LONG" => SampleType::U64,
            "MET_FLOAT" => SampleType::F32,
            "MET_DOUBLE" => SampleType::F64,
            found => {
                return Err(self.fields.data_type(format!("MetaImage type '{found}'")));
            }
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn header(text: &str) -> Result<Header<'static>, String> {
        let mut stream = text.as_bytes();
        Header::read(&mut stream, Path::new("a.mha")).map_err(|e| e.to_string())
    }

    #[test]
    fn keys_with_several_names_are_one() {
        let text = "ObjectType = Image\r\n\r\nComment = x = y\nPosition = 1 2 3\nOffset = 1 2 3\n\
                    ElementByteOrderMSB = true\nElementDataFile = LOCAL\nDimSize = 9\n";
        let header = header(text).unwrap();
        assert_eq!(header.fields.numbers("Offset").unwrap(), [1.0, 2.0, 3.0]);
        assert!(header.flag("BinaryDataByteOrderMSB", false).unwrap());
        assert!(!header.flag("CompressedData", false).unwrap());
        assert_eq!(header.fields.get("DimSize"), None);
    }

    #[test]
    fn broken_headers_are_refused() {
        let says = |text: &str, part: &str| {
            let message = header(text).unwrap_err();
            assert!(message.contains(part), "expected '{part}' in: {message}");
        };
        says("NDims = 3\n", "no 'ElementDataFile'");
        says("NDims: 3\n", "not Key = value");
        says("Offset = 1 2 3\nOrigin = 1 2 4\n", "two values of 'Offset'");
        let dims = |text: &str| {
            let header = header(&format!("{text}\nElementDataFile = LOCAL")).unwrap();
            header.dims().unwrap_err().to_string()
        };
        assert!(dims("NDims = 3\nDimSize = 3 4").contains("'NDims' is 3"));
        assert!(dims("NDims = 3\nDimSize = 3 4 -5").contains("dimensions [3, 4, -5]"));
        assert!(dims("NDims = 4\nDimSize = 3 4 5 1").contains("dimensions [3, 4, 5, 1]"));
        assert!(dims("NDims = 3\nDimSize = 3 4 nan").contains("whole numbers"));
        let kind = header("ElementType = MET_FLOAT_ARRAY\nElementDataFile = x").unwrap();
        assert!(matches!(
            kind.sample_type(),
            Err(VolumeFileError::DataType { .. })
        ));
        let numbers = kind.fields.numbers::<3>("Offset").unwrap_err().to_string();
        assert!(numbers.contains("no 'Offset'"), "{numbers}");
    }
}
