//! Resource limits of a glTF file, relative to its size. Without limits, a small file could request unbounded time or
//! memory by referring to the same bytes repeatedly.

use std::sync::atomic::{AtomicU64, Ordering};

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Resource {
    /// Number of bytes that accessors read.
    Read,
    /// Number of triangles of all meshes, counted for each combination of skin and weights.
    Triangles,
    Instances,
    /// Size of decompressed buffer views in bytes.
    Decompressed,
}

impl Resource {
    fn name(self) -> &'static str {
        match self {
            Resource::Read => "bytes of accessors, counted once per read",
            Resource::Triangles => "triangles",
            Resource::Instances => "instances of meshes",
            Resource::Decompressed => "bytes of decompressed buffer views",
        }
    }

    /// Returns the base allowance, the additional allowance per byte of the file (as a fraction), and the maximum.
    fn rates(self) -> (u64, (u64, u64), u64) {
        match self {
            Resource::Read => (1 << 30, (16, 1), u64::MAX),
            // A triangle of a triangle list has at least three bytes of indices.
            Resource::Triangles => (1 << 22, (1, 3), 1 << 28),
            // An instance uses more than 1 KiB of memory.
            Resource::Instances => (1 << 16, (1, 4), super::MAX_INSTANCES as u64),
            // Meshes usually compress by less than 20:1, zeros by up to 1000:1.
            Resource::Decompressed => (256 << 20, (64, 1), 4 << 30),
        }
    }
}

#[derive(Debug)]
pub(super) struct Budget {
    /// Total size of the JSON and of the referenced buffers.
    bytes: u64,
    /// Charged amount of each [`Resource`].
    used: [AtomicU64; 4],
}

impl Budget {
    pub fn of(bytes: u64) -> Budget {
        Budget {
            bytes,
            used: Default::default(),
        }
    }

    pub fn limit(&self, resource: Resource) -> u64 {
        let (base, (numerator, denominator), max) = resource.rates();
        base.saturating_add(self.bytes.saturating_mul(numerator) / denominator)
            .min(max)
    }

    /// Charges `count` to the budget; the error is the violated rule.
    pub fn take(&self, resource: Resource, count: u64) -> Result<(), String> {
        let limit = self.limit(resource);
        let used = &self.used[resource as usize];
        // A rejected charge does not change the counter, so the counter cannot overflow.
        let result = used.fetch_update(Ordering::Relaxed, Ordering::Relaxed, |used| {
            used.checked_add(count).filter(|sum| *sum <= limit)
        });
        let rule = |_| {
            format!(
                "a file of {} bytes must have at most {limit} {}",
                self.bytes,
                resource.name()
            )
        };
        result.map(drop).map_err(rule)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn requests_beyond_the_limit_are_rejected_and_not_charged() {
        let budget = Budget::of(300);
        let limit = (1 << 22) + 100;
        assert_eq!(budget.limit(Resource::Triangles), limit);
        budget.take(Resource::Triangles, limit - 1).unwrap();
        let rule = "a file of 300 bytes must have at most 4194404 triangles";
        for count in [2, u64::MAX] {
            assert_eq!(budget.take(Resource::Triangles, count).unwrap_err(), rule);
        }
        budget.take(Resource::Triangles, 1).unwrap();
        budget.take(Resource::Triangles, 0).unwrap();
        assert!(budget.take(Resource::Triangles, 1).is_err());
        budget.take(Resource::Instances, 65_536 + 75).unwrap();
        assert!(budget.take(Resource::Instances, 1).is_err());
    }

    #[test]
    fn limits_grow_with_the_file_up_to_a_maximum() {
        assert_eq!(Budget::of(u64::MAX).limit(Resource::Read), u64::MAX);
        assert_eq!(Budget::of(u64::MAX).limit(Resource::Instances), 1 << 20);
        // Ten million triangles with three 32-bit indices each.
        assert!(Budget::of(120 << 20).limit(Resource::Triangles) >= 10_000_000);
    }
}
