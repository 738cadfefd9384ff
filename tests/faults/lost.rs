//! Device loss: the device is re-opened, up to a limit of losses in a row, and the image does not change.

use std::io::{Read as _, Write as _};
use std::process::Command;
use std::time::{Duration, Instant};

use crate::test_folder::TestFolder;

use super::driver::{RunResult, SCENE, driver};

/// Values of `FAULTS_LOSE_IN`.
const LOSS_FUNCTIONS: [&str; 3] = ["submit", "status", "wait"];

/// Number of submits of a render of [`SCENE`]: warm-up, samples, film, first hits, readback.
const SUBMITS: usize = 5;

const GPU: [&str; 2] = ["--device", "gpu"];
const AUTO: [&str; 2] = ["--device", "auto"];

/// Checks the messages: `reopened` warnings about re-opened devices, then lines that start with `other_lines`.
fn assert_reopened(result: &RunResult, reopened: usize, other_lines: &[&str]) {
    let lines = result.stderr_lines();
    assert_eq!(lines.len(), reopened + other_lines.len(), "{}", result.stderr);
    for line in &lines[..reopened] {
        assert!(line.starts_with("warning: llvmpipe"), "{line}");
        assert!(line.contains(": the device was lost: the driver removed it"), "{line}");
        assert!(line.ends_with("; re-opening it"), "{line}");
    }
    for (line, start) in lines[reopened..].iter().zip(other_lines) {
        assert!(line.starts_with(start), "{line}");
    }
}

#[test]
fn without_faults_the_image_equals_the_image_of_the_cpu() {
    let Some(driver) = driver() else { return };
    let folder = TestFolder::with_scene(SCENE);
    let expected = folder.render_expected(driver, &[]);
    for device in [GPU, AUTO, ["--device", "llvmpipe"]] {
        let result = folder.run_on(driver, &device, &[]);
        assert_eq!((result.code, result.stderr.as_str()), (0, ""), "{device:?}");
        assert_eq!(
            (result.count("device"), result.count("submit")),
            (1, SUBMITS),
            "{:?}",
            result.log
        );
        assert!(result.picture == Some(expected.clone()), "{device:?}");
    }
    // Negative control: another seed gives another image.
    let other_seed = folder.run_on(driver, &["--device", "gpu", "--seed", "7"], &[]);
    assert!(other_seed.code == 0 && other_seed.picture != Some(expected));
}

#[test]
fn a_device_lost_at_any_submit_is_reopened() {
    let Some(driver) = driver() else { return };
    let folder = TestFolder::with_scene(SCENE);
    let expected = folder.render_expected(driver, &[]);
    for function in LOSS_FUNCTIONS {
        for submit in 1..=SUBMITS {
            let lost_submits = submit.to_string();
            let result = folder.run_on(
                driver,
                &GPU,
                &[("FAULTS_LOSE", &lost_submits), ("FAULTS_LOSE_IN", function)],
            );
            assert_eq!(result.code, 0, "{function} {submit}: {}", result.stderr);
            assert_reopened(&result, 1, &[]);
            let counts = (
                result.count("lost in"),
                result.count(&format!("lost in {function}")),
                result.count("device"),
            );
            assert_eq!(counts, (1, 1, 2), "{function} {submit}: {:?}", result.log);
            assert!(result.picture == Some(expected.clone()), "{function} {submit}");
        }
    }
}

#[test]
fn a_device_lost_several_times_is_reopened_each_time() {
    let Some(driver) = driver() else { return };
    let folder = TestFolder::with_scene(SCENE);
    let expected = folder.render_expected(driver, &[]);
    let twice_lost = folder.run_on(driver, &GPU, &[("FAULTS_LOSE", "2,4")]);
    assert_eq!(
        (twice_lost.code, twice_lost.count("lost")),
        (0, 2),
        "{}",
        twice_lost.stderr
    );
    assert_reopened(&twice_lost, 2, &[]);
    assert!(twice_lost.picture == Some(expected.clone()));
    // Two losses during the samples and two during the first hits: at the second to last submit, and again after the
    // next warm-up. Four losses in a row, without progress between them, would exceed the limit.
    let first_hits_submit = twice_lost.count("submit") - 1;
    let lost_submits = format!("2,4,{first_hits_submit},{}", first_hits_submit + 2);
    // The number of submits before the first hits depends on timing, so the losses of a run may miss the first hits.
    let mut runs = (0..5).map(|_| folder.run_on(driver, &GPU, &[("FAULTS_LOSE", &lost_submits)]));
    let result = runs.find(|result| (result.code, result.count("lost")) == (0, 4));
    let result = result.unwrap_or_else(|| panic!("{lost_submits}: none of five runs survived four losses"));
    assert_reopened(&result, 4, &[]);
    assert!(result.picture == Some(expected));
}

