#!/usr/bin/env bash
# Effective BRDF tables by biscale and by a Mitsuba 3 program, in turns on this machine: CPU seconds at equal noise.
#
# Sets up what it needs in target/peers: a Python environment with Mitsuba, and, on Debian-like systems, the LLVM that its vectorised
# variants compile with. For each case the other side runs first; its noise is the one that biscale has to reach.
#
# usage: scripts/compare_peers.sh [--quick] [CASE...]      cases: see scripts/peers/mitsuba_table.py
#        --quick: the other side with a sixteenth of its rays, to try the set-up
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."

say() { echo "compare: $*" >&2; }
fail() { say "$*"; exit 1; }

quick=()
if [[ ${1:-} == --quick ]]; then
    quick=(--quick)
    shift
fi
cases=("$@")
if [[ ${#cases[@]} -eq 0 ]]; then
    cases=(weave-diffuse weave-ggx-0.3 weave-ggx-0.05 bumpy-diffuse rods-diffuse vgroove-diffuse)
fi

# --- set-up --------------------------------------------------------------------------------------------------------------------

scripts/setup.sh
command -v python3 >/dev/null || fail "there is no python3; install it, with its module venv"
venv=target/peers/venv
if [[ ! -x $venv/bin/python ]]; then
    python3 -m venv "$venv" || fail "python3 -m venv failed; on Debian: apt-get install python3-venv"
fi
# The pinned versions that the figures of docs/performance.md were made with.
"$venv/bin/pip" install --quiet --disable-pip-version-check --requirement scripts/peers/requirements.txt

# Mitsuba compiles with LLVM, which it loads by itself where DRJIT_LIBLLVM_PATH says. LLVM 15 and older abort.
find_llvm() { ls /usr/lib/x86_64-linux-gnu/libLLVM-19.so* /usr/lib/x86_64-linux-gnu/libLLVM*.so.19* /usr/lib/llvm-19/lib/libLLVM*.so* 2>/dev/null | head -1; }
if [[ -z ${DRJIT_LIBLLVM_PATH:-} ]]; then
    DRJIT_LIBLLVM_PATH=$(find_llvm || true)
    if [[ -z $DRJIT_LIBLLVM_PATH ]]; then
        command -v apt-get >/dev/null || fail "please install LLVM 19 and set DRJIT_LIBLLVM_PATH to its shared library"
        as_root=
        if [[ $(id -u) -ne 0 ]]; then
            command -v sudo >/dev/null || fail "please install as root: apt-get install libllvm19"
            as_root=sudo
        fi
        say "installing with apt-get: libllvm19"
        $as_root apt-get update -q >&2
        $as_root env DEBIAN_FRONTEND=noninteractive apt-get install -q -y --no-install-recommends libllvm19 >&2
        DRJIT_LIBLLVM_PATH=$(find_llvm)
    fi
fi
export DRJIT_LIBLLVM_PATH

CARGO_NET_OFFLINE=true cargo build --release --locked --package biscale --bench table >&2

# --- the comparison --------------------------------------------------------------------------------------------------------------

results=target/peers/results.jsonl
: >"$results"
for case in "${cases[@]}"; do
    say "$case: Mitsuba"
    theirs=$("$venv/bin/python" scripts/peers/mitsuba_table.py "${quick[@]}" "$case")
    echo "$theirs" >>"$results"
    noise=$("$venv/bin/python" -c 'import json, sys; print(json.loads(sys.argv[1])["noise"])' "$theirs")
    say "$case: biscale, at a noise of $noise"
    CARGO_NET_OFFLINE=true cargo bench --quiet --locked --package biscale --bench table -- --json --noise "$noise" "$case" >>"$results"
done
"$venv/bin/python" scripts/peers/ratios.py "$results"
