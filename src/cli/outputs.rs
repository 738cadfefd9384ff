//! The destinations of a render. They are checked before the render begins: a destination must not be an input or occur
//! twice, and a default name must not replace another program's file.

use std::io::{self, IsTerminal as _};
use std::path::{Path, PathBuf};

use crate::error::RenderError;
use crate::image::{self, Aov, Format, Layers, Output, Pending, Target};
use wgray_image::Region;

use super::Usage;
use super::metadata::is_finished;
use super::picture_options::PictureOptions;

pub struct Outputs {
    images: Vec<ImageOutput>,
    /// The part of an image that is written instead of images.
    part: Option<Output>,
    stats: Option<Output>,
}

struct ImageOutput {
    format: Format,
    /// The image, then the AOVs in separate files; each with the option that requests the file.
    files: Vec<(String, Output)>,
}

impl ImageOutput {
    fn is_rewritable(&self) -> bool {
        self.files.iter().all(|(_, output)| output.is_file())
    }
}

pub struct OpenOutputs {
    pub files: Files,
    pub stats: Option<Pending>,
}

pub enum Files {
    Images(Vec<Target>),
    Part(Pending),
}

impl Files {
    /// Returns the name of the first file, for messages.
    pub fn name(&self) -> Option<&str> {
        match self {
            Files::Images(targets) => targets
                .iter()
                .flat_map(|target| &target.files)
                .next()
                .map(Pending::name),
            Files::Part(file) => Some(file.name()),
        }
    }
}

/// Decides whether the layers must be written.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum LayerPolicy {
    /// At least one output must support the layers.
    Requested,
    /// The layers are written to the outputs that support them.
    Available,
}

const PART: &str = "part";

impl Outputs {
    /// Checks all destinations. `-` is standard output. Without --output, the image is written to `default`, unless
    /// that file exists and was not written by wgray.
    pub fn find(
        options: &PictureOptions,
        default: &Path,
        (aovs, layer_policy): (&[Aov], LayerPolicy),
        stats: Option<&Path>,
    ) -> anyhow::Result<Outputs> {
        let paths = match options.output.as_slice() {
            [] => vec![default],
            paths => paths.iter().map(PathBuf::as_path).collect(),
        };
        let mut destinations = Vec::new();
        for path in paths {
            let destination = output(path)?;
            if path.as_os_str() == "-" && io::stdout().is_terminal() {
                let message = "--output: -: standard output is a terminal; redirect it with > FILE or | COMMAND";
                return Err(Usage(message.to_owned()).into());
            }
            forbid_ending("--output", path, &destination, "toml", "scenes")?;
            destinations.push((path, destination));
        }
        let formats = formats(&destinations, options.format)?;
        options.check(&formats)?;
        if let LayerPolicy::Requested = layer_policy {
            check_layers(aovs, &destinations, &formats)?;
        }
        let mut images = Vec::new();
        for ((path, destination), format) in destinations.into_iter().zip(formats) {
            let separate_aovs = match destination.is_file() {
                true => aovs,
                false => &[],
            };
            let mut files = vec![("--output".to_owned(), destination)];
            let aov_files = image::files(path, format, separate_aovs).into_iter().skip(1);
            for (aov, path) in separate_aovs.iter().filter(|aov| aov.has_file()).zip(aov_files) {
                files.push((format!("--aov {}", aov.name()), output(&path)?));
            }
            images.push(ImageOutput { format, files });
        }
        let outputs = Outputs {
            images,
            part: None,
            stats: stats.map(find_stats).transpose()?,
        };
        if options.output.is_empty() {
            outputs.reject_files_of_unknown_origin()?;
        }
        Ok(outputs)
    }

    /// Rejects existing files that wgray did not write.
    fn reject_files_of_unknown_origin(&self) -> Result<(), Usage> {
        let mut files = self.images.iter().flat_map(|image| &image.files);
        let is_not_by_wgray = |(_, output): &&(String, Output)| {
            let path = output.path().filter(|path| path.exists());
            path.is_some_and(|path| image::read_metadata(path).is_none())
        };
        match files.find(is_not_by_wgray) {
            Some((_, output)) => Err(Usage(format!(
                "{} exists and was not written by wgray; name the output with -o",
                output.name()
            ))),
            None => Ok(()),
        }
    }

