//! Where a render writes to, settled before it begins: nothing that it reads, and nothing twice.

use std::io::{self, IsTerminal as _};
use std::path::{Path, PathBuf};

use wgray::error::RenderError;
use wgray::film::Region;
use wgray::image::{self, Aov, Format, Layers, Output, Pending, Target};

use super::Usage;
use super::picture_options::PictureOptions;

/// All that a render writes.
pub struct Outputs {
    pictures: Vec<Picture>,
    /// In place of pictures, a part of one.
    part: Option<Output>,
    stats: Option<Output>,
}

/// A picture's places.
struct Picture {
    format: Format,
    /// The picture, then those of its AOVs that are files of their own; each with the option that asks for it.
    files: Vec<(String, Output)>,
}

/// What [`Outputs`] are once they are begun.
pub struct Begun {
    pub places: Places,
    pub stats: Option<Pending>,
}

/// Where a render goes to.
pub enum Places {
    Pictures(Vec<Target>),
    /// A part of a picture.
    Part(Pending),
}

impl Places {
    /// What messages call the first of them.
    pub fn name(&self) -> Option<&str> {
        match self {
            Places::Pictures(targets) => targets
                .iter()
                .flat_map(|target| &target.files)
                .next()
                .map(Pending::name),
            Places::Part(file) => Some(file.name()),
        }
    }
}

/// How layers come to be among the outputs.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Layered {
    /// Somebody asked for them, so some picture must take them.
    Asked,
    /// They are there, for the pictures that take them.
    There,
}

/// The end of a part's name.
const PART: &str = "part";

impl Outputs {
    /// Looks at all places. `-` is standard output. Where no picture is named it is `default`.
    pub fn find(
        options: &PictureOptions,
        default: &Path,
        (aovs, layered): (&[Aov], Layered),
        stats: Option<&Path>,
    ) -> anyhow::Result<Outputs> {
        let paths = match options.output.as_slice() {
            [] => vec![default],
            paths => paths.iter().map(PathBuf::as_path).collect(),
        };
        let mut found = Vec::new();
        for path in paths {
            let picture = output(path)?;
            if path.as_os_str() == "-" && io::stdout().is_terminal() {
                let message = "--output: -: must not be a terminal; > FILE or | COMMAND takes the picture";
                return Err(Usage(message.to_owned()).into());
            }
            forbid_ending("--output", path, &picture, "toml", "is a scene's name")?;
            found.push((path, picture));
        }
        let formats = formats(&found, options.format)?;
        options.check(&formats)?;
        if let Layered::Asked = layered {
            has_place_for(aovs, &found, &formats)?;
        }
        let mut pictures = Vec::new();
        for ((path, picture), format) in found.into_iter().zip(formats) {
            let beside = match picture.is_file() {
                true => aovs,
                false => &[],
            };
            let mut files = vec![("--output".to_owned(), picture)];
            for (aov, path) in beside
                .iter()
                .zip(image::files(path, format, beside).into_iter().skip(1))
            {
                files.push((format!("--aov {}", aov.name()), output(&path)?));
            }
            pictures.push(Picture { format, files });
        }
        Ok(Outputs {
            pictures,
            part: None,
            stats: stats.map(find_stats).transpose()?,
        })
    }

    /// Looks at the place of a part of a picture.
    pub fn find_part(options: &PictureOptions, stats: Option<&Path>) -> anyhow::Result<Outputs> {
        let ends = |path: &Path| path.extension().is_some_and(|end| end.eq_ignore_ascii_case(PART));
        let path = match options.output.as_slice() {
            [path] if ends(path) => path,
            _ => {
                let rule = "--tile: needs one -o NAME.part, which wgray merge joins with the others to a picture";
                return Err(Usage(rule.to_owned()).into());
            }
        };
        if options.format.is_some() {
            return Err(Usage("--format: is for pictures, and --tile writes a part".to_owned()).into());
        }
        options.check(&[])?;
        Ok(Outputs {
            pictures: Vec::new(),
            part: Some(output(path)?),
            stats: stats.map(find_stats).transpose()?,
        })
    }

    /// Refuses pictures that are larger than their format has them.
    pub fn check_size(&self, region: Region) -> Result<(), Usage> {
        let mut named = self
            .pictures
            .iter()
            .filter_map(|picture| Some((picture.format, picture.files.first()?)));
        named.try_for_each(|(format, (option, output))| {
            let rule = format.check_size(region.width(), region.height());
            rule.map_err(|rule| Usage(format!("{option}: {}: {rule}", output.name())))
        })
    }

