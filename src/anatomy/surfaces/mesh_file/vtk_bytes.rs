//! The bytes of a legacy VTK file: lines, words and arrays of numbers in ascii or binary.

/// Types of numbers, as the file names them. Those of binary files are big-endian.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum NumberType {
    I8,
    U8,
    I16,
    U16,
    I32,
    U32,
    I64,
    F32,
    F64,
}

impl NumberType {
    /// The type of this name. `long` is none: its size depends on the machine that wrote the file.
    pub fn of(name: &str) -> Result<Self, String> {
        Ok(match name.to_ascii_lowercase().as_str() {
            "char" => Self::I8,
            "unsigned_char" => Self::U8,
            "short" => Self::I16,
            "unsigned_short" => Self::U16,
            // Legacy files hold the indices of a 64-bit VTK as int.
            "int" | "vtkidtype" => Self::I32,
            "unsigned_int" => Self::U32,
            "vtktypeint64" => Self::I64,
            "float" => Self::F32,
            "double" => Self::F64,
            _ => {
                return Err(format!(
                    "it holds numbers of type '{name}'; expected float, double, int, vtktypeint64 or smaller ones"
                ));
            }
        })
    }

    fn size(self) -> usize {
        match self {
            Self::I8 | Self::U8 => 1,
            Self::I16 | Self::U16 => 2,
            Self::I32 | Self::U32 | Self::F32 => 4,
            Self::I64 | Self::F64 => 8,
        }
    }

    /// A number of a binary file. Whole numbers beyond 2^53, which no index is, are rounded.
    fn decode(self, bytes: &[u8]) -> f64 {
        fn array<const N: usize>(bytes: &[u8]) -> [u8; N] {
            bytes.try_into().expect("chunks have this size")
        }
        match self {
            Self::I8 => i8::from_be_bytes(array(bytes)).into(),
            Self::U8 => u8::from_be_bytes(array(bytes)).into(),
            Self::I16 => i16::from_be_bytes(array(bytes)).into(),
            Self::U16 => u16::from_be_bytes(array(bytes)).into(),
            Self::I32 => i32::from_be_bytes(array(bytes)).into(),
            Self::U32 => u32::from_be_bytes(array(bytes)).into(),
            Self::I64 => i64::from_be_bytes(array(bytes)) as f64,
            Self::F32 => f32::from_be_bytes(array(bytes)).into(),
            Self::F64 => f64::from_be_bytes(array(bytes)),
        }
    }
}

/// What of a file is not read yet.
pub(super) struct Bytes<'a> {
    rest: &'a [u8],
    binary: bool,
}

impl<'a> Bytes<'a> {
    /// All of a file; [`Self::numbers`] are ascii until [`Self::set_binary`].
    pub fn new(file: &'a [u8]) -> Self {
        Self {
            rest: file,
            binary: false,
        }
    }

    pub fn set_binary(&mut self) {
        self.binary = true;
    }

    /// The next line without its end, or `None` at the file's end.
    pub fn line(&mut self) -> Option<String> {
        if self.rest.is_empty() {
            return None;
        }
        let end = self.rest.iter().position(|&b| b == b'\n');
        let (line, rest) = match end {
            Some(end) => (&self.rest[..end], &self.rest[end + 1..]),
            None => (self.rest, &[][..]),
        };
        self.rest = rest;
        Some(String::from_utf8_lossy(line).trim().to_owned())
    }

    /// The next line that is not empty.
    pub fn full_line(&mut self) -> Option<String> {
        loop {
            let line = self.line()?;
            if !line.is_empty() {
                return Some(line);
            }
        }
    }

    /// The next `count` numbers of `what`.
    ///
    /// # Errors
    /// When the file ends before, or a word is no number.
    pub fn numbers(
        &mut self,
        count: usize,
        kind: NumberType,
        what: &str,
    ) -> Result<Vec<f64>, String> {
        // A number of an ascii file takes a digit, and a gap before the next one.
        let bytes_each = if self.binary { kind.size() } else { 2 };
        let needed = count.checked_mul(bytes_each);
        if needed.is_none_or(|n| n > self.rest.len().saturating_add(1)) {
            return Err(self.too_short(count, what));
        }
        if self.binary {
            let Some((array, rest)) = self.rest.split_at_checked(count * kind.size()) else {
                return Err(self.too_short(count, what));
            };
            self.rest = rest;
            return Ok(array
                .chunks_exact(kind.size())
                .map(|bytes| kind.decode(bytes))
                .collect());
        }
        let mut numbers = Vec::with_capacity(count);
        for _ in 0..count {
            let word = self.word();
            if word.is_empty() {
                return Err(self.too_short(count, what));
            }
            let number = std::str::from_utf8(word).ok().and_then(|w| w.parse().ok());
            numbers.push(number.ok_or_else(|| {
                format!(
                    "'{}' among its {what} is no number",
                    String::from_utf8_lossy(word)
                )
            })?);
        }
        Ok(numbers)
    }

    /// The next word of an ascii file; empty at its end.
    fn word(&mut self) -> &'a [u8] {
        let start = self.rest.iter().position(|b| !b.is_ascii_whitespace());
        let rest = &self.rest[start.unwrap_or(self.rest.len())..];
        let end = rest.iter().position(u8::is_ascii_whitespace);
        let (word, rest) = rest.split_at(end.unwrap_or(rest.len()));
        self.rest = rest;
        word
    }

    fn too_short(&self, count: usize, what: &str) -> String {
        format!(
            "it announces {count} numbers of {what}, and {} bytes are left; copy it again",
            self.rest.len()
        )
    }

    /// Whether numbers are binary.
    pub fn is_binary(&self) -> bool {
        self.binary
    }
}
