//! A Vulkan driver that injects faults and otherwise forwards to another driver. It can lose its device, refuse to open
//! one, run out of memory, or be slow. The tests compile it separately, as a library for the Vulkan loader.
//!
//! Environment variables control the driver. Submits and allocations of all devices of a process are numbered from 1:
//!
//! | variable | meaning |
//! | --- | --- |
//! | `FAULTS_DRIVER` | path of the library of the driver to forward to |
//! | `FAULTS_ITSELF` | path of this library, which stays loaded to keep its counters |
//! | `FAULTS_GPU` | if 1, the driver's device is a discrete GPU, so that `--device auto` selects it for any scene |
//! | `FAULTS_LOG` | path of a file to which a line per event is appended |
//! | `FAULTS_LOSE` | numbers of submits that lose the device, such as `2,7`; `every:N`: the N-th submit of each device |
//! | `FAULTS_LOSE_IN` | function that first returns `VK_ERROR_DEVICE_LOST`: `submit`, `status` (fence, semaphore), `wait` |
//! | `FAULTS_REFUSE` | number of device creations that fail after each loss |
//! | `FAULTS_REFUSE_FIRST` | number of device creations that fail at the start |
//! | `FAULTS_REFUSE_WITH` | error code of these failures, by default `VK_ERROR_INITIALIZATION_FAILED` |
//! | `FAULTS_IDLE` | return code of the wait-idle functions of a lost device, by default `VK_ERROR_DEVICE_LOST` |
//! | `FAULTS_LARGEST` | maximum size in bytes of an allocation; larger allocations fail |
//! | `FAULTS_NO_MEMORY_FROM` | number of the first allocation that fails; all later allocations fail, too |
//! | `FAULTS_NO_MEMORY_IN` | number of a submit that fails because memory is exhausted |
//! | `FAULTS_SLEEP` | `N:MS`: the N-th submit first sleeps for MS milliseconds |

use std::ffi::{CStr, CString, c_char, c_int, c_void};
use std::io::Write;
use std::ptr::null_mut;
use std::str::FromStr;
use std::sync::atomic::{AtomicBool, AtomicI64, AtomicPtr, AtomicU64, Ordering::SeqCst};
use std::time::Duration;

type Handle = *mut c_void;
type Code = i32;
type Function = *mut c_void;
type GetProcAddr = unsafe extern "system" fn(Handle, *const c_char) -> Function;

const SUCCESS: Code = 0;
const OUT_OF_DEVICE_MEMORY: Code = -2;
const INITIALIZATION_FAILED: Code = -3;
const DEVICE_LOST: Code = -4;

unsafe extern "C" {
    fn dlopen(name: *const c_char, flags: c_int) -> *mut c_void;
    fn dlsym(library: *mut c_void, name: *const c_char) -> *mut c_void;
}
const RTLD_NOW: c_int = 2;
const RTLD_NODELETE: c_int = 0x1000;

static SUBMITS: AtomicU64 = AtomicU64::new(0);
static SUBMITS_OF_DEVICE: AtomicU64 = AtomicU64::new(0);
static ALLOCATIONS: AtomicU64 = AtomicU64::new(0);
/// True after a function has returned `VK_ERROR_DEVICE_LOST`; all later calls return it, too.
static LOST: AtomicBool = AtomicBool::new(false);
/// True from the submit that loses the device until the function in `FAULTS_LOSE_IN` returns the loss.
static LOSS_PENDING: AtomicBool = AtomicBool::new(false);
/// Number of device creations that will fail; negative before the first device creation.
static TO_REFUSE: AtomicI64 = AtomicI64::new(-1);

fn variable<T: FromStr>(name: &str) -> Option<T> {
    std::env::var(name).ok()?.parse().ok()
}

fn log(line: &str) {
    let Ok(path) = std::env::var("FAULTS_LOG") else { return };
    let file = std::fs::OpenOptions::new().append(true).create(true).open(path);
    let _ = file.and_then(|mut file| writeln!(file, "{line}"));
}

fn driver_function(name: &CStr) -> *mut c_void {
    let path = std::env::var("FAULTS_DRIVER").expect("FAULTS_DRIVER names a driver");
    let path = CString::new(path).expect("a path");
    let library = unsafe { dlopen(path.as_ptr(), RTLD_NOW) };
    assert!(!library.is_null(), "{path:?} cannot be loaded");
    unsafe { dlsym(library, name.as_ptr()) }
}

