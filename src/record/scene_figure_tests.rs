//! Figures of a synthetic scene: an attractant near the top centre, repellents in the corners, axons that converge.

use super::*;
use crate::record::png;
use resvg::usvg;
use std::f64::consts::TAU;

/// What to draw.
#[derive(Clone, Copy)]
struct Synthetic {
    shafts: usize,
    stretch: f64,
    grown: f64,
    cues: bool,
}

const USUAL: Synthetic = Synthetic { shafts: 60, stretch: 1.4, grown: 1.0, cues: true };
const COLUMNS: usize = 40;
const ROWS: usize = 30;

/// Material (800 x 600 µm) to space: stretched in y, narrowed in x most at mid-height.
fn carried([x, y]: [f64; 2], stretch: f64) -> [f64; 2] {
    let waist = 1.0 - 0.2 * (stretch - 1.0) * (1.0 - (2.0 * y / 600.0 - 1.0).powi(2));
    [400.0 + (x - 400.0) * waist, 600.0 * 0.5 * (1.0 - stretch) + stretch * y]
}

fn concentration(point: [f64; 2], centres: &[[f64; 2]], amplitude: f64, length: f64) -> f64 {
    let at = |c: &[f64; 2]| amplitude * (-(point[0] - c[0]).hypot(point[1] - c[1]) / length).exp();
    centres.iter().map(at).sum()
}

fn synthetic_panel(label: &str, what: Synthetic) -> Panel {
    let grid = |i: usize, j: usize| [800.0 * i as f64 / COLUMNS as f64, 600.0 * j as f64 / ROWS as f64];
    let material: Vec<[f64; 2]> = (0..=ROWS).flat_map(|j| (0..=COLUMNS).map(move |i| grid(i, j))).collect();
    let at = |i: usize, j: usize| (j * (COLUMNS + 1) + i) as u32;
    let square =
        |i: usize, j: usize| [at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j), at(i + 1, j + 1), at(i, j + 1)];
    let edge = |name: &str, points: Vec<[f64; 2]>| BorderLine {
        name: name.to_owned(),
        points: points.iter().map(|&point| carried(point, what.stretch)).collect(),
    };
    let corners = [[60.0, 60.0], [740.0, 60.0], [60.0, 540.0], [740.0, 540.0]];
    let layer = |name: &str, effect, centres: &[[f64; 2]], amplitude, length| CueLayer {
        name: name.to_owned(),
        effect,
        concentration: material.iter().map(|&p| concentration(p, centres, amplitude, length)).collect(),
    };
    let cues = vec![
        layer("netrin-1", Effect::Attract, &[[400.0, 540.0]], 28.0, 130.0),
        layer("slit", Effect::Repel, &corners, 14.0, 40.0),
    ];
    let disc = (0..40).map(|i| TAU * f64::from(i) / 40.0).map(|a| [400.0 + 50.0 * a.cos(), 540.0 + 50.0 * a.sin()]);
    let shafts: Vec<Vec<[f64; 2]>> = (0..what.shafts).map(|axon| synthetic_shaft(axon, what)).collect();
    let tips = shafts.iter().enumerate().filter_map(|(axon, shaft)| {
        let position = *shaft.last()?;
        let arrived = what.grown >= 1.0 && axon % 3 != 0;
        let status = if arrived { TipStatus::Arrived } else { TipStatus::Growing };
        Some(Tip { position, status: if axon % 97 == 5 { TipStatus::Stalled } else { status } })
    });
    Panel {
        label: label.to_owned(),
        note: String::new(),
        vertices: material.iter().map(|&point| carried(point, what.stretch)).collect(),
        cells: (0..ROWS).flat_map(|j| (0..COLUMNS).flat_map(move |i| square(i, j))).collect(),
        borders: vec![
            edge("bottom", (0..=COLUMNS).map(|i| grid(i, 0)).collect()),
            edge("right", (0..=ROWS).map(|j| grid(COLUMNS, j)).collect()),
            edge("top", (0..=COLUMNS).map(|i| grid(i, ROWS)).collect()),
            edge("left", (0..=ROWS).map(|j| grid(0, j)).collect()),
        ],
        cues: if what.cues { cues } else { Vec::new() },
        tips: tips.collect(),
        shafts,
        targets: vec![disc.map(|point| carried(point, what.stretch)).collect()],
    }
}

