//! Tables over draws.

use crate::draws::{COMPONENTS, Draw};
use pao_sim::surgery::Cut;

const CAUSES: [&str; 5] = [
    "fragment-pelvis",
    "joined femur-pelvis",
    "femur-pelvis",
    "femur-fragment",
    "containment",
];

/// Prints all tables. Draws are ordered by hip and fragment.
pub fn print(draws: &[Draw]) {
    println!("## Accepted movements\n");
    println!(
        "| hips | fragments | rotation deg | translation mm | accepted | {} |",
        CAUSES.join(" | ")
    );
    println!("|---|---|---|---|---|{}", "---|".repeat(CAUSES.len()));
    for hip in draws.chunk_by(|a, b| a.hip == b.hip) {
        accepted_row(&hip[0].hip, hip);
    }
    accepted_row("all", draws);

    println!("\n## Between and within fragments\n");
    between(draws);
    println!("\n## By the size of the draw\n");
    by_size(draws);
    println!("\n## By component\n");
    by_component(draws);
    println!("\n## Where rejected fragments overlap the pelvis\n");
    by_cut(draws);
    println!("\n## The same draws under other tests\n");
    other_tests(draws);
}

fn fragments(draws: &[Draw]) -> impl Iterator<Item = &[Draw]> {
    draws.chunk_by(|a, b| (&a.hip, a.fragment) == (&b.hip, b.fragment))
}

fn accepted_row(name: &str, draws: &[Draw]) {
    let free: Vec<&Draw> = draws.iter().filter(|d| d.is_free()).collect();
    let of =
        |value: fn(&Draw) -> f64| mean_and_sd(&free.iter().map(|d| value(d)).collect::<Vec<_>>());
    let share = |cause: &str| {
        percent(
            draws.iter().filter(|d| d.outcome == cause).count(),
            draws.len(),
        )
    };
    println!(
        "| {name} | {} | {} | {} | {} of {} ({}) | {} |",
        fragments(draws).count(),
        of(|d| d.rotation_deg),
        of(|d| d.translation_mm),
        free.len(),
        draws.len(),
        share("free"),
        CAUSES.map(share).join(" | ")
    );
}

/// Means of fragments, and what is left within them.
fn between(draws: &[Draw]) {
    println!("| | means of fragments | SD of these means | SD within a fragment |");
    println!("|---|---|---|---|");
    for (name, value) in [
        (
            "rotation deg",
            (|d: &Draw| d.rotation_deg) as fn(&Draw) -> f64,
        ),
        ("translation mm", |d| d.translation_mm),
    ] {
        let of_fragment = |draws: &[Draw]| {
            let free: Vec<f64> = draws.iter().filter(|d| d.is_free()).map(value).collect();
            (mean(&free), sd(&free))
        };
        let found: Vec<(f64, f64)> = fragments(draws).map(of_fragment).collect();
        let means: Vec<f64> = found.iter().map(|f| f.0).collect();
        let variances: Vec<f64> = found.iter().map(|f| f.1 * f.1).collect();
        println!(
            "| {name} | {:.2} to {:.2} | {:.2} | {:.2} |",
            means.iter().copied().fold(f64::INFINITY, f64::min),
            means.iter().copied().fold(f64::NEG_INFINITY, f64::max),
            sd(&means),
            mean(&variances).sqrt()
        );
    }
    let mut shares: Vec<f64> = fragments(draws)
        .map(|f| f.iter().filter(|d| d.is_free()).count() as f64 / f.len() as f64)
        .collect();
    shares.sort_by(f64::total_cmp);
    println!(
        "\nAccepted of a fragment's draws: {:.0} % to {:.0} %, median {:.0} %.",
        100.0 * shares[0],
        100.0 * shares[shares.len() - 1],
        100.0 * shares[shares.len() / 2]
    );
}

fn by_size(draws: &[Draw]) {
    println!(
        "| rotation of the draw deg | draws | free | {} |",
        CAUSES[..2].join(" | ")
    );
    println!("|---|---|---|---|---|");
    for bin in 0..7 {
        let low = 5.0 * f64::from(bin);
        let inside = |d: &&Draw| (low..low + 5.0).contains(&d.rotation_deg);
        let drawn: Vec<&Draw> = draws.iter().filter(inside).collect();
        if drawn.is_empty() {
            continue;
        }
        let share = |what: &str| {
            percent(
                drawn.iter().filter(|d| d.outcome == what).count(),
                drawn.len(),
            )
        };
        println!(
            "| {low:.0}-{:.0} | {} | {} | {} | {} |",
            low + 5.0,
            drawn.len(),
            share("free"),
            share(CAUSES[0]),
            share(CAUSES[1])
        );
    }
}

