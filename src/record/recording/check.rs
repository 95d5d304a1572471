//! Whether a recording that was read holds together: what it names is there, and its times ascend.

use super::{NO_PARENT, Recording, RecordingError};

impl Recording {
    /// Refuses a recording whose numbers name what is not there.
    ///
    /// # Errors
    /// The first array or key of the header that does so.
    pub(super) fn check(&self) -> Result<(), RecordingError> {
        self.check_header()?;
        self.check_cues()?;
        below("cells", &self.cells, self.vertex_count)?;
        below("shaft_cell", &self.shaft_cell, self.cells.len() / 3)?;
        below("tip_status", &self.tip_status, self.header.status_words.len())?;
        below("axon_population", &self.axon_population, self.header.populations.len())?;
        let parents: Vec<u32> = self.axon_parent.iter().copied().filter(|&parent| parent != NO_PARENT).collect();
        below("axon_parent", &parents, self.header.axon_count)?;
        for border in &self.header.borders {
            below("cells", &border.vertices, self.vertex_count).map_err(|_| named("borders", &border.name))?;
        }
        for target in &self.header.targets {
            let equal = target.cells.len() == target.points.len() && target.weights.len() == target.points.len();
            let there = below("cells", &target.cells, self.cells.len() / 3).is_ok();
            let finite = target.points.iter().flatten().all(|number| number.is_finite());
            if !(equal && there && finite) {
                return Err(named("targets", &target.name));
            }
        }
        let starts = &self.shaft_start;
        let last = starts.last().map(|&last| last as usize);
        if starts.first() != Some(&0) || !starts.is_sorted() || last != Some(self.shaft_cell.len()) {
            let problem = format!("it does not ascend from 0 to the {} vertices of all shafts", self.shaft_cell.len());
            return Err(RecordingError::array("shaft_start", problem));
        }
        Ok(())
    }

    fn check_header(&self) -> Result<(), RecordingError> {
        let header = &self.header;
        let [left, low, right, high] = header.bounds;
        let finite = header.bounds.iter().all(|edge| edge.is_finite());
        let checks = [
            ("`box` is no box", finite && left < right && low < high),
            ("there is no frame", !header.frames.is_empty()),
            ("`frames` does not ascend from 0 or later", ascends(&header.frames)),
            ("`figure_frames` names no frame", header.figure_frames.iter().all(|&frame| frame < header.frames.len())),
            ("a column of `measures` has another length", self.measures_fit()),
        ];
        match checks.iter().find(|(_, fine)| !fine) {
            Some((problem, _)) => Err(RecordingError::Header((*problem).to_owned())),
            None => Ok(()),
        }
    }

    fn measures_fit(&self) -> bool {
        self.header.measures.values().all(|column| column.len() == self.header.frames.len())
    }

    fn check_cues(&self) -> Result<(), RecordingError> {
        for cue in &self.header.cues {
            let ascending = cue.frames.first() == Some(&0) && cue.frames.windows(2).all(|pair| pair[0] < pair[1]);
            let there = cue.frames.last().is_some_and(|&last| last < self.header.frames.len());
            let effect = cue.effect.as_deref().is_none_or(|effect| ["attract", "repel"].contains(&effect));
            if !(ascending && there && effect && cue.maximum.is_finite()) {
                return Err(named("cues", &cue.name));
            }
        }
        Ok(())
    }
}

fn ascends(times: &[f64]) -> bool {
    times.iter().all(|time| time.is_finite() && *time >= 0.0) && times.windows(2).all(|pair| pair[0] < pair[1])
}

/// Whether all numbers lie below a count.
fn below<T: Copy + Into<u32>>(name: &str, numbers: &[T], count: usize) -> Result<(), RecordingError> {
    match numbers.iter().map(|&number| number.into()).find(|&number| number as usize >= count) {
        Some(number) => Err(RecordingError::array(name, format!("it names number {number} of {count}"))),
        None => Ok(()),
    }
}

fn named(list: &str, name: &str) -> RecordingError {
    RecordingError::Header(format!("`{list}`: what is said of `{name}` does not fit the arrays"))
}
