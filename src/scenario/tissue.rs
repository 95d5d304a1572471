//! The keys of the tissue at rest: its outline, the names of its edges, its mesh.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::outline_file::FiledOutline;
use crate::keys;
use crate::model::mesh_extent::MeshExtent;
use crate::model::quantity::{Angle, Factor, Length};
use crate::model::shape::{Point, coordinates};
use crate::numerics::polygon::{perimeter, signed_area};

keys! {
    /// The tissue at rest and its mesh.
    pub struct Tissue {
        /// The border of the tissue at rest.
        #[schemars(with = "WrittenOutline")]
        pub outline: Outline = Outline::default(),
        /// The longest edge wanted in the mesh; a quarter of the decay length of a cue is an upper bound.
        #[schemars(extend("exclusiveMinimum" = 0.0, "x-typical" = [2.0, 60.0]))]
        pub mesh_size: Length = Length(15.0),
        /// Shorter edges where the cues' gradients ask for them. Absent: the same size everywhere.
        pub refinement: Option<Refinement> = None,
        /// Shorter edges within this distance (at most that to the next corner) of corners inside which there are more than 190°, the
        /// shorter the nearer, so that fields are as accurate as without the corner. Absent: none. Ours.
        #[schemars(extend("exclusiveMinimum" = 0.0, "x-typical" = [10.0, 200.0]))]
        pub corner_radius: Option<Length> = None,
        /// The smallest angle allowed in a triangle.
        #[schemars(extend("exclusiveMinimum" = 0.0, "maximum" = 33.0, "x-typical" = [15.0, 30.0]))]
        pub min_angle: Angle = Angle(25.0),
        /// A mesh with more vertices is refused.
        #[schemars(extend("minimum" = 3))]
        pub max_vertices: u64 = 1_000_000,
    }

    /// Local refinement of the mesh: edges are halved where a cue's gradient is too wrong, tissue at rest. Ours.
    pub struct Refinement {
        /// Largest estimate |∇c_h − G|/(|G| + c/ℓ) that is left in a cell, ∇c_h its own gradient, G the recovered one (whose error is about the square).
        #[schemars(extend("minimum" = 0.001, "x-typical" = [0.02, 0.3]))]
        pub tolerance: Factor = Factor(0.1),
        /// How often an edge may be halved.
        #[schemars(extend("minimum" = 1, "maximum" = 10))]
        pub levels: u64 = 4,
    }

    /// A closed line whose sides have names.
    pub struct Ring {
        /// The corners in order, either way round.
        #[schemars(length(min = 3))]
        pub points: Vec<Point> = Vec::new(),
        /// The name of each side, from its point to the next; sides may share one. By default all are called `outer`, or `hole`.
        pub edges: Vec<String> = Vec::new(),
    }
}

/// The border of the tissue at rest, as it may be written: a file gives way to its polygon on loading.
#[derive(JsonSchema)]
#[serde(untagged)]
#[allow(dead_code)] // its schema is what is used
enum WrittenOutline {
    /// In the scene.
    Here(Outline),
    /// In a file.
    Filed(FiledOutline),
}

/// The border of the tissue at rest.
#[derive(Debug, Clone, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case", deny_unknown_fields)]
pub enum Outline {
    /// The rectangle from (0, 0) to (width, height); its edges are called `bottom`, `right`, `top` and `left`.
    Rectangle {
        /// The extent along x \[µm\].
        #[schemars(extend("exclusiveMinimum" = 0.0))]
        width: Length,
        /// The extent along y \[µm\].
        #[schemars(extend("exclusiveMinimum" = 0.0))]
        height: Length,
    },
    /// Any polygon, with or without holes.
    Polygon {
        /// The outer border.
        outer: Ring,
        /// The borders of the holes.
        #[serde(default)]
        holes: Vec<Ring>,
        /// Points inside that the mesh shall have as vertices: given any, it is filled by these, and `mesh_size` bounds the sides along border,
        /// sources and targets alone.
        #[serde(default)]
        vertices: Vec<Point>,
    },
}

impl Tissue {
    /// About how many vertices a mesh of the wanted size has.
    pub fn expected_vertices(&self) -> f64 {
        self.mesh_extent().vertices_at(self.mesh_size)
    }

    /// What the number of vertices of a mesh depends on, and how many there may be.
    pub fn mesh_extent(&self) -> MeshExtent {
        let rings = std::iter::once(self.outline.outer()).chain(self.outline.holes());
        MeshExtent {
            area: self.outline.area(),
            border: rings.map(|ring| perimeter(&ring.coordinates())).sum(),
            max_vertices: self.max_vertices,
        }
    }
}

impl Default for Outline {
    fn default() -> Self {
        Self::Rectangle { width: Length(800.0), height: Length(600.0) }
    }
}

impl Outline {
    /// The outer border \[µm\] and the names of its sides; those of a rectangle run counter-clockwise from the origin.
    pub fn outer(&self) -> Ring {
        match self {
            Self::Rectangle { width, height } => {
                let zero = Length(0.0);
                let points = vec![[zero, zero], [*width, zero], [*width, *height], [zero, *height]];
                Ring { points, edges: ["bottom", "right", "top", "left"].map(str::to_owned).to_vec() }
            }
            Self::Polygon { outer, .. } => outer.named("outer"),
        }
    }

    /// The borders of the holes and the names of their sides.
    pub fn holes(&self) -> Vec<Ring> {
        match self {
            Self::Rectangle { .. } => Vec::new(),
            Self::Polygon { holes, .. } => holes.iter().map(|hole| hole.named("hole")).collect(),
        }
    }

    /// The vertices given for the inside \[µm\].
    pub fn vertices(&self) -> Vec<[f64; 2]> {
        match self {
            Self::Rectangle { .. } => Vec::new(),
            Self::Polygon { vertices, .. } => coordinates(vertices),
        }
    }

    /// The names of all edges, each once, in the order of the outline.
    pub fn edge_names(&self) -> Vec<String> {
        let mut names = Vec::new();
        for name in std::iter::once(self.outer()).chain(self.holes()).flat_map(|ring| ring.edges) {
            if !names.contains(&name) {
                names.push(name);
            }
        }
        names
    }

    /// The area of the tissue at rest \[µm²\].
    pub fn area(&self) -> f64 {
        let holes: f64 = self.holes().iter().map(Ring::area).sum();
        self.outer().area() - holes
    }
}

impl Ring {
    /// The corners as plain numbers \[µm\].
    pub fn coordinates(&self) -> Vec<[f64; 2]> {
        coordinates(&self.points)
    }

    /// The area enclosed \[µm²\].
    pub fn area(&self) -> f64 {
        signed_area(&self.coordinates()).abs()
    }

    fn named(&self, default: &str) -> Self {
        let mut ring = self.clone();
        if ring.edges.is_empty() {
            ring.edges = vec![default.to_owned(); ring.points.len()];
        }
        ring
    }
}
