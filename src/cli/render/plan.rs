//! The settings of a render, resolved from the options and the scene.

use std::io;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::{Duration, Instant};

use crate::error::RenderError;
use crate::image::{Aov, Layout};
use crate::options::Options;
use crate::progressive::MAX_SAMPLES;
use crate::renderer::{FaultHandler, Recovery, Renderer};
use crate::scene::{Scene, ViewSettings};
use crate::session::Session;
use tracing::info;
use wgray_image::Region;
use wgray_render::job::checkpoint::{Checkpoint, CheckpointError, CheckpointOptions};
use wgray_render::job::{self, Identity, PartHeader, Tile};
use wgray_trace::records::Packed;

use super::args::Args;
use super::once_log::OnceLog;
use crate::cli::frames::Frame;
use crate::cli::log::Level;
use crate::cli::metadata::RenderMetadata;
use crate::cli::picture_options::PictureOptions;
use crate::cli::progress::{self, Mode};
use crate::cli::signal::Stop;
use crate::cli::{Interrupted, Usage, cli_error, option_error};
use crate::device_cost::Workload;

/// Maximum samples per pixel with a noise limit, unless `--spp` is given.
const MAX_NOISE_SAMPLES: u32 = 4096;

/// The settings of a render, except its destinations.
pub struct Plan<'a> {
    pub scene: Arc<Packed>,
    /// The region of the image: the crop, or the full image.
    pub image_region: Region,
    /// The part to render, and the region of its rows.
    pub tile: Option<(Tile, Region)>,
    pub options: Options,
    /// Samples per pixel; with adaptive sampling or a noise limit, the maximum.
    pub samples: u32,
    /// The noise at which rendering stops.
    pub noise: Option<f64>,
    pub deadline: Option<Instant>,
    time_limit: Option<Duration>,
    /// Write intermediate images.
    pub preview: bool,
    pub checkpoint: Option<PathBuf>,
    checkpoint_interval: Duration,
    resume: bool,
    pub picture_options: PictureOptions,
    pub view: ViewSettings,
    pub metadata: RenderMetadata,
    pub progress: Mode,
    pub log: &'a OnceLog,
    pub frame: Frame,
}

impl<'a> Plan<'a> {
    /// Resolves the settings of one image, whose render began at `start`.
    pub fn resolve(
        args: &Args,
        session: &mut Session,
        log: &'a OnceLog,
        frame: Frame,
        start: Instant,
    ) -> anyhow::Result<Self> {
        let scene = &Arc::clone(session.scene());
        let early_stops = [
            ("--noise", args.noise.is_some()),
            ("--time-limit", args.time_limit.is_some()),
            ("--preview", args.preview),
        ];
        for (option, _) in early_stops.into_iter().filter(|(_, is_set)| *is_set) {
            check_early_stop(option, scene)?;
        }
        if args.noise.is_some() && scene.render.adaptive.is_some() {
            let rule =
                "--noise: cannot be combined with adaptive sampling, whose pixels have different numbers of samples";
            return Err(Usage(rule.to_owned()).into());
        }
        let max_samples = args.pixel_samples.unwrap_or(MAX_NOISE_SAMPLES);
        if !(1..=MAX_SAMPLES).contains(&max_samples) {
            return Err(Usage(format!("--spp: {max_samples} must be from 1 to {MAX_SAMPLES}")).into());
        }
        let mut options = args.rendering();
        options.aovs = options.layers(scene);
        let image_region = options.region(scene).map_err(|problem| option_error(&problem))?;
        let tile = match args.tile {
            None => None,
            Some(tile) => Some((tile, rows(tile, image_region)?)),
        };
        let progress = args.progress_mode();
        let packed = progress::with_spinner(progress, "preparing geometry, textures and lights", || {
            session.packed(&options)
        });
        Ok(Plan {
            image_region,
            tile,
            options,
            samples: match args.noise {
                Some(_) => max_samples,
                None => packed.sampling.pixel_samples,
            },
            noise: args.noise,
            deadline: args.time_limit.and_then(|limit| start.checked_add(limit)),
            time_limit: args.time_limit,
            preview: args.preview,
            checkpoint: args.checkpoint(frame)?,
            checkpoint_interval: args.checkpoint_interval,
            resume: args.resume,
            view: args.picture_options.view(scene.view),
            picture_options: args.picture_options.clone(),
            metadata: RenderMetadata::of(scene, &packed, args.time_limit, args.noise),
            scene: packed,
            progress,
            log,
            frame,
        })
    }

    /// Returns the region to render: the rows of the part, or the region of the image.
    pub fn region(&self) -> Region {
        self.tile.map_or(self.image_region, |(_, rows)| rows)
    }

