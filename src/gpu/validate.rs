//! All kernels of a scene, checked without a device, and all that is wrong with them at once.

use rayon::prelude::*;

use super::bake::{MOST_PRIMITIVES, bake};
use super::compile::{Checked, check_at};
use super::compose::{Kernel, Shaders, Source};
use super::functions::functions;
use super::interface;
use super::rounding::Rounding;
use crate::error::{ShaderError, ShaderErrors};
use crate::pack::Packed;

/// So many mistakes of a kernel are looked for.
const MOST: usize = 16;

/// How the kernels that are checked know the scene.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Forms {
    /// In buffers.
    Buffers,
    /// In buffers and, if it is small enough, as constants.
    All,
}

/// Compiles every kernel for a scene, to SPIR-V, as far as that goes without a driver, and compares its interface with
/// what the program binds.
///
/// # Errors
///
/// All that is wrong, each mistake once however many kernels have it. Of a function the first one is found.
pub fn check_kernels(packed: &Packed, shaders: &Shaders, forms: Forms) -> Result<(), ShaderErrors> {
    let small = forms == Forms::All && packed.primitives.len() <= MOST_PRIMITIVES;
    let baked = small.then(|| bake(packed));
    let mut scenes = vec![None];
    scenes.extend(baked.as_deref().map(Some));
    let all: Vec<(Kernel, Option<&str>)> = scenes
        .into_iter()
        .flat_map(|scene| Kernel::ALL.map(|kernel| (kernel, scene)))
        .collect();
    let found: Vec<Vec<ShaderError>> = all
        .into_par_iter()
        .map(|(kernel, scene)| mistakes(kernel, shaders.compose(kernel, scene), packed))
        .collect();
    let mut errors: Vec<ShaderError> = Vec::new();
    for error in found.into_iter().flatten() {
        if !errors.contains(&error) {
            errors.push(error);
        }
    }
    if errors.is_empty() { Ok(()) } else { Err(ShaderErrors(errors)) }
}

fn mistakes(kernel: Kernel, source: Source, packed: &Packed) -> Vec<ShaderError> {
    let (mut errors, rest) = mistakes_of_functions(source);
    let Some((source, checked)) = rest else { return errors };
    match interface::mistakes(kernel, &source, checked.module()) {
        Ok(more) => errors.extend(more),
        Err(error) => errors.push(error),
    }
    if errors.is_empty() {
        let compiled = checked.exact_spirv(kernel, &packed.specialization, Rounding::Device);
        errors.extend(compiled.err());
    }
    errors
}

/// naga stops at the first mistake. A function that has one gets an empty body, and the search goes on: to whoever calls
/// it it is the same. What is left at the end is a kernel that naga accepts, unless a mistake is in no function's body.
fn mistakes_of_functions(mut source: Source) -> (Vec<ShaderError>, Option<(Source, Checked)>) {
    let mut errors: Vec<ShaderError> = Vec::new();
    loop {
        let (mut error, at) = match check_at(&source) {
            Ok(checked) => return (errors, Some((source, checked))),
            Err(error) => error,
        };
        let texts = functions(&source.text);
        let emptied = |i: usize| {
            let function = &texts[i];
            let body = match function.result {
                "" => "{}".to_string(),
                ty => format!("{{ var nothing: {ty}; return nothing; }}"),
            };
            source.replaced(function.body.clone(), &body)
        };
        let culprit = match at {
            Some(at) => texts.iter().position(|text| (text.start..text.body.end).contains(&at)),
            // naga does not say where: it is where the mistake goes with the body.
            None => (0..texts.len()).find(|i| check_at(&emptied(*i)).err().map(|(error, _)| error).as_ref() != Some(&error)),
        };
        if let (None, Some(i)) = (at, culprit) {
            let function = &texts[i];
            let message = format!("in `{}`: {}", function.name, error.message);
            let head = function.start..function.start + "fn ".len() + function.name.len();
            error = ShaderError::at(&source, Some(naga::Span::from(head)), message);
        }
        let again = errors.iter().any(|known| known.place == error.place);
        if !again {
            errors.push(error);
        }
        let Some(i) = culprit.filter(|_| !again && errors.len() < MOST) else {
            return (errors, None);
        };
        source = emptied(i);
    }
}
