//! Resource limits of a glTF file, relative to its size. Small files could request unbounded time or memory by
//! referring to the same bytes repeatedly.

use std::sync::atomic::{AtomicU64, Ordering};

/// A limited resource.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Thing {
    /// Bytes of accessor reads.
    Read,
    /// Triangles of all meshes, per combination of skin and weights.
    Triangles,
    /// Instances of meshes.
    Instances,
    /// Bytes of decompressed buffer views.
    Decompressed,
}

impl Thing {
    fn name(self) -> &'static str {
        match self {
            Thing::Read => "bytes of accessors, counted as often as they are read",
            Thing::Triangles => "triangles",
            Thing::Instances => "instances of meshes",
            Thing::Decompressed => "bytes of compressed views, once they are decoded",
        }
    }

    /// Returns the base allowance, the additional fraction of the file size, and the maximum.
    fn rates(self) -> (u64, (u64, u64), u64) {
        match self {
            Thing::Read => (1 << 30, (16, 1), u64::MAX),
            // A triangle has at least three bytes of indices, except in a shared mesh.
            Thing::Triangles => (1 << 22, (1, 3), 1 << 28),
            // An instance takes more than 1 KiB in a scene.
            Thing::Instances => (1 << 16, (1, 4), super::MOST_INSTANCES as u64),
            // Real meshes compress by less than 20:1, zeros by up to 1000:1.
            Thing::Decompressed => (256 << 20, (64, 1), 4 << 30),
        }
    }
}

/// Resources used by a file.
#[derive(Debug)]
pub(super) struct Budget {
    /// Size of the JSON and of the referenced buffers.
    bytes: u64,
    taken: [AtomicU64; 4],
}

impl Budget {
    pub fn of(bytes: u64) -> Budget {
        Budget {
            bytes,
            taken: Default::default(),
        }
    }

    /// Returns the limit.
    pub fn most(&self, thing: Thing) -> u64 {
        let (any, (more, of), most) = thing.rates();
        any.saturating_add(self.bytes.saturating_mul(more) / of).min(most)
    }

    /// Charges `count`; the error is the rule.
    pub fn take(&self, thing: Thing, count: u64) -> Result<(), String> {
        let most = self.most(thing);
        let taken = &self.taken[thing as usize];
        // Rejected requests are not counted, so they cannot overflow the counter.
        let taking = taken.fetch_update(Ordering::Relaxed, Ordering::Relaxed, |taken| {
            taken.checked_add(count).filter(|all| *all <= most)
        });
        let told = |_| {
            format!(
                "a file of {} bytes must have at most {most} {}",
                self.bytes,
                thing.name()
            )
        };
        taking.map(drop).map_err(told)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_over_the_limit_is_told_and_not_taken() {
        let budget = Budget::of(300);
        let most = (1 << 22) + 100;
        assert_eq!(budget.most(Thing::Triangles), most);
        budget.take(Thing::Triangles, most - 1).unwrap();
        let rule = "a file of 300 bytes must have at most 4194404 triangles";
        for count in [2, u64::MAX] {
            assert_eq!(budget.take(Thing::Triangles, count).unwrap_err(), rule);
        }
        budget.take(Thing::Triangles, 1).unwrap();
        budget.take(Thing::Triangles, 0).unwrap();
        assert!(budget.take(Thing::Triangles, 1).is_err());
        budget.take(Thing::Instances, 65_536 + 75).unwrap();
        assert!(budget.take(Thing::Instances, 1).is_err());
    }

    #[test]
    fn large_files_may_have_more_up_to_an_end() {
        assert_eq!(Budget::of(u64::MAX).most(Thing::Read), u64::MAX);
        assert_eq!(Budget::of(u64::MAX).most(Thing::Instances), 1 << 20);
        // Ten million triangles with three 32-bit indices each.
        assert!(Budget::of(120 << 20).most(Thing::Triangles) >= 10_000_000);
    }
}
