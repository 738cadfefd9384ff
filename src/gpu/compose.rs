//! Kernels as text: each is the concatenation of a list of files, since WGSL's module scope has no order.

use std::ops::Range;
use std::{fs, io, path::Path};

macro_rules! files {
    ($($name:literal),* $(,)?) => {
        &[$(($name, include_str!(concat!("../../shaders/", $name)))),*]
    };
}

/// Every file of `shaders/`, as it was when the program was built.
pub const BUILT_IN: &[(&str, &str)] = files![
    "adaptive.wgsl",
    "bindings.wgsl",
    "camera.wgsl",
    "constants.wgsl",
    "differential.wgsl",
    "ellipsoid.wgsl",
    "filter.wgsl",
    "footprint.wgsl",
    "integrator.wgsl",
    "kernels/adaptive.wgsl",
    "kernels/aov.wgsl",
    "kernels/render.wgsl",
    "layout.wgsl",
    "light.wgsl",
    "math.wgsl",
    "path.wgsl",
    "pattern.wgsl",
    "phong.wgsl",
    "plane.wgsl",
    "ray.wgsl",
    "receipt.wgsl",
    "rectangle.wgsl",
    "rng.wgsl",
    "rounding.wgsl",
    "sampling.wgsl",
    "scene.wgsl",
    "sequence.wgsl",
    "shadow.wgsl",
    "specialization.wgsl",
    "specular.wgsl",
    "surface.wgsl",
    "tangent.wgsl",
    "texel.wgsl",
    "texels.wgsl",
    "texture.wgsl",
    "traverse.wgsl",
    "triangle.wgsl",
];

/// The files of the shared mathematics: pure functions and records, each with a twin in `src/cpu/`.
pub const SHARED: &[&str] = &[
    "constants.wgsl",
    "layout.wgsl",
    "math.wgsl",
    "rng.wgsl",
    "sampling.wgsl",
    "sequence.wgsl",
    "ray.wgsl",
    "rectangle.wgsl",
    "triangle.wgsl",
    "ellipsoid.wgsl",
    "plane.wgsl",
    "camera.wgsl",
    "surface.wgsl",
    "light.wgsl",
    "shadow.wgsl",
    "phong.wgsl",
    "differential.wgsl",
    "specular.wgsl",
    "path.wgsl",
    "footprint.wgsl",
    "pattern.wgsl",
    "texel.wgsl",
    "tangent.wgsl",
    "filter.wgsl",
    "adaptive.wgsl",
];

/// What may take the place of quotients and square roots. It comes first, as naga wants functions before their calls.
pub const ROUNDING: &str = "rounding.wgsl";

/// What every kernel adds to [`SHARED`]: its constants, its buffers and the way through the scene.
const KERNEL: &[&str] = &[
    "specialization.wgsl",
    "bindings.wgsl",
    "receipt.wgsl",
    "traverse.wgsl",
    "texture.wgsl",
    "integrator.wgsl",
];
/// The scene read from buffers, by loops. `bake` writes the same functions with the scene's records as constants.
const FROM_BUFFERS: &str = "scene.wgsl";
/// The texels in one buffer.
const TEXELS: &str = "texels.wgsl";

/// A compute shader's entry point and the file that it is in.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kernel {
    /// Accumulates samples in the film.
    Render,
    /// The same, as long as a pixel needs them.
    Adaptive,
    /// Writes what the first hit of each pixel's centre is like.
    Aov,
}

impl Kernel {
    /// Every kernel.
    pub const ALL: [Kernel; 3] = [Kernel::Render, Kernel::Adaptive, Kernel::Aov];

    /// The entry point's name.
    pub fn entry_point(self) -> &'static str {
        match self {
            Kernel::Render => "render",
            Kernel::Adaptive => "adaptive",
            Kernel::Aov => "aov",
        }
    }

    /// The file that has it.
    pub fn file(self) -> &'static str {
        match self {
            Kernel::Render => "kernels/render.wgsl",
            Kernel::Adaptive => "kernels/adaptive.wgsl",
            Kernel::Aov => "kernels/aov.wgsl",
        }
    }
}

