//! `report.html`: one page that holds the scenario, the summary and the recordings of a run or an ablation, or the numbers of a chart,
//! with all that it takes to look at them. It loads nothing from elsewhere.
//!
//! The page itself is `assets/report/template.html`; what is written into it are data, in which no `<` is left as it is.

use base64::Engine;
use base64::prelude::BASE64_STANDARD;
use serde::Serialize;
use serde_json::Value;
use std::collections::BTreeMap;

const TEMPLATE: &str = include_str!("../../assets/report/template.html");
/// How to cite the program.
const CITATION: &str = include_str!("../../CITATION.cff");

/// What a report is about.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum ReportKind {
    /// One run.
    Run,
    /// The arms of an ablation.
    Ablation,
    /// Error against time.
    Chart,
}

/// The data of a report besides its recordings.
#[derive(Debug, Clone, Serialize)]
pub struct Report {
    /// What it is about.
    pub kind: ReportKind,
    /// The title.
    pub title: String,
    /// What the scene shows.
    pub description: String,
    /// The scenario, merged.
    pub scenario: Value,
    /// `summary.json` of a run, `ablation.json` of an ablation, null for a chart.
    pub summary: Value,
    /// What the user should know of.
    pub notes: Vec<String>,
    /// What was typed to get it.
    pub command: String,
    /// How to cite the program, in the Citation File Format.
    pub cite: &'static str,
    /// Version of the program.
    pub version: &'static str,
    /// Shafts nearer than this belong to one fascicle (µm).
    pub linkage_distance: f64,
    /// Columns over the frames of the first recording.
    pub measures: BTreeMap<String, Vec<f64>>,
    /// The numbers of a chart.
    pub chart: Option<ReportChart>,
}

/// The work-precision figures of a chart.
#[derive(Debug, Clone, Default, PartialEq, Serialize)]
pub struct ReportChart {
    /// One entry a choice and way to be wrong.
    pub factors: Vec<ReportFactor>,
}

/// One figure of a chart.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct ReportFactor {
    /// What was measured.
    pub title: String,
    /// What follows from it.
    pub sentence: String,
    /// Name and unit of the error.
    pub x_label: String,
    /// Name and unit of the time.
    pub y_label: String,
    /// The methods.
    pub methods: Vec<ReportMethod>,
}

/// One line of a chart.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct ReportMethod {
    /// The method.
    pub name: String,
    /// Its settings.
    pub points: Vec<ReportPoint>,
}

/// One setting of a chart.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct ReportPoint {
    /// Median time (s).
    pub time_s: f64,
    /// Error, in the unit of the label; the number that is refined where methods agree exactly.
    pub error: f64,
    /// The setting in words.
    pub setting: String,
    /// Whether no other setting beats it in both.
    pub front: bool,
    /// Whether this is what the scene has.
    pub default: bool,
}

impl Report {
    /// A report of a kind without summary, recordings or chart.
    pub fn new(kind: ReportKind, title: impl Into<String>, scenario: Value) -> Self {
        Self {
            kind,
            title: title.into(),
            description: String::new(),
            scenario,
            summary: Value::Null,
            notes: Vec::new(),
            command: String::new(),
            cite: CITATION,
            version: env!("CARGO_PKG_VERSION"),
            linkage_distance: 0.0,
            measures: BTreeMap::new(),
            chart: None,
        }
    }

    /// The whole page, with the bytes of recordings by their labels: one without a label for a run, any number with labels otherwise.
    ///
    /// # Errors
    /// What JSON does not have.
    pub fn page(&self, recordings: &[(&str, Vec<u8>)]) -> Result<String, serde_json::Error> {
        let json = serde_json::to_string(self)?;
        let report =
            format!("<script type=\"application/json\" id=\"report\">{}</script>", json.replace('<', "\\u003c"));
        let mut blocks = Vec::new();
        for (place, (label, bytes)) in recordings.iter().enumerate() {
            let id = if label.is_empty() { "recording".to_owned() } else { format!("recording-{place}") };
            let (label, data) = (escape(label), BASE64_STANDARD.encode(bytes));
            blocks.push(format!(
                "<script type=\"application/octet-stream\" id=\"{id}\" data-label=\"{label}\">{data}</script>"
            ));
        }
        // None of the three can hold one of the marks: they have no `<` but their own.
        let page = TEMPLATE.replace("<!--TROPISM:TITLE-->", &escape(&self.title));
        let page = page.replace("<!--TROPISM:REPORT-->", &report);
        Ok(page.replace("<!--TROPISM:RECORDINGS-->", &blocks.join("\n")))
    }
}

/// Text for HTML, also inside quotes.
fn escape(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;").replace('"', "&quot;")
}

#[cfg(test)]
mod tests {
    use super::*;

    /// What stands in the script element of an id.
    fn data<'a>(page: &'a str, id: &str) -> &'a str {
        let (_, after) = page.split_once(&format!(" id=\"{id}\"")).unwrap();
        after.split_once('>').unwrap().1.split_once("</script>").unwrap().0
    }

    #[test]
    fn the_page_has_its_data_and_no_mark_and_what_a_scene_says_ends_no_script() {
        for mark in ["TITLE", "REPORT", "RECORDINGS"] {
            assert_eq!(TEMPLATE.matches(&format!("<!--TROPISM:{mark}-->")).count(), 1, "{mark}");
        }
        let words = "a </script><!--TROPISM:RECORDINGS--> \"b\" & <!-- c";
        let report = Report {
            description: words.to_owned(),
            notes: vec![words.to_owned()],
            ..Report::new(ReportKind::Run, words, Value::String(words.to_owned()))
        };
        let page = report.page(&[]).unwrap();
        assert!(!page.contains("<!--TROPISM:"));
        assert!(page.contains("<title>a &lt;/script&gt;"));
        let json = data(&page, "report");
        assert!(!json.contains('<'));
        let read: Value = serde_json::from_str(json).unwrap();
        for key in ["title", "description", "scenario"] {
            assert_eq!(read[key], Value::String(words.to_owned()));
        }
        assert_eq!((read["kind"].as_str(), read["version"].as_str()), (Some("run"), Some(env!("CARGO_PKG_VERSION"))));
        assert!(read["cite"].as_str().unwrap().starts_with("cff-version: 1.2.0\n"));
    }
}
