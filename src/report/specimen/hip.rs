//! One hip with its planned cuts: three slices through the femoral head's centre and three views of
//! the pelvis' surface, all in the APP.

use super::SIDES;
use super::painting::Painting;
use super::shading::{Scene, View};
use crate::anatomy::{Hip, Label, Landmark};
use crate::geometry::{Pixel, Point, Rigid, Vector};
use crate::report::picture::Colour;
use crate::surgery::{Cut, CutPlanes, SurgeryMap};
use crate::volume::{Surface, Volume};

/// Colours of the cuts, in the order of [`Cut::ALL`].
pub(super) const CUTS: [Colour; 4] = [
    [255, 90, 90],
    [90, 160, 255],
    [255, 230, 60],
    [200, 120, 255],
];
pub(super) const FRAGMENT: Colour = [240, 100, 190];
const CHISEL: Colour = [255, 230, 60];
const BONE: Colour = [225, 215, 195];

/// Edge of one of the six panels, and what a pixel of it stands for.
const PANEL: usize = 440;
const PIXEL_MM: f64 = 0.55;

/// Hounsfield values from black to white.
const WINDOW: (f64, f64) = (-250.0, 1100.0);

/// Rim points this near to a slice are drawn on it (mm).
const NEAR_SLICE_MM: f64 = 2.0;

/// What the cuts of a hip come to.
#[derive(Clone, Copy, Debug)]
pub struct HipPlan<'a> {
    pub cuts: &'a CutPlanes,
    pub map: &'a SurgeryMap,
}

/// The picture of a hip, with the planned cuts and their fragment where there are some. Above, slices
/// as radiologists show them: coronal from the front, sagittal from the side, axial from the feet.
/// Below, the pelvis' surface from the front, from the side and from within.
pub fn hip_picture(hip: &Hip, plan: Option<HipPlan>) -> Painting {
    let lateral = hip.lateral();
    let (up, front) = (Vector::y(), Vector::z());
    let view = |middle: Point, right: Vector, up: Vector| View {
        middle,
        right,
        up,
        pixel_mm: PIXEL_MM,
        size: PANEL,
    };
    let head = Point::origin();
    // Surfaces reach farther up, to the crest, than down.
    let bone = Point::from(up * 25.0 - lateral * 15.0);
    let (from_side, from_within) = (up.cross(&lateral), lateral.cross(&up));
    let mut whole = Painting::new(3 * PANEL, 2 * PANEL);
    for (column, (right, up, name)) in [
        (Vector::x(), up, "coronal"),
        (from_side, up, "sagittal, from the side"),
        (Vector::x(), front, "axial, from the feet"),
    ]
    .into_iter()
    .enumerate()
    {
        let mut panel = slice(hip, plan, &view(head, right, up));
        panel.words(&Pixel::new(6.0, 4.0), name, 14, [255; 3]);
        whole.paste(&panel, column * PANEL, 0);
    }
    let surfaces = surfaces(hip, plan);
    for (column, (right, name)) in [
        (Vector::x(), "from the front"),
        (from_side, "from the side"),
        (from_within, "from within"),
    ]
    .into_iter()
    .enumerate()
    {
        let mut panel = shaded(hip, &surfaces, &view(bone, right, up));
        panel.words(&Pixel::new(6.0, 4.0), name, 14, [255; 3]);
        whole.paste(&panel, column * PANEL, PANEL);
    }
    legend(&mut whole, hip, plan);
    whole
}

fn slice(hip: &Hip, plan: Option<HipPlan>, view: &View) -> Painting {
    let volume_from_app = hip.app_from_volume.inverse();
    let ct = &hip.specimen.ct;
    let mut panel = Painting::new(PANEL, PANEL);
    for y in 0..PANEL {
        for x in 0..PANEL {
            let at = volume_from_app * view.point(x as f64, y as f64);
            let Some(hu) = ct.nearest(&at) else { continue };
            panel.set(x, y, grey(hu));
            let label = plan.and_then(|plan| plan.map.labels.nearest(&at));
            if label == Some(Label::Fragment.value()) {
                panel.tint(x, y, FRAGMENT, 0.4);
            } else if label == Some(Label::Cut.value()) {
                panel.tint(x, y, CHISEL, 0.8);
            }
        }
    }
    if let Some(plan) = plan {
        cut_lines(&mut panel, plan.cuts, view);
    }
    let toward = view.toward();
    let side = SIDES[hip.side.index()];
    for point in hip.rim_in_app() {
        if (point - view.middle).dot(&toward).abs() < NEAR_SLICE_MM {
            panel.cross(&view.pixel(&point), 2, side);
        }
    }
    panel.cross(&view.pixel(&Point::origin()), 4, side);
    panel
}