/// The device is lost once, in the middle of many dispatches.
#[test]
fn a_long_render_survives_a_device_loss() {
    let Some(driver) = driver() else { return };
    let folder = TestFolder::with_scene(SCENE);
    let size = ["--size", "512x512", "--spp", "16"];
    let expected = folder.render_expected(driver, &size);
    for function in LOSS_FUNCTIONS {
        let result = folder.run_on(
            driver,
            &[&size[..], &GPU].concat(),
            &[("FAULTS_LOSE", "4"), ("FAULTS_LOSE_IN", function)],
        );
        assert_eq!(
            (result.code, result.count("lost")),
            (0, 1),
            "{function}: {}",
            result.stderr
        );
        assert_reopened(&result, 1, &[]);
        assert!(result.picture == Some(expected.clone()), "{function}");
    }
}

#[test]
fn a_permanent_device_loss_is_an_error_or_falls_back_to_the_cpu() {
    let Some(driver) = driver() else { return };
    let folder = TestFolder::with_scene(SCENE);
    let expected = folder.render_expected(driver, &[]);
    // The cases run in parallel, because each of them waits a few seconds for the device.
    let check_permanent_loss = |lost_submits: &str, device: &str| {
        let folder = TestFolder::with_scene(SCENE);
        let faults = [("FAULTS_LOSE", lost_submits), ("FAULTS_REFUSE", "99")];
        let result = folder.run_on(driver, &["--device", device], &faults);
        assert_eq!((result.code, result.picture.is_some()), (6, false), "{lost_submits}");
        assert_reopened(&result, 1, &["error: llvmpipe"]);
        let end = "; it could not be opened again: the driver does not open the device";
        assert!(result.stderr.trim_end().ends_with(end), "{}", result.stderr);
        assert_eq!((result.count("device refused"), result.count("lost")), (3, 1));
        let requeue = ["--device", device, "--requeue-exit", "75"];
        let result = folder.run_on(driver, &requeue, &faults);
        assert_eq!((result.code, result.picture.is_some()), (75, false), "{lost_submits}");
        assert_reopened(
            &result,
            1,
            &["error: llvmpipe", "note: exit code 75 requests another attempt"],
        );
        let result = folder.run_on(driver, &[&AUTO[..], &requeue[2..]].concat(), &faults);
        assert_eq!(result.code, 0, "{lost_submits}: {}", result.stderr);
        assert_reopened(&result, 1, &["warning: rendering on the CPU: llvmpipe"]);
        assert!(result.picture == Some(expected.clone()), "{lost_submits}");
    };
    std::thread::scope(|scope| {
        for (lost_submits, device) in [("1", "gpu"), ("2", "llvmpipe"), ("4", "gpu")] {
            let check_permanent_loss = &check_permanent_loss;
            scope.spawn(move || check_permanent_loss(lost_submits, device));
        }
    });
    let faults = [("FAULTS_LOSE", "2"), ("FAULTS_REFUSE", "99")];
    let result = folder.run_on(driver, &["--device", "auto", "--quiet"], &faults);
    assert_eq!((result.code, result.stderr.as_str()), (0, ""));
    assert!(result.picture == Some(expected.clone()));
    // On software Vulkan, `auto` selects the adapter for enough samples.
    let many_samples = ["--spp", "8192", "--threads", "1"];
    let expected_of_many = folder.render_expected(driver, &many_samples);
    let software = [&faults[..], &[("FAULTS_GPU", "0")]].concat();
    let result = folder.run_on(driver, &[&AUTO[..], &many_samples].concat(), &software);
    assert_reopened(&result, 1, &["warning: rendering on the CPU: llvmpipe"]);
    assert!(result.code == 0 && result.picture == Some(expected_of_many));
    // The program waits for a device that cannot be re-opened at first.
    let faults = [("FAULTS_LOSE", "2"), ("FAULTS_REFUSE", "2")];
    let result = folder.run_on(driver, &GPU, &faults);
    assert_eq!(
        (result.code, result.count("device refused")),
        (0, 2),
        "{}",
        result.stderr
    );
    assert_reopened(&result, 1, &[]);
    assert!(result.picture == Some(expected));
}

