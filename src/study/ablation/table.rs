//! The table of an ablation for a terminal: a few measures, each with its difference to the full model.

use super::{Ablation, Arm};
use crate::record::statistics::SummaryOverSeeds;
use std::fmt;

/// A column: heading, and the measure's place in the summary of a run.
struct Column {
    heading: &'static str,
    measure: String,
    decimals: usize,
}

impl Ablation {
    /// The columns that any arm has a value for.
    fn columns(&self) -> Vec<Column> {
        let mut wanted = vec![("hit fraction", "hits.fraction".to_owned())];
        if let Some(last) = self.heights.len().checked_sub(1) {
            wanted.push(("spread [um]", format!("heights.{last}.spread_um")));
            wanted.push(("largest fascicle", format!("heights.{last}.fascicles.largest_fraction")));
            wanted.push(("like neighbours", format!("heights.{last}.like_neighbours")));
        }
        wanted.push(("length [um]", "length_um.mean".to_owned()));
        wanted.push(("turning [deg]", "turning_angle_deg.mean".to_owned()));
        let column = |(heading, measure): (&'static str, String)| {
            let means = self.arms.iter().filter_map(|arm| arm.measures.get(&measure)).map(|found| found.mean.abs());
            let largest = means.reduce(f64::max)?;
            let decimals = [1.0, 10.0, 100.0].iter().filter(|size| largest < **size).count();
            Some(Column { heading, measure, decimals })
        };
        wanted.into_iter().filter_map(column).collect()
    }

    /// Why arms were skipped, and which ones.
    fn skipped(&self) -> Vec<(&str, Vec<&str>)> {
        let mut reasons: Vec<(&str, Vec<&str>)> = Vec::new();
        for (arm, reason) in self.arms.iter().filter_map(|arm| Some((arm, arm.skipped.as_deref()?))) {
            match reasons.iter_mut().find(|(known, _)| *known == reason) {
                Some((_, names)) => names.push(&arm.name),
                None => reasons.push((reason, vec![&arm.name])),
            }
        }
        reasons
    }
}

impl fmt::Display for Ablation {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let count = self.seeds.len();
        writeln!(f, "{}: {} arms, {count} {}", self.scene, self.arms.len(), if count == 1 { "seed" } else { "seeds" })?;
        let columns = self.columns();
        let mut lines = vec![(String::new(), columns.iter().map(|column| column.heading.to_owned()).collect())];
        for arm in &self.arms {
            lines.extend(lines_of(arm, &columns));
        }
        let width = |texts: &mut dyn Iterator<Item = usize>| texts.max().unwrap_or(0);
        let first = width(&mut lines.iter().map(|(head, _)| head.chars().count()));
        let widths: Vec<usize> = (0..columns.len())
            .map(|k| width(&mut lines.iter().filter_map(|(_, cells)| cells.get(k)).map(String::len)))
            .collect();
        for (head, cells) in &lines {
            let mut line = format!("  {head:first$}");
            cells.iter().zip(&widths).for_each(|(cell, width)| line.push_str(&format!("  {cell:width$}")));
            writeln!(f, "{}", line.trim_end())?;
        }
        for (reason, names) in self.skipped() {
            writeln!(f, "  skipped: {}, because {reason}", names.join(", "))?;
        }
        for arm in &self.arms {
            if let Some(failure) = arm.failures.first() {
                let (failed, of) = (arm.failures.len(), self.seeds.len());
                writeln!(
                    f,
                    "  {} failed for {failed} of {of} seeds; seed {}: {}",
                    arm.name, failure.seed, failure.account
                )?;
            }
        }
        let at_height = columns.iter().any(|column| column.measure.starts_with("heights."));
        if let Some(height) = self.heights.last().filter(|_| at_height) {
            writeln!(f, "  spread and largest fascicle at {height} of the tissue's height")?;
        }
        if self.arms.len() > 1 {
            writeln!(f, "  second lines: arm minus full model [95 % bootstrap interval over seeds]; * excludes zero")?;
        }
        let super::Solved { matrix_solves, cue_solves, cue_factorisations, .. } = self.solved;
        writeln!(
            f,
            "  {} runs solved {matrix_solves} equilibria and {cue_solves} cue fields ({cue_factorisations} factorisations) together",
            self.runs
        )
    }
}

/// The arm's means, and under them its differences.
fn lines_of(arm: &Arm, columns: &[Column]) -> Vec<(String, Vec<String>)> {
    if arm.measures.is_empty() {
        return vec![(arm.name.clone(), vec![arm.status().to_owned()])];
    }
    let mean = |column: &Column| match arm.measures.get(&column.measure) {
        Some(found) => fixed(found.mean, column.decimals),
        None => "-".to_owned(),
    };
    let difference = |column: &Column| match arm.differences.get(&column.measure) {
        Some(found) => {
            let mark = if arm.differs(&column.measure) { "*" } else { "" };
            format!("{}{mark}", with_interval(found, column.decimals))
        }
        None => String::new(),
    };
    let mut lines = vec![(arm.name.clone(), columns.iter().map(mean).collect())];
    if !arm.differences.is_empty() {
        lines.push((String::new(), columns.iter().map(difference).collect()));
    }
    lines
}

fn with_interval(found: &SummaryOverSeeds, decimals: usize) -> String {
    let sign = if found.mean > 0.0 { "+" } else { "" };
    let interval = found.low.zip(found.high).map(|ends| [ends.0, ends.1].map(|end| fixed(end, decimals)).join(", "));
    let interval = interval.map_or(String::new(), |ends| format!(" [{ends}]"));
    format!("{sign}{}{interval}", fixed(found.mean, decimals))
}

/// A number with so many decimals; one that rounds to zero has no sign.
fn fixed(value: f64, decimals: usize) -> String {
    let text = format!("{value:.decimals$}");
    match text.strip_prefix('-') {
        Some(rest) if rest.chars().all(|sign| sign == '0' || sign == '.') => rest.to_owned(),
        _ => text,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn differences_carry_a_sign_and_zero_carries_none() {
        let of = |mean: f64, low: f64, high: f64| {
            with_interval(&SummaryOverSeeds { mean, low: Some(low), high: Some(high), n: 3 }, 2)
        };
        assert_eq!(of(0.254, 0.1, 0.3), "+0.25 [0.10, 0.30]");
        assert_eq!(of(-0.254, -0.3, -0.001), "-0.25 [-0.30, 0.00]");
        assert_eq!(of(0.0, 0.0, 0.0), "0.00 [0.00, 0.00]");
        let one = SummaryOverSeeds { mean: 1.0, low: None, high: None, n: 1 };
        assert_eq!(with_interval(&one, 0), "+1");
    }
}
