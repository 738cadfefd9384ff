//! The text of `wgray info`: a table with one row per topic.

use std::collections::BTreeMap;
use std::fmt::Write as _;

use crate::scene::ModelContents;

use super::gather::{Info, Kinds, TextureInfo};

/// Maximum number of images, names and notes in a list.
const MAX_LISTED: usize = 20;

struct Table(String);

impl Table {
    /// Adds a row; with an empty name, the row continues the previous row.
    fn row(&mut self, name: &str, text: &str) {
        // Writing to a String cannot fail.
        let _ = writeln!(self.0, "    {name:<12}{text}");
    }
}

/// Returns the table; `verbose` adds sampling, memory, kernel and driver details.
pub fn table(info: &Info, verbose: bool) -> String {
    let mut table = Table(format!("{}\n", info.scene));
    image(&mut table, info, verbose);
    table.row("camera", &camera(info));
    table.row("bounds", &bounds(info));
    shapes(&mut table, info, verbose);
    table.row("materials", &materials(info));
    table.row("textures", &textures(&info.textures));
    lights(&mut table, info, verbose);
    info.models.iter().for_each(|model| contents(&mut table, model));
    memory(&mut table, info, verbose);
    if verbose {
        kernel(&mut table, info);
    }
    let device = &info.device;
    table.row("device", &format!("{}: {}", device.name, device.why));
    if verbose {
        table.row("", &device.driver);
        for file in &info.files {
            table.row("file", file);
        }
    }
    for note in info.notes.iter().take(MAX_LISTED) {
        table.row("warning", note);
    }
    if info.notes.len() > MAX_LISTED {
        table.row("", &format!("and {} more", info.notes.len() - MAX_LISTED));
    }
    table.0
}

fn image(table: &mut Table, info: &Info, verbose: bool) {
    let image = &info.picture;
    let max = match image.max_samples {
        max if max != image.pixel_samples => format!(", up to {max}"),
        _ => String::new(),
    };
    let samples = format!("{} per pixel{max}", count(image.pixel_samples.into(), "sample"));
    table.row(
        "image",
        &format!("{} x {} pixels, {samples}", image.width, image.height),
    );
    table.row(
        "integrator",
        &format!(
            "{}, up to {}",
            image.integrator,
            count(image.max_depth.into(), "bounce")
        ),
    );
    if verbose {
        let lights = count(image.light_samples, "light sample");
        table.row(
            "sampling",
            &format!("pattern {}, {lights} per hit, seed {}", image.pixel_pattern, image.seed),
        );
    }
}

fn camera(info: &Info) -> String {
    let camera = &info.camera;
    let (position, look_at) = (point(&camera.position), point(&camera.look_at));
    let mut text = format!("{} at {position}, looking at {look_at}", camera.kind);
    if let Some(fov) = camera.fov {
        let _ = write!(text, ", vertical field of view {} degrees", rounded(fov));
    }
    if let Some(height) = camera.height {
        let _ = write!(text, ", height {}", rounded(height));
    }
    if let (Some(aperture), Some(focus)) = (camera.aperture, camera.focus_distance) {
        let _ = write!(text, "; lens {} wide, focused at {}", rounded(aperture), rounded(focus));
    }
    if let Some([first, last]) = camera.frames {
        let _ = write!(text, "; moves from frame {first} to {last}");
    }
    text
}

fn bounds(info: &Info) -> String {
    let Some([low, high]) = &info.bounds else {
        return "none (no shapes other than planes)".to_owned();
    };
    let size = [0, 1, 2].map(|axis| rounded(high[axis] - low[axis]).to_string());
    format!("{} to {}, size {}", point(low), point(high), size.join(" x "))
}

fn shapes(table: &mut Table, info: &Info, verbose: bool) {
    let shapes = &info.shapes;
    table.row("shapes", &kinds(&shapes.kinds));
    if shapes.meshes > 0 {
        let instanced = match shapes.instanced_triangles {
            total if total == shapes.mesh_triangles => String::new(),
            total => format!("; {total} including instances"),
        };
        let triangles = count(shapes.mesh_triangles, "triangle");
        table.row("meshes", &format!("{} with {triangles}{instanced}", shapes.meshes));
    }
    if verbose {
        let lights = info.lights.kinds.by_type.get("rectangle");
        let lights = lights.map_or(String::new(), |n| format!(", including {}", count(*n, "area light")));
        table.row("primitives", &format!("{}{lights}", shapes.primitives));
    }
}

fn materials(info: &Info) -> String {
    match info.material_names.as_slice() {
        [] => kinds(&info.materials),
        names => format!(
            "{} ({})",
            kinds(&info.materials),
            list(names.iter().map(|name| Some(name.as_str())), false)
        ),
    }
}

fn lights(table: &mut Table, info: &Info, verbose: bool) {
    let lights = &info.lights;
    table.row("lights", &kinds(&lights.kinds));
    if let Some(environment) = &lights.environment {
        table.row("environment", environment);
    }
    if verbose && lights.emitters > 0 {
        table.row("emitters", &format!("{} sampled by the path tracer", lights.emitters));
    }
}

