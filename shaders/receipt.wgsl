// What the host is told of a call, so that no picture is cut short without a word. Some drivers end every loop of an
// invocation once all its loops together have gone round so many times, and say nothing (Mesa 22.3's software Vulkan:
// 65,535 rounds). From then on each further loop ends after its first round. So a last loop tells, if no compiler can know
// how long it is. The host repeats a call that was cut short, with fewer samples.

struct Receipt {
    ended: atomic<u32>,    // workgroups that came to their end
    cut: atomic<u32>,      // 1 where a loop of any pixel was cut short
}

// Signs for a pixel. It must come after all loops. `index` is the pixel's in its workgroup: the first signs for all of
// them, since an atomic addition for each pixel costs 3 % of a render on software Vulkan.
fn sign(index: u32) {
    var rounds = 0u;
    for (var i = work.proof.x; i < work.proof.y; i++) {
        rounds++;
    }
    if rounds != work.proof.y - work.proof.x {
        atomicStore(&receipt.cut, 1u);
    }
    if index == 0u {
        atomicAdd(&receipt.ended, 1u);
    }
}
