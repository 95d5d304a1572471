//! GIF: 255 colours for all frames, and one for what stays as it was.

use super::palette::Palette;
use super::{Frame, LAST_FRAME, MovieError, Pace, Reel};
use gif::{DisposalMethod, Encoder, Repeat};
use std::borrow::Cow;

/// Colours, besides the one for what stays.
const COLOURS: usize = 255;
/// The colour for what stays.
const STAYS: u8 = 255;

/// Encodes frames as a GIF that plays for ever.
pub(super) fn encode<F, T>(pace: Pace, frames: Reel<'_, F, T>) -> Result<Vec<u8>, MovieError>
where
    F: Fn(u32) -> Result<Frame, MovieError> + Sync,
    T: FnMut(f64),
{
    let last_number = pace.frames.saturating_sub(1);
    let mut samples = Vec::new();
    let mut size = [1, 1];
    for number in [0, last_number / 2, last_number] {
        let frame = frames.peek(number)?;
        size = frame.size;
        samples.extend(frame.pixels);
    }
    let mut palette = Palette::of(&samples, COLOURS);
    drop(samples);
    let mut colours = palette.table();
    colours.resize(3 * (COLOURS + 1), 0);
    let [width, height] = size.map(|extent| u16::try_from(extent).unwrap_or(u16::MAX));
    let mut file = Vec::new();
    let mut encoder = Encoder::new(&mut file, width, height, &colours).map_err(failed)?;
    encoder.set_repeat(Repeat::Infinite).map_err(failed)?;
    let mut last: Vec<u8> = Vec::new();
    for (number, frame) in (0..).zip(frames) {
        let indices: Vec<u8> = frame?.pixels.chunks_exact(3).map(|pixel| palette.index_of(pixel)).collect();
        let same = |(place, index): (usize, &u8)| if last.get(place) == Some(index) { STAYS } else { *index };
        let changes: Vec<u8> = indices.iter().enumerate().map(same).collect();
        let delay = if number == last_number { LAST_FRAME } else { (100.0 / f64::from(pace.rate)).round() as u16 };
        encoder
            .write_frame(&gif::Frame {
                delay,
                dispose: DisposalMethod::Keep,
                transparent: Some(STAYS),
                width,
                height,
                buffer: Cow::Owned(changes),
                ..gif::Frame::default()
            })
            .map_err(failed)?;
        last = indices;
    }
    drop(encoder);
    Ok(file)
}

fn failed(error: gif::EncodingError) -> MovieError {
    MovieError::Encode(error.to_string())
}