    /// Refuses what would replace an input or another output.
    pub fn check(&self, inputs: &[PathBuf], checkpoint: Option<&Path>) -> anyhow::Result<()> {
        // In a folder it has a name that nothing else has.
        let checkpoint = checkpoint.filter(|path| !path.is_dir());
        let checkpoint = checkpoint.map(find_checkpoint).transpose()?;
        let checkpoint = checkpoint
            .iter()
            .map(|output| ("--checkpoint", output, "choose another name"));
        let stats = self.stats.iter().map(|stats| ("--stats", stats, "choose another name"));
        let pictures = (self.pictures.iter().flat_map(|picture| &picture.files))
            .map(|(option, output)| (option.as_str(), output, "choose another name by --output"));
        let part = self
            .part
            .iter()
            .map(|part| ("--output", part, "choose another name by --output"));
        let mut before: Vec<(&str, &Output)> = Vec::new();
        for (option, output, way) in part.chain(pictures).chain(stats).chain(checkpoint) {
            keep_inputs(option, output, inputs, way)?;
            if let Some((other, _)) = before.iter().find(|(_, other)| other.is_same(output)) {
                let name = output.name();
                return Err(Usage(format!("{option}: {name}: is where {other} writes to; {way}")).into());
            }
            before.push((option, output));
        }
        Ok(())
    }

    /// Whether all of its files are there already, which are whole then. A stream for figures does not count; a picture on one
    /// is never there.
    pub fn are_there(&self) -> bool {
        let is_there = |output: &Output| output.path().is_some_and(Path::is_file);
        let pictures = self.pictures.iter().flat_map(|picture| &picture.files);
        let figures = self.stats.iter().filter(|stats| stats.is_file());
        let mut all = pictures.map(|(_, output)| output).chain(&self.part).chain(figures);
        all.all(is_there)
    }

    /// Where the part of a picture is, if it is one and a file.
    pub fn part(&self) -> Option<&Path> {
        self.part.as_ref()?.path()
    }

    /// The files that it writes, each with its option and its name in messages.
    pub fn files(&self) -> impl Iterator<Item = (&str, &str, &Path)> {
        let pictures = self.pictures.iter().flat_map(|picture| &picture.files);
        let pictures = pictures.map(|(option, output)| (option.as_str(), output));
        let part = self.part.iter().map(|part| ("--output", part));
        let stats = self.stats.iter().map(|stats| ("--stats", stats));
        let all = pictures.chain(part).chain(stats);
        all.filter_map(|(option, output)| Some((option, output.name(), output.path()?)))
    }

    /// Opens all. A pipe waits for its reader, so that is done while signals still end the program at once.
    pub fn begin(mut self) -> io::Result<Begun> {
        let pictures = self.pictures.iter_mut().flat_map(|picture| &mut picture.files);
        for output in pictures
            .map(|(_, output)| output)
            .chain(&mut self.part)
            .chain(&mut self.stats)
        {
            output.connect()?;
        }
        let target = |Picture { format, files }| {
            let files = files.into_iter().map(|(_, output)| Pending::start(output));
            let files = files.collect::<io::Result<_>>()?;
            Ok(Target { format, files })
        };
        Ok(Begun {
            places: match self.part {
                Some(part) => Places::Part(Pending::start(part)?),
                None => Places::Pictures(self.pictures.into_iter().map(target).collect::<io::Result<_>>()?),
            },
            stats: self.stats.map(Pending::start).transpose()?,
        })
    }
}

fn find_stats(path: &Path) -> anyhow::Result<Output> {
    let stats = output(path)?;
    forbid_pictures("--stats", path, &stats)?;
    Ok(stats)
}

fn find_checkpoint(path: &Path) -> anyhow::Result<Output> {
    let checkpoint = output(path)?;
    if !checkpoint.is_file() {
        let name = checkpoint.name();
        return Err(Usage(format!(
            "--checkpoint: {name}: must be a file, which can be gone on from"
        ))
        .into());
    }
    forbid_pictures("--checkpoint", path, &checkpoint)?;
    Ok(checkpoint)
}

