//! Paths of vectors along a parameter: values and slopes at levels, cubic Hermite between them.
//!
//! On an interval `[s₀, s₁]` with `h = s₁ − s₀` and `t = (s − s₀)/h`
//! ```text
//! y(s) = (1 + 2t)(1 − t)² y₀ + t²(3 − 2t) y₁ + h t (1 − t)² y₀' − h t² (1 − t) y₁',
//! ```
//! continuous with its first derivative, of order 4 in `h` (order 3 in the derivative). Whoever moves by the derivative of the
//! path arrives where the path says: both come from the same polynomial.
//!
//! The parameter is abstract: a load here, but a time for materials with history.

use std::collections::VecDeque;

/// What is known at one level of a path.
#[derive(Debug, Clone, PartialEq)]
pub struct Level {
    /// The path parameter.
    pub parameter: f64,
    /// The vector at the level.
    pub value: Vec<f64>,
    /// Its derivative with respect to the parameter.
    pub slope: Vec<f64>,
}

/// Why levels do not make a path.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
pub enum HermiteError {
    /// There is no level.
    #[error("a path needs at least one level")]
    Empty,
    /// The parameters do not increase.
    #[error("level {level} has the parameter {parameter}, which must be finite and above that of the level before")]
    Order {
        /// Which level.
        level: usize,
        /// Its parameter.
        parameter: f64,
    },
    /// Value and slope differ in length, or from those of the first level.
    #[error("level {level} has {value} values and {slope} slopes, but the path has {wanted} components")]
    Length {
        /// Which level.
        level: usize,
        /// Length of its value.
        value: usize,
        /// Length of its slope.
        slope: usize,
        /// Length of the first level's value.
        wanted: usize,
    },
}

/// What a path does between two levels.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Interpolation {
    /// The cubic through values and slopes; the derivative is continuous.
    #[default]
    Cubic,
    /// The straight line through the values: of order 2, its derivative constant between levels (order 1). For comparison.
    Linear,
}

/// A vector along a parameter, cubic between levels unless asked otherwise.
#[derive(Debug, Clone, PartialEq)]
pub struct HermitePath {
    levels: Vec<Level>,
    interpolation: Interpolation,
}

/// Where a parameter lies in a path, and the weights there: find once, use for as many components as needed.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct HermiteWeights {
    from: usize,
    to: usize,
    /// Of value and slope at `from`, value and slope at `to`.
    value: [f64; 4],
    derivative: [f64; 4],
}

impl HermitePath {
    /// A path through levels in ascending order.
    ///
    /// # Errors
    /// No level; parameters that do not increase; vectors of different length.
    pub fn new(levels: Vec<Level>) -> Result<Self, HermiteError> {
        let wanted = levels.first().ok_or(HermiteError::Empty)?.value.len();
        for (level, Level { parameter, value, slope }) in levels.iter().enumerate() {
            let rises = level == 0 || *parameter > levels[level - 1].parameter;
            if !(rises && parameter.is_finite()) {
                return Err(HermiteError::Order { level, parameter: *parameter });
            }
            if value.len() != wanted || slope.len() != wanted {
                return Err(HermiteError::Length { level, value: value.len(), slope: slope.len(), wanted });
            }
        }
        Ok(Self { levels, interpolation: Interpolation::Cubic })
    }

    /// The same levels with another course between them.
    pub fn interpolated(self, interpolation: Interpolation) -> Self {
        Self { interpolation, ..self }
    }

    /// The path of what a linear map makes of the vector. The map gives as many components for each level.
    pub fn mapped(&self, map: impl Fn(&[f64]) -> Vec<f64>) -> Self {
        let level =
            |level: &Level| Level { parameter: level.parameter, value: map(&level.value), slope: map(&level.slope) };
        Self { levels: self.levels.iter().map(level).collect(), interpolation: self.interpolation }
    }

    /// The levels, in ascending order of their parameter; there is at least one.
    pub fn levels(&self) -> &[Level] {
        &self.levels
    }

    /// Number of components of the vector.
    pub fn components(&self) -> usize {
        self.levels[0].value.len()
    }

    /// Number of parts: those between neighbouring levels, or one where there is a single level.
    pub fn parts(&self) -> usize {
        (self.levels.len() - 1).max(1)
    }