fn synthetic_shaft(axon: usize, what: Synthetic) -> Vec<[f64; 2]> {
    let fraction = |step: f64| (axon as f64 * step).fract();
    let (birth, lag) = (40.0 + 720.0 * fraction(0.618_034), 0.25 * fraction(0.414_214));
    let end = (what.grown - lag).max(0.02) * (0.85 + 0.15 * fraction(0.732_051));
    let wiggle = |s: f64| 14.0 * (17.0 * s + 40.0 * fraction(0.236_068)).sin() * s * (1.0 - s) * 2.0;
    (0..=120)
        .map(|i| end * f64::from(i) / 120.0)
        .map(|s| {
            let pull = s.powf(1.6) * if what.cues { 0.94 } else { 0.05 };
            carried([birth + (400.0 - birth) * pull + wiggle(s), 545.0 * s], what.stretch)
        })
        .collect()
}

fn three_panels(what: Synthetic) -> SceneFigure {
    let at = |label, stretch, grown| synthetic_panel(label, Synthetic { stretch, grown, ..what });
    let panels = vec![at("t = 0 h", 1.0, 0.05), at("t = 36 h", 1.2, 0.6), at("t = 72 h", 1.4, 1.0)];
    SceneFigure::new(
        "Complete model: 500 axons in a stretching tissue",
        "seed 1; λ = 2, κ = 0.93 h⁻¹, 1.4 × in y",
        panels,
    )
}

/// The boxes of all texts of an SVG.
fn text_boxes(tree: &usvg::Tree) -> Vec<usvg::tiny_skia_path::Rect> {
    fn collect(group: &usvg::Group, boxes: &mut Vec<usvg::tiny_skia_path::Rect>) {
        for node in group.children() {
            match node {
                usvg::Node::Path(path) if path.id() == "text" => boxes.push(path.abs_bounding_box()),
                usvg::Node::Group(inner) => collect(inner, boxes),
                _ => {}
            }
        }
    }
    let mut boxes = Vec::new();
    collect(tree.root(), &mut boxes);
    boxes
}

fn assert_well_laid(figure: &SceneFigure) -> String {
    let drawing = draw(figure).unwrap();
    let svg = drawing.finish();
    // Embedded data may hold any letters, but neither quotes nor spaces nor brackets.
    let wrong = ["\"NaN", " NaN", ">NaN", "\"inf", " inf"];
    assert!(!wrong.iter().any(|text| svg.contains(text)));
    let tree = usvg::Tree::from_str(&drawing.outlined(), &usvg::Options::default()).unwrap();
    let boxes = text_boxes(&tree);
    for (index, one) in boxes.iter().enumerate() {
        let inside = one.left() >= 0.0 && one.top() >= 0.0;
        let inside = inside && one.right() <= tree.size().width() && one.bottom() <= tree.size().height();
        assert!(inside, "text {index} is clipped: {one:?}");
        for other in &boxes[index + 1..] {
            let apart = one.right() <= other.left() || other.right() <= one.left();
            // Boxes of lines include room for accents and descenders that the text does not use.
            let apart = apart || one.bottom() <= other.top() + 1.5 || other.bottom() <= one.top() + 1.5;
            assert!(apart, "texts overlap: {one:?} {other:?}");
        }
    }
    svg
}

#[test]
fn no_text_overlaps_or_is_clipped_in_any_arrangement() {
    let names = ["complete model", "without homophilic attraction between the axons", "no cues", "fixed matrix"];
    for count in [1, 3, 4] {
        let what = |i: usize| Synthetic { shafts: 5, cues: i != 2, ..USUAL };
        let panels = (0..count).map(|i| synthetic_panel(names[i], what(i))).collect();
        assert_well_laid(&SceneFigure::new(
            "A title long enough to be broken into lines in a narrow figure",
            "",
            panels,
        ));
    }
}

#[test]
fn a_panel_without_cues_axons_or_targets_has_no_bars_and_no_nan() {
    let mut panel = synthetic_panel("bare", Synthetic { shafts: 0, cues: false, ..USUAL });
    panel.targets.clear();
    let svg = assert_well_laid(&SceneFigure::new("", "", vec![panel.clone()]));
    assert!(!svg.contains("linearGradient") && !svg.contains("(nM)"));
    panel.cues =
        vec![CueLayer { name: "zero".into(), effect: Effect::Attract, concentration: vec![0.0; panel.vertices.len()] }];
    assert!(!assert_well_laid(&SceneFigure::new("", "", vec![panel])).contains("(nM)"));
}