#[unsafe(no_mangle)]
pub unsafe extern "system" fn vk_icdNegotiateLoaderICDInterfaceVersion(version: *mut u32) -> Code {
    let this_library = std::env::var("FAULTS_ITSELF").expect("FAULTS_ITSELF names this library");
    let this_library = CString::new(this_library).expect("a path");
    let library = unsafe { dlopen(this_library.as_ptr(), RTLD_NOW | RTLD_NODELETE) };
    assert!(!library.is_null(), "{this_library:?} cannot be loaded");
    let real = driver_function(c"vk_icdNegotiateLoaderICDInterfaceVersion");
    let real: unsafe extern "system" fn(*mut u32) -> Code = unsafe { std::mem::transmute(real) };
    unsafe { real(version) }
}

#[unsafe(no_mangle)]
pub unsafe extern "system" fn vk_icdGetPhysicalDeviceProcAddr(instance: Handle, name: *const c_char) -> Function {
    let real = driver_function(c"vk_icdGetPhysicalDeviceProcAddr");
    let real: GetProcAddr = unsafe { std::mem::transmute(real) };
    unsafe { replaced(name, real(instance, name)) }
}

#[unsafe(no_mangle)]
pub unsafe extern "system" fn vk_icdGetInstanceProcAddr(instance: Handle, name: *const c_char) -> Function {
    let real = driver_function(c"vk_icdGetInstanceProcAddr");
    let real: GetProcAddr = unsafe { std::mem::transmute(real) };
    unsafe { replaced(name, real(instance, name)) }
}

/// Declares replacements of driver functions. Each line lists the names of the function, the static that stores the
/// driver's function, the replacement and its type.
macro_rules! replacements {
    ($($name:literal $($alias:literal)* => $original:ident, $function:ident: fn($($ty:ty),*) -> $result:ty;)*) => {
        $(static $original: AtomicPtr<c_void> = AtomicPtr::new(null_mut());)*

        /// Returns the replacement of the function `name`, or `real` if the function has no replacement.
        unsafe fn replaced(name: *const c_char, real: Function) -> Function {
            if real.is_null() {
                return real;
            }
            match unsafe { CStr::from_ptr(name) }.to_bytes() {
                $($name $(| $alias)* => {
                    $original.store(real, SeqCst);
                    let function: unsafe extern "system" fn($($ty),*) -> $result = $function;
                    function as Function
                })*
                _ => real,
            }
        }

        mod real {
            use super::*;
            $(pub unsafe fn $function() -> unsafe extern "system" fn($($ty),*) -> $result {
                unsafe { std::mem::transmute($original.load(SeqCst)) }
            })*
        }
    };
}

replacements! {
    b"vkGetDeviceProcAddr" => GET_DEVICE_PROC_ADDR, get_device_proc_addr: fn(Handle, *const c_char) -> Function;
    b"vkGetPhysicalDeviceProperties" => PROPERTIES, get_properties: fn(Handle, *mut Properties) -> ();
    b"vkGetPhysicalDeviceProperties2" b"vkGetPhysicalDeviceProperties2KHR" =>
        PROPERTIES_2, get_properties_2: fn(Handle, *mut Properties2) -> ();
    b"vkCreateDevice" => CREATE_DEVICE, create_device: fn(Handle, Handle, Handle, *mut Handle) -> Code;
    b"vkAllocateMemory" => ALLOCATE_MEMORY, allocate_memory: fn(Handle, *const Allocation, Handle, Handle) -> Code;
    b"vkQueueSubmit" => QUEUE_SUBMIT, queue_submit: fn(Handle, u32, Handle, u64) -> Code;
    b"vkQueueSubmit2" b"vkQueueSubmit2KHR" => QUEUE_SUBMIT_2, queue_submit_2: fn(Handle, u32, Handle, u64) -> Code;
    b"vkQueueWaitIdle" => QUEUE_WAIT_IDLE, queue_wait_idle: fn(Handle) -> Code;
    b"vkDeviceWaitIdle" => DEVICE_WAIT_IDLE, device_wait_idle: fn(Handle) -> Code;
    b"vkWaitForFences" => WAIT_FOR_FENCES, wait_for_fences: fn(Handle, u32, Handle, u32, u64) -> Code;
    b"vkWaitSemaphores" b"vkWaitSemaphoresKHR" => WAIT_SEMAPHORES, wait_semaphores: fn(Handle, Handle, u64) -> Code;
    b"vkGetFenceStatus" => GET_FENCE_STATUS, get_fence_status: fn(Handle, u64) -> Code;
    b"vkGetSemaphoreCounterValue" b"vkGetSemaphoreCounterValueKHR" =>
        GET_COUNTER, get_counter: fn(Handle, u64, *mut u64) -> Code;
}