/// Adds the contents of a glTF file, with the indices and names that options accept.
fn contents(table: &mut Table, model: &ModelContents) {
    table.row("glTF file", &model.file);
    let ModelContents {
        scenes,
        cameras,
        animations,
        variants,
        materials,
        images,
        ..
    } = model;
    let lists = [
        ("scenes", scenes),
        ("cameras", cameras),
        ("animations", animations),
        ("variants", variants),
        ("materials", materials),
        ("images", images),
    ];
    for (name, names) in lists {
        if !names.is_empty() {
            let listed = list(names.iter().map(Option::as_deref), true);
            table.row("", &format!("{name:<11}{}: {listed}", names.len()));
        }
    }
}

fn memory(table: &mut Table, info: &Info, verbose: bool) {
    let memory = &info.memory;
    let [total, scene, bvhs, texels, film] =
        [memory.total, memory.scene, memory.trees, memory.texels, memory.film].map(mebibytes);
    table.row("memory", &format!("{total} (scene {scene}, film {film})"));
    if !verbose {
        return;
    }
    table.row("", &format!("scene: {bvhs} of BVHs, {texels} of texels"));
    if memory.bands > 1 {
        table.row("", &format!("film: one of {} bands at a time", memory.bands));
    }
    if let Some(bytes) = memory.scene_on_device {
        table.row("", &format!("scene on the device: {}", mebibytes(bytes)));
    }
}

fn kernel(table: &mut Table, info: &Info) {
    let kernel = &info.kernel;
    let features = |names: &[&str]| match names {
        [] => "none".to_owned(),
        names => names.join(", "),
    };
    table.row(
        "kernel",
        &match (kernel.entry, kernel.lines, kernel.baked) {
            (Some(entry), Some(lines), Some(baked)) => {
                let storage = if baked { "constants" } else { "buffers" };
                format!("{entry}, {lines} lines of WGSL, scene in {storage}")
            }
            _ => "none (the CPU compiles no kernel)".to_owned(),
        },
    );
    table.row("", &format!("features: {}", features(&kernel.uses)));
    table.row("", &format!("unused: {}", features(&kernel.leaves_out)));
}

/// Lists at most `MAX_LISTED` names. If `indexed`, options of the command line accept indices, which are listed too.
fn list<'a>(names: impl ExactSizeIterator<Item = Option<&'a str>>, indexed: bool) -> String {
    let more = names.len().saturating_sub(MAX_LISTED);
    let item = |(i, name): (usize, Option<&str>)| match (name, indexed) {
        (Some(name), true) => format!("{i} {name:?}"),
        (Some(name), false) => name.to_owned(),
        (None, _) => format!("{i} (unnamed)"),
    };
    let mut listed: Vec<String> = names.enumerate().take(MAX_LISTED).map(item).collect();
    if more > 0 {
        listed.push(format!("and {more} more"));
    }
    listed.join(", ")
}

fn kinds(kinds: &Kinds) -> String {
    let by_type: Vec<String> = kinds
        .by_type
        .iter()
        .map(|(name, count)| format!("{count} {name}"))
        .collect();
    match by_type.is_empty() {
        true => "0".to_owned(),
        false => format!("{}: {}", kinds.count, by_type.join(", ")),
    }
}

fn textures(textures: &[TextureInfo]) -> String {
    let mut by_kind: BTreeMap<String, u64> = BTreeMap::new();
    for texture in textures {
        let name = match (texture.size, texture.texels) {
            (Some([width, height]), Some(texels)) => format!("image {width} x {height} ({texels})"),
            _ => texture.kind.to_owned(),
        };
        *by_kind.entry(name).or_default() += 1;
    }
    if by_kind.is_empty() {
        return "0".to_owned();
    }
    let listed: Vec<String> = by_kind
        .iter()
        .take(MAX_LISTED)
        .map(|(name, count)| format!("{count} {name}"))
        .collect();
    let more = match by_kind.len().saturating_sub(MAX_LISTED) {
        0 => String::new(),
        more => format!(" and {more} more kinds"),
    };
    format!("{}: {}{more}", textures.len(), listed.join(", "))
}

fn count(n: u64, noun: &str) -> String {
    format!("{n} {noun}{}", if n == 1 { "" } else { "s" })
}

fn point(point: &[f64; 3]) -> String {
    let numbers = point.map(|x| rounded(x).to_string());
    format!("[{}]", numbers.join(", "))
}

/// Rounds to six significant digits.
fn rounded(x: f64) -> f64 {
    format!("{x:.5e}").parse().unwrap_or(x)
}

fn mebibytes(bytes: u64) -> String {
    match bytes {
        0 => "0".to_owned(),
        bytes if bytes < 1 << 20 => format!("{:.1} KiB", bytes as f64 / 1024.0),
        bytes => format!("{:.1} MiB", bytes as f64 / f64::from(1 << 20)),
    }
}
