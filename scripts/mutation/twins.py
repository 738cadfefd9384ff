#!/usr/bin/env python3
"""Makes the mistakes of twins.toml, one at a time, and asks whether the tests find them.

Each is made in four ways: in the shader alone and in its twin alone, which the comparisons of GPU and CPU must find; in
both, which these must not find (else the two mistakes are not the same); and in both again for the tests that know right
answers, which must find it.  All twins' mistakes are built at once, behind a switch that an environment variable sets;
shaders are read from a folder.  So nothing is compiled for a mutation but its kernels.

    scripts/mutation/twins.py                     all of them (ten minutes on two cores)
    scripts/mutation/twins.py --only ray,shadow   those of some files
    scripts/mutation/twins.py --list              which there are, and whether each place is found once; runs nothing

Exit code 1 if one is not found, in either way.
"""

import argparse
import concurrent.futures
import os
import re
import shutil
import sys
import tomllib

from project import AGREEMENT, ANSWERS, LOOP, ROOT, WITHOUT_GPU, WORK, Tests, copy


class Mutation:
    def __init__(self, number, file, entry):
        self.number, self.file = number, file
        self.wgsl = entry.get("wgsl") or entry["both"]
        self.rust = entry.get("rust") or entry["both"]

    def __str__(self):
        return f"{self.number:3} {self.file}.wgsl: {self.wgsl[0]}  ->  {self.wgsl[1]}"


def mutations():
    tables = tomllib.loads((ROOT / "scripts/mutation/twins.toml").read_text())
    entries = [(file, entry) for file, list_ in tables.items() for entry in list_]
    return [Mutation(number, file, entry) for number, (file, entry) in enumerate(entries, 1)]


def place(text, expression, where):
    """Where an expression is, whatever the white space; the first time, outside of tests and comments."""
    words = [re.escape(word) for word in expression.split()]
    body = text.split("#[cfg(test)]")[0]
    body = re.sub(r"//[^\n]*", lambda comment: " " * len(comment[0]), body)
    found = re.search(r"\s+".join(words), body)
    if not found:
        raise SystemExit(f"scripts/mutation/twins.toml: {where} has no '{expression}' any more")
    return found.span()


def make_twins(all_mutations, folder):
    """A copy of the project whose twins make the mistake of the number in WGRAY_MUTANT."""
    copy(folder)
    for file in sorted({m.file for m in all_mutations}):
        path = folder / f"crates/render/src/cpu/{file}.rs"
        text = path.read_text()
        of_file = [m for m in all_mutations if m.file == file]
        places = sorted(((place(text, m.rust[0], path), m) for m in of_file), key=lambda p: p[0], reverse=True)
        for ((start, end), m), (later, _) in zip(places, [((len(text), 0), None)] + places):
            assert end <= later[0], f"{path}: two mutations overlap at '{m.rust[0]}'"
            here = text[start:end]
            text = f"{text[:start]}(if crate::mutant({m.number}) {{ {m.rust[1]} }} else {{ {here} }}){text[end:]}"
        path.write_text(text)


def try_out(tests, m):
    """Which tests find it: in WGSL alone, in Rust alone; whether the two differ; in both."""
    shaders = WORK / f"shaders-{m.number}"
    shutil.rmtree(shaders, ignore_errors=True)
    shutil.copytree(tests.folder / "shaders", shaders)
    path = shaders / f"{m.file}.wgsl"
    text = path.read_text()
    start, end = place(text, m.wgsl[0], path)
    path.write_text(text[:start] + m.wgsl[1] + text[end:])
    wgsl, rust = {"WGRAY_TEST_SHADERS": str(shaders)}, {"WGRAY_MUTANT": str(m.number)}
    found = (
        tests.first_failing(AGREEMENT, **wgsl),
        tests.first_failing(AGREEMENT, **rust),
        tests.first_failing(AGREEMENT[:1], **wgsl, **rust),
        tests.first_failing(ANSWERS, **WITHOUT_GPU, **rust),
    )
    shutil.rmtree(shaders)
    return found


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--only", help="names of files, without .wgsl, separated by commas")
    parser.add_argument("--list", action="store_true")
    arguments = parser.parse_args()
    all_mutations = mutations()
    for m in all_mutations:
        place((ROOT / f"shaders/{m.file}.wgsl").read_text(), m.wgsl[0], f"shaders/{m.file}.wgsl")
        place((ROOT / f"crates/render/src/cpu/{m.file}.rs").read_text(), m.rust[0], f"crates/render/src/cpu/{m.file}.rs")
    if arguments.list:
        print("\n".join(map(str, all_mutations)))
        return 0
    twins = WORK / "project"
    make_twins(all_mutations, twins)
    tests = Tests(twins)
    chosen = [m for m in all_mutations if not arguments.only or m.file in arguments.only.split(",")]
    survivors = {"apart": [], "together": []}
    with concurrent.futures.ThreadPoolExecutor(os.cpu_count()) as pool:
        for m, (by_wgsl, by_rust, differ, together) in zip(chosen, pool.map(lambda m: try_out(tests, m), chosen)):
            print(f"{m}\n    WGSL alone: {by_wgsl}; Rust alone: {by_rust}; together: {together}", flush=True)
            if differ and differ != LOOP:
                raise SystemExit(f"{m}\n  the mistakes in WGSL and in Rust are not the same: {differ}")
            if not (by_wgsl and by_rust):
                survivors["apart"].append(m)
            if not together:
                survivors["together"].append(m)
    for way, left in survivors.items():
        print(f"\n{way}: {len(chosen) - len(left)} of {len(chosen)} found")
        for m in left:
            print(f"  {m}")
    return 1 if any(survivors.values()) else 0


if __name__ == "__main__":
    sys.exit(main())
