//! A bench as text and files: a table, a document, a figure.

use super::{Bench, Row};
use crate::record::output::write_atomically;
use crate::record::plot::{Axis, Plot, Series, Stroke, draw};
use crate::study::run::{RunError, write_json, write_picture};
use std::fmt::{self, Display, Write};
use std::path::Path;

/// Writes `bench.json`, `bench.csv` and `bench.svg/.png`.
///
/// # Errors
/// The file that could not be written, or the picture that could not be drawn.
pub fn write(folder: &Path, bench: &Bench) -> Result<(), RunError> {
    write_json(&folder.join("bench.json"), bench)?;
    write_atomically(&folder.join("bench.csv"), table(bench).as_bytes())?;
    let title = format!("{}: what growth cones cost", bench.scene);
    write_picture(folder, "bench", &draw(&title, &subtitle(bench), &[time_plot(bench), memory_plot(bench)])?)
}

fn table(bench: &Bench) -> String {
    let mut text = "axons,cone_steps,cone_hours,seconds,plain_seconds,ratio,difference_um,scenery_seconds,\
                    cone_steps_a_second,cone_hours_a_second,cpu_seconds,cone_steps_a_cpu_second,cone_hours_a_cpu_second,bytes_an_axon\n"
        .to_owned();
    let word = |value: Option<f64>| value.map_or(String::new(), |value| format!("{value:e}"));
    for row in &bench.rows {
        // Writing to a string cannot fail.
        let _ = writeln!(
            text,
            "{},{},{:e},{:e},{},{},{},{:e},{:e},{:e},{},{},{},{}",
            row.axons,
            row.cone_steps,
            row.cone_hours,
            row.seconds.median,
            word(row.plain_seconds.map(|seconds| seconds.median)),
            word(row.ratio),
            word(row.difference),
            row.scenery_seconds,
            row.cone_steps_a_second,
            row.cone_hours_a_second,
            word(row.cpu_seconds),
            word(row.cone_steps_a_cpu_second),
            word(row.cone_hours_a_cpu_second),
            word(row.bytes_an_axon),
        );
    }
    text
}

fn subtitle(bench: &Bench) -> String {
    let growth = bench.growth_in_axons.map_or(String::new(), |power| {
        format!(" The cost of a cone-step grows with the power {power:.2} of their number.")
    });
    format!("Time that cones take, tissue and fields not counted; {} thread(s).{growth}", bench.threads)
}

fn time_plot(bench: &Bench) -> Plot {
    let each = |seconds: f64, row: &Row| [row.axons as f64, 1e6 * seconds / row.cone_steps as f64];
    let own = bench.rows.iter().map(|row| each(row.seconds.median, row));
    let plain = bench.rows.iter().filter_map(|row| Some(each(row.plain_seconds?.median, row)));
    let series = vec![
        Series::new("tropism", own, Stroke::LineAndMarks),
        Series::new("plain arrays", plain, Stroke::LineAndMarks),
    ];
    plot("Time of a cone-step", "us", series)
}

fn memory_plot(bench: &Bench) -> Plot {
    let bytes = bench.rows.iter().filter_map(|row| Some([row.axons as f64, row.bytes_an_axon?]));
    plot("Memory an axon", "bytes", vec![Series::new("tropism", bytes, Stroke::LineAndMarks)])
}

fn plot(title: &str, unit: &str, series: Vec<Series>) -> Plot {
    Plot {
        title: title.into(),
        x: Axis::logarithmic("axons"),
        y: Axis::logarithmic(unit),
        series,
        levels: Vec::new(),
        marks: Vec::new(),
        note: String::new(),
    }
}

impl Display for Bench {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        writeln!(
            formatter,
            "{:>10} {:>12} {:>9} {:>9} {:>6} {:>10} {:>10} {:>9} {:>11} {:>10} {:>9} {:>7}",
            "axons",
            "cone-steps",
            "wall s",
            "plain s",
            "ratio",
            "steps/s",
            "cone-h/s",
            "CPU s",
            "steps/CPU s",
            "h/CPU s",
            "scenery s",
            "B/axon"
        )?;
        let word = |value: Option<f64>, digits: usize| value.map_or("-".into(), |value| format!("{value:.digits$}"));
        for row in &self.rows {
            writeln!(
                formatter,
                "{:>10} {:>12} {:>9.3} {:>9} {:>6} {:>10.0} {:>10.0} {:>9} {:>11} {:>10} {:>9.3} {:>7}",
                row.axons,
                row.cone_steps,
                row.seconds.median,
                word(row.plain_seconds.map(|seconds| seconds.median), 3),
                word(row.ratio, 2),
                row.cone_steps_a_second,
                row.cone_hours_a_second,
                word(row.cpu_seconds, 3),
                word(row.cone_steps_a_cpu_second, 0),
                word(row.cone_hours_a_cpu_second, 0),
                row.scenery_seconds,
                word(row.bytes_an_axon, 0),
            )?;
        }
        for row in &self.rows {
            let mut phases: Vec<_> = row.share.iter().filter(|(_, share)| **share >= 0.01).collect();
            phases.sort_by(|a, b| b.1.total_cmp(a.1));
            let words: Vec<String> =
                phases.iter().map(|(phase, share)| format!("{phase} {:.0} %", 100.0 * *share)).collect();
            writeln!(formatter, "{} axons: {}; time ~ steps^{:.2}", row.axons, words.join(", "), row.growth_in_steps)?;
        }
        if let Some(power) = self.growth_in_axons {
            writeln!(formatter, "the cost of a cone-step grows with the power {power:.2} of the number of axons")?;
        }
        match &self.without_plain {
            Some(reason) => writeln!(formatter, "no plain loop beside: {reason}"),
            None => Ok(()),
        }
    }
}