#[test]
fn the_number_of_losses_in_a_row_is_limited() {
    let Some(driver) = driver() else { return };
    let folder = TestFolder::with_scene(SCENE);
    let expected = folder.render_expected(driver, &[]);
    // `every:1` loses each device in its warm-up: no device becomes ready again after the first loss, and only that
    // loss is reported. `every:2` loses each device while it renders samples: every loss is reported, the last as an
    // error.
    let check_repeated_losses = |lost_submits: &str, reopened: usize| {
        let folder = TestFolder::with_scene(SCENE);
        let result = folder.run_on(driver, &GPU, &[("FAULTS_LOSE", lost_submits)]);
        assert_eq!((result.code, result.picture.is_some()), (6, false), "{lost_submits}");
        assert_eq!(
            (result.count("lost"), result.count("device")),
            (4, 4),
            "{lost_submits}: {:?}",
            result.log
        );
        assert_reopened(&result, reopened, &["error: llvmpipe"]);
        let result = folder.run_on(driver, &AUTO, &[("FAULTS_LOSE", lost_submits)]);
        assert_eq!(
            (result.code, result.count("lost")),
            (0, 4),
            "{lost_submits}: {}",
            result.stderr
        );
        assert_reopened(&result, reopened, &["warning: rendering on the CPU: llvmpipe"]);
        assert!(result.picture == Some(expected.clone()), "{lost_submits}");
    };
    std::thread::scope(|scope| {
        for (lost_submits, reopened) in [("every:1", 1), ("every:2", 3)] {
            let check_repeated_losses = &check_repeated_losses;
            scope.spawn(move || check_repeated_losses(lost_submits, reopened));
        }
    });
}

#[test]
fn a_panic_on_dropping_a_lost_device_is_caught() {
    let Some(driver) = driver() else { return };
    let folder = TestFolder::with_scene(SCENE);
    let expected = folder.render_expected(driver, &[]);
    // With these return codes of the wait-idle functions, wgpu panics when it drops the queue.
    for code in ["-1", "-2", "-13"] {
        for function in LOSS_FUNCTIONS {
            let faults = [
                ("FAULTS_LOSE", "2"),
                ("FAULTS_LOSE_IN", function),
                ("FAULTS_IDLE", code),
            ];
            let result = folder.run_on(driver, &GPU, &faults);
            assert_eq!(
                (result.code, result.count("lost")),
                (0, 1),
                "{code} {function}: {}",
                result.stderr
            );
            assert!(
                result.count("idle") > 0,
                "the driver did not wait for an idle queue: {:?}",
                result.log
            );
            assert_reopened(&result, 1, &[]);
            assert!(result.picture == Some(expected.clone()), "{code} {function}");
        }
    }
}

#[test]
fn opening_a_requested_device_is_retried() {
    let Some(driver) = driver() else { return };
    let folder = TestFolder::with_scene(SCENE);
    let expected = folder.render_expected(driver, &[]);
    let result = folder.run_on(driver, &GPU, &[("FAULTS_REFUSE_FIRST", "2")]);
    assert_eq!(
        (result.code, result.count("device refused")),
        (0, 2),
        "{}",
        result.stderr
    );
    assert!(result.picture == Some(expected.clone()));
    let result = folder.run_on(driver, &GPU, &[("FAULTS_REFUSE_FIRST", "99")]);
    assert_eq!((result.code, result.picture.is_some()), (6, false), "{}", result.stderr);
    let result = folder.run_on(driver, &AUTO, &[("FAULTS_REFUSE_FIRST", "99")]);
    assert_eq!(
        (result.code, result.count("device refused")),
        (0, 1),
        "the program did not select another device after the first failure: {}",
        result.stderr
    );
    assert!(result.picture == Some(expected));
}

#[test]
fn a_slow_submit_does_not_change_the_image() {
    let Some(driver) = driver() else { return };
    let folder = TestFolder::with_scene(SCENE);
    let size = ["--size", "256x256"];
    let expected = folder.render_expected(driver, &size);
    let result = folder.run_on(driver, &[&size[..], &GPU].concat(), &[("FAULTS_SLEEP", "2:1500")]);
    assert_eq!((result.code, result.stderr.as_str(), result.count("sleep")), (0, "", 1));
    assert!(result.picture == Some(expected));
}

