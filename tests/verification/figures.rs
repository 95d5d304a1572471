//! Figures of what the tests measure. `docs/src/verification.md` shows copies of them.

use std::path::Path;

use tropism::record::plot::{Axis, Plot, Series, Stroke, draw};

/// Errors over a size (of cells, of steps), with the order in theory and the one that fits them.
pub struct Curve {
    name: String,
    points: Vec<[f64; 2]>,
    theory: f64,
}

impl Curve {
    pub fn new(name: &str, sizes: &[f64], errors: &[f64], [theory, fitted]: [f64; 2]) -> Self {
        let points = sizes.iter().zip(errors).map(|(&size, &error)| [size, error]).collect();
        Self { name: format!("{name}: {fitted:.2}"), points, theory }
    }

    /// The line of the order in theory through the error at the smallest size, and a point that ends it.
    fn expected(&self) -> Vec<[f64; 2]> {
        let &[size, error] = self.points.iter().min_by(|a, b| a[0].total_cmp(&b[0])).unwrap();
        let line = self.points.iter().map(|[x, _]| [*x, error * (x / size).powf(self.theory)]);
        line.chain([[f64::NAN; 2]]).collect()
    }
}

/// Series over two logarithmic axes.
pub fn plot(title: &str, [x, y]: [&str; 2], series: Vec<Series>) -> Plot {
    let (x, y) = (Axis::logarithmic(x), Axis::logarithmic(y));
    Plot { title: title.into(), x, y, series, levels: Vec::new(), marks: Vec::new(), note: String::new() }
}

/// Errors over sizes; a broad pale line under each curve has its order in theory.
pub fn orders(title: &str, axes: [&str; 2], curves: &[Curve]) -> Plot {
    let measured = curves.iter().map(|c| Series::new(c.name.as_str(), c.points.clone(), Stroke::LineAndMarks));
    let mut theory: Vec<f64> = curves.iter().map(|curve| curve.theory).collect();
    theory.sort_by(f64::total_cmp);
    theory.dedup();
    let words: Vec<String> = theory.iter().map(|order| ((order * 100.0).round() / 100.0).to_string()).collect();
    let expected = curves.iter().flat_map(Curve::expected);
    let expected = Series::new(format!("theory: {}", words.join(", ")), expected, Stroke::Underlay);
    plot(title, axes, measured.chain([expected]).collect())
}

/// Writes `<name>.svg` into the folder `figures` of the tests, and demands that the book shows a copy.
pub fn write(name: &str, [title, subtitle]: [&str; 2], plots: &[Plot]) {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join("figures");
    std::fs::create_dir_all(&folder).unwrap();
    std::fs::write(folder.join(format!("{name}.svg")), draw(title, subtitle, plots).unwrap().finish()).unwrap();
    let book = Path::new(env!("CARGO_MANIFEST_DIR")).join("docs");
    let copy = format!("figures/verification_{name}.svg");
    let chapter = std::fs::read_to_string(book.join("src/verification.md")).unwrap();
    assert!(book.join(&copy).is_file() && chapter.contains(&format!("(../{copy})")), "the book does not show {copy}");
}