/// The texts of all shader files.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Shaders {
    files: Vec<(String, String)>,
}

impl Shaders {
    /// The ones in the program.
    pub fn built_in() -> Shaders {
        Shaders {
            files: BUILT_IN
                .iter()
                .map(|(name, text)| (name.to_string(), text.to_string()))
                .collect(),
        }
    }

    /// The ones in a folder, which has the same files as the project's `shaders/`.
    pub fn read(folder: &Path) -> io::Result<Shaders> {
        let read = |name: &str| {
            let path = folder.join(name);
            let text = fs::read_to_string(&path)
                .map_err(|error| io::Error::new(error.kind(), format!("{}: {error}", path.display())))?;
            Ok((name.to_string(), text))
        };
        Ok(Shaders {
            files: BUILT_IN.iter().map(|(name, _)| read(name)).collect::<io::Result<_>>()?,
        })
    }

    /// The same with another text of a file.
    #[cfg(test)]
    pub(super) fn with(mut self, name: &str, text: String) -> Shaders {
        self.files.retain(|(file, _)| file != name);
        self.files.push((name.to_string(), text));
        self
    }

    /// A kernel that reads the scene from buffers, or, if `baked` is the text of the functions that know the scene, has
    /// it as constants.
    pub fn compose(&self, kernel: Kernel, baked: Option<&str>) -> Source {
        self.compose_with_texels(kernel, baked, None)
    }

    /// The same where `texels` is the text of the function that reads texels from several buffers.
    pub fn compose_with_texels(&self, kernel: Kernel, baked: Option<&str>, texels: Option<&str>) -> Source {
        let mut source = Source::default();
        for name in [&ROUNDING]
            .into_iter()
            .chain(SHARED)
            .chain(KERNEL)
            .chain([&kernel.file()])
        {
            source.append(name, self.text(name));
        }
        match baked {
            Some(text) => source.append("(the scene as constants)", text),
            None => source.append(FROM_BUFFERS, self.text(FROM_BUFFERS)),
        }
        match texels {
            Some(text) => source.append("(the texels' buffers)", text),
            None => source.append(TEXELS, self.text(TEXELS)),
        }
        source
    }

    /// The text of a file.
    pub fn text(&self, name: &str) -> &str {
        self.files
            .iter()
            .find(|(file, _)| file == name)
            .map_or("", |(_, text)| text)
    }
}

/// A kernel's whole text, and where each part of it came from.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Source {
    /// The WGSL.
    pub text: String,
    parts: Vec<Part>,
}

#[derive(Clone, Debug, PartialEq, Eq)]
struct Part {
    file: String,
    start: usize,
}

impl Source {
    /// Adds a file at the end.
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

    /// The text with a part of it replaced, and its lines where they were. What is replaced lies in one file.
    pub fn replaced(&self, range: Range<usize>, with: &str) -> Source {
        let lines = self.text[range.clone()].matches('\n').count();
        let with = with.to_string() + &"\n".repeat(lines);
        let moved = |start: usize| match start >= range.end {
            true => start - range.len() + with.len(),
            false => start,
        };
        Source {
            text: [&self.text[..range.start], &with, &self.text[range.end..]].concat(),
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

    /// Where a file starts.
    pub fn start_of(&self, file: &str) -> Option<usize> {
        self.parts.iter().find(|part| part.file == file).map(|part| part.start)
    }

    /// The file that a byte of the text came from, its own text, and the byte's offset in it.
    pub fn locate(&self, offset: usize) -> Option<(&str, &str, usize)> {
        let i = self.parts.partition_point(|part| part.start <= offset).checked_sub(1)?;
        let end = self.parts.get(i + 1).map_or(self.text.len(), |next| next.start);
        let part = &self.parts[i];
        Some((&part.file, &self.text[part.start..end], offset - part.start))
    }
}