/// The grey of a Hounsfield value in a slice.
pub(super) fn grey(hu: i16) -> Colour {
    let (low, high) = WINDOW;
    [(255.0 * ((f64::from(hu) - low) / (high - low)).clamp(0.0, 1.0)) as u8; 3]
}

/// Where the cuts' planes pass through the plane of a view.
pub(super) fn cut_lines(panel: &mut Painting, cuts: &CutPlanes, view: &View) {
    for (cut, colour) in Cut::ALL.into_iter().zip(CUTS) {
        let plane = cuts.get(cut);
        let (along, across) = (plane.normal.dot(&view.right), plane.normal.dot(&view.up));
        let steepness = along.hypot(across);
        // A plane that almost contains the slice has no line to speak of.
        if steepness < 0.1 {
            continue;
        }
        let distance = plane.signed_distance(&view.middle);
        let foot =
            view.middle - (view.right * along + view.up * across) * (distance / steepness.powi(2));
        let direction = (view.right * -across + view.up * along) / steepness;
        let ends = [-1.0, 1.0].map(|sign| view.pixel(&(foot + direction * (sign * 400.0))));
        panel.line(ends, colour);
    }
}

/// Pelvis and fragment in the APP, with their colours.
pub(super) fn surfaces(hip: &Hip, plan: Option<HipPlan>) -> Vec<(Surface, Colour)> {
    let labels: &Volume<u8> = match &plan {
        Some(plan) => &plan.map.labels,
        None => &hip.specimen.labels,
    };
    let near = Rigid::identity() * hip.app_from_volume;
    let of = |label: Label| {
        Surface::from_mask(labels, |v| v == label.value(), &Default::default()).transformed(&near)
    };
    let mut list = vec![(own_half(&of(Label::Pelvis), hip), BONE)];
    if plan.is_some() {
        list.push((of(Label::Fragment), FRAGMENT));
    }
    list
}

/// The triangles on the hip's side of the body's middle: the other half would hide the inner side.
fn own_half(surface: &Surface, hip: &Hip) -> Surface {
    let middle = [Landmark::Sps, Landmark::Ips].map(|landmark| {
        let point = hip.landmark(landmark).map(|p| hip.app_from_volume * p);
        point.map_or(0.0, |p| p.coords.dot(&hip.lateral()))
    });
    let limit = middle[0].min(middle[1]) - 5.0;
    let own = |t: &&[u32; 3]| {
        let corner = surface.vertices()[t[0] as usize];
        corner.coords.dot(&hip.lateral()) > limit
    };
    let triangles = surface.triangles().iter().filter(own).copied().collect();
    Surface::new(surface.vertices().to_vec(), triangles)
}

/// Surfaces with the hip's rim and landmarks.
pub(super) fn shaded(hip: &Hip, surfaces: &[(Surface, Colour)], view: &View) -> Painting {
    let mut scene = Scene::new(*view);
    for (surface, colour) in surfaces {
        scene.add(surface, *colour);
    }
    let mut panel = scene.painting();
    let side = SIDES[hip.side.index()];
    let rim = hip.rim_in_app();
    panel.line(rim.iter().chain(rim.first()).map(|p| view.pixel(p)), side);
    for landmark in Landmark::ALL {
        if let Ok(point) = hip.landmark(landmark) {
            let at = view.pixel(&(hip.app_from_volume * point));
            panel.cross(&at, 4, [0, 220, 255]);
            let words = at + nalgebra::Vector2::new(6.0, -13.0);
            panel.words(&words, landmark.name(), 12, [0, 220, 255]);
        }
    }
    panel
}

fn legend(picture: &mut Painting, hip: &Hip, plan: Option<HipPlan>) {
    let bottom = PANEL as f64 - 20.0;
    let mut x = 6.0;
    let mut word = |text: &str, colour: Colour| {
        picture.words(&Pixel::new(x, bottom), text, 14, colour);
        x += 8.5 * text.len() as f64 + 12.0;
    };
    word(&format!("{}, APP frame", hip.key()), [255; 3]);
    let Some(plan) = plan else {
        word("no cuts", [255; 3]);
        return;
    };
    for (cut, colour) in Cut::ALL.into_iter().zip(CUTS) {
        word(cut.name(), colour);
    }
    word(
        &format!("fragment {:.1} cm3", plan.map.fragment_cm3()),
        FRAGMENT,
    );
    word("chisel", CHISEL);
    word("rim", SIDES[hip.side.index()]);
}