    /// The four coefficients in Bernstein form of a component over a part.
    pub fn bernstein(&self, part: usize, component: usize) -> [f64; 4] {
        let (from, to) = (&self.levels[part], &self.levels[(part + 1).min(self.levels.len() - 1)]);
        let (first, last) = (from.value[component], to.value[component]);
        let third = (to.parameter - from.parameter) / 3.0;
        match self.interpolation {
            Interpolation::Cubic => {
                [first, first + third * from.slope[component], last - third * to.slope[component], last]
            }
            Interpolation::Linear => [first, (2.0 * first + last) / 3.0, (first + 2.0 * last) / 3.0, last],
        }
    }

    /// Bytes that the levels take.
    pub fn bytes(&self) -> usize {
        self.levels.iter().map(|level| size_of_val(&level.value[..]) + size_of_val(&level.slope[..])).sum()
    }

    /// The weights at a parameter. Outside the levels the path is constant and its derivative zero.
    pub fn locate(&self, parameter: f64) -> HermiteWeights {
        let last = self.levels.len() - 1;
        let above = self.levels.partition_point(|level| level.parameter <= parameter);
        let at_end = parameter == self.levels[last].parameter;
        if last == 0 || above == 0 || (above > last && !at_end) {
            let end = if above == 0 { 0 } else { last };
            return HermiteWeights { from: end, to: end, value: [1.0, 0.0, 0.0, 0.0], derivative: [0.0; 4] };
        }
        let to = above.min(last);
        let from = to - 1;
        let h = self.levels[to].parameter - self.levels[from].parameter;
        let t = (parameter - self.levels[from].parameter) / h;
        let r = 1.0 - t;
        if self.interpolation == Interpolation::Linear {
            return HermiteWeights { from, to, value: [r, 0.0, t, 0.0], derivative: [-1.0 / h, 0.0, 1.0 / h, 0.0] };
        }
        HermiteWeights {
            from,
            to,
            value: cubic(t, h),
            derivative: [-6.0 * t * r / h, r * (1.0 - 3.0 * t), 6.0 * t * r / h, t * (3.0 * t - 2.0)],
        }
    }

    /// One component of the vector and its derivative with respect to the parameter, at weights from [`Self::locate`].
    #[inline]
    pub fn component(&self, weights: &HermiteWeights, component: usize) -> (f64, f64) {
        let (from, to) = (&self.levels[weights.from], &self.levels[weights.to]);
        let data = [from.value[component], from.slope[component], to.value[component], to.slope[component]];
        (combine(&weights.value, data), combine(&weights.derivative, data))
    }

    /// [`Self::component`] without the derivative.
    #[inline]
    pub fn value(&self, weights: &HermiteWeights, component: usize) -> f64 {
        let (from, to) = (&self.levels[weights.from], &self.levels[weights.to]);
        combine(
            &weights.value,
            [from.value[component], from.slope[component], to.value[component], to.slope[component]],
        )
    }

    /// Writes the vector at a parameter into `out`; constant outside the levels.
    pub fn evaluate(&self, parameter: f64, out: &mut [f64]) {
        let weights = self.locate(parameter);
        self.combine_into(&weights, &weights.value, out);
    }

    /// Writes the derivative of [`Self::evaluate`] with respect to the parameter into `out`; zero outside the levels.
    pub fn derivative(&self, parameter: f64, out: &mut [f64]) {
        let weights = self.locate(parameter);
        self.combine_into(&weights, &weights.derivative, out);
    }

    fn combine_into(&self, place: &HermiteWeights, weights: &[f64; 4], out: &mut [f64]) {
        let (from, to) = (&self.levels[place.from], &self.levels[place.to]);
        let starts = from.value.iter().zip(&from.slope);
        let ends = to.value.iter().zip(&to.slope);
        for (out, ((a, b), (c, d))) in out.iter_mut().zip(starts.zip(ends)) {
            *out = combine(weights, [*a, *b, *c, *d]);
        }
    }
}

impl HermiteWeights {
    /// The number of the part that the parameter lies in, or that is nearest.
    pub fn part(&self) -> usize {
        if self.from == self.to { self.from.saturating_sub(1) } else { self.from }
    }
}

