//! The keys of files for other tools. Each is an object that is absent by default, and then nothing is written: `{}` writes the
//! state at the end, an `interval` that of the beginning and each interval too.

use crate::keys;
use crate::model::quantity::{Length, Time};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

keys! {
    /// When something is written.
    pub struct Every {
        /// The time between two; absent: at the end only.
        #[schemars(extend("exclusiveMinimum" = 0.0))]
        pub interval: Option<Time> = None,
    }

    /// Axons as SWC, one tree each, branches on their trunk.
    pub struct Swc {
        /// The time between two; absent: at the end only.
        #[schemars(extend("exclusiveMinimum" = 0.0))]
        pub interval: Option<Time> = None,
        /// The radius that every point is given; the model has none. Ours.
        #[schemars(extend("exclusiveMinimum" = 0.0, "x-typical" = [0.05, 2.0]))]
        pub radius: Length = Length(0.5),
        /// Whether the files go into one archive, `swc.zip`, in place of the folder `swc`.
        pub archive: bool = false,
    }

    /// Series of VTU files with their PVD, for ParaView, meshio and pyvista.
    pub struct Vtu {
        /// The mesh where it is now, with displacement, velocity and area ratio.
        pub tissue: Option<Every> = None,
        /// The mesh where it is now, with the concentration of each cue that is solved.
        pub fields: Option<Every> = None,
        /// The shafts as polylines, with axon and time at each point.
        pub shafts: Option<Every> = None,
    }
}

/// The form of tables.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Tables {
    /// Text, RFC 4180.
    Csv,
    /// Columns, Apache Parquet.
    Parquet,
    /// Each table in both forms.
    Both,
}

impl Tables {
    /// Whether tables are written as text.
    pub fn are_csv(self) -> bool {
        self != Self::Parquet
    }

    /// Whether tables are written as columns.
    pub fn are_parquet(self) -> bool {
        self != Self::Csv
    }

    /// The files of a table.
    pub fn files(self, table: &str) -> String {
        match self {
            Self::Csv => format!("{table}.csv"),
            Self::Parquet => format!("{table}.parquet"),
            Self::Both => format!("{table}.csv, {table}.parquet"),
        }
    }
}
