//! Renders step by step until another thread cancels the render at a deadline, and saves the partial image.
//!
//! ```sh
//! cargo run --release --example cancel -- scenes/cornell-path.toml 2
//! ```

use std::error::Error;
use std::thread;
use std::time::{Duration, Instant};

use wgray::{CancelToken, Context, Options, Overrides, Scene, Session, Status};

fn main() -> Result<(), Box<dyn Error>> {
    let mut arguments = std::env::args().skip(1);
    let file = arguments.next().unwrap_or("scenes/cornell-path.toml".to_string());
    let seconds: f64 = arguments.next().map_or(Ok(1.0), |seconds| seconds.parse())?;

    let overrides = Overrides {
        size: Some((120, 90)),
        pixel_samples: Some(4096),
        ..Overrides::default()
    };
    let mut session = Session::new(&Context::new(), Scene::load_with(file, &overrides)?);

    let cancel = CancelToken::new();
    let timer_token = cancel.clone();
    thread::spawn(move || {
        thread::sleep(Duration::from_secs_f64(seconds));
        timer_token.cancel();
    });

    let start = Instant::now();
    // If the deadline passes during this call, `start` returns an error, because no sample is rendered yet.
    let mut render = session.start(&Options::default(), &cancel)?;
    let status = loop {
        let status = render.step(&cancel)?;
        let (samples, percent) = (render.samples(), 100.0 * render.fraction());
        println!(
            "{:.2} s: {samples} samples per pixel, {percent:.1} %",
            start.elapsed().as_secs_f64()
        );
        if status != Status::Running {
            break status;
        }
    };
    let image = render.finish();
    image.save("target/cancel.png")?;
    println!("{status:?}; the image so far is target/cancel.png");
    Ok(())
}
