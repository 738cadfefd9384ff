//! Checks of a kernel's interface: entry point, workgroup size, bindings, layouts and overrides. The built-in kernel is
//! the reference. Devices accept mismatches and render garbage.

use naga::{
    AddressSpace, ArraySize, GlobalVariable, Handle, Module, ShaderStage, Span, StorageAccess, Type, TypeInner,
};

use super::compile::{ValidKernel, check};
use super::compose::{Kernel, Shaders, Source};
use super::functions::functions;
use super::naga_messages::type_name;
use crate::error::ShaderError;
use wgray_scene::Integrator;

/// Returns the interface errors of a kernel that naga accepts. Outputs are checked only if `whole` is true, which
/// requires all function bodies.
pub fn mistakes(
    kernel: &Kernel,
    integrator: Integrator,
    source: &Source,
    checked: &ValidKernel,
    whole: bool,
) -> Result<Vec<ShaderError>, ShaderError> {
    let built_in = Shaders::built_in().compose(kernel, integrator, None);
    let right = check(&built_in)?;
    let sides = Sides {
        kernel,
        source,
        own: checked.module(),
        built_in: &built_in,
        right: right.module(),
        found: Vec::new(),
    };
    Ok(sides.compared(checked, &right, whole))
}

struct Sides<'a> {
    kernel: &'a Kernel,
    source: &'a Source,
    own: &'a Module,
    built_in: &'a Source,
    right: &'a Module,
    found: Vec<ShaderError>,
}