/// `VkMemoryAllocateInfo`.
#[repr(C)]
struct Allocation {
    kind: i32,
    next: *const c_void,
    size: u64,
    memory_type: u32,
}

/// The start of `VkPhysicalDeviceProperties`.
#[repr(C)]
struct Properties {
    api_version: u32,
    driver_version: u32,
    vendor: u32,
    device: u32,
    device_type: u32,
}

/// The start of `VkPhysicalDeviceProperties2`.
#[repr(C)]
struct Properties2 {
    kind: i32,
    next: *mut c_void,
    properties: Properties,
}

fn set_device_type(properties: &mut Properties) {
    const DISCRETE_GPU: u32 = 2;
    if std::env::var_os("FAULTS_GPU").is_some_and(|value| value == "1") {
        properties.device_type = DISCRETE_GPU;
    }
}

unsafe extern "system" fn get_properties(physical: Handle, properties: *mut Properties) {
    unsafe {
        real::get_properties()(physical, properties);
        set_device_type(&mut *properties);
    }
}

unsafe extern "system" fn get_properties_2(physical: Handle, properties: *mut Properties2) {
    unsafe {
        real::get_properties_2()(physical, properties);
        set_device_type(&mut (*properties).properties);
    }
}

unsafe extern "system" fn get_device_proc_addr(device: Handle, name: *const c_char) -> Function {
    unsafe { replaced(name, real::get_device_proc_addr()(device, name)) }
}

unsafe extern "system" fn create_device(physical: Handle, info: Handle, host: Handle, device: *mut Handle) -> Code {
    if TO_REFUSE.load(SeqCst) < 0 {
        TO_REFUSE.store(variable("FAULTS_REFUSE_FIRST").unwrap_or(0), SeqCst);
    }
    if TO_REFUSE.load(SeqCst) > 0 {
        TO_REFUSE.fetch_sub(1, SeqCst);
        log("device refused");
        return variable("FAULTS_REFUSE_WITH").unwrap_or(INITIALIZATION_FAILED);
    }
    let code = unsafe { real::create_device()(physical, info, host, device) };
    if code == SUCCESS {
        log("device");
        SUBMITS_OF_DEVICE.store(0, SeqCst);
        LOST.store(false, SeqCst);
        LOSS_PENDING.store(false, SeqCst);
    }
    code
}

unsafe extern "system" fn allocate_memory(device: Handle, info: *const Allocation, host: Handle, out: Handle) -> Code {
    let number = 1 + ALLOCATIONS.fetch_add(1, SeqCst);
    let size = unsafe { (*info).size };
    let is_too_large = variable("FAULTS_LARGEST").is_some_and(|max_size: u64| size > max_size);
    let is_memory_exhausted = variable("FAULTS_NO_MEMORY_FROM").is_some_and(|first: u64| number >= first);
    if is_too_large || is_memory_exhausted {
        log(&format!("allocation {number} of {size} refused"));
        return OUT_OF_DEVICE_MEMORY;
    }
    log(&format!("allocation {number} of {size}"));
    unsafe { real::allocate_memory()(device, info, host, out) }
}

/// Returns true if a submit loses the device. `process_submit` is its number among the submits of the process,
/// `device_submit` among those of its device.
fn loses(process_submit: u64, device_submit: u64) -> bool {
    let Ok(spec) = std::env::var("FAULTS_LOSE") else {
        return false;
    };
    match spec.strip_prefix("every:") {
        Some(number) => number.parse() == Ok(device_submit),
        None => spec.split(',').any(|number| number.parse() == Ok(process_submit)),
    }
}

