//! Where a render writes to, settled before it begins: nothing that it reads, and nothing twice.

use std::io::{self, IsTerminal as _};
use std::path::{Path, PathBuf};

use wgray::image::{self, Aov, Format, Output, Pending};

use super::Usage;

/// All that a render writes.
pub struct Outputs {
    pub format: Format,
    /// The picture, then those of its AOVs that are files of their own; each with the option that asks for it.
    pictures: Vec<(String, Output)>,
    stats: Option<Output>,
}

/// What [`Outputs`] are once they are begun.
pub struct Begun {
    pub pictures: Vec<Pending>,
    pub stats: Option<Pending>,
}

impl Outputs {
    /// Looks at all places. `-` is standard output.
    pub fn find(path: &Path, format: Option<Format>, aovs: &[Aov], stats: Option<&Path>) -> anyhow::Result<Outputs> {
        let picture = output(path)?;
        if path.as_os_str() == "-" && io::stdout().is_terminal() {
            let message = "--output: -: must not be a terminal; > FILE or | COMMAND takes the picture";
            return Err(Usage(message.to_owned()).into());
        }
        let format = self::format(path, &picture, format)?;
        forbid_ending("--output", path, &picture, "toml", "is a scene's name")?;
        let beside = match format {
            Format::Png => aovs,
            Format::Exr => &[],
        };
        if let (false, [aov, ..]) = (picture.is_file(), beside) {
            let (aov, name) = (aov.name(), picture.name());
            return Err(Usage(format!(
                "--aov {aov}: is a file beside a PNG, and there is none beside {name}; --format exr puts it into the \
                 picture, -o NAME.png makes files"
            ))
            .into());
        }
        let mut pictures = vec![("--output".to_owned(), picture)];
        for (aov, path) in beside.iter().zip(image::files(path, format, aovs).into_iter().skip(1)) {
            pictures.push((format!("--aov {}", aov.name()), output(&path)?));
        }
        let stats = match stats {
            None => None,
            Some(path) => {
                let stats = output(path)?;
                forbid_ending("--stats", path, &stats, "toml", "is a scene's name")?;
                forbid_ending("--stats", path, &stats, "png", "is a picture's name")?;
                forbid_ending("--stats", path, &stats, "exr", "is a picture's name")?;
                Some(stats)
            }
        };
        Ok(Outputs {
            format,
            pictures,
            stats,
        })
    }

    /// Refuses what would replace an input or another output.
    pub fn check(&self, inputs: &[PathBuf]) -> Result<(), Usage> {
        let stats = self.stats.iter().map(|stats| ("--stats", stats, "choose another name"));
        let pictures =
            (self.pictures.iter()).map(|(option, output)| (option.as_str(), output, "choose another name by --output"));
        let mut before: Vec<(&str, &Output)> = Vec::new();
        for (option, output, way) in pictures.chain(stats) {
            keep_inputs(option, output, inputs, way)?;
            if let Some((other, _)) = before.iter().find(|(_, other)| other.is_same(output)) {
                let name = output.name();
                return Err(Usage(format!("{option}: {name}: is where {other} writes to; {way}")));
            }
            before.push((option, output));
        }
        Ok(())
    }

    /// Opens all. A pipe waits for its reader, so that is done while signals still end the program at once.
    pub fn begin(mut self) -> io::Result<Begun> {
        let all = self
            .pictures
            .iter_mut()
            .map(|(_, output)| output)
            .chain(&mut self.stats);
        for output in all {
            output.connect()?;
        }
        let pictures = self.pictures.into_iter().map(|(_, output)| Pending::start(output));
        Ok(Begun {
            pictures: pictures.collect::<io::Result<_>>()?,
            stats: self.stats.map(Pending::start).transpose()?,
        })
    }
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

fn output(path: &Path) -> io::Result<Output> {
    match path.to_str() {
        Some("-") => Ok(Output::standard()),
        _ => Output::find(path),
    }
}

/// The format that the option says, or the name's end; what is no file and has no such end gets a PNG.
fn format(path: &Path, picture: &Output, told: Option<Format>) -> Result<Format, Usage> {
    let name = path.display();
    match (told, Format::of(path)) {
        (Some(told), Some(named)) if told != named => {
            let ending = path.extension().unwrap_or_default().display();
            Err(Usage(format!(
                "--format: must be what the name of --output says, {name} ends in .{ending}"
            )))
        }
        (Some(format), _) | (None, Some(format)) => Ok(format),
        (None, None) if !picture.is_file() => Ok(Format::Png),
        (None, None) => Err(Usage(format!(
            "--output: {name}: must end in .png or .exr, or --format must say which it is"
        ))),
    }
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
