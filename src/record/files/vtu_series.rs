//! Series of VTU files, one an instant, with a PVD that says which belongs to which time (h).

use super::super::output::{WriteError, clear_folder, no_link, write_atomically};
use super::vtu::{CellKind, Grid, Values, escaped};
use super::{Output, OutputError};
use crate::model::clock::Clock;
use crate::model::configuration::Configuration;
use crate::model::keep::{Keep, KeptBytes};
use crate::model::observables::Observables;
use crate::model::remodel::SpareCones;
use crate::model::shafts::Shafts;
use crate::model::tissue::Tissue;
use bevy_ecs::prelude::World;
use std::fmt::Write;
use std::path::{Path, PathBuf};

/// What a series shows of a world.
pub type View = fn(&World) -> Grid;

/// `vtu/NAME/0000.vtu` and so on, and `vtu/NAME.pvd`, which is complete after every instant.
pub struct VtuSeries {
    folder: PathBuf,
    name: &'static str,
    grid: View,
    times: Vec<f64>,
}

impl VtuSeries {
    /// Begins a series of what `grid` sees, in the folder of results.
    ///
    /// # Errors
    /// The path and the system's reason.
    pub fn create(folder: &Path, name: &'static str, grid: View) -> Result<Self, OutputError> {
        no_link(&folder.join("vtu"))?;
        Ok(Self { folder: folder.join("vtu"), name, grid, times: Vec::new() })
    }

    fn file(&self, number: usize) -> String {
        format!("{}/{number:04}.vtu", self.name)
    }

    fn pvd(&self) -> String {
        let mut text =
            "<?xml version=\"1.0\"?>\n<VTKFile type=\"Collection\" version=\"0.1\">\n<Collection>\n".to_owned();
        for (number, time) in self.times.iter().enumerate() {
            // Writing to a string cannot fail.
            let _ =
                writeln!(text, "<DataSet timestep=\"{time}\" part=\"0\" file=\"{}\"/>", escaped(&self.file(number)));
        }
        text + "</Collection>\n</VTKFile>\n"
    }
}

impl Output for VtuSeries {
    fn look(&mut self, world: &World) -> Result<(), OutputError> {
        if self.times.is_empty() {
            clear_folder(&self.folder.join(self.name), "vtu")?;
        }
        let file = self.folder.join(self.file(self.times.len()));
        write_atomically(&file, (self.grid)(world).to_vtu().as_bytes())?;
        self.times.push(world.resource::<Clock>().hours());
        write_atomically(&self.folder.join(format!("{}.pvd", self.name)), self.pvd().as_bytes())?;
        Ok(())
    }

    fn keep(&self, into: &mut Vec<u8>) -> Result<(), WriteError> {
        self.times.keep(into);
        Ok(())
    }

    fn restore(&mut self, from: &mut KeptBytes) -> Result<(), OutputError> {
        self.times = from.read()?;
        Ok(())
    }
}

/// The mesh where it is now.
fn mesh(world: &World) -> Grid {
    let (tissue, configuration) = (world.resource::<Tissue>(), world.resource::<Configuration>());
    let connectivity: Vec<i64> = tissue.mesh.cells().iter().map(|&vertex| i64::from(vertex)).collect();
    Grid {
        points: configuration.coordinates().into_owned(),
        kind: CellKind::Triangle,
        connectivity,
        point_data: Vec::new(),
        cell_data: Vec::new(),
    }
}

/// The tissue: displacement and velocity of its vertices, and how much the area of each cell has grown.
pub fn tissue(world: &World) -> Grid {
    let (tissue, configuration) = (world.resource::<Tissue>(), world.resource::<Configuration>());
    let coordinates = configuration.coordinates();
    let moved = coordinates.iter().zip(tissue.mesh.vertices());
    let displacement = moved.map(|(now, rest)| [now[0] - rest[0], now[1] - rest[1]]).collect();
    let ratio = |cell| configuration.deformation_gradient(&tissue.mesh, cell).determinant();
    let ratios = (0..tissue.mesh.cell_count() as u32).map(ratio).collect();
    Grid {
        point_data: vec![
            ("displacement [um]".to_owned(), Values::Vectors(displacement)),
            ("velocity [um/h]".to_owned(), Values::Vectors(configuration.velocities().into_owned())),
        ],
        cell_data: vec![("area ratio".to_owned(), Values::Scalars(ratios))],
        ..mesh(world)
    }
}

/// The concentration of each cue that the scene solves.
pub fn fields(world: &World) -> Grid {
    let fields = world.resource::<Observables>().fields.iter();
    let values = |field: &crate::model::observables::Observable| {
        (format!("{} [nM]", field.name), Values::Scalars((field.read)(world, field.index)))
    };
    Grid { point_data: fields.map(values).collect(), ..mesh(world) }
}

/// The shafts from origin to tip, in straight pieces; at each point the number of the cone and when it passed there (h).
pub fn shafts(world: &World) -> Grid {
    let (tissue, configuration) = (world.resource::<Tissue>(), world.resource::<Configuration>());
    let (shafts, spares) = (world.resource::<Shafts>(), world.resource::<SpareCones>());
    let (mut points, mut connectivity) = (Vec::new(), Vec::new());
    let (mut times, mut numbers, mut cones, mut roots) = (Vec::new(), Vec::new(), Vec::new(), Vec::new());
    for shaft in 0..shafts.count() {
        let line = shafts.polyline(shaft);
        let (number, first) = (shaft as u32, points.len() as i64);
        if line.is_empty() {
            continue;
        }
        points.extend(line.iter().map(|point| configuration.place(&tissue.mesh, *point)));
        times.extend(shafts.vertices(shaft).map(|vertex| f64::from(shafts.time(vertex))));
        times.push(f64::from(shafts.tip_time(number)));
        numbers.extend(std::iter::repeat_n(i64::from(number), line.len()));
        connectivity.extend((first + 1..points.len() as i64).flat_map(|point| [point - 1, point]));
        cones.extend(std::iter::repeat_n(i64::from(number), line.len() - 1));
        roots.extend(std::iter::repeat_n(i64::from(spares.root(number)), line.len() - 1));
    }
    Grid {
        points,
        kind: CellKind::Line,
        connectivity,
        point_data: vec![
            ("axon".to_owned(), Values::Integers(numbers)),
            ("time [h]".to_owned(), Values::Scalars(times)),
        ],
        cell_data: vec![("axon".to_owned(), Values::Integers(cones)), ("root".to_owned(), Values::Integers(roots))],
    }
}