/// Marks the device as lost; `function` is the first to return the error.
fn lose(function: &str) -> Code {
    log(&format!("lost in {function}"));
    LOST.store(true, SeqCst);
    LOSS_PENDING.store(false, SeqCst);
    TO_REFUSE.store(variable("FAULTS_REFUSE").unwrap_or(0), SeqCst);
    DEVICE_LOST
}

/// Returns true if a loss is pending and `function` is the first to return it.
fn is_first_to_return_loss(function: &str) -> bool {
    LOSS_PENDING.load(SeqCst) && std::env::var("FAULTS_LOSE_IN").is_ok_and(|first| first == function)
}

unsafe fn submit(queue: Handle, forward: impl FnOnce() -> Code) -> Code {
    if LOST.load(SeqCst) {
        return DEVICE_LOST;
    }
    let process_submit = 1 + SUBMITS.fetch_add(1, SeqCst);
    let device_submit = 1 + SUBMITS_OF_DEVICE.fetch_add(1, SeqCst);
    log(&format!("submit {process_submit}"));
    if let Some((number, milliseconds)) = std::env::var("FAULTS_SLEEP")
        .ok()
        .as_deref()
        .and_then(|s| s.split_once(':'))
        && number.parse() == Ok(process_submit)
    {
        log("sleep");
        std::thread::sleep(Duration::from_millis(milliseconds.parse().unwrap_or(0)));
    }
    if variable("FAULTS_NO_MEMORY_IN") == Some(process_submit) {
        log("out of memory in a submit");
        return OUT_OF_DEVICE_MEMORY;
    }
    if !loses(process_submit, device_submit) {
        return forward();
    }
    // The wrapped driver finishes all dispatches first, because wgpu then releases their objects.
    let loses_later = std::env::var("FAULTS_LOSE_IN").is_ok_and(|first| first != "submit");
    let code = if loses_later { forward() } else { SUCCESS };
    unsafe { real::queue_wait_idle()(queue) };
    if !loses_later {
        return lose("submit");
    }
    LOSS_PENDING.store(true, SeqCst);
    code
}

unsafe extern "system" fn queue_submit(queue: Handle, count: u32, submits: Handle, fence: u64) -> Code {
    unsafe { submit(queue, || real::queue_submit()(queue, count, submits, fence)) }
}

unsafe extern "system" fn queue_submit_2(queue: Handle, count: u32, submits: Handle, fence: u64) -> Code {
    unsafe { submit(queue, || real::queue_submit_2()(queue, count, submits, fence)) }
}

/// Returns `VK_ERROR_DEVICE_LOST` if the device is lost; otherwise forwards the call.
fn forward_unless_lost(function: &str, forward: impl FnOnce() -> Code) -> Code {
    if LOST.load(SeqCst) {
        return DEVICE_LOST;
    }
    if is_first_to_return_loss(function) {
        lose(function)
    } else {
        forward()
    }
}

fn forward_unless_idle_fails(forward: impl FnOnce() -> Code) -> Code {
    if !LOST.load(SeqCst) {
        return forward();
    }
    log("idle");
    variable("FAULTS_IDLE").unwrap_or(DEVICE_LOST)
}

unsafe extern "system" fn queue_wait_idle(queue: Handle) -> Code {
    forward_unless_idle_fails(|| unsafe { real::queue_wait_idle()(queue) })
}

unsafe extern "system" fn device_wait_idle(device: Handle) -> Code {
    forward_unless_idle_fails(|| unsafe { real::device_wait_idle()(device) })
}

unsafe extern "system" fn wait_for_fences(device: Handle, count: u32, fences: Handle, all: u32, time: u64) -> Code {
    forward_unless_lost("wait", || unsafe {
        real::wait_for_fences()(device, count, fences, all, time)
    })
}

unsafe extern "system" fn wait_semaphores(device: Handle, info: Handle, time: u64) -> Code {
    forward_unless_lost("wait", || unsafe { real::wait_semaphores()(device, info, time) })
}

unsafe extern "system" fn get_fence_status(device: Handle, fence: u64) -> Code {
    forward_unless_lost("status", || unsafe { real::get_fence_status()(device, fence) })
}

unsafe extern "system" fn get_counter(device: Handle, semaphore: u64, value: *mut u64) -> Code {
    forward_unless_lost("status", || unsafe { real::get_counter()(device, semaphore, value) })
}
