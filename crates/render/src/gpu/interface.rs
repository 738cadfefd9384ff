//! Checks of a kernel's interface: entry point, workgroup size, bindings, layouts and overrides. The built-in kernel is
//! the reference. Devices accept mismatches, but render wrong images.

use naga::{
    AddressSpace, ArraySize, GlobalVariable, Handle, Module, ShaderStage, Span, StorageAccess, Type, TypeInner,
};

use super::compile::{ValidKernel, check};
use super::compose::{Kernel, Shaders, Source};
use super::functions::functions;
use super::naga_messages::type_name;
use crate::error::ShaderError;
use wgray_scene::Integrator;

/// Returns the interface errors of a kernel that naga accepts. `is_complete` is false if function bodies were removed;
/// outputs are then not checked.
pub fn errors(
    kernel: &Kernel,
    integrator: Integrator,
    source: &Source,
    checked: &ValidKernel,
    is_complete: bool,
) -> Result<Vec<ShaderError>, ShaderError> {
    let built_in = Shaders::built_in().compose(kernel, integrator, None);
    let reference = check(&built_in)?;
    let comparison = Comparison {
        kernel,
        source,
        module: checked.module(),
        built_in: &built_in,
        reference: reference.module(),
        errors: Vec::new(),
    };
    Ok(comparison.run(checked, &reference, is_complete))
}

/// Comparison of a kernel with the built-in kernel.
struct Comparison<'a> {
    kernel: &'a Kernel,
    source: &'a Source,
    module: &'a Module,
    built_in: &'a Source,
    /// The built-in kernel's module.
    reference: &'a Module,
    errors: Vec<ShaderError>,
}

