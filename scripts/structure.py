#!/usr/bin/env python3
"""How the source is built: import circles, and a table of what makes code long or hard to read.

usage: scripts/structure.py            the table, longest functions, unexplained numbers by folder, circles
       scripts/structure.py --check    fails if files of a crate import each other in a circle, or if a file of src/filter
                                       imports one that stands later in the flow (what `make test` runs)
       scripts/structure.py --root DIR of another checkout

Files are nodes; a path in a `use`, or in the code, is an arrow to the file that defines what it names. A face (a `mod.rs` or `lib.rs`
that defines nothing and only hands names on) is looked through. Tests are left out.
"""
import argparse
import re
import sys
from collections import defaultdict
from pathlib import Path

CRATES = {"biscale": "src", "biscale_capture": "capture/src", "biscale_fabricate": "fabricate/src", "biscale_fit": "fit/src", "biscale_cli": "cli/src"}
# The order in which data flows through src/filter, as its head lists it: a file imports only from those before it. `mod` is the face.
FILTER_FLOW = (
    "tolerance plan value control quality query subset facet_sampler lobes sums estimate importance prepared common_random_numbers "
    "visible_facets probes direct reference low_rank spherical_gaussians auto effective kernel_tests"
).split()

ITEM = re.compile(r"\b(?:fn|struct|enum|trait|type|const|static|union|macro_rules!)\s+([A-Za-z_]\w*)")


def without_comments(text):
    """Comments and the contents of strings are blanked; line breaks stay."""
    out, i, n = [], 0, len(text)
    while i < n:
        two = text[i : i + 2]
        if two == "//":
            end = text.find("\n", i)
            i = n if end < 0 else end
        elif two == "/*":
            depth, j = 1, i + 2
            while j < n and depth:
                if text[j : j + 2] == "/*":
                    depth, j = depth + 1, j + 2
                elif text[j : j + 2] == "*/":
                    depth, j = depth - 1, j + 2
                else:
                    j += 1
            out.append("\n" * text.count("\n", i, j))
            i = j
        elif text[i] == '"' or (text[i] in "rb" and re.match(r'b?r#*"', text[i:]) and not (i and (text[i - 1].isalnum() or text[i - 1] == "_"))):
            raw = re.match(r'b?r(#*)"', text[i:])
            if raw:
                close = '"' + raw.group(1)
                j = text.find(close, i + raw.end())
                j = n if j < 0 else j + len(close)
            else:
                j = i + 1
                while j < n and text[j] != '"':
                    j += 2 if text[j] == "\\" else 1
                j += 1
            out.append('""' + "\n" * text.count("\n", i, j))
            i = j
        elif text[i] == "'" and (m := re.match(r"'(?:\\u\{[^}]*\}|\\x..|\\.|[^\\'])'", text[i:])):
            out.append("' '")
            i += m.end()
        else:
            out.append(text[i])
            i += 1
    return "".join(out)


def matching(text, at):
    """Place behind the brace that closes the one at `at`."""
    depth = 0
    for j in range(at, len(text)):
        if text[j] == "{":
            depth += 1
        elif text[j] == "}":
            depth -= 1
            if depth == 0:
                return j + 1
    return len(text)


def without_tests(text):
    """Blanks `#[cfg(test)]` items."""
    while m := re.search(r"#\[cfg\(test\)\]", text):
        brace, semi = text.find("{", m.end()), text.find(";", m.end())
        end = semi + 1 if semi >= 0 and (brace < 0 or semi < brace) else matching(text, brace) if brace >= 0 else len(text)
        text = text[: m.start()] + "\n" * text.count("\n", m.start(), end) + text[end:]
    return text


def split_top(text):
    parts, depth, last = [], 0, 0
    for i, c in enumerate(text):
        depth += (c == "{") - (c == "}")
        if c == "," and depth == 0:
            parts.append(text[last:i])
            last = i + 1
    return parts + [text[last:]]


def leaves(tree, prefix=()):
    """Paths of a use tree, as (path, name it gets here)."""
    tree = tree.strip()
    if (brace := tree.find("{")) >= 0:
        head = [p for p in tree[:brace].split("::") if p.strip()]
        for part in split_top(tree[brace + 1 : tree.rindex("}")]):
            if part.strip():
                yield from leaves(part, prefix + tuple(p.strip() for p in head))
        return
    name = None
    if m := re.match(r"(.*)\bas\s+(\w+)$", tree, re.S):
        tree, name = m.group(1).strip(), m.group(2)
    path = prefix + tuple(p.strip() for p in tree.split("::") if p.strip())
    if path and path[-1] == "self":
        path = path[:-1]
    if path:
        yield path, name or path[-1]