impl Sides<'_> {
    fn compared(mut self, own: &ValidKernel, right: &ValidKernel, whole: bool) -> Vec<ShaderError> {
        self.entry_point();
        self.bindings();
        self.constants();
        if whole && self.found.is_empty() {
            self.results(own, right);
        }
        self.found
    }

    /// Checks that the kernel writes all buffers that are read back.
    fn results(&mut self, own: &ValidKernel, right: &ValidKernel) {
        let entry = self.kernel.entry_point;
        let at = |module: &Module, binding| {
            let mut all = module.global_variables.iter();
            all.find(|(_, variable)| variable.binding == binding)
                .map(|(handle, _)| handle)
        };
        for (handle, known) in self.right.global_variables.iter() {
            let mine = known.binding.and_then(|binding| at(self.own, Some(binding)));
            if let Some(mine) = mine
                && right.writes(entry, handle)
                && !own.writes(entry, mine)
            {
                let span = self.place_of_function(entry);
                let name = name_of(known);
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

    fn place_of_function(&self, name: &str) -> Option<Span> {
        let texts = functions(&self.source.text);
        let text = texts.iter().find(|text| text.name == name)?;
        let head = self.source.text[text.start..text.body.start].trim_end();
        Some(Span::from(text.start..text.start + head.len()))
    }

    fn report(&mut self, span: Option<Span>, message: String) {
        let error = ShaderError::at(self.source, span, message);
        self.found.push(error);
    }

    /// Returns the location of the first character of the file that contains a span of the built-in kernel.
    fn file_with(&self, span: Span) -> Option<Span> {
        let (file, ..) = self.built_in.locate(span.to_range()?.start)?;
        self.source.start_of(file).map(|start| Span::from(start..start + 1))
    }

    fn entry_point(&mut self) {
        let name = self.kernel.entry_point;
        let is_it = |entry: &&naga::EntryPoint| entry.name == name && entry.stage == ShaderStage::Compute;
        let Some(right) = self.right.entry_points.iter().find(is_it) else {
            return;
        };
        let size = right.workgroup_size;
        let attributes = format!("@compute @workgroup_size({}, {})", size[0], size[1]);
        let place = |name: &str| self.place_of_function(name);
        let (span, message) = match self.own.entry_points.iter().find(is_it) {
            Some(own) if own.workgroup_size == size && own.workgroup_size_overrides.is_none() => return,
            Some(own) => {
                let [x, y, z] = own.workgroup_size;
                let span = place(name).and_then(|span| {
                    let start = self.source.text[..span.to_range()?.start].rfind("@workgroup_size")?;
                    let length = self.source.text[start..].find(')')? + 1;
                    Some(Span::from(start..start + length))
                });
                let is = match own.workgroup_size_overrides {
                    Some(_) => "set by an override".to_string(),
                    None if z != 1 => format!("({x}, {y}, {z})"),
                    None => format!("({x}, {y})"),
                };
                let message = format!(
                    "the workgroup size of `{name}` is {is}; it must be ({}, {}), because the program counts workgroups by it",
                    size[0], size[1]
                );
                (span.or_else(|| place(name)), message)
            }
            None => {
                let other = self.own.entry_points.first().map(|entry| entry.name.as_str());
                let message = match (place(name), other) {
                    (Some(_), _) => format!("`{name}` must be the entry point: {attributes}"),
                    (None, Some(other)) => format!("the entry point must be called `{name}`, not `{other}`"),
                    (None, None) => format!("there is no entry point: {attributes} fn {name}"),
                };
                let file = self.source.start_of(self.kernel.file());
                let file = file.map(|start| Span::from(start..start + 1));
                (place(name).or_else(|| place(other?)).or(file), message)
            }
        };
        self.report(span, message);
    }

    fn bindings(&mut self) {
        let (own, right) = (self.own, self.right);
        for (handle, variable) in own.global_variables.iter() {
            let Some(binding) = variable.binding else { continue };
            let name = variable.name.as_deref().unwrap_or_default();
            let known = || right.global_variables.iter().map(|(_, known)| known);
            let message = match known().find(|known| known.binding == Some(binding)) {
                Some(known) => self.difference(variable, known),
                None => Some(match known().find(|known| known.name == variable.name) {
                    Some(known) => format!("`{name}` must be at {}", place_of(known)),
                    None => format!("`{name}`: the program binds nothing at {}", place_of(variable),),
                }),
            };
            if let Some(message) = message {
                self.report(Some(own.global_variables.get_span(handle)), message);
            }
        }
        // If a buffer that the program reads back were missing, the image would be black.
        for (handle, known) in right.global_variables.iter() {
            let stores = AddressSpace::Storage {
                access: StorageAccess::LOAD | StorageAccess::STORE,
            };
            let is_bound = |variable: &GlobalVariable| {
                let bound = variable.binding.is_some(); // a private variable may have the same name
                variable.binding == known.binding || (bound && variable.name == known.name)
            };
            if known.space == stores && !own.global_variables.iter().any(|(_, variable)| is_bound(variable)) {
                let file = self.file_with(right.global_variables.get_span(handle));
                let ty = type_name(right, known.ty);
                let space = space_name(known.space);
                let message = format!("{} {space} {}: {ty} is missing", place_of(known), name_of(known));
                self.report(file, message);
            }
        }
    }

    fn difference(&self, variable: &GlobalVariable, known: &GlobalVariable) -> Option<String> {
        let name = variable.name.as_deref().unwrap_or_default();
        if variable.space != known.space {
            let (is, must) = (space_name(variable.space), space_name(known.space));
            return Some(format!("`{name}` is {is}; {} must be {must}", place_of(known)));
        }
        let layouts = Layouts {
            own: self.own,
            right: self.right,
        };
        let why = layouts.difference(variable.ty, known.ty, name)?;
        Some(format!(
            "`{name}` is not laid out as what the program binds at {}: {why}",
            place_of(known)
        ))
    }

    fn constants(&mut self) {
        let (own, right) = (self.own, self.right);
        for (handle, known) in right.overrides.iter() {
            let name = known.name.as_deref().unwrap_or_default();
            let ty = type_name(right, known.ty);
            let Some((at, found)) = own.overrides.iter().find(|(_, own)| own.name == known.name) else {
                let file = self.file_with(right.overrides.get_span(handle));
                self.report(
                    file,
                    format!("`override {name}: {ty};` is missing; the program sets it"),
                );
                continue;
            };
            if found.id.is_some() || type_name(own, found.ty) != ty {
                let message = format!("`{name}` must be `override {name}: {ty};`, as the program sets it");
                self.report(Some(own.overrides.get_span(at)), message);
            }
        }
        for (handle, found) in own.overrides.iter() {
            let known = right.overrides.iter().any(|(_, known)| known.name == found.name);
            if !known && found.init.is_none() {
                let name = found.name.as_deref().unwrap_or_default();
                let message = format!("`{name}` has no value: the program does not know it; give it one, `= 0`");
                self.report(Some(own.overrides.get_span(handle)), message);
            }
        }
    }
}

fn place_of(variable: &GlobalVariable) -> String {
    let at = variable.binding.map(|at| (at.group, at.binding)).unwrap_or_default();
    format!("@group({}) @binding({})", at.0, at.1)
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
    own: &'a Module,
    right: &'a Module,
}

impl Layouts<'_> {
    /// Returns the first difference of two memory layouts. Member names may differ, but a name of the reference must
    /// not appear at a different offset.
    fn difference(&self, own: Handle<Type>, right: Handle<Type>, path: &str) -> Option<String> {
        match (&self.own.types[own].inner, &self.right.types[right].inner) {
            (
                TypeInner::Struct { members, span },
                TypeInner::Struct {
                    members: known,
                    span: known_span,
                },
            ) => {
                for (i, right) in known.iter().enumerate() {
                    let right_name = right.name.as_deref().unwrap_or_default();
                    let Some(member) = members.get(i) else {
                        let ty = type_name(self.right, right.ty);
                        return Some(format!("`{path}.{right_name}: {ty}` is missing"));
                    };
                    let name = member.name.as_deref().unwrap_or_default();
                    let same_name = known.iter().find(|known| known.name == member.name).unwrap_or(right);
                    if member.offset != same_name.offset {
                        return Some(format!(
                            "`{path}.{name}` is at byte {} and must be at byte {}",
                            member.offset, same_name.offset
                        ));
                    }
                    let inside = self.difference(member.ty, right.ty, &format!("{path}.{name}"));
                    if inside.is_some() {
                        return inside;
                    }
                }
                if let Some(more) = members.get(known.len()) {
                    let name = more.name.as_deref().unwrap_or_default();
                    return Some(format!("`{path}.{name}` does not exist in what the program binds"));
                }
                (span != known_span).then(|| format!("`{path}` has {span} bytes and must have {known_span}"))
            }
            (
                TypeInner::Array { base, size, stride },
                TypeInner::Array {
                    base: known,
                    size: known_size,
                    stride: known_stride,
                },
            ) if same_size(size, known_size) => {
                let inside = self.difference(*base, *known, &format!("{path}[]"));
                inside.or_else(|| {
                    let strides = format!("the elements of `{path}` have {stride} bytes and must have {known_stride}");
                    (stride != known_stride).then_some(strides)
                })
            }
            (
                is
                @ (TypeInner::Scalar(_) | TypeInner::Vector { .. } | TypeInner::Matrix { .. } | TypeInner::Atomic(_)),
                must,
            ) if is == must => None,
            _ => {
                let (is, must) = (type_name(self.own, own), type_name(self.right, right));
                Some(format!("`{path}` is `{is}` and must be `{must}`"))
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