    /// Checks the destinations of a part.
    pub fn find_part(options: &PictureOptions, stats: Option<&Path>) -> anyhow::Result<Outputs> {
        let is_part = |path: &Path| path.extension().is_some_and(|end| end.eq_ignore_ascii_case(PART));
        let path = match options.output.as_slice() {
            [path] if is_part(path) => path,
            _ => {
                let rule = "--tile: needs exactly one -o NAME.part, to be joined by wgray merge";
                return Err(Usage(rule.to_owned()).into());
            }
        };
        if options.format.is_some() {
            return Err(Usage("--format: cannot be used with --tile, which writes a part".to_owned()).into());
        }
        options.check(&[])?;
        Ok(Outputs {
            images: Vec::new(),
            part: Some(output(path)?),
            stats: stats.map(find_stats).transpose()?,
        })
    }

    /// Rejects images too large for their format.
    pub fn check_size(&self, region: Region) -> Result<(), Usage> {
        let mut named = self
            .images
            .iter()
            .filter_map(|image| Some((image.format, image.files.first()?)));
        named.try_for_each(|(format, (option, output))| {
            let rule = format.check_size(region.width(), region.height());
            rule.map_err(|rule| Usage(format!("{option}: {}: {rule}", output.name())))
        })
    }

    /// Rejects destinations that would replace an input or another output.
    pub fn check(&self, inputs: &[PathBuf], checkpoint: Option<&Path>) -> anyhow::Result<()> {
        // wgray gives checkpoints in a folder unique names, so only a checkpoint file can replace another file.
        let checkpoint = checkpoint.filter(|path| !path.is_dir());
        let checkpoint = checkpoint.map(find_checkpoint).transpose()?;
        let checkpoint = checkpoint
            .iter()
            .map(|output| ("--checkpoint", output, "choose another name"));
        let stats = self.stats.iter().map(|stats| ("--stats", stats, "choose another name"));
        let images =
            (self.images.iter().flat_map(|image| &image.files)).map(|(option, output)| match option.as_str() {
                "--output" => ("--output", output, "choose another name"),
                option => (option, output, "choose another name with --output"),
            });
        let part = self.part.iter().map(|part| ("--output", part, "choose another name"));
        let mut checked: Vec<(&str, &Output)> = Vec::new();
        for (option, output, remedy) in part.chain(images).chain(stats).chain(checkpoint) {
            protect_inputs(option, output, inputs, remedy)?;
            if let Some((other, _)) = checked.iter().find(|(_, other)| other.is_same(output)) {
                let name = output.name();
                return Err(Usage(match option == *other {
                    true => format!("{option}: {name} is given twice"),
                    false => format!("{option}: {name} is also written by {other}; {remedy}"),
                })
                .into());
            }
            checked.push((option, output));
        }
        Ok(())
    }

    /// Returns true if all files exist and all images are complete. Image streams count as missing; a statistics stream
    /// is ignored.
    pub fn exist(&self) -> bool {
        let exists = |output: &Output| output.path().is_some_and(Path::is_file);
        let mut images = self.images.iter().flat_map(|image| &image.files);
        let stats = self.stats.iter().filter(|stats| stats.is_file());
        self.part.iter().chain(stats).all(exists)
            && images.all(|(_, output)| exists(output) && output.path().is_some_and(is_finished))
    }

    /// Returns the images that previews can rewrite because they are files: the format, the image and its layers.
    pub fn rewritable(&self) -> io::Result<Vec<(Format, Vec<Output>)>> {
        let images = self.images.iter().filter(|image| image.is_rewritable());
        let reopened = |ImageOutput { format, files }: &ImageOutput| {
            let files = files.iter().map(|(_, output)| output.again());
            Ok((*format, files.collect::<io::Result<_>>()?))
        };
        images.map(reopened).collect()
    }

