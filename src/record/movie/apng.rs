//! Animated PNG: the first frame whole, then what changes.

use super::{Frame, LAST_FRAME, MovieError, Pace};

/// Encodes frames as an animated PNG that plays for ever.
pub(super) fn encode(
    pace: Pace,
    frames: impl Iterator<Item = Result<Frame, MovieError>>,
) -> Result<Vec<u8>, MovieError> {
    let mut frames = frames.peekable();
    let size = match frames.peek() {
        Some(Ok(first)) => first.size,
        _ => [1, 1],
    };
    let mut file = Vec::new();
    let mut encoder = png::Encoder::new(&mut file, size[0], size[1]);
    encoder.set_color(png::ColorType::Rgba);
    encoder.set_depth(png::BitDepth::Eight);
    encoder.set_compression(png::Compression::Balanced);
    encoder.set_animated(pace.frames, 0).map_err(failed)?;
    encoder.set_frame_delay(1, pace.rate).map_err(failed)?;
    encoder.set_blend_op(png::BlendOp::Over).map_err(failed)?;
    let mut writer = encoder.write_header().map_err(failed)?;
    let mut last: Option<Frame> = None;
    for (number, frame) in (1..).zip(frames) {
        let frame = frame?;
        if number == pace.frames {
            writer.set_frame_delay(LAST_FRAME, 100).map_err(failed)?;
        }
        writer.write_image_data(&changes(last.as_ref(), &frame)).map_err(failed)?;
        last = Some(frame);
    }
    writer.finish().map_err(failed)?;
    Ok(file)
}

/// The pixels of a frame with their opacity: none where the last frame has the same.
fn changes(last: Option<&Frame>, frame: &Frame) -> Vec<u8> {
    let mut pixels = Vec::with_capacity(frame.pixels.len() / 3 * 4);
    for (place, pixel) in frame.pixels.chunks_exact(3).enumerate() {
        let same = last.is_some_and(|last| last.pixels.get(3 * place..3 * place + 3) == Some(pixel));
        let opaque = [pixel[0], pixel[1], pixel[2], u8::MAX];
        pixels.extend(if same { [0; 4] } else { opaque });
    }
    pixels
}

fn failed(error: png::EncodingError) -> MovieError {
    MovieError::Encode(error.to_string())
}
