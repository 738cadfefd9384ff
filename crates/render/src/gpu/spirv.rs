//! SPIR-V transformations that prevent drivers from fusing or reordering float operations, and request float controls.

use super::float_controls::FloatControls;

/// Float arithmetic that naga emits: negate, add, subtract, multiply, divide, vector times scalar, dot.
pub const ARITHMETIC: [u16; 7] = [127, 129, 131, 133, 136, 142, 148];

/// Conversions between floats and integers.
pub const CONVERSIONS: [u16; 4] = [109, 110, 111, 112];

const OP_DECORATE: u32 = 71;
const NO_CONTRACTION: u32 = 42;
const FIRST_TYPE: u16 = 19; // OpTypeVoid
const LAST_TYPE: u16 = 39; // OpTypeForwardPointer
const HEADER: usize = 5;

// Opcodes of a module's first sections, in order (SPIR-V 1.6, section 2.4).
const OP_CAPABILITY: u16 = 17;
const OP_EXTENSION: u16 = 10;
const OP_EXT_INST_IMPORT: u16 = 11;
const OP_MEMORY_MODEL: u16 = 14;
const OP_ENTRY_POINT: u16 = 15;
const OP_EXECUTION_MODE: u16 = 16;

/// Extension of the float controls before SPIR-V 1.4.
const FLOAT_CONTROLS: &[u8] = b"SPV_KHR_float_controls";
/// Width in bits of the float type to which the controls apply.
const WIDTH: u32 = 32;

/// Returns a module's instructions: the opcode, and all words. The first word encodes opcode and length.
pub fn instructions(module: &[u32]) -> impl Iterator<Item = (u16, &[u32])> {
    let mut rest = module.get(HEADER..).unwrap_or(&[]);
    std::iter::from_fn(move || {
        let length = (*rest.first()? >> 16) as usize;
        let (instruction, after) = rest.split_at_checked(length.max(1))?;
        rest = after;
        Some((instruction[0] as u16, instruction))
    })
}

/// Returns the offset of the first instruction for whose opcode `is_included` returns false.
fn end_of(module: &[u32], is_included: impl Fn(u16) -> bool) -> usize {
    let first = instructions(module).take_while(|(opcode, _)| is_included(*opcode));
    HEADER + first.map(|(_, words)| words.len()).sum::<usize>()
}

/// Decorates all float operations with `NoContraction` (SPIR-V 1.6, section 3.20), so that each operation is rounded
/// separately. Conversions are decorated too, since Mesa would turn f32(i32(x)) into a truncation, which keeps the sign
/// of -0.
pub fn forbid_contraction(module: &[u32]) -> Vec<u32> {
    let decorations = instructions(module)
        .filter(|(opcode, _)| ARITHMETIC.contains(opcode) || CONVERSIONS.contains(opcode))
        .flat_map(|(_, words)| [3 << 16 | OP_DECORATE, words[2], NO_CONTRACTION]);
    let before_types = end_of(module, |opcode| !(FIRST_TYPE..=LAST_TYPE).contains(&opcode));
    let (head, tail) = module.split_at(before_types);
    head.iter()
        .copied()
        .chain(decorations)
        .chain(tail.iter().copied())
        .collect()
}

/// Requests 32-bit float controls in all entry points: capabilities and execution modes (SPIR-V 1.6, sections 3.31 and
/// 3.6), and the extension.
pub fn request_controls(controls: FloatControls, module: &[u32]) -> Vec<u32> {
    let requested: Vec<(u32, u32)> = [
        (controls.denormals, (4464, 4459)),
        (controls.signed_zeros, (4466, 4461)),
        (controls.rounding, (4467, 4462)),
    ]
    .into_iter()
    .filter_map(|(is_requested, numbers)| is_requested.then_some(numbers))
    .collect();
    if requested.is_empty() {
        return module.to_vec();
    }
    let capabilities = requested
        .iter()
        .flat_map(|(capability, _)| [instruction(OP_CAPABILITY, 2), *capability]);
    let entry_points = instructions(module).filter(|(opcode, _)| *opcode == OP_ENTRY_POINT);
    let modes = entry_points.flat_map(|(_, words)| {
        let modes = requested.iter().map(|(_, mode)| *mode);
        modes.flat_map(|mode| [instruction(OP_EXECUTION_MODE, 4), words[2], mode, WIDTH])
    });
    let sections = [
        OP_CAPABILITY,
        OP_EXTENSION,
        OP_EXT_INST_IMPORT,
        OP_MEMORY_MODEL,
        OP_ENTRY_POINT,
        OP_EXECUTION_MODE,
    ];
    let end = |count: usize| end_of(module, |opcode| sections[..count].contains(&opcode));
    let ends = [end(1), end(2), end(sections.len())];
    let mut out = module[..ends[0]].to_vec();
    out.extend(capabilities);
    out.extend_from_slice(&module[ends[0]..ends[1]]);
    out.extend(extension(FLOAT_CONTROLS));
    out.extend_from_slice(&module[ends[1]..ends[2]]);
    out.extend(modes);
    out.extend_from_slice(&module[ends[2]..]);
    out
}

fn instruction(opcode: u16, words: usize) -> u32 {
    (words as u32) << 16 | u32::from(opcode)
}