    /// Rejects `--preview` if no image is written to a regular file.
    pub fn check_preview(&self) -> Result<(), Usage> {
        match self.images.iter().any(ImageOutput::is_rewritable) {
            true => Ok(()),
            false => Err(Usage(
                "--preview: needs an output that is a file, such as -o NAME.png".to_owned(),
            )),
        }
    }

    /// Returns the path of the part, if the output is a part.
    pub fn part(&self) -> Option<&Path> {
        self.part.as_ref()?.path()
    }

    /// Returns the files, each with its option and its name for messages.
    pub fn files(&self) -> impl Iterator<Item = (&str, &str, &Path)> {
        let images = self.images.iter().flat_map(|image| &image.files);
        let images = images.map(|(option, output)| (option.as_str(), output));
        let part = self.part.iter().map(|part| ("--output", part));
        let stats = self.stats.iter().map(|stats| ("--stats", stats));
        let all = images.chain(part).chain(stats);
        all.filter_map(|(option, output)| Some((option, output.name(), output.path()?)))
    }

    /// Returns the name of the first output whose format has no alpha.
    pub fn without_alpha(&self) -> Option<&str> {
        let is_opaque = |image: &&ImageOutput| image.format == Format::Jpeg;
        let (_, output) = self.images.iter().find(is_opaque)?.files.first()?;
        Some(output.name())
    }

    /// Returns the names of the images or of the part, for messages.
    pub fn image_names(&self) -> Vec<String> {
        let images = self.images.iter().flat_map(|image| &image.files);
        let outputs = images.map(|(_, output)| output).chain(&self.part);
        outputs.map(|output| output.name().to_owned()).collect()
    }

    /// Opens all destinations. Opening a pipe blocks until it has a reader, so signals must still end the program
    /// immediately.
    pub fn open(mut self) -> io::Result<OpenOutputs> {
        let images = self.images.iter_mut().flat_map(|image| &mut image.files);
        for output in images
            .map(|(_, output)| output)
            .chain(&mut self.part)
            .chain(&mut self.stats)
        {
            output.connect()?;
        }
        let target = |ImageOutput { format, files }| {
            let files = files.into_iter().map(|(_, output)| Pending::start(output));
            let files = files.collect::<io::Result<_>>()?;
            Ok(Target { format, files })
        };
        Ok(OpenOutputs {
            files: match self.part {
                Some(part) => Files::Part(Pending::start(part)?),
                None => Files::Images(self.images.into_iter().map(target).collect::<io::Result<_>>()?),
            },
            stats: self.stats.map(Pending::start).transpose()?,
        })
    }
}

fn find_stats(path: &Path) -> anyhow::Result<Output> {
    let stats = output(path)?;
    forbid_known_extensions("--stats", path, &stats)?;
    Ok(stats)
}

fn find_checkpoint(path: &Path) -> anyhow::Result<Output> {
    let checkpoint = output(path)?;
    if !checkpoint.is_file() {
        let name = checkpoint.name();
        return Err(Usage(format!("--checkpoint: {name}: must be a regular file")).into());
    }
    forbid_known_extensions("--checkpoint", path, &checkpoint)?;
    Ok(checkpoint)
}

/// Rejects names with the extension of a scene, part, model or image: the user probably confused two options.
fn forbid_known_extensions(option: &str, path: &Path, output: &Output) -> Result<(), Usage> {
    forbid_ending(option, path, output, "toml", "scenes")?;
    forbid_ending(option, path, output, PART, "parts of images")?;
    let mut model_extensions = ["gltf", "glb"].into_iter();
    model_extensions.try_for_each(|ending| forbid_ending(option, path, output, ending, "models"))?;
    let mut image_extensions = ["png", "exr", "jpg", "jpeg", "webp"].into_iter();
    image_extensions.try_for_each(|ending| forbid_ending(option, path, output, ending, "images"))
}

