//! The GPU adapter that the tests use, and the known deviations of its drivers.

use std::io::Write as _;
use std::sync::OnceLock;
use std::sync::atomic::{AtomicUsize, Ordering};

use wgray_render::gpu::{AdapterChoice, Device, choose};

/// Environment variable that selects the adapter by a part of its name, driver or type.
const ADAPTER: &str = "WGRAY_TEST_ADAPTER";
/// Environment variable that, if 1, restricts the tests to those that need no adapter.
const WITHOUT_GPU: &str = "WGRAY_TEST_WITHOUT_GPU";

/// Number of devices that the test threads share, because lavapipe compiles the kernels of a device one after another.
///
/// An adapter that [`ADAPTER`] selects has one device: SwiftShader compiles one kernel at a time in each process, and
/// compiles it again for every device.
const DEVICE_COUNT: usize = 4;

/// Number of threads that use each device.
static USERS: [AtomicUsize; DEVICE_COUNT] = [const { AtomicUsize::new(0) }; DEVICE_COUNT];

/// The index of the device that a thread uses until it ends.
struct DeviceIndex(usize);

impl DeviceIndex {
    /// Selects a device with the fewest users.
    fn select() -> DeviceIndex {
        let device_count = if std::env::var_os(ADAPTER).is_some() {
            1
        } else {
            DEVICE_COUNT
        };
        let users = |index: &usize| USERS[*index].load(Ordering::Relaxed);
        let index = (0..device_count).min_by_key(users).expect("a device");
        USERS[index].fetch_add(1, Ordering::Relaxed);
        DeviceIndex(index)
    }
}

impl Drop for DeviceIndex {
    fn drop(&mut self) {
        USERS[self.0].fetch_sub(1, Ordering::Relaxed);
    }
}

/// Returns a device of the adapter under test, always the same one in a thread, or `None` if `WGRAY_TEST_WITHOUT_GPU`
/// is 1. Panics if no adapter is found.
pub fn device() -> Option<&'static Device> {
    static DEVICES: [OnceLock<Option<Device>>; DEVICE_COUNT] = [const { OnceLock::new() }; DEVICE_COUNT];
    thread_local! {
        static INDEX: DeviceIndex = DeviceIndex::select();
    }
    let index = INDEX.with(|index| index.0);
    DEVICES[index].get_or_init(|| open(index)).as_ref()
}

/// Opens the adapter under test as the device `index`. Prints the adapter once, if `index` is 0.
fn open(index: usize) -> Option<Device> {
    let print_line = |line: &str| {
        if index == 0 {
            print_line(line);
        }
    };
    if std::env::var_os(WITHOUT_GPU).is_some_and(|value| value == "1") {
        print_line("adapter: none, because WGRAY_TEST_WITHOUT_GPU is 1; GPU and CPU are not compared");
        return None;
    }
    let choice = std::env::var(ADAPTER).map_or(AdapterChoice::Auto, AdapterChoice::Named);
    match choose(&choice) {
        Ok(device) => {
            let info = &device.info;
            print_line(&format!(
                "adapter: {}, {} ({}, {})",
                info.name, info.driver, info.backend, info.kind
            ));
            Some(device)
        }
        Err(error) => panic!("{error}. To run only the tests that need no adapter, set {WITHOUT_GPU}=1."),
    }
}

/// Writes to standard error directly because the test harness captures `eprintln!`.
fn print_line(line: &str) {
    let _ = writeln!(std::io::stderr(), "{line}"); // a closed stderr does not fail the test
}

/// Returns true for a software Vulkan driver, which must match the CPU bit for bit.
pub fn bit_exact(device: &Device) -> bool {
    device.info.exact && device.info.is_software()
}

/// A deviation of one driver whose cause is known.
#[derive(Clone, Copy, Debug)]
pub struct KnownDifference {
    /// Part of the adapter's name or driver.
    pub adapter: &'static str,
    /// The name of a shared function, `denormal numbers` for all functions, `picture` or `first hits`.
    pub check: &'static str,
    pub reason: &'static str,
    /// Maximum fraction of results that may differ.
    pub max_fraction: f64,
}