/// Returns `OpExtension` with a name, zero-terminated and zero-padded to whole words.
fn extension(name: &[u8]) -> Vec<u32> {
    let mut bytes = name.to_vec();
    bytes.resize((name.len() / 4 + 1) * 4, 0);
    let name = bytes
        .chunks_exact(4)
        .map(|word| u32::from_le_bytes([word[0], word[1], word[2], word[3]]));
    std::iter::once(instruction(OP_EXTENSION, 1 + bytes.len() / 4))
        .chain(name)
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::gpu::compose::Source;
    use crate::gpu::{Rounding, check};

    const KERNEL: &str = "
        @group(0) @binding(0) var<storage, read_write> out: array<f32>;
        @compute @workgroup_size(4) fn half(@builtin(global_invocation_id) id: vec3u) {
            out[id.x] = sqrt(out[id.x]) / 2.0;
        }";

    fn module(controls: FloatControls) -> Vec<u32> {
        let mut source = Source::default();
        source.append("half", KERNEL);
        let checked = check(&source).unwrap_or_else(|error| panic!("{error}"));
        checked.exact_entry("half", &[], Rounding::Device, controls).unwrap()
    }

    /// Returns an instruction's section; `None` inside functions and among the types.
    fn section(opcode: u16) -> Option<usize> {
        let sections: [&[u16]; 9] = [
            &[17],
            &[10],
            &[11],
            &[14],
            &[15],
            &[16, 331],
            &[3, 4, 5, 6, 7],
            &[71, 72],
            &[19, 20, 21, 22, 23, 24, 28, 29, 30, 32, 33, 43, 44, 59],
        ];
        sections.iter().position(|opcodes| opcodes.contains(&opcode))
    }

    fn in_order(module: &[u32]) -> bool {
        let before_functions = instructions(module).take_while(|(opcode, _)| *opcode != 54);
        before_functions.map(|(opcode, _)| section(opcode)).is_sorted()
    }

    /// Returns the float-control capabilities, the execution modes with operands, and true if the extension is
    /// declared.
    fn requested_controls(module: &[u32]) -> (Vec<u32>, Vec<Vec<u32>>, bool) {
        let with_opcode = |expected: u16| instructions(module).filter(move |(opcode, _)| *opcode == expected);
        let controls = 4459..=4468;
        let entry = with_opcode(15).next().expect("an entry point").1[2];
        let capabilities = with_opcode(17)
            .map(|(_, words)| words[1])
            .filter(|number| controls.contains(number));
        let modes = with_opcode(16).filter(|(_, words)| words[1] == entry && controls.contains(&words[2]));
        let has_extension = with_opcode(10).any(|(_, words)| {
            let bytes: Vec<u8> = words[1..].iter().flat_map(|word| word.to_le_bytes()).collect();
            bytes == *b"SPV_KHR_float_controls\0\0"
        });
        let modes = modes.map(|(_, words)| words[2..].to_vec());
        (capabilities.collect(), modes.collect(), has_extension)
    }

    #[test]
    fn float_controls_are_in_their_sections() {
        let single = |capability: u32, mode: u32| (vec![capability], vec![vec![mode, 32]], true);
        let (denormals, signed_zeros, rounding) = (single(4464, 4459), single(4466, 4461), single(4467, 4462));
        let none = FloatControls::NONE;
        for (controls, expected) in [
            (none, (vec![], vec![], false)),
            (
                FloatControls {
                    denormals: true,
                    ..none
                },
                denormals,
            ),
            (
                FloatControls {
                    signed_zeros: true,
                    ..none
                },
                signed_zeros,
            ),
            (FloatControls { rounding: true, ..none }, rounding),
            (
                FloatControls::ALL,
                (
                    vec![4464, 4466, 4467],
                    vec![vec![4459, 32], vec![4461, 32], vec![4462, 32]],
                    true,
                ),
            ),
        ] {
            let module = module(controls);
            assert_eq!(requested_controls(&module), expected, "{controls:?}");
            assert!(in_order(&module), "{controls:?}");
        }
        let (plain, all) = (module(none), module(FloatControls::ALL));
        let other_instructions = |module: &[u32]| -> Vec<Vec<u32>> {
            let is_control = |words: &[u32]| words[1..].iter().any(|word| (4459..=4468).contains(word));
            let others = instructions(module).filter(|(opcode, words)| *opcode != 10 && !is_control(words));
            others.map(|(_, words)| words.to_vec()).collect()
        };
        assert_eq!(
            other_instructions(&plain),
            other_instructions(&all),
            "other instructions were changed"
        );
        assert_eq!(plain[..HEADER], all[..HEADER]);
    }

    #[test]
    fn misplaced_instructions_are_detected() {
        let module = module(FloatControls::ALL);
        let mut misplaced = module.clone();
        let capabilities = end_of(&module, |opcode| opcode == OP_CAPABILITY);
        let first: Vec<u32> = misplaced.drain(HEADER..HEADER + 2).collect();
        let position = capabilities + extension(FLOAT_CONTROLS).len() - 2;
        misplaced.splice(position..position, first);
        assert_eq!(requested_controls(&misplaced).2, requested_controls(&module).2);
        assert!(
            !in_order(&misplaced),
            "a capability after an extension was not detected"
        );
    }
}
