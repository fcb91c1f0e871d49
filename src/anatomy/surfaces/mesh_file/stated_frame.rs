//! The frame that 3D Slicer writes into the header of a surface it saves.

use crate::anatomy::PatientFrame;

/// The frame of a header or comment that says `SPACE=LPS` or `SPACE=RAS`; `None` for any other.
///
/// # Errors
/// When the text names another space, or two.
pub(super) fn stated_frame(text: &str) -> Result<Option<PatientFrame>, String> {
    const TAG: &str = "SPACE=";
    let text = text.to_ascii_uppercase();
    let mut found = None;
    for (at, _) in text.match_indices(TAG) {
        // COLORSPACE= and its like are other keys.
        if text[..at].ends_with(|c: char| c.is_alphanumeric() || c == '_') {
            continue;
        }
        let value = text[at + TAG.len()..]
            .split(|c: char| !c.is_ascii_alphanumeric() && c != '-')
            .next()
            .unwrap_or_default();
        let frame: PatientFrame = value.parse().map_err(|()| {
            format!("its header says SPACE={value}; expected SPACE=LPS or SPACE=RAS")
        })?;
        if found.is_some_and(|before| before != frame) {
            return Err("its header says both SPACE=LPS and SPACE=RAS".into());
        }
        found = Some(frame);
    }
    Ok(found)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_the_key_itself_states_a_frame() {
        for (text, frame) in [
            ("3D Slicer output. SPACE=LPS", Some(PatientFrame::Lps)),
            ("SPACE=RAS\0\0", Some(PatientFrame::Ras)),
            ("SPACE=LPS;SPACE=LPS", Some(PatientFrame::Lps)),
            ("COLORSPACE=RGB in an empty space", None),
            ("", None),
        ] {
            assert_eq!(stated_frame(text), Ok(frame), "{text}");
        }
        for (text, reason) in [
            ("SPACE=LAS", "SPACE=LAS"),
            ("SPACE=", "expected SPACE=LPS"),
            ("SPACE=LPS SPACE=RAS", "both"),
            ("SPACE=LPSX", "SPACE=LPSX"),
        ] {
            let message = stated_frame(text).unwrap_err();
            assert!(message.contains(reason), "{text}: {message}");
        }
    }
}
