//! How much a file may ask for, by its bytes: accessors can name the same bytes any number of times, or none, and so can meshes,
//! skins and channels. What no file needs that is not made to be much is refused, before it takes time or memory.

use std::sync::atomic::{AtomicU64, Ordering};

/// What there is a limit on.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Thing {
    /// Bytes of accessors as they are read, as often as they are.
    Read,
    /// Triangles of all meshes, those of a mesh with several skins or weights as often.
    Triangles,
    /// Instances of meshes.
    Instances,
    /// Bytes of views that are decompressed.
    Decompressed,
}

impl Thing {
    /// What messages call it.
    fn name(self) -> &'static str {
        match self {
            Thing::Read => "bytes of accessors, counted as often as they are read",
            Thing::Triangles => "triangles",
            Thing::Instances => "instances of meshes",
            Thing::Decompressed => "bytes of compressed views, once they are decoded",
        }
    }

    /// How many any file may have; how many more for so many of its bytes; and the most of any file.
    fn rates(self) -> (u64, (u64, u64), u64) {
        match self {
            Thing::Read => (1 << 30, (16, 1), u64::MAX),
            // A triangle has three bytes of indices at least, or is in a mesh that several share.
            Thing::Triangles => (1 << 22, (1, 3), 1 << 28),
            // Each takes more than a kilobyte in a scene.
            Thing::Instances => (1 << 16, (1, 4), super::MOST_INSTANCES as u64),
            // Of what real meshes are it is less than 20; of zeros it could be 1,000.
            Thing::Decompressed => (256 << 20, (64, 1), 4 << 30),
        }
    }
}

/// What a file has asked for by now.
#[derive(Debug)]
pub(super) struct Budget {
    /// The bytes of its JSON, and of its buffers that are used.
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

    /// The most that the file may have.
    pub fn most(&self, thing: Thing) -> u64 {
        let (any, (more, of), most) = thing.rates();
        any.saturating_add(self.bytes.saturating_mul(more) / of).min(most)
    }

    /// Takes so many. The error is the rule, where there would be more than the file may have.
    pub fn take(&self, thing: Thing, count: u64) -> Result<(), String> {
        let most = self.most(thing);
        let taken = &self.taken[thing as usize];
        // Where that is refused nothing is taken, so that many refusals do not go around to 0.
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
        // Others are counted by themselves.
        budget.take(Thing::Instances, 65_536 + 75).unwrap();
        assert!(budget.take(Thing::Instances, 1).is_err());
    }

    #[test]
    fn large_files_may_have_more_up_to_an_end() {
        assert_eq!(Budget::of(u64::MAX).most(Thing::Read), u64::MAX);
        assert_eq!(Budget::of(u64::MAX).most(Thing::Instances), 1 << 20);
        // Ten million triangles, each with three indices of 32 bits.
        assert!(Budget::of(120 << 20).most(Thing::Triangles) >= 10_000_000);
    }
}