pub fn protect_inputs(option: &str, output: &Output, inputs: &[PathBuf], remedy: &str) -> Result<(), Usage> {
    let Some(input) = inputs.iter().find(|input| output.is_input(input)) else {
        return Ok(());
    };
    let without_dot = |path: &str| path.strip_prefix("./").unwrap_or(path).to_owned();
    let (name, input) = (output.name(), input.display().to_string());
    Err(Usage(if without_dot(name) == without_dot(&input) {
        format!("{option}: {name} is an input of the scene; {remedy}")
    } else {
        format!("{option}: {name} is the same file as {input}, an input of the scene; {remedy}")
    }))
}

fn output(path: &Path) -> Result<Output, RenderError> {
    match path.to_str() {
        Some("-") => Ok(Output::standard()),
        _ => Output::find(path).map_err(RenderError::Output),
    }
}

/// Returns the format of each output: that of its extension, else that of --format. Streams default to PNG.
fn formats(destinations: &[(&Path, Output)], option: Option<Format>) -> Result<Vec<Format>, Usage> {
    let by_extension: Vec<Option<Format>> = destinations.iter().map(|(path, _)| Format::of(path)).collect();
    if let (Some(option), false) = (option, by_extension.contains(&None)) {
        // All outputs have known extensions, which --format must not contradict.
        let contradiction = destinations
            .iter()
            .zip(&by_extension)
            .find(|(_, format)| **format != Some(option));
        if let Some(((path, _), _)) = contradiction {
            let (name, ending) = (path.display(), path.extension().unwrap_or_default().display());
            return Err(Usage(format!(
                "--format: contradicts --output {name}, which ends in .{ending}"
            )));
        }
    }
    let format = |((path, destination), by_extension): (&(&Path, Output), Option<Format>)| match by_extension.or(option)
    {
        Some(format) => Ok(format),
        None if !destination.is_file() => Ok(Format::Png),
        None if path.extension().is_some_and(|end| end.eq_ignore_ascii_case(PART)) => Err(Usage(format!(
            "--output: {}: names a part; use --tile i/n to render part i of n",
            path.display()
        ))),
        None => Err(Usage(format!(
            "--output: {}: must end in .png, .exr, .jpg, .jpeg or .webp; or set --format",
            path.display()
        ))),
    };
    destinations.iter().zip(by_extension).map(format).collect()
}

/// Rejects layers that no output supports.
fn check_layers(aovs: &[Aov], destinations: &[(&Path, Output)], formats: &[Format]) -> Result<(), Usage> {
    let mut layers = destinations
        .iter()
        .zip(formats)
        .map(|((_, output), format)| match format.layers() {
            Layers::Beside if !output.is_file() => Layers::Unsupported,
            layers => layers,
        });
    let (Some(aov), true) = (
        aovs.iter().find(|aov| aov.has_file()),
        layers.all(|layers| layers == Layers::Unsupported),
    ) else {
        return Ok(());
    };
    let aov = aov.name();
    let message = match destinations
        .iter()
        .zip(formats)
        .find(|(_, format)| **format == Format::Png)
    {
        Some(((_, output), _)) => format!(
            "--aov {aov}: needs a file beside {}, which is a stream; use -o NAME.png, or --format exr for a layer",
            output.name()
        ),
        None => format!("--aov {aov}: only applies to EXR and PNG outputs; add -o NAME.exr or -o NAME.png"),
    };
    Err(Usage(message))
}

fn forbid_ending(option: &str, path: &Path, output: &Output, ending: &str, kind: &str) -> Result<(), Usage> {
    let has_ending = |path: &Path| path.extension().is_some_and(|end| end.eq_ignore_ascii_case(ending));
    match has_ending(path) || output.path().is_some_and(has_ending) {
        false => Ok(()),
        true => {
            let name = output.name();
            Err(Usage(format!(
                "{option}: {name}: must not end in .{ending} or link to such a file: .{ending} files are {kind}"
            )))
        }
    }
}