impl Comparison<'_> {
    fn run(mut self, checked: &ValidKernel, reference: &ValidKernel, is_complete: bool) -> Vec<ShaderError> {
        self.entry_point();
        self.bindings();
        self.constants();
        if is_complete && self.errors.is_empty() {
            self.results(checked, reference);
        }
        self.errors
    }

    /// Checks that the kernel writes all buffers that are read back.
    fn results(&mut self, checked: &ValidKernel, reference: &ValidKernel) {
        let entry = self.kernel.entry_point;
        let variable_at = |module: &Module, binding| {
            let mut variables = module.global_variables.iter();
            variables
                .find(|(_, variable)| variable.binding == binding)
                .map(|(handle, _)| handle)
        };
        for (handle, expected) in self.reference.global_variables.iter() {
            let variable = expected
                .binding
                .and_then(|binding| variable_at(self.module, Some(binding)));
            if let Some(variable) = variable
                && reference.writes(entry, handle)
                && !checked.writes(entry, variable)
            {
                let span = self.function_span(entry);
                let name = name_of(expected);
                let hint = match name {
                    "completion" => ": every pixel must end with `report_completion(local)`",
                    _ => "",
                };
                self.report(
                    span,
                    format!("`{entry}` never writes `{name}`, which the program reads{hint}"),
                );
            }
        }
    }

    fn function_span(&self, name: &str) -> Option<Span> {
        let texts = functions(&self.source.text);
        let text = texts.iter().find(|text| text.name == name)?;
        let head = self.source.text[text.start..text.body.start].trim_end();
        Some(Span::from(text.start..text.start + head.len()))
    }

    fn report(&mut self, span: Option<Span>, message: String) {
        let error = ShaderError::at(self.source, span, message);
        self.errors.push(error);
    }

    /// Returns the location of the first character of the file that contains a span of the built-in kernel.
    fn file_with(&self, span: Span) -> Option<Span> {
        let (file, ..) = self.built_in.locate(span.to_range()?.start)?;
        self.source.start_of(file).map(|start| Span::from(start..start + 1))
    }

    fn entry_point(&mut self) {
        let name = self.kernel.entry_point;
        let is_entry = |entry: &&naga::EntryPoint| entry.name == name && entry.stage == ShaderStage::Compute;
        let Some(expected) = self.reference.entry_points.iter().find(is_entry) else {
            return;
        };
        let size = expected.workgroup_size;
        let attributes = format!("@compute @workgroup_size({}, {})", size[0], size[1]);
        let span_of = |name: &str| self.function_span(name);
        let (span, message) = match self.module.entry_points.iter().find(is_entry) {
            Some(entry) if entry.workgroup_size == size && entry.workgroup_size_overrides.is_none() => return,
            Some(entry) => {
                let [x, y, z] = entry.workgroup_size;
                let span = span_of(name).and_then(|span| {
                    let start = self.source.text[..span.to_range()?.start].rfind("@workgroup_size")?;
                    let length = self.source.text[start..].find(')')? + 1;
                    Some(Span::from(start..start + length))
                });
                let found = match entry.workgroup_size_overrides {
                    Some(_) => "set by an override".to_string(),
                    None if z != 1 => format!("({x}, {y}, {z})"),
                    None => format!("({x}, {y})"),
                };
                let message = format!(
                    "the workgroup size of `{name}` is {found}; it must be ({}, {}), because the program \
                     dispatches workgroups of this size",
                    size[0], size[1]
                );
                (span.or_else(|| span_of(name)), message)
            }
            None => {
                let found = self.module.entry_points.first().map(|entry| entry.name.as_str());
                let message = match (span_of(name), found) {
                    (Some(_), _) => format!("`{name}` must be the entry point: {attributes}"),
                    (None, Some(found)) => format!("the entry point must be called `{name}`, not `{found}`"),
                    (None, None) => format!("there is no entry point: {attributes} fn {name}"),
                };
                let file = self.source.start_of(self.kernel.file());
                let file = file.map(|start| Span::from(start..start + 1));
                (span_of(name).or_else(|| span_of(found?)).or(file), message)
            }
        };
        self.report(span, message);
    }

    fn bindings(&mut self) {
        let (module, reference) = (self.module, self.reference);
        for (handle, variable) in module.global_variables.iter() {
            let Some(binding) = variable.binding else { continue };
            let name = variable.name.as_deref().unwrap_or_default();
            let expected = || reference.global_variables.iter().map(|(_, expected)| expected);
            let message = match expected().find(|expected| expected.binding == Some(binding)) {
                Some(expected) => self.difference(variable, expected),
                None => Some(match expected().find(|expected| expected.name == variable.name) {
                    Some(expected) => format!("`{name}` must be at {}", binding_of(expected)),
                    None => format!("`{name}`: the program binds nothing at {}", binding_of(variable)),
                }),
            };
            if let Some(message) = message {
                self.report(Some(module.global_variables.get_span(handle)), message);
            }
        }
        // If a buffer that the program reads back were missing, the image would be black.
        for (handle, expected) in reference.global_variables.iter() {
            let stores = AddressSpace::Storage {
                access: StorageAccess::LOAD | StorageAccess::STORE,
            };
            let is_bound = |variable: &GlobalVariable| {
                let has_binding = variable.binding.is_some(); // a private variable may have the same name
                variable.binding == expected.binding || (has_binding && variable.name == expected.name)
            };
            if expected.space == stores && !module.global_variables.iter().any(|(_, variable)| is_bound(variable)) {
                let file = self.file_with(reference.global_variables.get_span(handle));
                let ty = type_name(reference, expected.ty);
                let space = space_name(expected.space);
                let message = format!(
                    "{} {space} {}: {ty} is missing",
                    binding_of(expected),
                    name_of(expected)
                );
                self.report(file, message);
            }
        }
    }

    fn difference(&self, variable: &GlobalVariable, expected: &GlobalVariable) -> Option<String> {
        let name = variable.name.as_deref().unwrap_or_default();
        if variable.space != expected.space {
            let (found, required) = (space_name(variable.space), space_name(expected.space));
            return Some(format!(
                "`{name}` is {found}; {} must be {required}",
                binding_of(expected)
            ));
        }
        let layouts = Layouts {
            module: self.module,
            reference: self.reference,
        };
        let difference = layouts.difference(variable.ty, expected.ty, name)?;
        Some(format!(
            "`{name}` does not have the layout of the buffer that the program binds at {}: {difference}",
            binding_of(expected)
        ))
    }

    fn constants(&mut self) {
        let (module, reference) = (self.module, self.reference);
        for (handle, expected) in reference.overrides.iter() {
            let name = expected.name.as_deref().unwrap_or_default();
            let ty = type_name(reference, expected.ty);
            let Some((found_handle, found)) = module.overrides.iter().find(|(_, found)| found.name == expected.name)
            else {
                let file = self.file_with(reference.overrides.get_span(handle));
                self.report(
                    file,
                    format!("`override {name}: {ty};` is missing; the program sets this override"),
                );
                continue;
            };
            if found.id.is_some() || type_name(module, found.ty) != ty {
                let message =
                    format!("`{name}` must be `override {name}: {ty};`, because the program sets this override");
                self.report(Some(module.overrides.get_span(found_handle)), message);
            }
        }
        for (handle, found) in module.overrides.iter() {
            let is_set = reference
                .overrides
                .iter()
                .any(|(_, expected)| expected.name == found.name);
            if !is_set && found.init.is_none() {
                let name = found.name.as_deref().unwrap_or_default();
                let message = format!(
                    "`{name}` has no value, and the program does not set this override; add a value, such as `= 0`"
                );
                self.report(Some(module.overrides.get_span(handle)), message);
            }
        }
    }
}

