//! Float controls: what a Vulkan device keeps to in 32-bit arithmetic, if its SPIR-V asks for that.

/// What a kernel asks of a device's 32-bit floats, or what a device can be asked for (Vulkan 1.2, "Float Controls").
/// Where it is not asked for, Vulkan leaves it to the driver.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct FloatControls {
    /// Results are rounded to the nearest number, and to the even one of two: `RoundingModeRTE`. Without it Vulkan
    /// allows either of the two numbers beside an exact result.
    pub rounding: bool,
    /// Signs of zeros, infinities and NaN are kept: `SignedZeroInfNanPreserve`. Without it a driver may take infinities
    /// and NaN to be absent, and one zero for the other.
    pub signed_zeros: bool,
    /// Denormal numbers are kept: `DenormPreserve`. Without it a driver may take zero for them.
    pub denormals: bool,
}

impl FloatControls {
    /// None of them.
    pub const NONE: FloatControls = FloatControls {
        rounding: false,
        signed_zeros: false,
        denormals: false,
    };
    /// All of them.
    pub const ALL: FloatControls = FloatControls {
        rounding: true,
        signed_zeros: true,
        denormals: true,
    };

    /// What an adapter can be asked for: nothing where it is not reached by Vulkan 1.2 or later.
    #[cfg(any(windows, target_os = "linux", target_os = "android", target_os = "freebsd"))]
    pub(super) fn of(adapter: &wgpu::Adapter) -> FloatControls {
        use ash::vk;

        // SAFETY: the adapter is only asked for its properties, and nothing of it is destroyed.
        let Some(vulkan) = (unsafe { adapter.as_hal::<wgpu::hal::api::Vulkan>() }) else {
            return FloatControls::NONE;
        };
        let instance = vulkan.shared_instance();
        let version = vulkan.physical_device_capabilities().properties().api_version;
        if version < vk::API_VERSION_1_2 || instance.instance_api_version() < vk::API_VERSION_1_1 {
            return FloatControls::NONE;
        }
        let mut found = vk::PhysicalDeviceFloatControlsProperties::default();
        let mut properties = vk::PhysicalDeviceProperties2::default().push_next(&mut found);
        // SAFETY: the instance has this function since Vulkan 1.1, and the device the structure since 1.2.
        unsafe {
            instance
                .raw_instance()
                .get_physical_device_properties2(vulkan.raw_physical_device(), &mut properties);
        }
        // Lavapipe of Mesa 22.3.6 makes finite numbers of infinities and NaN once it is asked to keep them, and keeps them
        // unasked.
        let lavapipe = vulkan
            .physical_device_capabilities()
            .is_driver(vk::DriverId::MESA_LLVMPIPE);
        // Without independence the widths of floats must all be asked for the same, and kernels ask for 32 bits alone.
        let alone = |independence| independence != vk::ShaderFloatControlsIndependence::NONE;
        FloatControls {
            rounding: found.shader_rounding_mode_rte_float32 == vk::TRUE && alone(found.rounding_mode_independence),
            signed_zeros: found.shader_signed_zero_inf_nan_preserve_float32 == vk::TRUE && !lavapipe,
            denormals: found.shader_denorm_preserve_float32 == vk::TRUE && alone(found.denorm_behavior_independence),
        }
    }

    /// What an adapter can be asked for: nothing, as there is no Vulkan.
    #[cfg(not(any(windows, target_os = "linux", target_os = "android", target_os = "freebsd")))]
    pub(super) fn of(_: &wgpu::Adapter) -> FloatControls {
        FloatControls::NONE
    }
}
