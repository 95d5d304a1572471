use super::*;

/// A white square that goes across a page of many colours.
fn frame(number: u32) -> Frame {
    let size = [40, 24];
    let pixel = |x: u32, y: u32| {
        let inside = (x / 4 == number) && (8..16).contains(&y);
        if inside { [255, 255, 255] } else { [(6 * x) as u8, (10 * y) as u8, 90] }
    };
    let pixels = (0..size[1]).flat_map(|y| (0..size[0]).flat_map(move |x| pixel(x, y))).collect();
    Frame { size, pixels }
}

const PACE: Pace = Pace { frames: 7, rate: 10 };

fn made(format: MovieFormat) -> Vec<u8> {
    let mut shares = Vec::new();
    let beside = std::env::temp_dir().join("tropism-movie");
    let bytes = encode(format, PACE, |number| Ok(frame(number)), |share| shares.push(share), &beside).unwrap();
    assert_eq!((shares.len(), shares.last()), (7, Some(&1.0)));
    assert!(shares.is_sorted());
    bytes
}

/// Lays what changes over what was there.
fn lay(canvas: &mut [u8], changes: &[u8]) {
    for (below, above) in canvas.chunks_exact_mut(3).zip(changes.chunks_exact(4)) {
        if above[3] > 0 {
            below.copy_from_slice(&above[..3]);
        }
    }
}

#[test]
fn an_animated_png_has_every_frame_to_the_pixel() {
    let file = made(MovieFormat::Apng);
    let mut reader = png::Decoder::new(std::io::Cursor::new(file)).read_info().unwrap();
    assert_eq!(reader.info().animation_control().unwrap().num_frames, 7);
    let mut canvas = vec![0; 40 * 24 * 3];
    for number in 0..7 {
        let mut changes = vec![0; reader.output_buffer_size().unwrap()];
        reader.next_frame(&mut changes).unwrap();
        let control = reader.info().frame_control().unwrap();
        let delay = f64::from(control.delay_num) / f64::from(control.delay_den);
        assert_eq!(delay, if number == 6 { 1.5 } else { 0.1 });
        lay(&mut canvas, &changes);
        assert!(canvas == frame(number).pixels, "frame {number}");
    }
}

#[test]
fn a_gif_has_every_frame_in_nearly_its_colours() {
    let file = made(MovieFormat::Gif);
    let mut options = ::gif::DecodeOptions::new();
    options.set_color_output(::gif::ColorOutput::RGBA);
    let mut reader = options.read_info(&file[..]).unwrap();
    assert_eq!((reader.width(), reader.height(), reader.repeat()), (40, 24, ::gif::Repeat::Infinite));
    let mut canvas = vec![0; 40 * 24 * 3];
    let mut number = 0;
    while let Some(changes) = reader.read_next_frame().unwrap() {
        assert_eq!(changes.delay, if number == 6 { 150 } else { 10 });
        lay(&mut canvas, &changes.buffer);
        let expected = frame(number).pixels;
        let far: f64 = canvas.iter().zip(&expected).map(|(a, b)| f64::from(a.abs_diff(*b))).sum();
        assert!(far / (canvas.len() as f64) < 8.0, "frame {number}: {far}");
        number += 1;
    }
    assert_eq!(number, 7);
}

#[test]
fn a_frame_that_fails_ends_the_movie_with_its_reason() {
    let broken = |number: u32| if number < 3 { Ok(frame(number)) } else { Err(MovieError::Encode("torn".into())) };
    for format in [MovieFormat::Gif, MovieFormat::Apng] {
        let error = encode(format, PACE, broken, |_| (), Path::new("x")).unwrap_err();
        assert!(error.to_string().contains("torn"), "{error}");
    }
}

#[test]
fn names_and_endings_give_formats() {
    for name in MovieFormat::NAMES {
        let format = MovieFormat::of(name).unwrap();
        assert_eq!(MovieFormat::of(format.ending()), Some(format));
    }
    assert_eq!((MovieFormat::of("PNG"), MovieFormat::of("mov")), (Some(MovieFormat::Apng), None));
}
