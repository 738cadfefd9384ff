#!/usr/bin/env python3
"""Tests all mutations that cargo-mutants generates for crates/trace/src/cpu, one at a time.

cargo-mutants would compile the project once per mutation, two thousand times. This script uses cargo-mutants only to
list the mutations. It compiles all mutations into one binary, in which an environment variable selects one mutation.
Mutations that do not compile are skipped, as in cargo-mutants.

    scripts/mutation/operators.py                     all mutations (about an hour on two cores)
    scripts/mutation/operators.py --only ray,shadow   the mutations of some files
    scripts/mutation/operators.py --sample 10         every tenth mutation
    scripts/mutation/operators.py --again LOG         the mutations that survived a run with the output LOG

Needs cargo-mutants (`cargo install cargo-mutants`) and the Python packages tree-sitter and tree-sitter-rust. The exit
code is 1 if the tests detect fewer than 95 % of the mutations, if survivors.toml does not explain a survivor, or if an
explained mutation does not survive.
"""

import argparse
import concurrent.futures
import json
import os
import re
import subprocess
import sys
import time
import tomllib
from collections import defaultdict

import tree_sitter
import tree_sitter_rust

from project import AGREEMENT, KNOWN_RESULTS, REST, ROOT, WITHOUT_GPU, WORK, Tests, cargo, copy

PROBES, IMAGES = AGREEMENT[:1], AGREEMENT[1:]
# Minimum fraction of the mutations that the tests must detect.
MIN_DETECTED = 0.95
REASONS = ROOT / "scripts/mutation/survivors.toml"


class Mutation:
    def __init__(self, number, entry, text):
        self.number, self.file, self.genre = number, entry["file"], entry["genre"]
        self.name = entry["name"]
        self.function = (entry["function"] or {}).get("function_name", "")
        self.replacement = entry["replacement"]
        start, end = entry["span"]["start"], entry["span"]["end"]
        lines = text.split("\n")
        offset = lambda point: len("\n".join(lines[: point["line"] - 1] + [lines[point["line"] - 1][: point["column"] - 1]]).encode())
        self.start, self.end = offset(start), offset(end)
        line = lines[start["line"] - 1]
        self.line = line.strip()
        if self.genre == "BinaryOperator":
            found = re.search(r"replace (\S+) with (\S+)", self.name)
            self.change = f"{found[1]} to {found[2]}"
        else:
            self.change = re.sub(r"^\S+ ", "", self.name)
        # A key that does not depend on other lines: the function, the text of the line and the column in this text.
        self.key = f"{self.function}: {self.line} | {self.change} @{start['column'] - (len(line) - len(line.lstrip()))}"

    def switch(self, mutated, original):
        """Returns a switch between the mutated and the original expression, with markers that locate compile errors."""
        return f"if crate::mutant({self.number}) {{ /*<{self.number}*/ {mutated} /*{self.number}>*/ }} else {{ {original} }}"


def all_mutations():
    out = subprocess.run(
        ["cargo", "mutants", "--list", "--json", "--file", "crates/trace/src/cpu/**/*.rs"], cwd=ROOT, stdout=subprocess.PIPE, check=True
    ).stdout
    text = {path: (ROOT / path).read_text() for path in {entry["file"] for entry in json.loads(out)}}
    return [Mutation(number, entry, text[entry["file"]]) for number, entry in enumerate(json.loads(out), 1)]


class Writer:
    """Rewrites a file with its mutations behind the switch."""

    def __init__(self, source, mutations):
        self.source, self.by_start = source, defaultdict(list)
        for m in mutations:
            self.by_start[m.start].append(m)
        self.written = set()

    def text(self, node):
        """Returns the text of a node with rewritten children."""
        out, end = "", node.start_byte
        for child in node.children:
            out += self.source[end : child.start_byte].decode() + self.write(child)
            end = child.end_byte
        return out + self.source[end : node.end_byte].decode()

    def mutations(self, genre, start):
        found = [m for m in self.by_start[start] if m.genre == genre]
        self.written.update(m.number for m in found)
        return found

    def write(self, node):
        field = node.child_by_field_name
        if node.type in ("binary_expression", "compound_assignment_expr"):
            operator = field("operator")
            found = self.mutations("BinaryOperator", operator.start_byte)
            if found:
                return self.operation(node, operator.text.decode(), found)
        if node.type == "unary_expression":
            found = self.mutations("UnaryOperator", node.start_byte)
            if found:
                operator, operand = node.children
                original = f"{operator.text.decode()} a_"
                return f"({{ let a_ = {self.write(operand)}; {found[0].switch('a_', original)} }})"
        if node.type == "match_arm":
            found = self.mutations("MatchArm", node.start_byte)
            if found:
                pattern, value = field("pattern"), field("value")
                rest = self.source[value.end_byte : node.end_byte].decode()
                return f"{pattern.text.decode()} if !crate::mutant({found[0].number}) => {self.write(value)}{rest}"
        if node.type == "field_initializer":
            found = self.mutations("StructField", node.start_byte)
            if found:
                base = next(n for n in node.parent.children if n.type == "base_field_initializer").text.decode().lstrip(".")
                name, value = field("field").text.decode(), self.write(field("value"))
                return f"{name}: " + found[0].switch(f"({base}).{name}", value)
        if node.type == "block" and node.parent.type == "function_item":
            inner = [child for child in node.children if child.is_named]
            found = self.mutations("FnValue", inner[0].start_byte) if inner else []
            first = "".join(
                f"if crate::mutant({m.number}) {{ /*<{m.number}*/ return {m.replacement}; /*{m.number}>*/ }}\n" for m in found
            )
            return "{ " + first + self.text(node)[1:]
        return self.text(node)

    def operation(self, node, operator, found):
        left, right = self.write(node.child_by_field_name("left")), self.write(node.child_by_field_name("right"))
        if operator in ("&&", "||"):
            parts, a, b = f"let (a_, b_) = ({left}, || {right});", "a_", "b_()"
        elif node.type == "compound_assignment_expr":
            parts, a, b = f"let b_ = {right};", left, "b_"
        else:
            parts, a, b = f"let (a_, b_) = ({left}, {right});", "a_", "b_"
        text = f"{a} {operator} {b}"
        for m in found:
            text = m.switch(f"{a} {m.replacement} {b}", text)
        return f"({{ {parts} {text} }})"


