//! Vulkan float controls: guarantees for 32-bit arithmetic that SPIR-V can request.

/// Float controls that a kernel requests or a device supports (Vulkan 1.2, "Float Controls"). Without a request,
/// drivers differ.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct FloatControls {
    /// Rounding to nearest even: `RoundingModeRTE`. Else Vulkan allows either neighbor of the exact result.
    pub rounding: bool,
    /// Signed zeros, infinities and NaN: `SignedZeroInfNanPreserve`. Else a driver may assume that infinities and NaN
    /// do not occur, and ignore the sign of zero.
    pub signed_zeros: bool,
    /// Denormals: `DenormPreserve`. Else a driver may flush them to zero.
    pub denormals: bool,
}

impl FloatControls {
    /// No float controls.
    pub const NONE: FloatControls = FloatControls {
        rounding: false,
        signed_zeros: false,
        denormals: false,
    };
    /// All float controls.
    pub const ALL: FloatControls = FloatControls {
        rounding: true,
        signed_zeros: true,
        denormals: true,
    };

    /// Returns the float controls of an adapter. They require Vulkan 1.2.
    #[cfg(any(windows, target_os = "linux", target_os = "android", target_os = "freebsd"))]
    pub(super) fn of(adapter: &wgpu::Adapter) -> FloatControls {
        use ash::vk;

        // SAFETY: the properties of the adapter are queried; nothing is destroyed.
        let Some(vulkan) = (unsafe { adapter.as_hal::<wgpu::hal::api::Vulkan>() }) else {
            return FloatControls::NONE;
        };
        let instance = vulkan.shared_instance();
        let version = vulkan.physical_device_capabilities().properties().api_version;
        if version < vk::API_VERSION_1_2 || instance.instance_api_version() < vk::API_VERSION_1_1 {
            return FloatControls::NONE;
        }
        let mut supported = vk::PhysicalDeviceFloatControlsProperties::default();
        let mut properties = vk::PhysicalDeviceProperties2::default().push_next(&mut supported);
        // SAFETY: Vulkan 1.1 instances have this function, and Vulkan 1.2 devices support this structure.
        unsafe {
            instance
                .raw_instance()
                .get_physical_device_properties2(vulkan.raw_physical_device(), &mut properties);
        }
        // Lavapipe of Mesa 22.3.6 preserves infinities and NaN without a request, but converts them to finite numbers
        // if their preservation is requested.
        let lavapipe = vulkan
            .physical_device_capabilities()
            .is_driver(vk::DriverId::MESA_LLVMPIPE);
        // Without independence, all float widths need the same setting, but kernels only request it for 32 bits.
        let is_independent = |independence| independence != vk::ShaderFloatControlsIndependence::NONE;
        FloatControls {
            rounding: supported.shader_rounding_mode_rte_float32 == vk::TRUE
                && is_independent(supported.rounding_mode_independence),
            signed_zeros: supported.shader_signed_zero_inf_nan_preserve_float32 == vk::TRUE && !lavapipe,
            denormals: supported.shader_denorm_preserve_float32 == vk::TRUE
                && is_independent(supported.denorm_behavior_independence),
        }
    }

    #[cfg(not(any(windows, target_os = "linux", target_os = "android", target_os = "freebsd")))]
    pub(super) fn of(_: &wgpu::Adapter) -> FloatControls {
        FloatControls::NONE
    }
}