/// Components of all draws and of accepted ones, and the means of what each cause rejects.
fn by_component(draws: &[Draw]) {
    let causes: [(&str, Test); 5] = [
        ("ilium cut", |d| d.cut == "ilium"),
        ("ischium cut", |d| d.cut == "ischium"),
        ("posterior cut", |d| d.cut == "posterior"),
        ("pubis cut", |d| d.cut == "pubis"),
        ("femur as one body", |d| d.outcome == CAUSES[1]),
    ];
    let names = causes.map(|(name, _)| name).join(" | ");
    println!("| | drawn | accepted | mean rejected for {names} |");
    println!("|---|---|---|{}", "---|".repeat(causes.len()));
    for (n, name) in COMPONENTS.iter().enumerate() {
        let of = |kept: Test| -> Vec<f64> {
            let kept = draws.iter().filter(|d| kept(d));
            kept.map(|d| d.components()[n]).collect()
        };
        println!(
            "| {name} | {} | {} | {} |",
            mean_and_sd(&of(|_| true)),
            mean_and_sd(&of(Draw::is_free)),
            causes
                .map(|(_, kept)| format!("{:.1}", mean(&of(kept))))
                .join(" | ")
        );
    }
}

fn by_cut(draws: &[Draw]) {
    let rejected: Vec<&Draw> = draws.iter().filter(|d| d.outcome == CAUSES[0]).collect();
    println!("| cut | share |");
    println!("|---|---|");
    for name in Cut::ALL.map(Cut::name).into_iter().chain([""]) {
        let count = rejected.iter().filter(|d| d.cut == name).count();
        let shown = if name.is_empty() {
            "none: less than a voxel"
        } else {
            name
        };
        println!("| {shown} | {} |", percent(count, rejected.len()));
    }
}

/// Whether a draw is kept.
type Test = fn(&Draw) -> bool;

/// What other tests keep of the same draws, each fragment with equal weight.
fn other_tests(draws: &[Draw]) {
    println!("| test | rotation deg | translation mm | accepted |");
    println!("|---|---|---|---|");
    let rows: [(&str, Test); 6] = [
        ("all", Draw::is_free),
        ("all, on voxels", |d| d.voxel_free == Some(true)),
        ("without the femur", |d| d.outcome != CAUSES[0]),
        ("without overlaps at the pubis cut", |d| {
            d.is_free() || d.cut == "pubis"
        }),
        ("without overlaps at the posterior cut", |d| {
            d.is_free() || d.cut == "posterior"
        }),
        ("none", |_| true),
    ];
    for (name, kept) in rows {
        let (mut rotation, mut translation) = (Weighted::default(), Weighted::default());
        for fragment in fragments(draws) {
            let kept: Vec<&Draw> = fragment.iter().filter(|d| kept(d)).collect();
            for d in &kept {
                rotation.add(d.rotation_deg, 1.0 / kept.len() as f64);
                translation.add(d.translation_mm, 1.0 / kept.len() as f64);
            }
        }
        let count = draws.iter().filter(|d| kept(d)).count();
        if count > 0 {
            println!(
                "| {name} | {} | {} | {} |",
                rotation.mean_and_sd(),
                translation.mean_and_sd(),
                percent(count, draws.len())
            );
        }
    }
    let both = |d: &&Draw| d.voxel_free.is_some();
    let differ = |d: &&Draw| d.voxel_free.is_some_and(|free| free != d.is_free());
    let asked = draws.iter().filter(both).count();
    if asked > 0 {
        let count = draws.iter().filter(differ).count();
        println!(
            "\nSurfaces and voxels differ on {} of the draws.",
            percent(count, asked)
        );
    }
}

#[derive(Default)]
struct Weighted {
    weight: f64,
    sum: f64,
    squares: f64,
}

impl Weighted {
    fn add(&mut self, value: f64, weight: f64) {
        self.weight += weight;
        self.sum += weight * value;
        self.squares += weight * value * value;
    }

    fn mean_and_sd(&self) -> String {
        let mean = self.sum / self.weight;
        let variance = self.squares / self.weight - mean * mean;
        format!("{mean:.2} ± {:.2}", variance.sqrt())
    }
}

fn mean(values: &[f64]) -> f64 {
    values.iter().sum::<f64>() / values.len() as f64
}

fn sd(values: &[f64]) -> f64 {
    let mean = mean(values);
    let squares: f64 = values.iter().map(|v| (v - mean).powi(2)).sum();
    (squares / (values.len() as f64 - 1.0)).sqrt()
}

fn mean_and_sd(values: &[f64]) -> String {
    format!("{:.2} ± {:.2}", mean(values), sd(values))
}

fn percent(count: usize, of: usize) -> String {
    format!("{:.1} %", 100.0 * count as f64 / of as f64)
}
