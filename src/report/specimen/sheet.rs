//! One page that shows whether a specimen is right: radiograph, slices with labels, surfaces with the
//! plan, and the table of checks.

use super::SIDES;
use super::hip::{self, CUTS, FRAGMENT, HipPlan};
use super::painting::Painting;
use super::radiograph::ap_radiograph;
use super::shading::View;
use crate::anatomy::check::{Check, Verdict};
use crate::anatomy::{Hip, Label, Landmark, Side, Specimen};
use crate::geometry::{Pixel, Point, Vector};
use crate::report::picture::Colour;
use crate::surgery::Cut;
use crate::xray::AttenuationParameters;
use nalgebra::Vector2;

/// Edge of a slice's and of a surface's panel.
const PANEL: usize = 430;

/// A slice shows the whole body, a surface one hip.
const SLICE_PIXEL_MM: f64 = 1.0;
const SURFACE_PIXEL_MM: f64 = 0.62;

/// Columns of the table of checks.
const TABLE: usize = 900;
const ROW: usize = 17;
const WORDS: u32 = 12;
/// Where the table's columns begin, and how many letters fit in the first three.
const COLUMNS: [f64; 4] = [10.0, 395.0, 620.0, 815.0];
const FITTING: [usize; 3] = [58, 33, 28];

/// Letters of a line of advice.
const ADVICE: usize = 280;

const WHITE: Colour = [255; 3];
const DIM: Colour = [170; 3];
const PELVIS: Colour = [255, 220, 60];

/// The sheet of a specimen and its checks. Above the radiograph as it is shown to people, the patient's
/// left on the right, and below it slices through the femoral heads with the labels' outlines (axial from
/// the feet, coronal from the front, sagittal from the left through the left head), then each hip's
/// surface from the front and from within; at the side the table and, below the pictures, what to do about what is not ok. A hip without a plan is drawn without
/// cuts, one without a frame not at all.
pub fn check_sheet(
    specimen: &Specimen,
    hips: &[(Hip, Option<HipPlan>)],
    checks: &[Check],
) -> Painting {
    let ap = ap_radiograph(specimen, &AttenuationParameters::default());
    let width = ap.width().max(3 * PANEL);
    let below = 3 * PANEL + 2 * ROW;
    let said = advice(checks);
    let height = (below + (said.len() + 1) * ROW).max((checks.len() + 5) * ROW);
    let mut sheet = Painting::new(width + 2 * PANEL + TABLE, height);
    sheet.paste(&ap, (width - ap.width()) / 2, 0);
    for (n, (view, name)) in slices(specimen).into_iter().enumerate() {
        let mut panel = slice(specimen, &view);
        panel.words(&Pixel::new(6.0, 4.0), name, 14, WHITE);
        orientation(&mut panel, &view);
        sheet.paste(&panel, n * PANEL, ap.height());
    }
    legend(&mut sheet, ap.height() + PANEL + 12);
    for (hip, plan) in hips {
        let surfaces = hip::surfaces(hip, *plan);
        let lateral = hip.lateral();
        let middle = Point::from(Vector::y() * 25.0 - lateral * 15.0);
        let views = [
            (Vector::x(), "from the front"),
            (lateral.cross(&Vector::y()), "from within"),
            (Vector::y().cross(&lateral), "from the side"),
        ];
        for (row, (right, name)) in views.into_iter().enumerate() {
            let view = View {
                middle,
                right,
                up: Vector::y(),
                pixel_mm: SURFACE_PIXEL_MM,
                size: PANEL,
            };
            let mut panel = hip::shaded(hip, &surfaces, &view);
            if let Some(plan) = plan {
                hip::cut_lines(&mut panel, plan.cuts, &view);
            }
            let words = format!("{} {name}", hip.side);
            panel.words(&Pixel::new(6.0, 4.0), &words, 14, WHITE);
            // The patient's right hip on the left, as in the radiograph.
            let column = width + PANEL * (1 - hip.side.index());
            sheet.paste(&panel, column, row * PANEL);
        }
    }
    for (n, (line, colour)) in said.iter().enumerate() {
        let at = Pixel::new(8.0, (below + n * ROW) as f64);
        sheet.words(&at, line, WORDS, *colour);
    }
    table(&mut sheet, width + 2 * PANEL, specimen, checks);
    sheet
}