class Module:
    def __init__(self, crate, path, file):
        self.crate, self.path, self.file = crate, path, file
        self.raw = file.read_text()
        self.code = without_tests(without_comments(self.raw))
        self.children, self.uses, self.items = {}, [], set()
        for m in re.finditer(r"^\s*(pub(?:\([^)]*\))?\s+)?use\s+([^;]+);", self.code, re.M):
            self.uses.extend((path, name, bool(m.group(1))) for path, name in leaves(m.group(2)))
        depth = 0
        for line in self.code.split("\n"):
            if depth == 0:
                self.items.update(ITEM.findall(line))
            depth += line.count("{") - line.count("}")
        self.body = re.sub(r"^\s*(?:pub(?:\([^)]*\))?\s+)?use\s+[^;]+;", lambda m: "\n" * m.group(0).count("\n"), self.code, flags=re.M)

    def is_face(self):
        return self.file.name in ("mod.rs", "lib.rs") and not self.items


def read(root):
    modules = {}

    def load(crate, path, file, folder):
        module = Module(crate, path, file)
        modules[(crate,) + path] = module
        for m in re.finditer(r'^\s*(?:#\[path\s*=\s*""\]\s*)?(?:pub(?:\([^)]*\))?\s+)?mod\s+(\w+)\s*;', module.code, re.M):
            name = m.group(1)
            for candidate, sub in ((folder / f"{name}.rs", folder / name), (folder / name / "mod.rs", folder / name)):
                if candidate.exists():
                    module.children[name] = path + (name,)
                    load(crate, path + (name,), candidate, sub)
                    break

    for crate, folder in CRATES.items():
        base = root / folder
        top = next((base / f for f in ("lib.rs", "main.rs") if (base / f).exists()), None)
        if top:
            load(crate, (), top, base)
    return modules


def resolve(modules, crate, here, path, depth=0):
    """Files that a path leads to, from the module `here` of `crate`."""
    if depth > 8 or not path:
        return set()
    first, rest = path[0], path[1:]
    if first == "crate":
        at = ()
    elif first == "self":
        at = here
    elif first == "super":
        at, rest = here[:-1], path[1:]
        while rest and rest[0] == "super":
            at, rest = at[:-1], rest[1:]
    elif first in CRATES:
        if first == crate and here == ():
            pass
        crate, at = first, ()
    else:
        module = modules[(crate,) + here]
        if first in module.children:
            at = module.children[first]
        else:
            for use, name, _ in module.uses:
                if name == first and use != path:
                    return resolve(modules, crate, here, use + rest, depth + 1)
            return set()
    while rest and rest[0] in modules[(crate,) + at].children:
        at, rest = modules[(crate,) + at].children[rest[0]], rest[1:]
    module = modules[(crate,) + at]
    if rest and rest[0] == "*":
        rest = ()
    if rest and rest[0] not in module.items:
        for use, name, public in module.uses:
            if (name == rest[0] or name == "*") and use[0] != "*":
                found = resolve(modules, crate, at, (use[:-1] + (rest[0],)) if name == "*" else use, depth + 1)
                if found:
                    return found
    return {module}


def arrows(modules):
    found = defaultdict(lambda: defaultdict(set))
    path_in_code = re.compile(r"(?<![\w:])((?:crate|super|self|[a-z_]\w*)(?:::\w+)+)")
    for (crate, *here), module in modules.items():
        here = tuple(here)
        paths = [use for use, _, _ in module.uses] + [tuple(m.group(1).split("::")) for m in path_in_code.finditer(module.body)]
        if module.is_face():
            continue
        for path in paths:
            for target in resolve(modules, crate, here, path):
                if target is not module and not target.is_face():
                    found[module.file][target.file].add(path[-1])
    return found


def circles(found):
    """Strongly connected components of more than one file (Tarjan)."""
    index, low, stack, on, out, counter = {}, {}, [], set(), [], [0]

    def visit(v):
        index[v] = low[v] = counter[0]
        counter[0] += 1
        stack.append(v)
        on.add(v)
        for w in found.get(v, ()):
            if w not in index:
                visit(w)
                low[v] = min(low[v], low[w])
            elif w in on:
                low[v] = min(low[v], index[w])
        if low[v] == index[v]:
            component = []
            while True:
                w = stack.pop()
                on.discard(w)
                component.append(w)
                if w == v:
                    break
            if len(component) > 1:
                out.append(sorted(component))

    sys.setrecursionlimit(10000)
    for v in list(found):
        if v not in index:
            visit(v)
    return sorted(out)


def functions(module):
    for m in re.finditer(r"\bfn\s+(\w+)", module.code):
        brace, semi = module.code.find("{", m.end()), module.code.find(";", m.end())
        if brace < 0 or 0 <= semi < brace and "[" not in module.code[m.end() : semi]:
            continue
        yield module.code.count("\n", m.start(), matching(module.code, brace)) + 1, m.group(1)


# Numbers that need no word: small counts and halves, powers of ten as unit factors, degrees of a turn.
PLAIN = {0, 1, 2, 3, 4, 0.5, 8, 10, 60, 64, 90, 100, 180, 255, 256, 360, 1000, 1e6, 1e-3, 1e3, 0.25}
NUMBER = re.compile(r"(?<![\w.])(\d[\d_]*(?:\.[\d_]+)?(?:e[+-]?\d+)?)(?:_?[iuf]\d+|_?usize)?(?![\w.])")