/// Weights of the cubic at a share `t` of a part of length `h`.
fn cubic(t: f64, h: f64) -> [f64; 4] {
    let r = 1.0 - t;
    [(1.0 + 2.0 * t) * r * r, h * t * r * r, t * t * (3.0 - 2.0 * t), -h * t * t * r]
}

#[inline]
fn combine(weights: &[f64; 4], data: [f64; 4]) -> f64 {
    weights[0] * data[0] + weights[1] * data[1] + weights[2] * data[2] + weights[3] * data[3]
}

/// When to stop refining.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Refinement {
    /// The defect to be met at the middle of every interval, in the units that the caller's `defect` returns.
    pub tolerance: f64,
    /// No more levels than these (those given are kept, even if more).
    pub max_levels: usize,
}

/// What refining came to.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RefinementReport {
    /// Evaluations beyond the levels given.
    pub solves: usize,
    /// Largest defect among the last checks of all parts of the path: each measured *before* the middle that was evaluated for
    /// the check became a level, so the path is better (about 16 times where it is smooth).
    pub worst_defect: f64,
    /// Whether every part met the tolerance; false if `max_levels` came first.
    pub met: bool,
}

/// Value and slope of a path at one parameter.
pub type ValueAndSlope = (Vec<f64>, Vec<f64>);

/// Evaluates the levels at `parameters` (ascending), each with the tangent at the one before as the guess (none for the first),
/// then refines by [`refine_path`]. `E` must be able to say that the levels make no path.
///
/// # Errors
/// The first error of `evaluate`; parameters that do not increase, or vectors of different length.
pub fn refine<E: From<HermiteError>>(
    parameters: &[f64],
    mut evaluate: impl FnMut(f64, Option<&[f64]>) -> Result<ValueAndSlope, E>,
    mut defect: impl FnMut(&[f64], &[f64]) -> f64,
    goal: Refinement,
) -> Result<(HermitePath, RefinementReport), E> {
    let mut levels: Vec<Level> = Vec::with_capacity(parameters.len());
    for &parameter in parameters {
        let guess = levels.last().map(|level| tangent_guess(level, parameter));
        let (value, slope) = evaluate(parameter, guess.as_deref())?;
        levels.push(Level { parameter, value, slope });
    }
    refine_path(HermitePath::new(levels)?, evaluate, |_, interpolated, exact| defect(interpolated, exact), goal)
}

/// The tangent predictor: value plus slope times the way from a level.
pub fn tangent_guess(level: &Level, parameter: f64) -> Vec<f64> {
    let way = parameter - level.parameter;
    level.value.iter().zip(&level.slope).map(|(value, slope)| value + way * slope).collect()
}

/// The cubic through two levels, gone on with beyond the second: of order 4 in the way where the tangent is of order 2.
pub fn cubic_guess([before, level]: [&Level; 2], parameter: f64) -> Vec<f64> {
    let h = level.parameter - before.parameter;
    let weights = cubic((parameter - before.parameter) / h, h);
    let ends = before.value.iter().zip(&before.slope).zip(level.value.iter().zip(&level.slope));
    ends.map(|((a, b), (c, d))| combine(&weights, [*a, *b, *c, *d])).collect()
}

