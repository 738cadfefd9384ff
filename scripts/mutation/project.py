"""Shared code of the two mutation runs: a copy of the project with switchable mutations, and the tests of the copy."""

import json
import os
import re
import shutil
import subprocess
import time
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent.parent
TARGET = Path(os.environ.get("CARGO_TARGET_DIR", ROOT / "target")).resolve()
WORK = TARGET / "mutants"

SWITCH = """
/// Returns true if the mutation with this number is active.
#[doc(hidden)]
pub fn mutant(number: u32) -> bool {
    static ACTIVE: std::sync::LazyLock<u32> =
        std::sync::LazyLock::new(|| std::env::var("WGRAY_MUTANT").map_or(0, |n| n.parse().expect("a number")));
    *ACTIVE == number
}
"""

# Comparisons of GPU and CPU, fastest first.
AGREEMENT = [
    ["main", "probes::functions_give_the_same_bits"],
    ["main", "render::pictures_of_all_scenes", "render::first_hits_of_all_scenes", "textures::agreement"],
    ["main", "random_scenes::random_scenes_are_the_same"],
]
# Tests against known results, on the CPU only. The comparisons of GPU and CPU extend these tests to the GPU.
KNOWN_RESULTS = [
    ["lib", "cpu::"],
    ["main", "textures::", "against_oracle::", "radiance::", "culling::", "--skip", "is_found", "--skip", "textures::agreement"],
    ["main", "bounds::", "analytic::", "statistics::", "robust::", "--skip", "is_found"],
    ["main", "sampling::", "--skip", "is_found"],
    ["main", "path::", "lens::", "panorama::", "--skip", "is_found"],
    ["main", "meshes::", "--skip", "is_found", "--skip", "meshes::bad_input", "--skip", "meshes::readers"],
]
# The remaining tests: the command line, and the division of a render into dispatches.
REST = [["main", "render::", "cli::", "sampling::"], ["lib"]]
LOOP = "an infinite loop"
WITHOUT_GPU = {"WGRAY_TEST_WITHOUT_GPU": "1"}


def copy(folder):
    """Copies the project, and adds the function that selects a mutation."""
    shutil.rmtree(folder, ignore_errors=True)
    folder.mkdir(parents=True)
    for name in ["Cargo.toml", "Cargo.lock", "rustfmt.toml", "src", "crates", "shaders", "scenes", "tests", "examples", "benches", "docs", "README.md"]:
        if (ROOT / name).is_dir():
            shutil.copytree(ROOT / name, folder / name)
        else:
            shutil.copy2(ROOT / name, folder / name)
    lib = folder / "crates/trace/src/lib.rs"
    lib.write_text(lib.read_text() + SWITCH)


def cargo(folder, *arguments):
    """Runs cargo in a copy. Returns the exit code and the messages of cargo."""
    environment = os.environ | {"CARGO_TARGET_DIR": str(WORK / "build"), "RUSTFLAGS": "--cap-lints=allow"}
    run = subprocess.run(
        ["cargo", *arguments, "--message-format=json"], cwd=folder, env=environment, stdout=subprocess.PIPE, text=True
    )
    return run.returncode, [json.loads(line) for line in run.stdout.splitlines() if line.startswith("{")]


def build(folder):
    """Builds the test binaries of a copy: `lib` from crates/trace, and `main` from tests/main.rs."""
    code, messages = cargo(folder, "test", "--release", "--no-run", "-p", "wgray", "-p", "wgray-trace", "--lib", "--test", "main")
    if code != 0:
        raise SystemExit("the copy of the project does not compile")
    binaries = {}
    for message in messages:
        if message.get("executable") and message.get("profile", {}).get("test"):
            name = {"wgray_trace": "lib"}.get(message["target"]["name"], message["target"]["name"])
            # cargo uses the same path for the binaries of all copies.
            binaries[name] = shutil.copy2(message["executable"], folder / f"tests-{name}")
    return binaries


class Tests:
    """The test binaries of a copy, and the time of each stage without a mutation."""

    def __init__(self, folder):
        self.folder, self.binaries, self.seconds = folder, build(folder), {}
        for name, stages, environment in [("agreement", AGREEMENT, {}), ("known results", KNOWN_RESULTS, WITHOUT_GPU), ("rest", REST, {})]:
            for stage in stages:
                begin = time.monotonic()
                failed = self.first_failing([stage], **environment)
                if failed:
                    raise SystemExit(f"without a mutation, a test of the group '{name}' fails: {failed}")
                self.seconds[str(stage)] = time.monotonic() - begin

    def first_failing(self, stages, **environment):
        """Returns the name of the first failing test of the stages, or None. A stage that takes five times as long as
        without a mutation counts as failed, because the mutation has probably caused an infinite loop."""
        for stage in stages:
            binary, *filters = stage
            timeout = 5 * self.seconds[str(stage)] + 5 if str(stage) in self.seconds else None
            try:
                run = subprocess.run(
                    [self.binaries[binary], "--quiet", *filters], cwd=self.folder, env=os.environ | environment,
                    stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, timeout=timeout, errors="replace",
                )
            except subprocess.TimeoutExpired:
                return LOOP
            if run.returncode != 0:
                failed = re.findall(r"^---- (\S+) stdout", run.stdout, re.M)
                return failed[0] if failed else f"exit code {run.returncode}"
            if not re.search(r"[1-9]\d* passed", run.stdout):
                raise SystemExit(f"no test matches {' or '.join(filters)}")
        return None
