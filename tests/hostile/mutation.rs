//! Random mutations of every file format must give an image or an error within the limits.

use std::collections::BTreeMap;
use std::fs;

use super::changed::changed;
use super::seeds::{How, Kind, SCENES, START, all, put};
use super::{Ran, render, run};
use crate::random::Random;

/// Bits of integers at the ends of ranges, and of special floats.
const STRANGE: [u32; 8] = [
    0,
    1,
    u32::MAX,
    0x7fff_ffff,
    0x8000_0000,
    0x7fc0_0000,
    0x7f80_0000,
    0x0100_0000,
];
/// Numbers and syntax errors.
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

fn bytes_changed(bytes: &mut Vec<u8>, random: &Random) {
    let below = |count: usize| random.below(count.max(1) as u32) as usize;
    for _ in 0..1 + below(4) {
        let at = below(bytes.len());
        let length = below(1 + below(32)).min(bytes.len() - at);
        match below(8) {
            0 if !bytes.is_empty() => bytes[at] ^= 1 << below(8),
            1 if !bytes.is_empty() => bytes[at] = below(256) as u8,
            2 if at + 4 <= bytes.len() => bytes[at..at + 4].copy_from_slice(&random.pick(&STRANGE).to_le_bytes()),
            3 if at + 4 <= bytes.len() => bytes[at..at + 4].copy_from_slice(&random.pick(&STRANGE).to_be_bytes()),
            4 => drop(bytes.drain(at..at + length)),
            5 => {
                let again = bytes[at..at + length].to_vec();
                bytes.splice(at..at, again.repeat(1 + below(3)));
            }
            6 => drop(bytes.splice(at..at + length.min(3), random.pick(&TEXTS).iter().copied())),
            _ if random.once_in(8) => bytes.truncate(at),
            // Replaces the next number of a text.
            _ => {
                let is_digit = |byte: &u8| byte.is_ascii_digit() || b".-".contains(byte);
                if let Some(start) = bytes[at..].iter().position(is_digit).map(|start| at + start) {
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

/// Mutates the values of a file if its format permits that, otherwise its bytes.
fn mutated(kind: &Kind, random: &Random) -> Vec<u8> {
    if let Some((values, written)) = kind.values.as_ref().filter(|_| !random.once_in(3)) {
        let mut values = values.clone();
        for _ in 0..1 + random.below(3) {
            changed(&mut values, &mut |count| random.below(count as u32) as usize);
        }
        if let Some(bytes) = written(&values) {
            return bytes;
        }
    }
    let mut bytes = kind.bytes.clone();
    bytes_changed(&mut bytes, random);
    bytes
}

#[test]
fn changed_files_are_read_or_told() {
    // Small by default; the seeds are fixed.
    let count: usize = std::env::var("WGRAY_TEST_HOSTILE").map_or(8, |count| count.parse().unwrap());
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    for (number, kind) in all(folder).into_iter().enumerate() {
        // All scenes together count as one kind.
        let count = if kind.ending == "toml" {
            count.div_ceil(SCENES.len())
        } else {
            count
        };
        let file = format!("a.{}", kind.ending);
        let random = Random::new(number as u64);
        let mut codes: BTreeMap<i32, usize> = BTreeMap::new();
        let mut longest = 0.0_f64;
        let meet = |bytes: &[u8]| -> Vec<Ran> {
            fs::write(folder.join(&file), bytes).unwrap();
            let scene = |text: &str| {
                fs::write(
                    folder.join("names.toml"),
                    START.to_owned() + &text.replace("FILE", &file),
                )
                .unwrap()
            };
            let plain = [
                "render",
                "plain.toml",
                "--device",
                "cpu",
                "--threads",
                "2",
                "-o",
                "out.png",
            ];
            match kind.how {
                How::Scene => vec![render(folder, &file)],
                How::Named(text) => {
                    if kind.ending == "mtl" {
                        fs::write(folder.join("a.mtl"), bytes).unwrap();
                    }
                    scene(text);
                    vec![render(folder, "names.toml")]
                }
                How::Picture(text) => {
                    scene(text);
                    vec![render(folder, "names.toml"), run(folder, &["diff", &file, "t.png"])]
                }
                How::Checkpoint => vec![run(
                    folder,
                    &[&plain[..], &["--checkpoint", &file, "--resume"]].concat(),
                )],
                How::Part => vec![run(folder, &["merge", &file, "-o", "out.exr", "-o", "out.png", "-q"])],
            }
        };
        // Control: the original file is accepted.
        for ran in meet(&kind.bytes) {
            assert!(
                [0, 1, 5].contains(&ran.code) && (ran.code == 0 || matches!(kind.how, How::Picture(_))),
                "{file}: {}",
                ran.said
            );
        }
        for number in 0..count {
            let bytes = mutated(&kind, &random);
            let all = std::panic::catch_unwind(std::panic::AssertUnwindSafe(|| meet(&bytes)));
            let keep = || {
                let kept = std::env::temp_dir().join(format!("wgray-hostile-{number}.{}", kind.ending));
                fs::write(&kept, &bytes).unwrap();
                kept
            };
            let all = all.unwrap_or_else(|_| panic!("{}: the file is kept", keep().display()));
            for ran in all {
                let is_good = ran.code == 0 || kind.codes.contains(&ran.code);
                assert!(is_good, "exit code {}: {}\n{}", ran.code, ran.said, keep().display());
                *codes.entry(ran.code).or_default() += 1;
                longest = longest.max(ran.seconds);
            }
        }
        let counts: Vec<String> = codes.iter().map(|(code, count)| format!("{count} x {code}")).collect();
        println!("| {} | {count} | {} | {longest:.1} s |", kind.ending, counts.join(", "));
        put(folder);
    }
}
