"""What both mutation runs share: a copy of the project that makes its mistakes behind a switch, and its tests."""

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
/// Whether the mistake of this number is made.
#[doc(hidden)]
pub fn mutant(number: u32) -> bool {
    static MADE: std::sync::LazyLock<u32> =
        std::sync::LazyLock::new(|| std::env::var("WGRAY_MUTANT").map_or(0, |n| n.parse().expect("a number")));
    *MADE == number
}
"""

# Comparisons of GPU and CPU, fast ones first.
AGREEMENT = [
    ["main", "probes::functions_give_the_same_bits"],
    ["main", "render::pictures_of_all_scenes", "render::first_hits_of_all_scenes", "textures::agreement"],
    ["main", "random_scenes::random_scenes_are_the_same"],
]
# What knows right answers, on the CPU alone: where both paths agree, it speaks for both.
ANSWERS = [
    ["lib", "cpu::"],
    ["main", "textures::", "against_oracle::", "radiance::", "culling::", "--skip", "is_found", "--skip", "textures::agreement"],
    ["main", "bounds::", "analytic::", "statistics::", "robust::", "--skip", "is_found"],
    ["main", "sampling::", "--skip", "is_found"],
    ["main", "path::", "lens::", "panorama::", "--skip", "is_found"],
    ["main", "meshes::", "--skip", "is_found", "--skip", "meshes::bad_input", "--skip", "meshes::readers"],
]
# What else there is, of the command line and of how work is cut.
REST = [["main", "render::", "cli::", "sampling::"], ["lib"]]
LOOP = "a loop without end"
WITHOUT_GPU = {"WGRAY_TEST_WITHOUT_GPU": "1"}


def copy(folder):
    """A copy of the project with the switch, in which mistakes can be made."""
    shutil.rmtree(folder, ignore_errors=True)
    folder.mkdir(parents=True)
    for name in ["Cargo.toml", "Cargo.lock", "rustfmt.toml", "src", "crates", "shaders", "scenes", "tests", "examples", "benches", "docs", "README.md"]:
        if (ROOT / name).is_dir():
            shutil.copytree(ROOT / name, folder / name)
        else:
            shutil.copy2(ROOT / name, folder / name)
    lib = folder / "crates/render/src/lib.rs"
    lib.write_text(lib.read_text() + SWITCH)


def cargo(folder, *arguments):
    """Runs cargo in a copy; returns its exit code and messages."""
    environment = os.environ | {"CARGO_TARGET_DIR": str(WORK / "build"), "RUSTFLAGS": "--cap-lints=allow"}
    run = subprocess.run(
        ["cargo", *arguments, "--message-format=json"], cwd=folder, env=environment, stdout=subprocess.PIPE, text=True
    )
    return run.returncode, [json.loads(line) for line in run.stdout.splitlines() if line.startswith("{")]


def build(folder):
    """The test binaries of a copy: that of crates/render, `lib`, and that of tests/main.rs, `main`."""
    code, messages = cargo(folder, "test", "--release", "--no-run", "-p", "wgray", "-p", "wgray-render", "--lib", "--test", "main")
    if code != 0:
        raise SystemExit("the copy of the project does not compile")
    binaries = {}
    for message in messages:
        if message.get("executable") and message.get("profile", {}).get("test"):
            name = {"wgray_render": "lib"}.get(message["target"]["name"], message["target"]["name"])
            # cargo gives all copies' binaries the same path
            binaries[name] = shutil.copy2(message["executable"], folder / f"tests-{name}")
    return binaries


class Tests:
    """The tests of a copy."""

    def __init__(self, folder):
        self.folder, self.binaries, self.seconds = folder, build(folder), {}
        for name, stages, environment in [("agreement", AGREEMENT, {}), ("answers", ANSWERS, WITHOUT_GPU), ("the rest", REST, {})]:
            for stage in stages:
                begin = time.monotonic()
                failed = self.first_failing([stage], **environment)
                if failed:
                    raise SystemExit(f"without any mistake, the tests of {name} fail: {failed}")
                self.seconds[str(stage)] = time.monotonic() - begin

    def first_failing(self, stages, **environment):
        """The name of the first test that fails, by stages in order; None if none does. What takes five times as long
        as without a mistake loops without end, and counts as failed."""
        for stage in stages:
            binary, *filters = stage
            patience = 5 * self.seconds[str(stage)] + 5 if str(stage) in self.seconds else None
            try:
                run = subprocess.run(
                    [self.binaries[binary], "--quiet", *filters], cwd=self.folder, env=os.environ | environment,
                    stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, timeout=patience, errors="replace",
                )
            except subprocess.TimeoutExpired:
                return LOOP
            if run.returncode != 0:
                failed = re.findall(r"^---- (\S+) stdout", run.stdout, re.M)
                return failed[0] if failed else f"exit code {run.returncode}"
            if not re.search(r"[1-9]\d* passed", run.stdout):
                raise SystemExit(f"no test is called {' or '.join(filters)}")
        return None
