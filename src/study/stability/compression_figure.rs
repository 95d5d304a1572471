//! The figure of the matrix in compression.

use super::Figure;
use super::compression::{Case, CompressionMap, Law, Sides};
use crate::record::plot::{Axis, Level, Mark, Plot, Series, Stroke};

fn name(Case { law, poisson, sides }: Case) -> String {
    let sides = if sides == Sides::Free { "free" } else { "confined" };
    let law = if law == Law::NeoHookean { "neo-Hookean, " } else { "" };
    format!("{law}ν = {poisson}, {sides}")
}

fn stroke(sides: Sides) -> Stroke {
    if sides == Sides::Free { Stroke::Line } else { Stroke::Dashed }
}

impl CompressionMap {
    /// Ellipticity, force and Newton's iterations over the stretch, with the first negative eigenvalues.
    pub fn figure(&self) -> Figure {
        let x = || Axis { range: Some([0.5, 1.0]), ..Axis::linear("stretch of the block") };
        let plot = |title: &str, y, series, levels, marks, note: &str| Plot {
            title: title.into(),
            x: x(),
            y,
            series,
            levels,
            marks,
            note: note.into(),
        };
        let shown = |law, poisson| law == Law::StVenantKirchhoff || poisson == 0.3;
        let ellipticity = self.ellipticity.iter().filter(|map| shown(map.law, map.poisson)).map(|map| {
            let case = Case { law: map.law, poisson: map.poisson, sides: map.sides };
            Series::new(name(case), map.curve.iter().copied(), stroke(map.sides))
        });
        let lost = self.ellipticity.iter().filter_map(|map| {
            let at = map.lost_at?;
            Some(Mark { name: format!("{at:.3}"), at: [at, 0.0] })
        });
        let force = self.force.iter().map(|map| {
            let case = Case { law: Law::StVenantKirchhoff, poisson: map.poisson, sides: map.sides };
            Series::new(name(case), map.curve.iter().copied(), stroke(map.sides))
        });
        let newton = self.newton.iter().filter(|map| map.poisson == 0.3 && !map.clamped).map(|map| {
            let case = Case { law: map.law, poisson: map.poisson, sides: map.sides };
            Series::new(name(case), map.iterations.iter().copied(), Stroke::LineAndMarks)
        });
        let finest = self.inertia.iter().map(|map| map.rows).max();
        let buckling = self
            .inertia
            .iter()
            .filter(|map| Some(map.rows) == finest && map.law == Law::StVenantKirchhoff && map.poisson == 0.3);
        let buckling = buckling.filter_map(|map| {
            let sides = if map.sides == Sides::Free { "free" } else { "confined" };
            Some(Level { name: format!("{sides}: unstable below"), at: map.first_negative?, vertical: true })
        });
        let zero = Level { name: "elliptic above".into(), at: 0.0, vertical: false };
        let root = Level { name: "1/√3".into(), at: 1.0 / 3f64.sqrt(), vertical: true };
        Figure {
            name: "compression",
            title: "The matrix in compression",
            subtitle: "a block between sliding ends; St. Venant–Kirchhoff unless named; 20 % per side is a stretch of 0.6",
            plots: vec![
                plot(
                    "ellipticity",
                    Axis { range: Some([-0.5, 1.0]), ..Axis::linear("smallest acoustic eigenvalue over E") },
                    ellipticity.collect(),
                    vec![zero],
                    lost.collect(),
                    "over all directions, at the homogeneous F",
                ),
                plot(
                    "force",
                    Axis::linear("compressive force over E and width"),
                    force.collect(),
                    vec![root],
                    Vec::new(),
                    "of the discrete block; the maximum does not depend on ν",
                ),
                plot(
                    "Newton's method, ν = 0.3",
                    Axis { range: Some([0.0, 12.0]), ..Axis::linear("iterations a level of 2.5 %") },
                    newton.collect(),
                    buckling.collect(),
                    Vec::new(),
                    "vertical: first negative eigenvalue of the tangent",
                ),
            ],
        }
    }
}
