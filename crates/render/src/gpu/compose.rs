//! Kernel sources: concatenated shader files and their locations in the text. The order of the files does not matter,
//! because WGSL declarations at module scope are unordered.

use std::ops::Range;
use std::{fs, io, path::Path};

use super::bake::{bvh_loaders, record_loaders};
use super::dispatch;
use super::functions::is_same_code;
use wgray_image::blocking_path;
use wgray_scene::Integrator;
use wgray_shaders::{
    ADAPTIVE_FILES, DENOISE_FILES, FIRST_HITS_FILES, FROM_BUFFERS, KERNEL, PATH, PHONG, RENDER_FILES, ROUNDING_FILES,
    SAMPLES, TEXELS,
};
pub use wgray_shaders::{File, SHARED, built_in};
use wgray_trace::records;
use wgray_trace::records::Specialization;

/// File with division and square roots in software.
pub const ROUNDING: &str = "rounding.wgsl";

/// A compute shader.
#[derive(Debug, PartialEq, Eq)]
pub struct Kernel {
    /// Name of the entry point.
    pub entry_point: &'static str,
    /// Files in addition to [`SHARED`], the scene and an integrator. The last file has the entry point and declares the
    /// outputs.
    pub files: &'static [&'static [File]],
    /// True if the kernel needs an integrator.
    pub integrates: bool,
}

/// Accumulates samples in the film.
pub static RENDER: Kernel = Kernel {
    entry_point: "render",
    files: &[KERNEL, SAMPLES, RENDER_FILES],
    integrates: true,
};
/// Accumulates samples until each pixel has converged.
pub static ADAPTIVE: Kernel = Kernel {
    entry_point: "adaptive",
    files: &[KERNEL, SAMPLES, ADAPTIVE_FILES],
    integrates: true,
};
/// Writes the first hits through pixel centers.
pub static FIRST_HITS: Kernel = Kernel {
    entry_point: "first_hits",
    files: &[KERNEL, FIRST_HITS_FILES],
    integrates: false,
};
/// Denoises an image. Reads no scene.
pub static DENOISE: Kernel = Kernel {
    entry_point: "denoise",
    files: &[DENOISE_FILES],
    integrates: false,
};
/// All kernels that read the scene.
pub static KERNELS: [&Kernel; 3] = [&RENDER, &ADAPTIVE, &FIRST_HITS];

fn integrator_files(integrator: Integrator) -> &'static [File] {
    match integrator {
        Integrator::Phong => PHONG,
        Integrator::Path => PATH,
    }
}

impl Kernel {
    /// Returns the file with the entry point.
    pub fn file(&self) -> &'static str {
        self.files.iter().copied().flatten().last().map_or("", |(name, _)| name)
    }
}

/// Contents of all shader files.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Shaders {
    files: Vec<(String, String)>,
}

/// Replaces a byte-order mark, which WGSL does not allow, by spaces of the same length, so that offsets do not change.
fn without_byte_order_mark(text: String) -> String {
    match text.strip_prefix('\u{feff}') {
        Some(rest) => format!("   {rest}"),
        None => text,
    }
}

impl Shaders {
    /// Returns the built-in shaders.
    pub fn built_in() -> Shaders {
        Shaders {
            files: built_in()
                .map(|(name, text)| (name.to_string(), text.to_string()))
                .collect(),
        }
    }

    /// Reads the files of `shaders/` from another folder.
    pub fn read(folder: &Path) -> io::Result<Shaders> {
        let read = |name: &str| {
            let path = folder.join(name);
            let text = blocking_path::reject(&path).and_then(|()| fs::read_to_string(&path));
            let text = text.map_err(|error| io::Error::new(error.kind(), format!("{}: {error}", path.display())))?;
            Ok((name.to_string(), without_byte_order_mark(text)))
        };
        Ok(Shaders {
            files: built_in().map(|(name, _)| read(name)).collect::<io::Result<_>>()?,
        })
    }

    /// Returns true if only comments and white space differ.
    pub fn has_same_code(&self, other: &Shaders) -> bool {
        self.files().all(|(name, text)| is_same_code(text, other.text(name)))
    }

    /// Returns all names and contents.
    pub fn files(&self) -> impl Iterator<Item = (&str, &str)> {
        self.files.iter().map(|(name, text)| (name.as_str(), text.as_str()))
    }

    /// Replaces the contents of a file.
    #[must_use]
    pub fn with(mut self, name: &str, text: String) -> Shaders {
        self.files.retain(|(file, _)| file != name);
        self.files.push((name.to_string(), text));
        self
    }

    /// Returns the shared mathematics: constants, records and pure functions.
    pub fn shared(&self) -> Source {
        let mut source = Source::default();
        source.append(
            "crates/trace/src/records/constants.rs",
            &records::constant_declarations(),
        );
        source.append("crates/trace/src/records/layout.rs", &records::declarations());
        self.append(&mut source, SHARED);
        source
    }

