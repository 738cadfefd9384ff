//! Random mutations of every file format must give an image or an error within the limits.

use std::collections::BTreeMap;
use std::fs;

use super::changed::changed;
use super::seeds::{Format, ReadCommand, SCENE_START, SCENES, all_formats, write_referenced_files};
use super::{RunResult, render, run};
use crate::random::Random;

/// Bit patterns of extreme integers and of special floats.
const EXTREME_BITS: [u32; 8] = [
    0,
    1,
    u32::MAX,
    0x7fff_ffff,
    0x8000_0000,
    0x7fc0_0000,
    0x7f80_0000,
    0x0100_0000,
];
/// Texts to insert: extreme numbers, control characters, syntax errors and a path.
const TEXTS: [&[u8]; 16] = [
    b"-1",
    b"0",
    b"1e39",
    b"nan",
    b"inf",
    b"99999999999999999999",
    b"4294967295",
    b"-0.0",
    b"1e-45",
    b"\xff",
    b"\0",
    b"\x1b[31m",
    b"[[[[",
    b"{",
    b"\"",
    b"../../../../etc/passwd",
];

fn mutate_bytes(bytes: &mut Vec<u8>, random: &Random) {
    let below = |count: usize| random.below(count.max(1) as u32) as usize;
    for _ in 0..1 + below(4) {
        let offset = below(bytes.len());
        let length = below(1 + below(32)).min(bytes.len() - offset);
        match below(8) {
            0 if !bytes.is_empty() => bytes[offset] ^= 1 << below(8),
            1 if !bytes.is_empty() => bytes[offset] = below(256) as u8,
            2 if offset + 4 <= bytes.len() => {
                bytes[offset..offset + 4].copy_from_slice(&random.pick(&EXTREME_BITS).to_le_bytes())
            }
            3 if offset + 4 <= bytes.len() => {
                bytes[offset..offset + 4].copy_from_slice(&random.pick(&EXTREME_BITS).to_be_bytes())
            }
            4 => drop(bytes.drain(offset..offset + length)),
            5 => {
                let copy = bytes[offset..offset + length].to_vec();
                bytes.splice(offset..offset, copy.repeat(1 + below(3)));
            }
            6 => drop(bytes.splice(offset..offset + length.min(3), random.pick(&TEXTS).iter().copied())),
            _ if random.once_in(8) => bytes.truncate(offset),
            // Replaces the next decimal number.
            _ => {
                let is_digit = |byte: &u8| byte.is_ascii_digit() || b".-".contains(byte);
                if let Some(start) = bytes[offset..].iter().position(is_digit).map(|start| offset + start) {
                    let end = bytes[start..]
                        .iter()
                        .position(|byte| !is_digit(byte))
                        .map_or(bytes.len(), |end| start + end);
                    bytes.splice(start..end, random.pick(&TEXTS).iter().copied());
                }
            }
        }
    }
}

/// In two of three cases, mutates the values of the file if its format has a serializer; otherwise mutates the bytes.
fn mutate(format: &Format, random: &Random) -> Vec<u8> {
    if let Some((values, serialize)) = format.values.as_ref().filter(|_| !random.once_in(3)) {
        let mut values = values.clone();
        for _ in 0..1 + random.below(3) {
            changed(&mut values, &mut |count| random.below(count as u32) as usize);
        }
        if let Some(bytes) = serialize(&values) {
            return bytes;
        }
    }
    let mut bytes = format.bytes.clone();
    mutate_bytes(&mut bytes, random);
    bytes
}

#[test]
fn mutated_files_are_read_or_rejected_with_a_message() {
    // Number of mutations of each format. The seeds are fixed.
    let count: usize = std::env::var("WGRAY_TEST_HOSTILE").map_or(8, |count| count.parse().unwrap());
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    for (format_index, format) in all_formats(folder).into_iter().enumerate() {
        // All scenes together get the number of mutations of one format.
        let count = if format.extension == "toml" {
            count.div_ceil(SCENES.len())
        } else {
            count
        };
        let file = format!("a.{}", format.extension);
        let random = Random::new(format_index as u64);
        let mut codes: BTreeMap<i32, usize> = BTreeMap::new();
        let mut max_seconds = 0.0_f64;
        let run_commands = |bytes: &[u8]| -> Vec<RunResult> {
            fs::write(folder.join(&file), bytes).unwrap();
            let write_scene = |text: &str| {
                fs::write(
                    folder.join("names.toml"),
                    SCENE_START.to_owned() + &text.replace("FILE", &file),
                )
                .unwrap()
            };
            let render_plain = [
                "render",
                "plain.toml",
                "--device",
                "cpu",
                "--threads",
                "2",
                "-o",
                "out.png",
            ];
            match format.command {
                ReadCommand::Scene => vec![render(folder, &file)],
                ReadCommand::Named(text) => {
                    if format.extension == "mtl" {
                        fs::write(folder.join("a.mtl"), bytes).unwrap();
                    }
                    write_scene(text);
                    vec![render(folder, "names.toml")]
                }
                ReadCommand::Picture(text) => {
                    write_scene(text);
                    vec![render(folder, "names.toml"), run(folder, &["diff", &file, "t.png"])]
                }
                ReadCommand::Checkpoint => vec![run(
                    folder,
                    &[&render_plain[..], &["--checkpoint", &file, "--resume"]].concat(),
                )],
                ReadCommand::Part => vec![run(folder, &["merge", &file, "-o", "out.exr", "-o", "out.png", "-q"])],
            }
        };
        // Positive control: the unmutated file is accepted.
        for result in run_commands(&format.bytes) {
            assert!(
                [0, 1, 5].contains(&result.code)
                    && (result.code == 0 || matches!(format.command, ReadCommand::Picture(_))),
                "{file}: {}",
                result.output
            );
        }
        for mutation_index in 0..count {
            let bytes = mutate(&format, &random);
            let results = std::panic::catch_unwind(std::panic::AssertUnwindSafe(|| run_commands(&bytes)));
            let save_file = || {
                let path = std::env::temp_dir().join(format!("wgray-hostile-{mutation_index}.{}", format.extension));
                fs::write(&path, &bytes).unwrap();
                path
            };
            let results = results.unwrap_or_else(|_| panic!("the mutated file is saved as {}", save_file().display()));
            for result in results {
                let is_permitted = result.code == 0 || format.codes.contains(&result.code);
                assert!(
                    is_permitted,
                    "exit code {}: {}\n{}",
                    result.code,
                    result.output,
                    save_file().display()
                );
                *codes.entry(result.code).or_default() += 1;
                max_seconds = max_seconds.max(result.seconds);
            }
        }
        let counts: Vec<String> = codes.iter().map(|(code, count)| format!("{count} x {code}")).collect();
        println!(
            "| {} | {count} | {} | {max_seconds:.1} s |",
            format.extension,
            counts.join(", ")
        );
        write_referenced_files(folder);
    }
}
