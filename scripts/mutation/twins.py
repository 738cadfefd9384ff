#!/usr/bin/env python3
"""Applies the mutations of twins.toml, one at a time, and checks that the tests detect them.

The comparisons of GPU and CPU must detect a mutation of only the shader, and a mutation of only the Rust twin. They must
not detect a mutation of both twins; otherwise the two mutations are not equivalent. The tests against known results must
detect the mutation of both twins. All mutations of twins are compiled into one binary, in which an environment variable selects one
mutation; mutated shaders are read from a folder. Only the mutated kernels are therefore compiled again.

    scripts/mutation/twins.py                     all mutations (ten minutes on two cores)
    scripts/mutation/twins.py --only ray,shadow   the mutations of some files
    scripts/mutation/twins.py --list              lists the mutations and checks that their expressions exist; runs no test

The exit code is 1 if a mutation is not detected.
"""

import argparse
import concurrent.futures
import os
import re
import shutil
import sys
import tomllib

from project import AGREEMENT, KNOWN_RESULTS, LOOP, ROOT, WITHOUT_GPU, WORK, Tests, copy


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


def locate(text, expression, file):
    """Returns the span of the first occurrence of an expression outside of tests and comments, with any white space."""
    words = [re.escape(word) for word in expression.split()]
    body = text.split("#[cfg(test)]")[0]
    body = re.sub(r"//[^\n]*", lambda comment: " " * len(comment[0]), body)
    found = re.search(r"\s+".join(words), body)
    if not found:
        raise SystemExit(f"scripts/mutation/twins.toml: '{expression}' is not in {file}")
    return found.span()


def make_twins(all_mutations, folder):
    """Writes a copy of the project, with the twins' mutations. The number in WGRAY_MUTANT selects a mutation."""
    copy(folder)
    for file in sorted({m.file for m in all_mutations}):
        path = folder / f"crates/trace/src/cpu/{file}.rs"
        text = path.read_text()
        in_file = [m for m in all_mutations if m.file == file]
        spans = sorted(((locate(text, m.rust[0], path), m) for m in in_file), key=lambda s: s[0], reverse=True)
        for ((start, end), m), (next_span, _) in zip(spans, [((len(text), 0), None)] + spans):
            assert end <= next_span[0], f"{path}: two mutations overlap at '{m.rust[0]}'"
            original = text[start:end]
            text = f"{text[:start]}(if crate::mutant({m.number}) {{ {m.rust[1]} }} else {{ {original} }}){text[end:]}"
        path.write_text(text)


def run_tests(tests, m):
    """Returns four results, each the first test that detects the mutation, or None. The comparisons of GPU and CPU run with
    the mutation in WGSL only, in Rust only, and in both; the tests against known results run with the mutation in both."""
    shaders = WORK / f"shaders-{m.number}"
    shutil.rmtree(shaders, ignore_errors=True)
    shutil.copytree(tests.folder / "shaders", shaders)
    path = shaders / f"{m.file}.wgsl"
    text = path.read_text()
    start, end = locate(text, m.wgsl[0], path)
    path.write_text(text[:start] + m.wgsl[1] + text[end:])
    wgsl, rust = {"WGRAY_TEST_SHADERS": str(shaders)}, {"WGRAY_MUTANT": str(m.number)}
    found = (
        tests.first_failing(AGREEMENT, **wgsl),
        tests.first_failing(AGREEMENT, **rust),
        tests.first_failing(AGREEMENT[:1], **wgsl, **rust),
        tests.first_failing(KNOWN_RESULTS, **WITHOUT_GPU, **rust),
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
        locate((ROOT / f"shaders/{m.file}.wgsl").read_text(), m.wgsl[0], f"shaders/{m.file}.wgsl")
        locate((ROOT / f"crates/trace/src/cpu/{m.file}.rs").read_text(), m.rust[0], f"crates/trace/src/cpu/{m.file}.rs")
    if arguments.list:
        print("\n".join(map(str, all_mutations)))
        return 0
    twins = WORK / "project"
    make_twins(all_mutations, twins)
    tests = Tests(twins)
    chosen = [m for m in all_mutations if not arguments.only or m.file in arguments.only.split(",")]
    survivors = {"in one language": [], "in both languages": []}
    with concurrent.futures.ThreadPoolExecutor(os.cpu_count()) as pool:
        for m, (by_wgsl, by_rust, twin_difference, by_both) in zip(chosen, pool.map(lambda m: run_tests(tests, m), chosen)):
            print(f"{m}\n    detected in WGSL by {by_wgsl}; in Rust by {by_rust}; in both by {by_both}", flush=True)
            if twin_difference and twin_difference != LOOP:
                raise SystemExit(f"{m}\n  the mutations in WGSL and in Rust are not equivalent: {twin_difference}")
            if not (by_wgsl and by_rust):
                survivors["in one language"].append(m)
            if not by_both:
                survivors["in both languages"].append(m)
    for kind, undetected in survivors.items():
        print(f"\n{kind}: {len(chosen) - len(undetected)} of {len(chosen)} detected")
        for m in undetected:
            print(f"  {m}")
    return 1 if any(survivors.values()) else 0


if __name__ == "__main__":
    sys.exit(main())