    /// Composes a kernel that reads no scene.
    pub fn compose_alone(&self, kernel: &Kernel) -> Source {
        let mut source = Source::default();
        self.append(&mut source, ROUNDING_FILES);
        source.extend(&self.shared());
        source.append(
            "crates/trace/src/records/specialization.rs",
            &Specialization::declarations(),
        );
        for files in kernel.files {
            self.append(&mut source, files);
        }
        source
    }

    /// Composes a kernel. `baked` is the text of functions with the scene as constants; if it is `None`, the scene is
    /// read from buffers.
    pub fn compose(&self, kernel: &Kernel, integrator: Integrator, baked: Option<&str>) -> Source {
        self.compose_with_texels(kernel, integrator, baked, None)
    }

    /// Like [`Shaders::compose`]. `texels` is a function that reads texels from several buffers; `None` for a single
    /// buffer.
    pub fn compose_with_texels(
        &self,
        kernel: &Kernel,
        integrator: Integrator,
        baked: Option<&str>,
        texels: Option<&str>,
    ) -> Source {
        let mut source = self.compose_alone(kernel);
        if kernel.integrates {
            self.append(&mut source, integrator_files(integrator));
        }
        match baked {
            Some(text) => source.append("(the scene as constants)", text),
            None => {
                self.append(&mut source, FROM_BUFFERS);
                source.append("(the loops over kinds of primitives)", &dispatch::linear_loops());
                source.append("(the functions that load records)", &record_loaders());
            }
        }
        source.append("(the functions that load BVH records)", &bvh_loaders());
        source.append(
            "(the intersections of items of the BVH)",
            &dispatch::item_intersections(),
        );
        match texels {
            Some(text) => source.append("(the texels' buffers)", text),
            None => self.append(&mut source, TEXELS),
        }
        source
    }

    fn append(&self, source: &mut Source, files: &[File]) {
        for (name, _) in files {
            source.append(name, self.text(name));
        }
    }

    /// Returns the contents of a file, or an empty text if no file has this name.
    pub fn text(&self, name: &str) -> &str {
        self.files
            .iter()
            .find(|(file, _)| file == name)
            .map_or("", |(_, text)| text)
    }
}

/// A kernel's text, and the origin of each part.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Source {
    /// WGSL text.
    pub text: String,
    parts: Vec<Part>,
}

#[derive(Clone, Debug, PartialEq, Eq)]
struct Part {
    file: String,
    start: usize,
}

impl Source {
    /// Appends a file.
    pub fn append(&mut self, file: &str, text: &str) {
        self.parts.push(Part {
            file: file.to_string(),
            start: self.text.len(),
        });
        self.text.push_str(text);
        if !text.ends_with('\n') {
            self.text.push('\n');
        }
    }

    fn extend(&mut self, other: &Source) {
        let start = self.text.len();
        self.parts.extend(other.parts.iter().map(|part| Part {
            file: part.file.clone(),
            start: start + part.start,
        }));
        self.text.push_str(&other.text);
    }

    /// Replaces a range inside one file by text with the same number of lines.
    pub fn replaced(&self, range: Range<usize>, replacement: &str) -> Source {
        let lines = self.text[range.clone()].matches('\n').count();
        let replacement = replacement.to_string() + &"\n".repeat(lines);
        let moved = |start: usize| match start >= range.end {
            true => start - range.len() + replacement.len(),
            false => start,
        };
        Source {
            text: [&self.text[..range.start], &replacement, &self.text[range.end..]].concat(),
            parts: self
                .parts
                .iter()
                .map(|part| Part {
                    file: part.file.clone(),
                    start: moved(part.start),
                })
                .collect(),
        }
    }

    /// Returns the offset of a file.
    pub fn start_of(&self, file: &str) -> Option<usize> {
        self.parts.iter().find(|part| part.file == file).map(|part| part.start)
    }

    /// Returns file, line and column of a byte of the text.
    pub fn place(&self, offset: usize) -> Option<String> {
        let (file, text, offset) = self.locate(offset)?;
        let preceding = &text[..offset];
        let start = preceding.rfind('\n').map_or(0, |newline| newline + 1);
        let (line, column) = (
            preceding.matches('\n').count() + 1,
            preceding[start..].chars().count() + 1,
        );
        Some(format!("{file}:{line}:{column}"))
    }

    /// Returns the file that contains a byte, the contents of the file, and the offset of the byte in the file.
    pub fn locate(&self, offset: usize) -> Option<(&str, &str, usize)> {
        let i = self.parts.partition_point(|part| part.start <= offset).checked_sub(1)?;
        let end = self.parts.get(i + 1).map_or(self.text.len(), |next| next.start);
        let part = &self.parts[i];
        Some((&part.file, &self.text[part.start..end], offset - part.start))
    }
}