def unexplained(module):
    """Numbers in the code that are no documented constant or field default."""
    count, lines = 0, module.code.split("\n")
    raw = module.raw.split("\n")
    inside_params, inside_const, depth = 0, False, 0
    for k, line in enumerate(lines):
        if re.search(r"impl\s+Default\s+for", line) or inside_params:
            inside_params += line.count("{") - line.count("}")
            continue
        if inside_const or re.search(r"\b(?:const|static)\s+\w+\s*:", line):
            # A named value may take several lines: to the semicolon outside of all brackets.
            depth += sum(line.count(c) for c in "([{") - sum(line.count(c) for c in ")]}")
            inside_const = not (depth <= 0 and line.rstrip().endswith(";"))
            depth = depth if inside_const else 0
            continue
        if "#[" in line or "assert" in line:
            continue
        for m in NUMBER.finditer(line):
            try:
                value = float(m.group(1).replace("_", ""))
            except ValueError:
                continue
            if value not in PLAIN and not re.search(r"//", raw[k]):
                count += 1
    return count


def waivers(module):
    return len(re.findall(r"#!?\[(?:allow|expect|cfg_attr\(test, (?:allow|expect))\(", module.code))


def duplicates(modules, length=6):
    """Runs of `length` equal lines of code that stand in two places; overlapping runs count once."""
    seen, count = defaultdict(list), 0
    for module in modules:
        code = [(k, line.strip()) for k, line in enumerate(module.code.split("\n"))]
        code = [(k, l) for k, l in code if len(l) > 3 and not l.startswith(("use ", "#["))]
        for i in range(len(code) - length + 1):
            seen["\n".join(l for _, l in code[i : i + length])].append((module.file, i))
    pairs = set()
    for places in seen.values():
        if len(places) > 1:
            for a in places:
                for b in places:
                    if a < b:
                        pairs.add((a[0], b[0], a[1] - b[1]))
    return len(pairs)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--check", action="store_true")
    parser.add_argument("--root", default=Path(__file__).resolve().parent.parent, type=Path)
    options = parser.parse_args()
    modules = read(options.root)
    found = arrows(modules)
    rings = circles(found)
    short = lambda file: str(file.relative_to(options.root))
    bad = 0
    for ring in rings:
        bad += 1
        print("circle: " + ", ".join(map(short, ring)))
        for a in ring:
            for b in ring:
                if names := found[a].get(b):
                    print(f"    {short(a)} -> {short(b)}: {', '.join(sorted(names))}")
    if FILTER_FLOW:
        base = options.root / "src/filter"
        place = {}
        for module in modules.values():
            if module.file.is_relative_to(base):
                parts = module.file.relative_to(base).parts
                name = parts[0].removesuffix(".rs")
                if name != "mod" and name not in FILTER_FLOW:
                    print(f"{short(module.file)} has no place in the order of the flow: add it to FILTER_FLOW")
                    bad += 1
                elif name != "mod":
                    place[module.file] = FILTER_FLOW.index(name)
        for a, targets in found.items():
            for b in targets:
                if a in place and b in place and place[b] > place[a]:
                    print(f"back arrow: {short(a)} -> {short(b)}: {', '.join(sorted(targets[b]))}")
                    bad += 1
    if options.check:
        if bad:
            sys.exit(f"{bad} faults of structure: move what both files need into a third one that stands before them")
        print(f"no import circle among {len(modules)} files")
        return
    all_modules = list(modules.values())
    print(f"{'crate':20} {'files':>6} {'lines':>7} {'longest function':>40} {'over 60':>8} {'waivers':>8} {'numbers':>8} {'repeats':>8}")
    for crate in list(CRATES) + ["all"]:
        own = [m for m in all_modules if crate in ("all", m.crate)]
        longest = sorted(((n, name, short(m.file)) for m in own for n, name in functions(m)), reverse=True)
        print(
            f"{crate:20} {len(own):6} {sum(m.raw.count(chr(10)) for m in own):7} {longest[0][0]:4} {longest[0][2] + ':' + longest[0][1]:>40}"
            f" {sum(n > 60 for n, *_ in longest):8} {sum(map(waivers, own)):8} {sum(map(unexplained, own)):8} {duplicates(own):8}"
        )
    for folder in ("fit/src", "capture/src/weave", "src/filter"):
        numbers = sorted(((unexplained(m), short(m.file)) for m in all_modules if short(m.file).startswith(folder + "/")), reverse=True)
        print(f"numbers without a name in {folder}: {sum(n for n, _ in numbers)}: " + ", ".join(f"{f} {n}" for n, f in numbers[:6] if n))
    print(f"{len(rings)} circles")


if __name__ == "__main__":
    main()
