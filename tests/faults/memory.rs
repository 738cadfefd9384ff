//! If device memory is exhausted, the program reports an error with the sizes or falls back to the CPU.

use crate::test_folder::TestFolder;

use super::driver::{RunResult, SCENE, driver};

const ADVICE: &str = "; render a crop or a smaller image, or use the CPU \
                      (--crop, --size, --device cpu)\n";

fn assert_out_of_memory(result: &RunResult, texts: &[&str]) {
    assert_eq!((result.code, result.picture.is_some()), (7, false), "{}", result.stderr);
    assert!(result.stderr.starts_with("error: llvmpipe"), "{}", result.stderr);
    assert_eq!(result.stderr_lines().len(), 1, "{}", result.stderr);
    for text in texts {
        assert!(result.stderr.contains(text), "{text}: {}", result.stderr);
    }
}

#[test]
fn a_film_that_does_not_fit_is_reported_with_its_size() {
    let Some(driver) = driver() else { return };
    let folder = TestFolder::with_scene(SCENE);
    let (large, gpu) = (["--size", "1024x1024"], ["--device", "gpu"]);
    let expected = folder.render_expected(driver, &large);
    let result = folder.run_on(driver, &[large, gpu].concat(), &[("FAULTS_LARGEST", "8388608")]);
    let texts = [
        ": out of memory: the driver cannot allocate 16.0 MiB for a film of 1024 x 1024 pixels",
        ADVICE,
    ];
    assert_out_of_memory(&result, &texts);
    assert!(result.count("allocation") > 0 && result.log.iter().any(|line| line.ends_with("of 16777216 refused")));
    // A crop fits; with a higher limit, the full film fits.
    let crop = ["--size", "1024x1024", "--crop", "0,0,1024,64", "--device", "gpu"];
    let result = folder.run_on(driver, &crop, &[("FAULTS_LARGEST", "8388608")]);
    assert_eq!((result.code, result.stderr.as_str()), (0, ""));
    let result = folder.run_on(driver, &[large, gpu].concat(), &[("FAULTS_LARGEST", "67108864")]);
    assert_eq!((result.code, result.stderr.as_str()), (0, ""));
    assert!(result.picture.as_ref() == Some(&expected));
    let result = folder.run_on(
        driver,
        &[large, ["--device", "auto"]].concat(),
        &[("FAULTS_LARGEST", "8388608")],
    );
    assert_eq!((result.code, result.stderr_lines().len()), (0, 1), "{}", result.stderr);
    assert!(
        result.stderr.starts_with("warning: rendering on the CPU: llvmpipe"),
        "{}",
        result.stderr
    );
    assert!(result.picture == Some(expected));
}

/// Memory runs out at each allocation in turn: of the device, the film and the readbacks.
#[test]
fn exhausted_memory_is_an_error_or_falls_back_to_the_cpu() {
    let Some(driver) = driver() else { return };
    let folder = TestFolder::with_scene(SCENE);
    let size = ["--size", "256x256"];
    let expected = folder.render_expected(driver, &size);
    let unlimited = folder.run_on(driver, &[size, ["--device", "gpu"]].concat(), &[]);
    let allocations = unlimited.count("allocation");
    assert!((2..100).contains(&allocations), "{:?}", unlimited.log);
    let mut failures = 0;
    for first_failure in 1..=allocations {
        let first_failure = first_failure.to_string();
        let faults = [("FAULTS_NO_MEMORY_FROM", first_failure.as_str())];
        let result = folder.run_on(driver, &[size, ["--device", "gpu"]].concat(), &faults);
        // The number of allocations depends on timing, so a run may not reach the first allocation that fails.
        if result.log.iter().any(|line| line.ends_with("refused")) {
            assert_out_of_memory(&result, &[": out of memory: the driver "]);
            failures += 1;
        } else {
            assert_eq!(result.code, 0, "{first_failure}: {}", result.stderr);
        }
        let result = folder.run_on(driver, &[size, ["--device", "auto"]].concat(), &faults);
        assert_eq!(result.code, 0, "{first_failure}: {}", result.stderr);
        assert!(result.picture.as_ref() == Some(&expected), "{first_failure}");
    }
    assert!(failures >= 2, "{failures}");
}

#[test]
fn a_scene_that_does_not_fit_is_reported_with_its_size() {
    let Some(driver) = driver() else { return };
    let textured = SCENE.replace("color = [0.5, 0.4, 0.3]", "color = { texture = \"large\" }")
        + "[textures.large]\ntype = \"image\"\nfile = \"large.png\"\n";
    let folder = TestFolder::with_scene(&textured);
    // 4 MiB of texels, and a third of that for the mip levels.
    let large = image::RgbImage::from_fn(1024, 1024, |x, y| image::Rgb([x as u8, y as u8, (x * y) as u8]));
    large.save(folder.path("large.png")).expect("an image");
    let limit = [("FAULTS_LARGEST", "4194304")];
    let result = folder.run_on(driver, &["--device", "gpu"], &limit);
    assert_out_of_memory(
        &result,
        &[
            ": out of memory: the driver cannot allocate 5.3 MiB for the scene; ",
            ADVICE,
        ],
    );
    let result = folder.run_on(driver, &["--device", "gpu"], &[]);
    assert_eq!((result.code, result.stderr.as_str()), (0, ""));
}

/// wgpu drops the device when a submit runs out of memory, so this error resembles a device loss.
#[test]
fn a_submit_without_memory_is_not_a_device_loss() {
    let Some(driver) = driver() else { return };
    let folder = TestFolder::with_scene(SCENE);
    let expected = folder.render_expected(driver, &[]);
    for submit in ["1", "2", "3", "4", "5"] {
        let faults = [("FAULTS_NO_MEMORY_IN", submit)];
        let result = folder.run_on(driver, &["--device", "gpu"], &faults);
        assert_out_of_memory(&result, &[": out of memory: the driver "]);
        let result = folder.run_on(driver, &["--device", "auto"], &faults);
        assert_eq!(
            (result.code, result.stderr_lines().len()),
            (0, 1),
            "{submit}: {}",
            result.stderr
        );
        assert!(result.picture.as_ref() == Some(&expected), "{submit}");
    }
    let faults = [("FAULTS_REFUSE_FIRST", "1"), ("FAULTS_REFUSE_WITH", "-2")];
    let result = folder.run_on(driver, &["--device", "gpu"], &faults);
    assert_out_of_memory(
        &result,
        &[": out of memory: the driver has no memory to open the device; "],
    );
}
