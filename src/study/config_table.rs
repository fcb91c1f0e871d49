//! Tables of a TOML document with the places of their entries.

use std::ops::Range;
use toml::Spanned;
use toml::de::{DeTable, DeValue};

/// Lays `entries` over `base`: tables are merged, anything else replaced. Entries keep their spans.
pub(super) fn overlay<'a>(base: &mut DeTable<'a>, entries: DeTable<'a>) {
    for (key, value) in entries {
        let span = value.span();
        let below = base.remove(key.get_ref().as_ref()).map(Spanned::into_inner);
        let merged = match (below, value.into_inner()) {
            (Some(DeValue::Table(mut below)), DeValue::Table(above)) => {
                overlay(&mut below, above);
                DeValue::Table(below)
            }
            (_, value) => value,
        };
        // Removed before: inserting over a key would keep the old key and its span.
        base.insert(key, Spanned::new(span, merged));
    }
}

/// Takes out the innermost entry whose key or value is at `span`, and gives its dotted path.
pub(super) fn remove(table: &mut DeTable, span: &Range<usize>, prefix: &str) -> Option<String> {
    let mut found = None;
    for (key, value) in table.iter_mut() {
        let path = format!("{prefix}{}", key.get_ref());
        // The span of a table with a header of its own is that header, so any table may hold it.
        if let DeValue::Table(inner) = value.get_mut()
            && let Some(path) = remove(inner, span, &format!("{path}."))
        {
            return Some(path);
        }
        let within = value.span().start <= span.start && span.end <= value.span().end;
        if within || key.span() == *span {
            found = Some((key.clone(), path));
        }
    }
    let (key, path) = found?;
    table.remove(key.get_ref().as_ref());
    Some(path)
}

/// Where the entry of a dotted path stands, or its nearest enclosing section; an index in brackets
/// is ignored.
pub(super) fn span_of(table: &DeTable, path: &str) -> Option<Range<usize>> {
    let (name, rest) = path.split_once('.').unwrap_or((path, ""));
    let name = name.split('[').next().unwrap_or(name);
    let (key, value) = table.get_key_value(name)?;
    let deeper = match value.get_ref() {
        DeValue::Table(inner) if !rest.is_empty() => span_of(inner, rest),
        _ => None,
    };
    Some(deeper.unwrap_or_else(|| key.span()))
}