    /// Returns the layout of the image. `middle_depth` is the depth at the image center.
    pub fn layout(&self, middle_depth: f32) -> Layout {
        Layout {
            picture: (self.scene.camera.width, self.scene.camera.height),
            region: self.region(),
            aovs: self.options.aovs.clone(),
            alpha: self.scene.has_alpha(),
            middle_depth,
            max_samples: self.samples,
            view: self.view,
        }
    }

    /// Returns the workload of this image and of the images that follow.
    pub fn workload(&self, images: usize) -> Workload {
        let workload = Workload::new(&self.scene, &self.options, images);
        Workload {
            pixels: self.region().pixels(),
            samples: if self.noise.is_some() {
                self.samples
            } else {
                workload.samples
            },
            time_limit: self.time_limit,
            ..workload
        }
    }

    /// Returns true if the image is denoised.
    pub fn denoises(&self) -> bool {
        self.options.aovs.contains(&Aov::Denoised)
    }

    /// Returns true if the file is the complete part of the image that this render would write.
    pub fn is_done(&self, path: &Path) -> bool {
        let (Some((tile, _)), Ok((identity, found))) = (self.tile, job::read_part(path)) else {
            return false;
        };
        let layout = self.layout(f32::from_bits(found.middle_depth));
        identity == self.identity() && found == PartHeader::of(tile, &layout, self.metadata.without_device())
    }

    /// Returns the identity of the image, which all of its parts share.
    pub fn identity(&self) -> Identity {
        self.identity_of(self.image_region)
    }

    fn identity_of(&self, region: Region) -> Identity {
        Identity {
            pixel_samples: self.samples,
            ..Identity::of(&self.scene, region, self.options.exact_rounding)
        }
    }

    /// Opens the checkpoint, if requested; waits while another process uses the file. A part has the same checkpoint as
    /// an image that is cropped to the rows of the part.
    pub fn open_checkpoint<'b>(&'b self, stop: Option<&'b Stop>) -> anyhow::Result<Option<Checkpoint<'b>>> {
        let Some(path) = &self.checkpoint else {
            return Ok(None);
        };
        // If signals are not deferred (`stop` is `None`), a signal terminates the process immediately, so there is
        // nothing to check.
        let signal = move || stop.and_then(Stop::signal);
        let options = CheckpointOptions {
            path: path.clone(),
            resume: self.resume,
            interval: self.checkpoint_interval,
            wait: Box::new(move || signal().is_none() && self.deadline.is_none_or(|end| Instant::now() < end)),
            report: Box::new(|message| self.log.log(Level::Warning, message)),
        };
        match Checkpoint::open(options, self.identity_of(self.region()), self.scene.film_layout()) {
            Ok(checkpoint) => Ok(Some(checkpoint)),
            Err(error @ CheckpointError::Busy(_)) => Err(match signal() {
                Some(signal) => Interrupted(signal).into(),
                None => anyhow::anyhow!("--checkpoint: {error}, and the time limit is reached"),
            }),
            Err(CheckpointError::Io { path, error }) => {
                let message = format!("--checkpoint: {}: {error}", path.display());
                Err(RenderError::Output(io::Error::new(error.kind(), message)).into())
            }
            Err(error) => Err(Usage(format!("--checkpoint: {error}")).into()),
        }
    }

    /// Opens the device for the scene, unless the session has opened it for an earlier frame.
    pub fn renderer<'b>(&'b self, session: &'b mut Session, stop: &'b Stop) -> anyhow::Result<Renderer<'b>> {
        let on_fault = FaultHandler {
            report: Box::new(|error, recovery| match recovery {
                Recovery::Reopen => self.log.log(Level::Warning, &format!("{error}; re-opening it")),
                Recovery::Cpu => self
                    .log
                    .log_once(Level::Warning, &format!("rendering on the CPU: {error}")),
            }),
            is_stopped: Box::new(|| stop.signal().is_some()),
        };
        let renderer = progress::with_spinner(self.progress, "opening the device and compiling kernels", || {
            session.renderer(&self.options, on_fault)
        });
        let renderer = renderer.map_err(cli_error)?;
        if let Some(reason) = renderer.cpu_reason() {
            info!("rendering on the CPU: {reason}");
        }
        Ok(renderer)
    }
}

/// Returns the rows of a part of the image.
fn rows(tile: Tile, image_region: Region) -> Result<Region, Usage> {
    let rule = format!(
        "--tile: {tile}: the number of parts must not exceed the number of rows, {}",
        image_region.height()
    );
    tile.rows(image_region).ok_or(Usage(rule))
}

/// Rejects an option that may stop the render early, unless the first samples of the pixel pattern cover the pixel.
fn check_early_stop(option: &str, scene: &Scene) -> Result<(), Usage> {
    let pattern = scene.render.pixel_samples.pattern;
    match pattern.needs_square() {
        false => Ok(()),
        true => Err(Usage(format!(
            "{option}: the first samples must cover the pixel, but those of --pixel-pattern {} do not; use sobol",
            pattern.name()
        ))),
    }
}
