//! SPIR-V whose floating-point arithmetic no driver may fuse or reorder.

/// Opcodes of float arithmetic that naga writes: negate, add, subtract, multiply, divide, vector times scalar, dot.
pub const ARITHMETIC: [u16; 7] = [127, 129, 131, 133, 136, 142, 148];

/// Opcodes of conversions between floats and integers.
pub const CONVERSIONS: [u16; 4] = [109, 110, 111, 112];

const OP_DECORATE: u32 = 71;
const NO_CONTRACTION: u32 = 42;
const FIRST_TYPE: u16 = 19; // OpTypeVoid
const LAST_TYPE: u16 = 39; // OpTypeForwardPointer
const HEADER: usize = 5;

/// The instructions of a module: opcode and words, the first of which holds opcode and length.
pub fn instructions(module: &[u32]) -> impl Iterator<Item = (u16, &[u32])> {
    let mut rest = module.get(HEADER..).unwrap_or(&[]);
    std::iter::from_fn(move || {
        let length = (*rest.first()? >> 16) as usize;
        let (instruction, after) = rest.split_at_checked(length.max(1))?;
        rest = after;
        Some((instruction[0] as u16, instruction))
    })
}

/// Decorates the result of every float operation with `NoContraction` (SPIR-V 1.6, section 3.20): it is then computed
/// as written, each operation rounded by itself. So with conversions: Mesa would make f32(i32(x)) a truncation, which
/// keeps the sign of -0.
pub fn forbid_contraction(module: &[u32]) -> Vec<u32> {
    let decorations = instructions(module)
        .filter(|(opcode, _)| ARITHMETIC.contains(opcode) || CONVERSIONS.contains(opcode))
        .flat_map(|(_, words)| [3 << 16 | OP_DECORATE, words[2], NO_CONTRACTION]);
    let before_types: usize = instructions(module)
        .take_while(|(opcode, _)| !(FIRST_TYPE..=LAST_TYPE).contains(opcode))
        .map(|(_, words)| words.len())
        .sum();
    let (head, tail) = module.split_at(HEADER + before_types);
    head.iter()
        .copied()
        .chain(decorations)
        .chain(tail.iter().copied())
        .collect()
}