def write_mutations(mutations, folder):
    """Writes all mutations into a copy of the project."""
    parser = tree_sitter.Parser(tree_sitter.Language(tree_sitter_rust.language()))
    missed = []
    for file in {m.file for m in mutations}:
        source = (ROOT / file).read_bytes()
        in_file = [m for m in mutations if m.file == file]
        writer = Writer(source, in_file)
        (folder / file).write_text(writer.write(parser.parse(source).root_node))
        missed += [m for m in in_file if m.number not in writer.written]
    if missed:
        raise SystemExit("cannot locate these mutations:\n" + "\n".join(m.name for m in missed))


def unviable(messages, folder):
    """Returns the numbers of the mutations with compile errors."""
    numbers = set()
    for message in messages:
        diagnostic = message.get("message") or {}
        if message.get("reason") != "compiler-message" or diagnostic.get("level") != "error":
            continue
        culprits = set()
        for span in diagnostic["spans"]:
            text = (folder / span["file_name"]).read_bytes()[: span["byte_start"]].decode()
            opened = re.findall(r"/\*<(\d+)\*/", text)
            closed = set(re.findall(r"/\*(\d+)>\*/", text))
            culprits.update(int(n) for n in opened if n not in closed)
        if not culprits and diagnostic["spans"]:
            raise SystemExit(f"compile error outside of the mutations:\n{diagnostic['rendered']}")
        numbers |= culprits
    return numbers


def probed():
    """Returns the names of the functions that tests/probes.rs tests."""
    text = (ROOT / "tests/probes.rs").read_text()
    probes = text[text.index("probes! {\n") :]
    return set(re.findall(r"^    (\w+)\(", probes[: probes.index("\n}")], re.M))


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--only", help="file names without .rs, separated by commas")
    parser.add_argument("--sample", type=int, default=1, metavar="N", help="test only every N-th mutation")
    parser.add_argument("--again", type=argparse.FileType(), metavar="LOG", help="test only the survivors listed in LOG")
    arguments = parser.parse_args()
    mutations = all_mutations()
    chosen = [m for m in mutations if not arguments.only or m.file.split("cpu/")[-1][:-3] in arguments.only.split(",")][:: arguments.sample]
    if arguments.again:
        names = {line.removeprefix("survives: ").strip() for line in arguments.again if line.startswith("survives: ")}
        chosen = [m for m in chosen if m.name in names]
    folder = WORK / "operators"
    copy(folder)
    uncompilable = []
    while True:
        write_mutations(chosen, folder)
        code, messages = cargo(folder, "check", "--release", "--lib")
        if code == 0:
            break
        numbers = unviable(messages, folder)
        uncompilable += [m for m in chosen if m.number in numbers]
        chosen = [m for m in chosen if m.number not in numbers]
    print(f"{len(chosen)} mutations; {len(uncompilable)} more do not compile", flush=True)
    tests, functions = Tests(folder), probed()

    def failing_test(m):
        mutant = {"WGRAY_MUTANT": str(m.number)}
        if m.function in functions:
            test = tests.first_failing(PROBES, WGRAY_TEST_FUNCTION=m.function, **mutant)
            if test:
                return test
        return tests.first_failing(KNOWN_RESULTS, **WITHOUT_GPU, **mutant) or tests.first_failing(IMAGES + REST, **mutant)

    begin = time.monotonic()
    survivors, detected_by = [], defaultdict(int)
    with concurrent.futures.ThreadPoolExecutor(os.cpu_count()) as pool:
        for done, (m, test) in enumerate(zip(chosen, pool.map(failing_test, chosen)), 1):
            detected_by[test] += 1
            if not test:
                survivors.append(m)
                print(f"survives: {m.name}\n    {m.key}", flush=True)
            if done % 100 == 0:
                print(f"{done} of {len(chosen)}, {time.monotonic() - begin:.0f} s, {len(survivors)} survive", flush=True)
    reasons = tomllib.loads(REASONS.read_text()) if REASONS.exists() else {}
    unexplained = [m for m in survivors if m.key not in reasons]
    killed = {m.key for m in chosen} - {m.key for m in survivors}
    stale = [key for key in reasons if key in killed or key not in {m.key for m in mutations}]
    detected_fraction = 1 - len(survivors) / len(chosen)
    print(f"\n{len(chosen) - len(survivors)} of {len(chosen)} detected ({detected_fraction:.1%}). Mutations by detecting test:")
    for test, number in sorted(detected_by.items(), key=lambda item: -item[1]):
        print(f"  {number:5} {test or 'no test'}")
    for m in unexplained:
        print(f"survives without an explanation: {m.name}\n    {m.key}")
    for key in stale:
        print(f"does not survive, but is listed in survivors.toml: {key}")
    return 0 if detected_fraction >= MIN_DETECTED and not unexplained and not stale else 1


if __name__ == "__main__":
    sys.exit(main())