#[test]
fn titles_with_signs_special_to_xml_are_shown() {
    let panel = synthetic_panel("v < 20 & \"κ\" > 0", Synthetic { shafts: 2, ..USUAL });
    assert!(assert_well_laid(&SceneFigure::new("a<b>&c", "", vec![panel])).contains("a&lt;b&gt;&amp;c"));
}

#[test]
fn a_figure_of_500_axons_is_below_one_and_a_half_megabytes() {
    let svg = draw(&three_panels(Synthetic { shafts: 500, ..USUAL })).unwrap().finish();
    assert!(svg.len() < 1_500_000, "{} bytes", svg.len());
}

#[test]
fn many_shafts_become_a_density_of_bounded_size() {
    let svg = draw(&three_panels(Synthetic { shafts: MOST_LINES + 1, ..USUAL })).unwrap().finish();
    assert!(svg.contains("axons at a point") && svg.len() < 1_500_000, "{} bytes", svg.len());
}

#[test]
fn the_same_figure_gives_the_same_bytes() {
    let figure = SceneFigure::new("", "", vec![synthetic_panel("t = 0 h", Synthetic { shafts: 9, ..USUAL })]);
    let (one, other) = (draw(&figure).unwrap(), draw(&figure).unwrap());
    assert_eq!(one, other);
    assert_eq!(png::to_png(&one.outlined(), 1.0).unwrap(), png::to_png(&other.outlined(), 1.0).unwrap());
}

#[test]
fn the_field_is_purple_at_the_attractant_and_blue_at_a_repellent() {
    let figure = SceneFigure::new("", "", vec![synthetic_panel("x", Synthetic { shafts: 0, stretch: 1.0, ..USUAL })]);
    let layout = Layout::of(&figure).unwrap();
    let picture = png::to_png(&draw(&figure).unwrap().outlined(), 1.0).unwrap();
    let picture = resvg::tiny_skia::Pixmap::decode_png(&picture).unwrap();
    let view = layout.cell(0).view;
    let colour = |x: f64, y: f64| {
        let place = [view.corner[0] + view.scale * (x - view.left), view.corner[1] + view.scale * (view.top - y)];
        let pixel = picture.pixel(place[0] as u32, place[1] as u32).unwrap();
        [pixel.red(), pixel.green(), pixel.blue()].map(i32::from)
    };
    let ([r, g, b], [r2, g2, b2]) = (colour(400.0, 530.0), colour(60.0, 60.0));
    assert!(r > g + 20 && b > g + 20, "purple: {r} {g} {b}");
    assert!(b2 > r2 + 20 && g2 > r2, "light blue: {r2} {g2} {b2}");
}

#[test]
fn data_that_do_not_fit_are_refused_by_name() {
    let good = synthetic_panel("x", Synthetic { shafts: 1, ..USUAL });
    let refuse = |change: &dyn Fn(&mut Panel)| {
        let mut bad = good.clone();
        change(&mut bad);
        draw(&SceneFigure::new("", "", vec![good.clone(), bad])).unwrap_err()
    };
    let count = good.vertices.len();
    assert_eq!(draw(&SceneFigure::new("", "", vec![])), Err(FigureError::NoPanel));
    assert_eq!(refuse(&|p| p.shafts[0][3][0] = f64::NAN), FigureError::NotFinite { panel: 1, what: "shafts" });
    assert_eq!(
        refuse(&|p| p.cells[5] = 99_999),
        FigureError::NoSuchVertex { panel: 1, entry: 5, vertex: 99_999, count }
    );
    let cue = "slit".to_owned();
    let short = refuse(&|p| p.cues[1].concentration.truncate(count - 1));
    assert_eq!(short, FigureError::Concentration { panel: 1, cue, found: count - 1, expected: count });
    let empty = draw(&SceneFigure::new("", "", vec![Panel::default()]));
    assert!(matches!(empty, Err(FigureError::NoExtent { .. })));
}
