// Detection of truncated loops. Mesa 22.3's lavapipe ends every loop of an invocation after its first iteration once
// all loops together have run 65,535 iterations, without an error. A final loop, whose length the compiler cannot
// predict, detects this truncation. The host repeats a truncated dispatch with fewer samples.

struct Completion {
    groups_done: atomic<u32>, // number of workgroups that ended
    truncated: atomic<u32>,   // 1 if a loop of any pixel was truncated
}

// Reports the end of a pixel, after all loops of a kernel. `index` is the index of the pixel in its workgroup. The
// first invocation reports for the whole workgroup, since an atomic addition per pixel takes 3 % of the render time on
// lavapipe.
fn report_completion(index: u32) {
    var rounds = 0u;
    for (var i = params.loop_probe.x; i < params.loop_probe.y; i++) {
        rounds++;
    }
    if rounds != params.loop_probe.y - params.loop_probe.x {
        atomicStore(&completion.truncated, 1u);
    }
    if index == 0u {
        atomicAdd(&completion.groups_done, 1u);
    }
}
