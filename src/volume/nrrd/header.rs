//! The text header: `field: value` and `key:=value` lines up to an empty one.

use super::FORMAT;
use crate::volume::VolumeFileError;
use crate::volume::header_fields::HeaderFields;
use crate::volume::samples::SampleType;
use crate::volume::source::HeaderLines;
use std::collections::BTreeMap;
use std::io::BufRead;
use std::path::Path;

/// The fields that are read; the format's others say nothing about voxels or their place.
const FIELDS: [&str; 14] = [
    "dimension",
    "type",
    "sizes",
    "encoding",
    "endian",
    "space",
    "space dimension",
    "space directions",
    "space origin",
    "space units",
    "kinds",
    "data file",
    "line skip",
    "byte skip",
];

/// Keys of Slicer's segmentations start so.
const SEGMENT_KEYS: &str = "Segment";

/// A header as it is written.
#[derive(Debug)]
pub(super) struct Header<'a> {
    /// Names are in lower case.
    pub fields: HeaderFields<'a>,
    /// `key:=value` lines of a segmentation.
    pub segment_keys: BTreeMap<String, String>,
}

impl<'a> Header<'a> {
    /// Reads a header to its end: voxels follow in the stream when there is no `data file`.
    ///
    /// # Errors
    /// When it does not start as NRRD, says a field twice, or holds a line that is neither.
    pub fn read(stream: &mut dyn BufRead, path: &'a Path) -> Result<Self, VolumeFileError> {
        let mut header = Self {
            fields: HeaderFields::new(path, FORMAT),
            segment_keys: BTreeMap::new(),
        };
        let mut lines = HeaderLines::new(path, FORMAT);
        let first = lines.next(stream)?.unwrap_or_default();
        match first.strip_prefix("NRRD000") {
            Some("1" | "2" | "3" | "4" | "5" | "6") => {}
            Some(version) => {
                let reason = format!("its version is '{version}'; this program reads 1 to 6");
                return Err(header.fields.wrong(reason));
            }
            None => return Err(header.fields.wrong("it does not start with NRRD000".into())),
        }
        while let Some(line) = lines.next(stream)? {
            if line.is_empty() {
                break;
            }
            if !line.starts_with('#') {
                header.take(&line)?;
            }
        }
        Ok(header)
    }

    fn take(&mut self, line: &str) -> Result<(), VolumeFileError> {
        let split = line.split_once(':').ok_or_else(|| {
            let start: String = line.chars().take(60).collect();
            self.fields.wrong(format!(
                "its header's line '{start}' is neither a field nor a key"
            ))
        })?;
        let (name, value) = split;
        if let Some(value) = value.strip_prefix('=') {
            if name.starts_with(SEGMENT_KEYS) {
                self.segment_keys
                    .insert(unescaped(name), unescaped(value.trim_end()));
            }
            return Ok(());
        }
        let name = name.trim().to_ascii_lowercase();
        let name = match name.as_str() {
            "datafile" => "data file",
            "lineskip" => "line skip",
            "byteskip" => "byte skip",
            other => other,
        };
        if let Some(&name) = FIELDS.iter().find(|&&field| field == name)
            && self.fields.insert(name, value.trim()).is_some()
        {
            return Err(self.fields.wrong(format!("its header has '{name}' twice")));
        }
        Ok(())
    }

    /// The type of the samples.
    pub fn sample_type(&self) -> Result<SampleType, VolumeFileError> {
        let found = self.fields.needed("type")?;
        let words: Vec<&str> = found.split_whitespace().collect();
        Ok(match words.join(" ").to_ascii_lowercase().as_str() {
            "signed char" | "int8" | "int8_t" => SampleType::I8,
            "uchar" | "unsigned char" | "uint8" | "uint8_t" => SampleType::U8,
            "short" | "short int" | "signed short" | "signed short int" | "int16" | "int16_t" => {
                SampleType::I16
            }
            "ushort" | "unsigned short" | "unsigned short int" | "uint16" | "uint16_t" => {
                SampleType::U16
            }
            "int" | "signed int" | "int32" | "int32_t" => SampleType::I32,
            "uint" | "unsigned int" | "uint32" | "uint32_t" => SampleType::U32,
            "longlong"
            | "long long"
            | "long long int"
            | "signed long long"
            | "signed long long int"
            | "int64"
            | "int64_t" => SampleType::I64,
            "ulonglong"
            | "unsigned long long"
            | "unsigned long long int"
            | "uint64"
            | "uint64_t" => SampleType::U64,
            "float" => SampleType::F32,
            "double" => SampleType::F64,
            _ => {
                return Err(self.fields.data_type(format!("NRRD type '{found}'")));
            }
        })
    }
}