/// Views through the heads' middle, or the CT's where there are none.
fn slices(specimen: &Specimen) -> [(View, &'static str); 3] {
    let heads = Side::BOTH.map(|side| specimen.landmarks.get(Landmark::Fh, side));
    let grid = &specimen.ct.grid;
    let [i, j, k] = grid.dims.map(|n| (n as f64 - 1.0) / 2.0);
    let center = grid.point(i, j, k);
    let left = heads[0].unwrap_or(center);
    let middle = nalgebra::center(&left, &heads[1].unwrap_or(center));
    let view = |middle: Point, right: Vector, up: Vector| View {
        middle,
        right,
        up,
        pixel_mm: SLICE_PIXEL_MM,
        size: PANEL,
    };
    let (left_ward, front, up) = (Vector::x(), -Vector::y(), Vector::z());
    // The CT's middle height shows most of it.
    let upright = |p: Point| Point::new(p.x, p.y, center.z);
    [
        (view(middle, left_ward, front), "axial, from the feet"),
        (
            view(upright(middle), left_ward, up),
            "coronal, from the front",
        ),
        (
            view(upright(left), Vector::y(), up),
            "sagittal through the left head",
        ),
    ]
}

fn slice(specimen: &Specimen, view: &View) -> Painting {
    let mut panel = Painting::new(PANEL, PANEL);
    let label = |x: usize, y: usize| {
        let at = view.point(x as f64, y as f64);
        specimen.labels.nearest(&at).unwrap_or(0)
    };
    for y in 0..PANEL {
        for x in 0..PANEL {
            let at = view.point(x as f64, y as f64);
            if let Some(hu) = specimen.ct.nearest(&at) {
                panel.set(x, y, hip::grey(hu));
            }
            let own = label(x, y);
            let beside = [
                (x + 1 < PANEL, x + 1, y),
                (x > 0, x.wrapping_sub(1), y),
                (y + 1 < PANEL, x, y + 1),
                (y > 0, x, y.wrapping_sub(1)),
            ];
            let edge = beside
                .iter()
                .any(|&(there, i, j)| there && label(i, j) != own);
            if own != 0 && edge {
                panel.set(x, y, colour(own));
            }
        }
    }
    for side in Side::BOTH {
        if let Some(head) = specimen.landmarks.get(Landmark::Fh, side) {
            let off = (head - view.middle).dot(&view.toward()).abs();
            if off < 12.0 {
                panel.cross(&view.pixel(&head), 5, WHITE);
            }
        }
    }
    panel
}

fn colour(label: u8) -> Colour {
    match label {
        l if l == Label::Pelvis.value() => PELVIS,
        l if l == Label::FemurLeft.value() => SIDES[0],
        l if l == Label::FemurRight.value() => SIDES[1],
        _ => [255, 0, 255],
    }
}

/// L, A or P where the view's right end lies, and their opposites.
fn orientation(panel: &mut Painting, view: &View) {
    let (ends, middle) = (["R", "L"], (PANEL / 2 - 8) as f64);
    let right = match view.right.x.abs() > 0.5 {
        true => ends,
        false => ["A", "P"],
    };
    panel.words(&Pixel::new(4.0, middle), right[0], 16, WHITE);
    panel.words(
        &Pixel::new(PANEL as f64 - 16.0, middle),
        right[1],
        16,
        WHITE,
    );
}

fn legend(sheet: &mut Painting, top: usize) {
    let mut at = Pixel::new(8.0, top as f64);
    let mut word = |text: &str, colour: Colour| {
        sheet.words(&at, text, 14, colour);
        at += Vector2::new(8.2 * text.chars().count() as f64 + 14.0, 0.0);
    };
    word("left", SIDES[0]);
    word("right", SIDES[1]);
    word("pelvis", PELVIS);
    word("planned cuts:", WHITE);
    for (cut, colour) in Cut::ALL.into_iter().zip(CUTS) {
        word(cut.name(), colour);
    }
    word("fragment", FRAGMENT);
}

/// What to say about checks that are not fine, in lines that fit below the pictures.
fn advice(checks: &[Check]) -> Vec<(String, Colour)> {
    let mut lines: Vec<(String, Colour)> = Vec::new();
    for check in checks.iter().filter(|c| c.verdict != Verdict::Fine) {
        let text = format!(
            "{} ({}): {}",
            check.what,
            check.verdict.name(),
            check.advice
        );
        let mut line = String::new();
        for word in text.split(' ') {
            if line.chars().count() + word.chars().count() > ADVICE {
                lines.push((line, shade(check.verdict)));
                line = "   ".into();
            }
            if !line.is_empty() {
                line.push(' ');
            }
            line.push_str(word);
        }
        lines.push((line, shade(check.verdict)));
    }
    lines
}

fn table(sheet: &mut Painting, left: usize, specimen: &Specimen, checks: &[Check]) {
    let mut y = 8.0;
    let mut row = |cells: &[(usize, &str)], colour: Colour| {
        for (column, text) in cells {
            let at = Pixel::new(left as f64 + COLUMNS[*column], y);
            sheet.words(&at, text, WORDS, colour);
        }
        y += ROW as f64;
    };
    let title = format!(
        "{} ({}, {}), {}",
        specimen.name, specimen.source.kind, specimen.source.sex, specimen.source.licence
    );
    row(&[(0, &title)], WHITE);
    row(
        &[(0, "check"), (1, "found"), (2, "expected"), (3, "verdict")],
        DIM,
    );
    for check in checks {
        let fitting = |text: &str, column: usize| match text.chars().count() > FITTING[column] {
            true => text.chars().take(FITTING[column] - 3).collect::<String>() + "...",
            false => text.to_owned(),
        };
        let (what, found, expected) = (
            fitting(&check.what, 0),
            fitting(&check.found, 1),
            fitting(&check.expected, 2),
        );
        let cells = [
            (0, &*what),
            (1, &*found),
            (2, &*expected),
            (3, check.verdict.name()),
        ];
        row(&cells, shade(check.verdict));
    }
    row(&[], WHITE);
    let count = |verdict| checks.iter().filter(|c| c.verdict == verdict).count();
    let counts = format!(
        "{} checks: {} ok, {} doubtful, {} wrong",
        checks.len(),
        count(Verdict::Fine),
        count(Verdict::Doubtful),
        count(Verdict::Wrong)
    );
    row(&[(0, &counts)], WHITE);
}

fn shade(verdict: Verdict) -> Colour {
    match verdict {
        Verdict::Fine => [190, 220, 190],
        Verdict::Doubtful => [255, 210, 70],
        Verdict::Wrong => [255, 90, 90],
    }
}
