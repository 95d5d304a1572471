//! Results out: measures over axons, statistics over seeds, figures and tables.
//!
//! Everything here takes plain data (polylines, nodal values, lists) and gives plain data back, so that a run, a replay
//! of stored trajectories and a test use the same code. Lengths are in µm, times in h, concentrations in nM.
//!
//! | question | file |
//! |---|---|
//! | Did the axons arrive, how straight, how far turned? | [`measures`] |
//! | How dispersed and how bundled are they at a height? | [`fascicles`] |
//! | What is the mean over seeds, and how sure is it? | [`statistics`] |
//! | How does it look? | [`scene_figure`] → [`png`] |
//! | How did it look at any time? | [`recording`] |
//! | How does one look through all of it? | [`report`] |
//! | Where are the numbers? | [`csv`], written by [`output`] |
//! | What do other tools load? | [`files`] |

pub mod checkpoint;
pub mod colour;
pub mod csv;
mod cue_scale;
pub mod earlier;
pub mod fascicles;
pub mod files;
pub mod leaves;
mod lettering;
pub mod manifest;
mod markers;
pub mod measures;
pub mod movie;
pub mod moving_figure;
pub mod output;
pub mod plot;
pub mod plot_axis;
mod plot_parts;
pub mod png;
pub mod polyline;
pub mod raster;
pub mod recorder;
pub mod recording;
pub mod report;
pub mod scene_figure;
mod scene_layout;
mod scene_legend;
mod scene_panel;
pub mod scene_view;
pub mod snapshot;
pub mod statistics;
pub mod summary;
pub mod svg;
pub mod theme;