/// Adds levels until the interpolant meets the tolerance at the middle of every interval.
///
/// `evaluate(s, guess)` returns value and slope at `s`; the guess is the interpolant there. `defect(s, interpolated, exact)` says
/// how far the two are. A middle that was evaluated becomes a level, met or not, so nothing is solved twice. The widest parts
/// are checked first, so that a cap on the levels spreads them evenly; order and result are deterministic.
///
/// # Errors
/// The first error of `evaluate`; vectors of different length.
pub fn refine_path<E: From<HermiteError>>(
    path: HermitePath,
    mut evaluate: impl FnMut(f64, Option<&[f64]>) -> Result<ValueAndSlope, E>,
    mut defect: impl FnMut(f64, &[f64], &[f64]) -> f64,
    goal: Refinement,
) -> Result<(HermitePath, RefinementReport), E> {
    let HermitePath { mut levels, interpolation } = path;
    let mut report = RefinementReport { solves: 0, worst_defect: 0.0, met: true };
    // Parts still to be checked, by their ends, with the defect that their parent had.
    let mut open: VecDeque<(f64, f64, f64)> =
        levels.windows(2).map(|pair| (pair[0].parameter, pair[1].parameter, f64::INFINITY)).collect();
    while let Some((start, end, inherited)) = open.pop_front() {
        let middle = 0.5 * (start + end);
        if levels.len() >= goal.max_levels || !(start < middle && middle < end) {
            report.met = false;
            report.worst_defect = report.worst_defect.max(inherited);
            continue;
        }
        let above = levels.partition_point(|level| level.parameter < middle);
        let part = HermitePath { levels: levels[above - 1..=above].to_vec(), interpolation };
        let mut guess = vec![0.0; part.components()];
        part.evaluate(middle, &mut guess);
        let (value, slope) = evaluate(middle, Some(&guess))?;
        report.solves += 1;
        let found = defect(middle, &guess, &value);
        levels.insert(above, Level { parameter: middle, value, slope });
        if found <= goal.tolerance {
            report.worst_defect = report.worst_defect.max(found);
        } else {
            open.extend([(start, middle, found), (middle, end, found)]);
        }
    }
    Ok((HermitePath::new(levels)?.interpolated(interpolation), report))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn wave(s: f64) -> ValueAndSlope {
        (vec![(3.0 * s).sin(), (2.0 * s).exp()], vec![3.0 * (3.0 * s).cos(), 2.0 * (2.0 * s).exp()])
    }

    fn sampled(parameters: &[f64], function: impl Fn(f64) -> ValueAndSlope) -> HermitePath {
        let level = |&parameter: &f64| {
            let (value, slope) = function(parameter);
            Level { parameter, value, slope }
        };
        HermitePath::new(parameters.iter().map(level).collect()).unwrap()
    }

    fn largest_difference(a: &[f64], b: &[f64]) -> f64 {
        a.iter().zip(b).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max)
    }

    #[test]
    fn a_linear_path_is_the_chord_and_its_slope() {
        let path = sampled(&[0.0, 0.5, 1.0], wave).interpolated(Interpolation::Linear);
        let (mut value, mut slope) = ([0.0; 2], [0.0; 2]);
        path.evaluate(0.7, &mut value);
        path.derivative(0.7, &mut slope);
        let (a, b) = (wave(0.5).0, wave(1.0).0);
        for k in 0..2 {
            assert!((value[k] - (0.6 * a[k] + 0.4 * b[k])).abs() < 1e-15);
            assert!((slope[k] - 2.0 * (b[k] - a[k])).abs() < 1e-14);
        }
    }

    #[test]
    fn a_cubic_is_reproduced_with_its_derivative_on_uneven_levels() {
        let cubic = |s: f64| (vec![1.0 - s + 2.0 * s * s - 3.0 * s.powi(3)], vec![-1.0 + 4.0 * s - 9.0 * s * s]);
        let path = sampled(&[-0.5, 0.1, 0.2, 1.3], cubic);
        let mut out = [0.0];
        for k in 0..=36 {
            let s = -0.5 + 0.05 * k as f64;
            path.evaluate(s, &mut out);
            assert!((out[0] - cubic(s).0[0]).abs() < 1e-14);
            path.derivative(s, &mut out);
            assert!((out[0] - cubic(s).1[0]).abs() < 1e-13, "{s}");
        }
    }

    #[test]
    fn the_interpolant_is_of_order_four_and_its_derivative_of_order_three() {
        let error = |intervals: usize| {
            let parameters: Vec<f64> = (0..=intervals).map(|k| k as f64 / intervals as f64).collect();
            let path = sampled(&parameters, wave);
            let (mut value, mut slope) = ([0.0; 2], [0.0; 2]);
            let mut worst = [0.0f64; 2];
            for k in 0..1000 {
                let s = k as f64 / 1000.0;
                path.evaluate(s, &mut value);
                path.derivative(s, &mut slope);
                worst[0] = worst[0].max(largest_difference(&value, &wave(s).0));
                worst[1] = worst[1].max(largest_difference(&slope, &wave(s).1));
            }
            worst
        };
        let (coarse, fine) = (error(8), error(32));
        let order = |i: usize| (coarse[i] / fine[i]).log2() / 2.0;
        assert!((order(0) - 4.0).abs() < 0.2 && (order(1) - 3.0).abs() < 0.2, "{} {}", order(0), order(1));
    }

    #[test]
    fn outside_the_levels_a_path_stands_still_and_at_its_ends_it_has_its_slopes() {
        let path = sampled(&[0.0, 0.5, 1.0], wave);
        let mut out = [0.0; 2];
        for (s, value, slope) in
            [(-1.0, wave(0.0).0, vec![0.0; 2]), (2.0, wave(1.0).0, vec![0.0; 2]), (1.0, wave(1.0).0, wave(1.0).1)]
        {
            path.evaluate(s, &mut out);
            assert!(largest_difference(&out, &value) < 1e-15 * 16.0);
            path.derivative(s, &mut out);
            assert!(largest_difference(&out, &slope) < 1e-15 * 16.0, "{s}");
            let weights = path.locate(s);
            assert_eq!(path.component(&weights, 1).1, out[1]);
        }
    }

    #[test]
    fn refining_meets_the_tolerance_everywhere_and_solves_nothing_twice() {
        let mut asked: Vec<u64> = Vec::new();
        let evaluate = |s: f64, _: Option<&[f64]>| -> Result<ValueAndSlope, HermiteError> {
            asked.push(s.to_bits());
            // A layer at 0.7: levels must gather there.
            let t = (s - 0.7) / 0.02;
            Ok((vec![t.tanh()], vec![(1.0 - t.tanh().powi(2)) / 0.02]))
        };
        let goal = Refinement { tolerance: 1e-5, max_levels: 1000 };
        let (path, report) = refine(&[0.0, 0.5, 1.0], evaluate, largest_difference, goal).unwrap();
        assert!(report.met && report.worst_defect <= 1e-5);
        assert_eq!(path.levels().len(), report.solves + 3);
        asked.sort_unstable();
        asked.dedup();
        assert_eq!(asked.len(), path.levels().len());
        let mut out = [0.0];
        for k in 0..=5000 {
            let s = k as f64 / 5000.0;
            path.evaluate(s, &mut out);
            assert!((out[0] - ((s - 0.7) / 0.02).tanh()).abs() < 1e-5, "{s}");
        }
        let near = path.levels().iter().filter(|level| (level.parameter - 0.7).abs() < 0.1).count();
        assert!(2 * near > path.levels().len(), "{near} of {}", path.levels().len());
    }

    #[test]
    fn a_cap_on_the_levels_is_kept_and_said() {
        let evaluate = |s: f64, _: Option<&[f64]>| -> Result<ValueAndSlope, HermiteError> { Ok(wave(s)) };
        let goal = Refinement { tolerance: 1e-12, max_levels: 9 };
        let (path, report) = refine(&[0.0, 1.0], evaluate, largest_difference, goal).unwrap();
        assert!(!report.met && report.worst_defect > 1e-12 && report.worst_defect < 1e-3);
        let spacing: Vec<f64> = path.levels().windows(2).map(|w| w[1].parameter - w[0].parameter).collect();
        assert_eq!(spacing, [0.125; 8]);
    }

    #[test]
    fn the_guess_of_a_march_is_the_tangent_and_of_a_check_the_interpolant() {
        let line = |s: f64| (vec![2.0 - 5.0 * s], vec![-5.0]);
        let evaluate = |s: f64, guess: Option<&[f64]>| -> Result<ValueAndSlope, HermiteError> {
            if s > 0.0 {
                assert!((guess.unwrap()[0] - line(s).0[0]).abs() < 1e-15 * 8.0);
            }
            Ok(line(s))
        };
        let goal = Refinement { tolerance: 1e-12, max_levels: 9 };
        assert!(refine(&[0.0, 0.3, 1.0], evaluate, largest_difference, goal).unwrap().1.met);
    }

    #[test]
    fn levels_out_of_order_or_of_unequal_length_are_refused() {
        let level = |parameter: f64, n: usize| Level { parameter, value: vec![0.0; n], slope: vec![0.0; n] };
        assert_eq!(HermitePath::new(vec![]), Err(HermiteError::Empty));
        let falling = HermitePath::new(vec![level(1.0, 1), level(1.0, 1)]);
        assert_eq!(falling, Err(HermiteError::Order { level: 1, parameter: 1.0 }));
        assert!(matches!(HermitePath::new(vec![level(0.0, 1), level(1.0, 2)]), Err(HermiteError::Length { .. })));
    }
}