#[test]
fn waiting_for_a_device_can_be_interrupted() {
    let Some(driver) = driver() else { return };
    crate::cli::restore_signal_defaults();
    let folder = TestFolder::with_scene(SCENE);
    let faults = [("FAULTS_LOSE", "2"), ("FAULTS_REFUSE", "99")];
    let mut child = folder.start(driver, &GPU, &faults);
    // After two failures, the program is in its longest pause, of 2 s.
    let log = folder.path("log");
    let refusals = || std::fs::read_to_string(&log).map_or(0, |log| log.matches("device refused").count());
    let start = Instant::now();
    while refusals() < 2 {
        assert!(start.elapsed() < Duration::from_secs(60) && child.try_wait().unwrap().is_none());
        std::thread::sleep(Duration::from_millis(10));
    }
    let signal_time = Instant::now();
    let kill_status = Command::new("kill").args(["-INT", &child.id().to_string()]).status();
    assert!(kill_status.unwrap().success());
    let status = child.wait().unwrap();
    assert!(
        signal_time.elapsed() < Duration::from_millis(1500),
        "{:?}",
        signal_time.elapsed()
    );
    assert_eq!(status.code(), Some(130));
    assert_eq!(refusals(), 2, "the program did not stop during the pause");
    let mut message = String::new();
    child.stderr.unwrap().read_to_string(&mut message).unwrap();
    assert!(!message.contains("panicked"), "{message}");
    assert!(!folder.path("out.exr").exists());
}

/// Environment variable with the number of random cases.
const CASES: &str = "WGRAY_TEST_FAULTS";

/// `scripts/test-slow faults` runs many cases.
#[test]
fn random_faults_do_not_change_the_image() {
    let Some(driver) = driver() else { return };
    let requested_cases = std::env::var(CASES).ok();
    let cases = requested_cases
        .as_ref()
        .map_or(4, |number| number.parse().expect("WGRAY_TEST_FAULTS is a number"));
    let folder = TestFolder::with_scene(SCENE);
    let size = ["--size", "320x240", "--spp", "16"];
    let expected = folder.render_expected(driver, &size);
    let (mut losses, mut refusals, mut cpu_fallbacks) = (0, 0, 0);
    for case in 0..cases {
        let faults = random_faults(&mut Draws::new(case));
        let faults: Vec<(&str, &str)> = faults.iter().map(|(name, value)| (*name, value.as_str())).collect();
        let result = folder.run_on(driver, &[&size[..], &AUTO].concat(), &faults);
        assert_eq!(result.code, 0, "{faults:?}: {}", result.stderr);
        assert!(result.picture.as_ref() == Some(&expected), "{faults:?}");
        losses += result.count("lost");
        refusals += result.log.iter().filter(|line| line.ends_with("refused")).count();
        cpu_fallbacks += usize::from(result.stderr.contains("rendering on the CPU"));
    }
    if requested_cases.is_some() {
        let summary = format!("{losses} losses, {refusals} refusals, {cpu_fallbacks} renders finished on the CPU");
        let _ = writeln!(
            std::io::stderr(),
            "{cases} renders with faults: {summary}; all images equal"
        );
    }
    assert!(losses as u64 >= cases, "{losses} losses in {cases} renders");
}

/// Returns random faults: losses a few submits apart, failed device creations after each loss, and sometimes exhausted
/// memory.
fn random_faults(draws: &mut Draws) -> Vec<(&'static str, String)> {
    let mut submit = 1 + draws.below(5);
    let mut lost_submits = submit.to_string();
    for _ in 0..draws.below(5) {
        submit += 1 + draws.below(5);
        lost_submits += &format!(",{submit}");
    }
    let mut faults = vec![
        ("FAULTS_LOSE", lost_submits),
        ("FAULTS_LOSE_IN", LOSS_FUNCTIONS[draws.below(3) as usize].to_string()),
        ("FAULTS_REFUSE", draws.below(6).saturating_sub(2).to_string()),
    ];
    if draws.below(4) == 0 {
        faults.push(("FAULTS_NO_MEMORY_FROM", (5 + draws.below(20)).to_string()));
    }
    faults
}

struct Draws(u64);

impl Draws {
    fn new(seed: u64) -> Draws {
        Draws(seed)
    }

    /// Returns a number below `end`: SplitMix64 (Steele, Lea and Flood, "Fast splittable pseudorandom number
    /// generators", 2014, figure 17).
    fn below(&mut self, end: u64) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        (z ^ (z >> 31)) % end
    }
}
