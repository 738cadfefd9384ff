//! `wgray devices`: what there is to render on.

use std::io::{self, Write};
use std::process::ExitCode;

use wgray::gpu::{self, FloatControls, Info};

pub fn run() -> ExitCode {
    super::ended(list(&gpu::adapters()), ExitCode::SUCCESS)
}

fn list(adapters: &[Info]) -> io::Result<()> {
    let mut out = io::stdout().lock();
    for (number, info) in (1..).zip(adapters) {
        let Info {
            name,
            driver,
            backend,
            kind,
            exact,
            float_controls,
            largest_binding,
            storage_buffers,
            largest_buffer,
        } = info;
        writeln!(out, "{number}: {name}")?;
        writeln!(out, "    type            {kind}, by {backend}")?;
        writeln!(out, "    driver          {driver}")?;
        writeln!(
            out,
            "    arithmetic      {}",
            if *exact {
                "exactly as written"
            } else {
                "as the driver likes it"
            }
        )?;
        if *exact {
            writeln!(out, "    float controls  {}", names(*float_controls))?;
        }
        writeln!(out, "    largest binding {}", mebibytes(*largest_binding))?;
        writeln!(out, "    buffers         {storage_buffers} in a shader")?;
        writeln!(out, "    largest buffer  {}", mebibytes(*largest_buffer))?;
    }
    writeln!(out, "cpu")?;
    writeln!(out, "    type            this program's own, without a driver")?;
    writeln!(out, "    threads         {}", rayon::current_num_threads())?;
    let chosen = adapters.first().map_or("cpu", |info| &info.name);
    writeln!(out, "auto chooses: {chosen}")?;
    if adapters.is_empty() {
        writeln!(out, "{}", gpu::HOW_TO_GET_VULKAN)?;
    }
    Ok(())
}

/// What a device's arithmetic is asked to keep to, in words.
fn names(controls: FloatControls) -> String {
    let FloatControls {
        rounding,
        signed_zeros,
        denormals,
    } = controls;
    let all = [
        (rounding, "rounding to nearest"),
        (signed_zeros, "signed zeros"),
        (denormals, "denormals"),
    ];
    let names: Vec<&str> = all.iter().filter(|(has, _)| *has).map(|(_, name)| *name).collect();
    if names.is_empty() {
        "none".to_owned()
    } else {
        names.join(", ")
    }
}

fn mebibytes(bytes: u64) -> String {
    format!("{:.0} MiB", bytes as f64 / f64::from(1 << 20))
}