/// Refuses names that would be a slip.
fn forbid_pictures(option: &str, path: &Path, output: &Output) -> Result<(), Usage> {
    forbid_ending(option, path, output, "toml", "is a scene's name")?;
    forbid_ending(option, path, output, PART, "is a part's name")?;
    let mut models = ["gltf", "glb"].into_iter();
    models.try_for_each(|ending| forbid_ending(option, path, output, ending, "is a model's name"))?;
    let mut pictures = ["png", "exr", "jpg", "jpeg", "webp"].into_iter();
    pictures.try_for_each(|ending| forbid_ending(option, path, output, ending, "is a picture's name"))
}

/// Refuses an output that is a file which the work reads.
pub fn keep_inputs(option: &str, output: &Output, inputs: &[PathBuf], way: &str) -> Result<(), Usage> {
    let Some(input) = inputs.iter().find(|input| output.is_input(input)) else {
        return Ok(());
    };
    let plain = |path: &str| path.strip_prefix("./").unwrap_or(path).to_owned();
    let (name, input) = (output.name(), input.display().to_string());
    Err(Usage(if plain(name) == plain(&input) {
        format!("{option}: {name}: is a file that the scene is made of, and must stay; {way}")
    } else {
        format!("{option}: {name}: is the file {input}, which the scene is made of and must stay; {way}")
    }))
}

fn output(path: &Path) -> Result<Output, RenderError> {
    match path.to_str() {
        Some("-") => Ok(Output::standard()),
        _ => Output::find(path).map_err(RenderError::Output),
    }
}

/// The formats that the names' ends say, or the option; what is no file and has no such end gets a PNG.
fn formats(pictures: &[(&Path, Output)], told: Option<Format>) -> Result<Vec<Format>, Usage> {
    let named: Vec<Option<Format>> = pictures.iter().map(|(path, _)| Format::of(path)).collect();
    if let (Some(told), false) = (told, named.contains(&None)) {
        // It is for no picture, and must at least be true.
        let other = pictures.iter().zip(&named).find(|(_, named)| **named != Some(told));
        if let Some(((path, _), _)) = other {
            let (name, ending) = (path.display(), path.extension().unwrap_or_default().display());
            return Err(Usage(format!(
                "--format: must be what the name of --output says, {name} ends in .{ending}"
            )));
        }
    }
    let format = |((path, picture), named): (&(&Path, Output), Option<Format>)| match named.or(told) {
        Some(format) => Ok(format),
        None if !picture.is_file() => Ok(Format::Png),
        None if path.extension().is_some_and(|end| end.eq_ignore_ascii_case(PART)) => Err(Usage(format!(
            "--output: {}: is a part's name; --tile 1/4 renders the first of four parts",
            path.display()
        ))),
        None => Err(Usage(format!(
            "--output: {}: must end in .png, .exr, .jpg, .jpeg or .webp, or --format must say which it is",
            path.display()
        ))),
    };
    pictures.iter().zip(named).map(format).collect()
}

/// Refuses layers that none of the pictures takes.
fn has_place_for(aovs: &[Aov], pictures: &[(&Path, Output)], formats: &[Format]) -> Result<(), Usage> {
    let mut layers = pictures
        .iter()
        .zip(formats)
        .map(|((_, output), format)| match format.layers() {
            Layers::Beside if !output.is_file() => Layers::Unsupported,
            layers => layers,
        });
    let (Some(aov), true) = (aovs.first(), layers.all(|layers| layers == Layers::Unsupported)) else {
        return Ok(());
    };
    let aov = aov.name();
    let message = match pictures.iter().zip(formats).find(|(_, format)| **format == Format::Png) {
        Some(((_, output), _)) => format!(
            "--aov {aov}: is a file beside a PNG, and there is none beside {}; --format exr puts it into the picture, \
             -o NAME.png makes files",
            output.name()
        ),
        None => format!(
            "--aov {aov}: is in an EXR or beside a PNG, and no output is one; a further -o NAME.exr or -o NAME.png takes it"
        ),
    };
    Err(Usage(message))
}

fn forbid_ending(option: &str, path: &Path, output: &Output, ending: &str, why: &str) -> Result<(), Usage> {
    let ends = |path: &Path| path.extension().is_some_and(|end| end.eq_ignore_ascii_case(ending));
    match ends(path) || output.path().is_some_and(ends) {
        false => Ok(()),
        true => {
            let name = output.name();
            Err(Usage(format!(
                "{option}: {name}: must not end in .{ending}, nor lead to such a file: that {why}"
            )))
        }
    }
}