/// Keys and values write a line's end as `\n` and a backslash as two.
fn unescaped(text: &str) -> String {
    let mut out = String::with_capacity(text.len());
    let mut characters = text.chars();
    while let Some(c) = characters.next() {
        match (c, characters.clone().next()) {
            ('\\', Some('n')) => out.push('\n'),
            ('\\', Some('\\')) => out.push('\\'),
            _ => {
                out.push(c);
                continue;
            }
        }
        characters.next();
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    fn header(text: &str) -> Result<Header<'static>, String> {
        let mut stream = text.as_bytes();
        Header::read(&mut stream, Path::new("a.nrrd")).map_err(|e| e.to_string())
    }

    #[test]
    fn fields_aliases_comments_and_keys_are_told_apart() {
        let text = "NRRD0005\r\n# type: no\r\nType:  unsigned   CHAR\r\nlineskip: 3\r\n\
                    content: a: b\r\nSegment0_Name:=one:=two\\\\ \\n three\r\nother:=x\r\n\r\nsizes: 1";
        let header = header(text).unwrap();
        assert_eq!(header.sample_type().unwrap(), SampleType::U8);
        assert_eq!(header.fields.whole("line skip", 0).unwrap(), 3);
        assert_eq!(header.fields.whole("byte skip", -1).unwrap(), -1);
        assert_eq!(header.segment_keys.len(), 1);
        assert_eq!(header.segment_keys["Segment0_Name"], "one:=two\\ \n three");
        assert_eq!(header.fields.get("sizes"), None);
    }

    /// The format's definition lists these names of each type.
    #[test]
    fn every_name_of_a_type_is_known() {
        let bytes = |names: &str, size: usize| {
            for name in names.split(", ") {
                let header = header(&format!("NRRD0004\ntype: {name}\n")).unwrap();
                assert_eq!(header.sample_type().unwrap().size(), size, "{name}");
            }
        };
        bytes(
            "signed char, int8, int8_t, uchar, unsigned char, uint8, uint8_t",
            1,
        );
        bytes(
            "short, short int, signed short, signed short int, int16, int16_t",
            2,
        );
        bytes(
            "ushort, unsigned short, unsigned short int, uint16, uint16_t",
            2,
        );
        bytes(
            "int, signed int, int32, int32_t, uint, unsigned int, uint32, uint32_t, float",
            4,
        );
        bytes(
            "longlong, long long, long long int, signed long long, signed long long int, int64, int64_t",
            8,
        );
        bytes(
            "ulonglong, unsigned long long, unsigned long long int, uint64, uint64_t, double",
            8,
        );
        let block = header("NRRD0004\ntype: block\n").unwrap();
        assert!(matches!(
            block.sample_type(),
            Err(VolumeFileError::DataType { .. })
        ));
    }

    #[test]
    fn broken_headers_are_refused() {
        let says = |text: &str, part: &str| {
            let message = header(text).unwrap_err();
            assert!(message.contains(part), "expected '{part}' in: {message}");
        };
        says("", "start with NRRD000");
        says("NRRD0009\n", "version is '9'");
        says("NRRD0004\nsizes 3 4 5\n", "neither a field nor a key");
        says("NRRD0004\nsizes: 3\nsizes: 4\n", "'sizes' twice");
        says(
            &format!("NRRD0004\n{}", "#\n".repeat(1 << 20)),
            "does not end",
        );
        let sizes = |text: &str| {
            header(text)
                .unwrap()
                .fields
                .sizes("dimension", "sizes")
                .unwrap_err()
                .to_string()
        };
        assert!(sizes("NRRD0004\ndimension: 3\nsizes: 3 4\n").contains("'dimension' is 3"));
        assert!(sizes("NRRD0004\ndimension: 3\nsizes: 3 4 1e9\n").contains("whole numbers"));
    }
}
