//! What `wgray info` tells, as a table.

use std::collections::BTreeMap;
use std::fmt::Write as _;

use super::gather::{Info, Kinds, Textured};

/// So many images and notes are listed by themselves.
const MOST: usize = 20;

/// A line for each thing, and one below it for what is more of it.
pub fn table(info: &Info) -> String {
    let mut out = format!("{}\n", info.scene);
    let mut row = |name: &str, text: &str| {
        // Writing to a String cannot fail.
        let _ = writeln!(out, "    {name:<12}{text}");
    };
    let picture = &info.picture;
    let most = match picture.most_samples {
        most if most != picture.pixel_samples => format!(", up to {most}"),
        _ => String::new(),
    };
    let samples = format!(
        "{} samples each ({}){most}, {} of light",
        picture.pixel_samples, picture.pixel_pattern, picture.light_samples
    );
    row(
        "picture",
        &format!("{} x {} pixels, {samples}", picture.width, picture.height),
    );
    row(
        "light",
        &format!(
            "{}, up to {} bounces, seed {}",
            picture.integrator, picture.max_depth, picture.seed
        ),
    );
    row("camera", &camera(info));
    row(
        "bounds",
        &match &info.bounds {
            Some([low, high]) => format!("{} to {}", point(low), point(high)),
            None => "none: there is nothing but planes, or nothing at all".to_owned(),
        },
    );
    row("shapes", &kinds(&info.shapes.kinds));
    let shapes = &info.shapes;
    if shapes.meshes > 0 {
        let (meshes, triangles) = (shapes.meshes, shapes.mesh_triangles);
        row(
            "meshes",
            &format!(
                "{meshes} different, of {triangles} triangles; {} with all their copies",
                shapes.placed_mesh_triangles
            ),
        );
    }
    let lit = info.lights.kinds.by_type.get("rectangle");
    let more = [
        lit.map(|count| format!("rectangles of lights among them, {count}")),
        (shapes.meshes > 0).then(|| "meshes not".to_owned()),
    ];
    let more: Vec<String> = more.into_iter().flatten().collect();
    row(
        "primitives",
        &match more.is_empty() {
            true => shapes.primitives.to_string(),
            false => format!("{}: {}", shapes.primitives, more.join("; ")),
        },
    );
    row("materials", &kinds(&info.materials));
    row("textures", &textures(&info.textures));
    let lights = &info.lights;
    let around = lights
        .environment
        .as_ref()
        .map(|text| format!("; around the scene: {text}"));
    let sampled = match lights.emitters {
        0 => String::new(),
        count => format!("; light is sampled of {count}"),
    };
    row(
        "lights",
        &format!("{}{sampled}{}", kinds(&lights.kinds), around.unwrap_or_default()),
    );
    let memory = &info.memory;
    let [scene, trees, texels, film] = [memory.scene, memory.trees, memory.texels, memory.film].map(mebibytes);
    row(
        "memory",
        &format!("{scene} for the scene: {trees} of trees, {texels} of texels"),
    );
    let bands = match memory.bands {
        0 | 1 => String::new(),
        count => format!(" at a time, for {count} parts of the picture"),
    };
    row("", &format!("{film} for the film{bands}"));
    if let Some(bytes) = memory.scene_on_device {
        row("", &format!("{} for the scene on the device", mebibytes(bytes)));
    }
    let kernel = &info.kernel;
    let list = |names: &[&str]| match names {
        [] => "nothing of these".to_owned(),
        names => names.join(", "),
    };
    row(
        "kernel",
        &match (kernel.entry, kernel.lines, kernel.baked) {
            (Some(entry), Some(lines), Some(baked)) => {
                let form = if baked {
                    "the scene as constants"
                } else {
                    "the scene in buffers"
                };
                format!("{entry}, {lines} lines of WGSL, with {form}")
            }
            _ => "none is compiled: the CPU has all".to_owned(),
        },
    );
    row("", &format!("uses {}", list(&kernel.uses)));
    row("", &format!("leaves out {}", list(&kernel.leaves_out)));
    let device = &info.device;
    row("device", &format!("{}: {}", device.name, device.why));
    row("", &device.driver);
    for note in info.notes.iter().take(MOST) {
        row("note", note);
    }
    if info.notes.len() > MOST {
        row("", &format!("and {} more", info.notes.len() - MOST));
    }
    out
}

fn camera(info: &Info) -> String {
    let camera = &info.camera;
    let (position, look_at) = (point(&camera.position), point(&camera.look_at));
    let mut text = format!("{}, at {position}, looks at {look_at}", camera.kind);
    if let Some(fov) = camera.fov {
        let _ = write!(text, ", {} degrees high", short(fov));
    }
    if let Some(height) = camera.height {
        let _ = write!(text, ", {} high", short(height));
    }
    if let (Some(aperture), Some(focus)) = (camera.aperture, camera.focus_distance) {
        let _ = write!(text, "; a lens {} wide, sharp at {}", short(aperture), short(focus));
    }
    if let Some([first, last]) = camera.frames {
        let _ = write!(text, "; it moves from frame {first} to {last}");
    }
    text
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

fn textures(textures: &[Textured]) -> String {
    let mut by_kind: BTreeMap<String, u64> = BTreeMap::new();
    for texture in textures {
        let name = match (texture.size, texture.texels) {
            (Some([width, height]), Some(texels)) => format!("image of {width} x {height} ({texels})"),
            _ => texture.kind.to_owned(),
        };
        *by_kind.entry(name).or_default() += 1;
    }
    if by_kind.is_empty() {
        return "0".to_owned();
    }
    let listed: Vec<String> = by_kind
        .iter()
        .take(MOST)
        .map(|(name, count)| format!("{count} {name}"))
        .collect();
    let more = match by_kind.len().saturating_sub(MOST) {
        0 => String::new(),
        more => format!(" and {more} more kinds"),
    };
    format!("{}: {}{more}", textures.len(), listed.join(", "))
}

fn point(point: &[f64; 3]) -> String {
    let numbers = point.map(|x| short(x).to_string());
    format!("[{}]", numbers.join(", "))
}

/// With six digits.
fn short(x: f64) -> f64 {
    format!("{x:.5e}").parse().unwrap_or(x)
}

fn mebibytes(bytes: u64) -> String {
    match bytes {
        0 => "nothing".to_owned(),
        bytes if bytes < 1 << 20 => format!("{:.1} KiB", bytes as f64 / 1024.0),
        bytes => format!("{:.1} MiB", bytes as f64 / f64::from(1 << 20)),
    }
}
