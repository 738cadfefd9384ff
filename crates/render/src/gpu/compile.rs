//! Kernel compilation with naga: parsing, validation, specialization and SPIR-V.

use std::borrow::Cow;

use naga::back::{pipeline_constants::process_overrides, spv};
use naga::valid::{Capabilities, GlobalUse, ModuleInfo, ValidationError, ValidationFlags, Validator};
use naga::{GlobalVariable, Handle, Module, Span, WithSpan};

use super::compose::{Kernel, ROUNDING, Source};
use super::float_controls::FloatControls;
use super::naga_messages;
use super::nesting_limit::too_deep;
use super::prune::prune;
use super::rounding::{Rounding, round_in_software};
use super::spirv;
use crate::error::ShaderError;
use wgray_trace::records::Specialization;

/// A kernel accepted by naga.
pub struct ValidKernel {
    module: Module,
    info: ModuleInfo,
}

/// Parses and validates a kernel.
pub fn check(source: &Source) -> Result<ValidKernel, ShaderError> {
    check_with_offset(source).map_err(|(error, _)| error)
}

/// Like [`check`]. Errors include the byte offset in the kernel's text, if known.
pub fn check_with_offset(source: &Source) -> Result<ValidKernel, (ShaderError, Option<usize>)> {
    let start = |span: Option<Span>| span.and_then(Span::to_range).map(|range| range.start);
    if let Some((range, rule)) = too_deep(&source.text) {
        let span = Some(Span::from(range));
        return Err((ShaderError::at(source, span, rule), start(span)));
    }
    let module = naga::front::wgsl::parse_str(&source.text).map_err(|error| {
        let (span, message) = naga_messages::parse_message(&error, source);
        (ShaderError::at(source, span, message), start(span))
    })?;
    let info = validate(&module).map_err(|error| {
        let span = naga_messages::location(&source.text, &error);
        let message = naga_messages::message(&module, &source.text, error.as_inner());
        (ShaderError::at(source, span, message), start(span))
    })?;
    Ok(ValidKernel { module, info })
}

fn validate(module: &Module) -> Result<ModuleInfo, Box<WithSpan<ValidationError>>> {
    Validator::new(ValidationFlags::all(), Capabilities::empty())
        .validate(module)
        .map_err(Box::new)
}

impl ValidKernel {
    pub(super) fn module(&self) -> &Module {
        &self.module
    }

    /// Returns true if an entry point writes a variable, even in called functions.
    pub(super) fn writes(&self, entry: &str, variable: Handle<GlobalVariable>) -> bool {
        let position = self
            .module
            .entry_points
            .iter()
            .position(|entry_point| entry_point.name == entry);
        let usage = position.map(|i| self.info.get_entry_point(i)[variable]);
        usage.is_some_and(|usage| usage.intersects(GlobalUse::WRITE | GlobalUse::ATOMIC))
    }

    /// Returns the SPIR-V of a specialized kernel, executed exactly as written.
    pub fn exact_spirv(
        &self,
        kernel: &Kernel,
        constants: &Specialization,
        rounding: Rounding,
        controls: FloatControls,
    ) -> Result<Vec<u32>, ShaderError> {
        self.exact_entry(kernel.entry_point, &constants.constants(), rounding, controls)
    }

    /// Returns the SPIR-V of any compute entry point with these overrides. The arithmetic is executed exactly as
    /// written.
    pub fn exact_entry(
        &self,
        entry: &str,
        constants: &[(&str, u32)],
        rounding: Rounding,
        controls: FloatControls,
    ) -> Result<Vec<u32>, ShaderError> {
        let rounded = match rounding {
            Rounding::Device => None,
            Rounding::Software => Some(self.rounded_in_software()?),
        };
        let ValidKernel { module, info } = rounded.as_ref().unwrap_or(self);
        let constants = constants
            .iter()
            .map(|(name, value)| (name.to_string(), f64::from(*value)));
        let entry_point = Some((naga::ShaderStage::Compute, entry));
        let (specialized, _): (Cow<'_, _>, Cow<'_, _>) =
            process_overrides(module, info, entry_point, &constants.collect())
                .map_err(|error| ShaderError::at_stage("specialization", &error))?;
        let mut module = specialized.into_owned();
        prune(&mut module);
        let info = validate(&module).map_err(|error| ShaderError::at_stage("specialization", &error))?;
        // naga need not bound loops, because every loop of the kernels ends.
        let options = spv::Options {
            lang_version: (1, 3),
            force_loop_bounding: false,
            bounds_check_policies: naga::proc::BoundsCheckPolicies {
                index: naga::proc::BoundsCheckPolicy::Restrict,
                buffer: naga::proc::BoundsCheckPolicy::Restrict,
                image_load: naga::proc::BoundsCheckPolicy::Restrict,
                binding_array: naga::proc::BoundsCheckPolicy::Restrict,
            },
            flags: spv::WriterFlags::empty(),
            ..spv::Options::default()
        };
        let pipeline = spv::PipelineOptions {
            shader_stage: naga::ShaderStage::Compute,
            entry_point: entry.to_string(),
        };
        let words = spv::write_vec(&module, &info, &options, Some(&pipeline))
            .map_err(|error| ShaderError::at_stage("SPIR-V", &error))?;
        Ok(spirv::request_controls(controls, &spirv::forbid_contraction(&words)))
    }

    /// Replaces quotients and square roots by functions of `shaders/rounding.wgsl`.
    fn rounded_in_software(&self) -> Result<ValidKernel, ShaderError> {
        let mut module = self.module.clone();
        round_in_software(&mut module, &self.info).map_err(|error| ShaderError::at_stage(ROUNDING, &error))?;
        let info = validate(&module).map_err(|error| ShaderError::at_stage("rounding", &error))?;
        Ok(ValidKernel { module, info })
    }
}
