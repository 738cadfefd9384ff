//! `wgray devices`: lists the devices that can render.

use std::io::{self, Write};
use std::process::ExitCode;

#[cfg(feature = "gpu")]
use wgray_render::gpu::{self, FloatControls, GpuInfo};

pub fn run() -> ExitCode {
    super::finish_output(list(&mut io::stdout().lock()), ExitCode::SUCCESS)
}

#[cfg(feature = "gpu")]
fn list(out: &mut impl Write) -> io::Result<()> {
    let adapters = gpu::adapters();
    list_adapters(out, &adapters)?;
    list_cpu(out)?;
    match adapters.first() {
        Some(info) if gpu::is_lavapipe(&info.name) => {
            writeln!(out, "auto selects: {}, or cpu if predicted to be faster", info.name)?;
        }
        Some(info) if !info.is_software() => writeln!(out, "auto selects: {}", info.name)?,
        _ => writeln!(out, "auto selects: cpu")?,
    }
    if adapters.is_empty() {
        writeln!(out, "{}", wgray_render::error::HOW_TO_GET_VULKAN)?;
    }
    Ok(())
}

#[cfg(not(feature = "gpu"))]
fn list(out: &mut impl Write) -> io::Result<()> {
    list_cpu(out)?;
    writeln!(out, "auto selects: cpu")?;
    writeln!(
        out,
        "this program was built without the feature \"gpu\" and cannot use GPUs"
    )
}

#[cfg(feature = "gpu")]
fn list_adapters(out: &mut impl Write, adapters: &[GpuInfo]) -> io::Result<()> {
    for (number, info) in (1..).zip(adapters) {
        let GpuInfo {
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
        writeln!(out, "    type            {kind} ({backend})")?;
        writeln!(out, "    driver          {driver}")?;
        writeln!(
            out,
            "    arithmetic      {}",
            if *exact {
                "exact (IEEE 754)"
            } else {
                "driver-dependent (--exact-rounding makes it exact)"
            }
        )?;
        if *exact {
            writeln!(out, "    float controls  {}", names(*float_controls))?;
        }
        writeln!(out, "    largest binding {}", mebibytes(*largest_binding))?;
        writeln!(out, "    buffers         {storage_buffers} per shader")?;
        writeln!(out, "    largest buffer  {}", mebibytes(*largest_buffer))?;
    }
    Ok(())
}

#[cfg(feature = "gpu")]
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
    let names: Vec<&str> = all
        .iter()
        .filter(|(is_set, _)| *is_set)
        .map(|(_, name)| *name)
        .collect();
    if names.is_empty() {
        "none".to_owned()
    } else {
        names.join(", ")
    }
}

fn list_cpu(out: &mut impl Write) -> io::Result<()> {
    writeln!(out, "cpu")?;
    writeln!(out, "    type            built in, needs no driver")?;
    writeln!(out, "    threads         {}", rayon::current_num_threads())
}

#[cfg(feature = "gpu")]
fn mebibytes(bytes: u64) -> String {
    format!("{:.0} MiB", bytes as f64 / f64::from(1 << 20))
}