pub const KNOWN_DIFFERENCES: &[KnownDifference] = &[
    swiftshader("denormal numbers", "denormal numbers are treated as zero", 0.0096),
    swiftshader("grid_sample", ROUNDED_TWICE, 0.0014),
    swiftshader("rotated_grid_sample", ROUNDED_TWICE, 0.0014),
    swiftshader("jittered_sample", ROUNDED_TWICE, 0.0065),
    swiftshader("sample_square", ROUNDED_TWICE, 0.0009),
    swiftshader("filter_offset", ROUNDED_TWICE, 0.012),
];

/// The driver rounds twice when it converts these integers to floats. Indices in scenes are below 2^31, so
/// images are not affected.
pub const ROUNDED_TWICE: &str = "unsigned integers of 2^31 or more are rounded twice";

const fn swiftshader(check: &'static str, reason: &'static str, max_fraction: f64) -> KnownDifference {
    KnownDifference {
        adapter: "SwiftShader",
        check,
        reason,
        max_fraction,
    }
}

/// Returns the table entry for a check on a device.
pub fn allowed<'a>(
    entries: &'a [KnownDifference],
    name: &str,
    driver: &str,
    check: &str,
) -> Option<&'a KnownDifference> {
    entries
        .iter()
        .find(|entry| entry.check == check && (name.contains(entry.adapter) || driver.contains(entry.adapter)))
}

/// Checks the fraction of differing results against the entry of known differences. Without an entry, no result may
/// differ. With an entry, some results must differ: otherwise the entry is obsolete, which is an error.
pub fn judge(entry: Option<&KnownDifference>, check: &str, fraction: f64) -> Result<(), String> {
    match entry {
        None if fraction == 0.0 => Ok(()),
        None => Err(format!("{check}: {:.4} % of the results differ", fraction * 100.0)),
        Some(entry) if fraction == 0.0 => Err(format!(
            "{check}: no result differs any more; remove the entry: {}",
            entry.reason
        )),
        Some(entry) if fraction > entry.max_fraction => Err(format!(
            "{check}: {:.4} % of the results differ, more than this entry allows: {}",
            fraction * 100.0,
            entry.reason
        )),
        Some(_) => Ok(()),
    }
}

#[test]
fn outdated_or_exceeded_known_differences_fail() {
    let entries = [KnownDifference {
        adapter: "Some GPU",
        check: "dot",
        reason: "division by an approximation",
        max_fraction: 0.1,
    }];
    let entry = allowed(&entries, "Some GPU 9000", "driver 1", "dot");
    assert!(entry.is_some());
    assert!(judge(entry, "dot", 0.05).is_ok());
    assert!(judge(entry, "dot", 0.0).is_err(), "an outdated entry is accepted");
    assert!(
        judge(entry, "dot", 0.2).is_err(),
        "more differences than listed are accepted"
    );
    for (name, driver, check) in [("Some GPU", "driver 1", "cross"), ("Other", "driver 1", "dot")] {
        let entry = allowed(&entries, name, driver, check);
        assert!(entry.is_none());
        assert!(judge(entry, check, 1e-6).is_err(), "an unlisted difference is accepted");
        assert!(judge(entry, check, 0.0).is_ok());
    }
}

/// If the query of the driver properties failed, float controls would look unsupported.
#[test]
fn float_controls_of_software_vulkan_are_queried() {
    let Some(device) = device().filter(|device| bit_exact(device)) else {
        return;
    };
    let controls = device.info.float_controls;
    if device.info.name.contains("llvmpipe") {
        assert!(controls.rounding && !controls.signed_zeros, "{controls:?}");
    } else if device.info.name.contains("SwiftShader") {
        assert!(controls.signed_zeros, "{controls:?}");
    }
}