/// Returns the attributes of a variable's binding.
fn binding_of(variable: &GlobalVariable) -> String {
    let resource = variable.binding.map(|resource| (resource.group, resource.binding));
    let (group, binding) = resource.unwrap_or_default();
    format!("@group({group}) @binding({binding})")
}

fn name_of(variable: &GlobalVariable) -> &str {
    variable.name.as_deref().unwrap_or_default()
}

fn space_name(space: AddressSpace) -> &'static str {
    match space {
        AddressSpace::Uniform => "`var<uniform>`",
        AddressSpace::Storage { access } if access.contains(StorageAccess::STORE) => "`var<storage, read_write>`",
        AddressSpace::Storage { .. } => "`var<storage, read>`",
        _ => "no buffer",
    }
}

struct Layouts<'a> {
    module: &'a Module,
    reference: &'a Module,
}

impl Layouts<'_> {
    /// Returns the first difference of two memory layouts. Member names may differ, but a name of the reference must
    /// not appear at a different offset.
    fn difference(&self, found: Handle<Type>, expected: Handle<Type>, path: &str) -> Option<String> {
        match (&self.module.types[found].inner, &self.reference.types[expected].inner) {
            (
                TypeInner::Struct { members, span },
                TypeInner::Struct {
                    members: expected_members,
                    span: expected_span,
                },
            ) => {
                for (i, expected) in expected_members.iter().enumerate() {
                    let Some(member) = members.get(i) else {
                        let name = expected.name.as_deref().unwrap_or_default();
                        let ty = type_name(self.reference, expected.ty);
                        return Some(format!("`{path}.{name}: {ty}` is missing"));
                    };
                    let name = member.name.as_deref().unwrap_or_default();
                    let same_name = expected_members.iter().find(|expected| expected.name == member.name);
                    let same_name = same_name.unwrap_or(expected);
                    if member.offset != same_name.offset {
                        return Some(format!(
                            "`{path}.{name}` is at byte {} and must be at byte {}",
                            member.offset, same_name.offset
                        ));
                    }
                    let difference = self.difference(member.ty, expected.ty, &format!("{path}.{name}"));
                    if difference.is_some() {
                        return difference;
                    }
                }
                if let Some(member) = members.get(expected_members.len()) {
                    let name = member.name.as_deref().unwrap_or_default();
                    return Some(format!(
                        "`{path}.{name}` does not exist in the buffer that the program binds"
                    ));
                }
                (span != expected_span).then(|| format!("`{path}` has {span} bytes and must have {expected_span}"))
            }
            (
                TypeInner::Array { base, size, stride },
                TypeInner::Array {
                    base: expected_base,
                    size: expected_size,
                    stride: expected_stride,
                },
            ) if same_size(size, expected_size) => {
                let difference = self.difference(*base, *expected_base, &format!("{path}[]"));
                difference.or_else(|| {
                    let rule = format!("the elements of `{path}` have {stride} bytes and must have {expected_stride}");
                    (stride != expected_stride).then_some(rule)
                })
            }
            (
                found @ (TypeInner::Scalar(_)
                | TypeInner::Vector { .. }
                | TypeInner::Matrix { .. }
                | TypeInner::Atomic(_)),
                expected,
            ) if found == expected => None,
            _ => {
                let (found, expected) = (type_name(self.module, found), type_name(self.reference, expected));
                Some(format!("`{path}` is `{found}` and must be `{expected}`"))
            }
        }
    }
}

fn same_size(a: &ArraySize, b: &ArraySize) -> bool {
    match (a, b) {
        (ArraySize::Constant(a), ArraySize::Constant(b)) => a == b,
        (ArraySize::Dynamic, ArraySize::Dynamic) => true,
        _ => false,
    }
}
